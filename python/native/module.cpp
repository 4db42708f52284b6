// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The extension module cullet._native: what cullet/*.py hands arrays to. Errors of the C interface become exceptions.
#include "cullet/abi/status.h"
#include "cullet/python/native/bindings.h"

namespace
{
namespace nb = nanobind;

PyObject* exceptionOf(cullet_status status)
{
    switch (status)
    {
        case CULLET_ERROR_NULL:
        case CULLET_ERROR_ARGUMENT:
        case CULLET_ERROR_SIZE:
        case CULLET_ERROR_NOT_FINITE:
            return PyExc_ValueError;
        case CULLET_ERROR_ID:
            return PyExc_KeyError;
        case CULLET_ERROR_MEMORY:
            return PyExc_MemoryError;
        default:
            return PyExc_RuntimeError;
    }
}

void raise(const std::exception_ptr& thrown, void*)
{
    try
    {
        std::rethrow_exception(thrown);
    }
    catch (const cullet::abi::Failure& failure)
    {
        PyErr_SetString(exceptionOf(failure.status), failure.text.c_str());
    }
}
}  // namespace

NB_MODULE(_native, module)
{
    module.attr("version") = CULLET_VERSION;
    nb::register_exception_translator(raise);
    cullet::python::bindBoxSet(module);
    cullet::python::bindHulls(module);
}
