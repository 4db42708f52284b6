// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <string>

namespace cullet::abi
{
/// The exception for errors of the C interface; the text becomes cullet_last_error().
struct Failure
{
    cullet_status status;
    std::string text;
};

/// Stores the text for cullet_last_error() of this thread. @return status
cullet_status fail(cullet_status status, const char* text) noexcept;

inline void require(bool condition, cullet_status status, const char* text)
{
    if (!condition)
        throw Failure{status, text};
}

inline void requirePointer(const void* pointer, const char* text)
{
    require(pointer != nullptr, CULLET_ERROR_NULL, text);
}

/// Runs the body of a function of the C interface and converts exceptions to a status.
template <class Body>
cullet_status guarded(const Body& body) noexcept
{
    try
    {
        return body();
    }
    catch (const Failure& failure)
    {
        return fail(failure.status, failure.text.c_str());
    }
    catch (const std::bad_alloc&)
    {
        return fail(CULLET_ERROR_MEMORY, "out of memory");
    }
    catch (const std::exception& error)
    {
        return fail(CULLET_ERROR_INTERNAL, error.what());
    }
    catch (...)
    {
        return fail(CULLET_ERROR_INTERNAL, "unknown exception");
    }
}

/// A copy of the caller's options in this library's version: members that the caller's version lacks are zero, and
/// members that the library's version lacks must be zero.
///
/// @tparam kFirstSize sizeof(Options) in the first version that had the struct
template <std::size_t kFirstSize, class Options>
Options readOptions(const Options* options)
{
    Options known{};
    if (options == nullptr)
        return known;
    require(options->size >= kFirstSize, CULLET_ERROR_SIZE, "options: set size to sizeof the struct");
    const auto* bytes = reinterpret_cast<const unsigned char*>(options);
    for (std::size_t i = sizeof(Options); i < options->size; ++i)
        require(bytes[i] == 0, CULLET_ERROR_SIZE, "options: a member is set that this library does not know");
    std::memcpy(&known, options, options->size < sizeof(Options) ? options->size : sizeof(Options));
    return known;
}

template <std::size_t kFirstSize, class Result>
void requireResult(const Result* result)
{
    requirePointer(result, "the result is NULL");
    require(result->size >= kFirstSize, CULLET_ERROR_SIZE, "result: set size to sizeof the struct");
}

/// Writes the members of a result that the caller's version has. @pre requireResult()
template <class Result>
void writeResult(Result known, Result* result)
{
    const std::uint32_t size = result->size;
    known.size = size;
    std::memcpy(result, &known, size < sizeof(Result) ? size : sizeof(Result));
}

/// Requires the elements of an array to lie within the addresses that there are.
///
/// @param element bytes of an element
/// @param stride  bytes from an element to the next; not 0
inline void requireAddressable(std::size_t element, std::size_t stride, std::uint32_t count)
{
    constexpr std::size_t kMost = ~std::size_t{0} / 2;
    require(count <= 1 || (kMost - element) / (count - 1) >= stride, CULLET_ERROR_SIZE,
            "stride: the array is larger than the address space");
}

/// @return margin @pre it is not negative
inline float checkedMargin(double margin)
{
    require(margin <= std::numeric_limits<float>::max(), CULLET_ERROR_ARGUMENT,
            "margin: a finite number in float expected");
    return static_cast<float>(margin);
}

/// @return threads; 0 means as many as the machine has
inline int checkedThreads(std::int32_t threads)
{
    require(threads >= 0 && threads <= 4096, CULLET_ERROR_ARGUMENT, "threads: 0 to 4096 expected");
    return threads;
}
}  // namespace cullet::abi
