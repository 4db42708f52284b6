// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <functional>

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

/// One call of this thread, that after so many others, calls a function before it takes memory.
class OneNewCalls
{
public:
    /// @param function throws nothing; its own calls of operator new are like any others
    OneNewCalls(std::uint64_t after, const std::function<void()>& function) noexcept;
    ~OneNewCalls();
    OneNewCalls(const OneNewCalls&) = delete;
    OneNewCalls& operator=(const OneNewCalls&) = delete;

    bool hasHappened() const noexcept { return m_turn.hasHappened(); }

private:
    OneNewFails m_turn;
};
}  // namespace cullet::test
