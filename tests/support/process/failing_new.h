// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <functional>

/// Replaced operator new of the programs that link failing_new.cpp.
namespace cullet::test
{
/// Calls of this thread so far.
std::uint64_t newCount() noexcept;

/// Calls of all threads whose memory is not deleted yet.
std::int64_t liveNewCount() noexcept;

/// Memory of those calls in bytes, as the C library counts it; 0 where it does not tell.
std::int64_t liveNewBytes() noexcept;

/// Bytes of the calls of this thread so far for a MiB or more without an alignment to pages.
std::uint64_t largeUnalignedNewBytes() noexcept;

/// Sets a function that every call on any thread asks first: true lets the call fail. Null, as at the start: none.
void setNewFault(bool (*isNextToFail)() noexcept) noexcept;

/// During the lifetime of this object one call of this thread fails, after a number of successful ones.
class OneNewFails
{
public:
    explicit OneNewFails(std::uint64_t after) noexcept;
    ~OneNewFails();
    OneNewFails(const OneNewFails&) = delete;
    OneNewFails& operator=(const OneNewFails&) = delete;

    bool hasHappened() const noexcept;
};

/// One call of this thread, after a number of others, calls a function before it allocates.
class OneNewCalls
{
public:
    /// @param function must not throw; its own calls of operator new are ordinary ones
    OneNewCalls(std::uint64_t after, const std::function<void()>& function) noexcept;
    ~OneNewCalls();
    OneNewCalls(const OneNewCalls&) = delete;
    OneNewCalls& operator=(const OneNewCalls&) = delete;

    bool hasHappened() const noexcept { return m_turn.hasHappened(); }

private:
    OneNewFails m_turn;
};
}  // namespace cullet::test
