// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/python/native/arrays.h"

#include <cstring>
#include <limits>

namespace cullet::python
{
namespace
{
[[noreturn]] void refuse(const char* name, const std::string& what)
{
    throw nb::value_error((std::string(name) + ": " + what).c_str());
}

void requireCpu(const AnyArray& array, const char* name)
{
    if (array.device_type() != nb::device::cpu::value)
        refuse(name, "the array is on a device; copy it to the CPU first");
}

template <class Number>
Number readUnaligned(const unsigned char* from)
{
    Number number;
    std::memcpy(&number, from, sizeof(number));
    return number;
}

std::string shapeOf(const AnyArray& array)
{
    std::string text = "(";
    for (std::size_t i = 0; i < array.ndim(); ++i)
        text += std::to_string(array.shape(i)) + (array.ndim() == 1 || i + 1 < array.ndim() ? "," : "");
    return text + ")";
}

/// Whole numbers row by row, in the range of Result.
template <class Result, class Number>
std::vector<Result> readRows(const AnyArray& array, std::size_t columns, const char* name)
{
    const auto* bytes = static_cast<const unsigned char*>(array.data());
    const auto size = static_cast<std::ptrdiff_t>(sizeof(Number));
    const std::ptrdiff_t rowStride = static_cast<std::ptrdiff_t>(array.stride(0)) * size;
    const std::ptrdiff_t columnStride =
        columns == 0 ? 0 : static_cast<std::ptrdiff_t>(array.stride(1)) * size;
    const std::size_t rows = array.shape(0), inRow = columns == 0 ? 1 : columns;
    std::vector<Result> numbers;
    numbers.reserve(rows * inRow);
    for (std::size_t row = 0; row < rows; ++row)
    {
        for (std::size_t column = 0; column < inRow; ++column)
        {
            const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(row) * rowStride +
                                          static_cast<std::ptrdiff_t>(column) * columnStride;
            const Number number = readUnaligned<Number>(bytes + offset);
            const auto result = static_cast<Result>(number);
            if (static_cast<Number>(result) != number || (number < 0) != (result < 0))
                refuse(name, std::to_string(number) + " is out of range");
            numbers.push_back(result);
        }
    }
    return numbers;
}

template <class Result>
std::vector<Result> readWhole(const AnyArray& array, std::size_t columns, const char* name)
{
    requireCpu(array, name);
    const bool isShape = columns == 0 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == columns;
    if (!isShape)
        refuse(name, "shape (n," + (columns == 0 ? "" : std::to_string(columns)) + ") expected, not " +
                         shapeOf(array));
    const nb::dlpack::dtype type = array.dtype();
    if (type == nb::dtype<std::int64_t>())
        return readRows<Result, std::int64_t>(array, columns, name);
    if (type == nb::dtype<std::int32_t>())
        return readRows<Result, std::int32_t>(array, columns, name);
    if (type == nb::dtype<std::uint32_t>())
        return readRows<Result, std::uint32_t>(array, columns, name);
    if (type == nb::dtype<std::uint64_t>())
        return readRows<Result, std::uint64_t>(array, columns, name);
    refuse(name, "whole numbers of 32 or 64 bits expected");
}
}  // namespace

NumberArray::NumberArray(const AnyArray& array, const char* name) : m_array(array)
{
    requireCpu(array, name);
    m_isDouble = array.dtype() == nb::dtype<double>();
    if (!m_isDouble && array.dtype() != nb::dtype<float>())
        refuse(name, "float32 or float64 expected");
}

double NumberArray::at(std::ptrdiff_t offset) const
{
    return m_isDouble ? readUnaligned<double>(data() + offset)
                      : static_cast<double>(readUnaligned<float>(data() + offset));
}

void NumberArray::requireRowsOf(std::size_t columns, const char* name) const
{
    if (ndim() != 2 || shape(1) != columns)
        refuse(name, "shape (n," + std::to_string(columns) + ") expected, not " + shapeOf(m_array));
    if (shape(0) > std::numeric_limits<std::uint32_t>::max())
        refuse(name, "at most 2^32 - 1 rows expected");
}

std::vector<std::uint32_t> readIndices(const AnyArray& array, std::size_t columns, const char* name)
{
    return readWhole<std::uint32_t>(array, columns, name);
}

std::vector<std::int32_t> readWords(const AnyArray& array, const char* name)
{
    return readWhole<std::int32_t>(array, 0, name);
}
}  // namespace cullet::python
