// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <string>
#include <vector>

namespace cullet::python
{
namespace nb = nanobind;

/// What NumPy, or DLPack, gives: any numbers, shape and strides.
using AnyArray = nb::ndarray<nb::ro>;

/// float32 or float64 numbers in the memory of the CPU, read where they are.
class NumberArray
{
public:
    /// @param name of the argument, for messages
    /// Throws nb::value_error.
    NumberArray(const AnyArray& array, const char* name);

    std::size_t ndim() const { return m_array.ndim(); }
    std::size_t shape(std::size_t dimension) const { return m_array.shape(dimension); }
    bool isDouble() const { return m_isDouble; }
    const unsigned char* data() const { return static_cast<const unsigned char*>(m_array.data()); }

    /// In bytes.
    std::ptrdiff_t stride(std::size_t dimension) const
    {
        return static_cast<std::ptrdiff_t>(m_array.stride(dimension)) *
               static_cast<std::ptrdiff_t>(m_array.itemsize());
    }

    /// @param offset in bytes, a sum of strides
    double at(std::ptrdiff_t offset) const;

    /// Throws nb::value_error unless the array has rows of so many numbers.
    void requireRowsOf(std::size_t columns, const char* name) const;

private:
    const AnyArray& m_array;
    bool m_isDouble;
};

/// Whole numbers of an array of up to 32 or 64 bits, row by row. Throws nb::value_error for other arrays, and a number out
/// of [0, 2^32).
///
/// @param columns 0: the array has one dimension
std::vector<std::uint32_t> readIndices(const AnyArray& array, std::size_t columns, const char* name);

/// Words of filters, which may be negative.
std::vector<std::int32_t> readWords(const AnyArray& array, const char* name);

/// An array of NumPy that owns its memory.
template <class Number>
nb::ndarray<nb::numpy, Number> toNumpy(std::unique_ptr<Number[]> numbers,
                                       std::initializer_list<std::size_t> shape)
{
    Number* const data = numbers.get();
    const nb::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<Number*>(memory); });
    numbers.release();
    return nb::ndarray<nb::numpy, Number>(data, shape, owner);
}
}  // namespace cullet::python
