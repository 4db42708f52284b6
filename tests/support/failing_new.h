// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

/// operator new of the programs that are linked with failing_new.cpp.
namespace cullet::test
{
/// Calls of this thread so far.
std::uint64_t newCount() noexcept;

/// One call of this thread fails in the life of this object, that after so many others.
class OneNewFails
{
public:
    explicit OneNewFails(std::uint64_t after) noexcept;
    ~OneNewFails();
    OneNewFails(const OneNewFails&) = delete;
    OneNewFails& operator=(const OneNewFails&) = delete;

    bool hasHappened() const noexcept;
};
}  // namespace cullet::test
