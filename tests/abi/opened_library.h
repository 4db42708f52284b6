// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"

#include <gtest/gtest.h>

#include <dlfcn.h>

namespace cullet::test
{
/// The library of the C interface, opened at run time.
class Library
{
public:
    Library() : m_handle(dlopen(CULLET_C_LIBRARY, RTLD_NOW | RTLD_LOCAL))
    {
        if (m_handle == nullptr)
            ADD_FAILURE() << dlerror();
    }

    template <class Function>
    Function* find(const char* name) const
    {
        void* symbol = dlsym(m_handle, name);
        EXPECT_NE(symbol, nullptr) << name;
        return reinterpret_cast<Function*>(symbol);
    }

private:
    void* m_handle;
};
// The declaration gives the type only; nothing is linked.
#define LOADED(library, name) (library).find<decltype(name)>(#name)

/// A struct of zeros with its size.
template <class Result>
Result sized()
{
    Result result = {};
    result.size = sizeof(Result);
    return result;
}
}  // namespace cullet::test
