// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <stdexcept>

/// One planned fault of the process. Every seam where something can fail asks isNextFault(); all faults of a kind are
/// counted in one order, over all threads.
namespace cullet::test
{
enum class FaultKind
{
    New,               ///< operator new in any form returns nothing
    BulletAllocation,  ///< btAlignedAlloc() throws std::bad_alloc
    ThreadStart,       ///< pthread_create() has no thread
    FileWrite,         ///< write() finds the disk full
    Callback,          ///< a callback of the application throws CallbackFault
    DeviceMemory,      ///< a call of an executor runs out of memory
    DeviceLoss         ///< a call of an executor loses its device
};

const char* nameOf(FaultKind kind) noexcept;

/// What a callback of the application throws.
struct CallbackFault : std::runtime_error
{
    CallbackFault() : std::runtime_error("fault of a callback") {}
};

/// Plans one fault of a kind inside FaultScope, after so many calls that succeed.
void planFault(FaultKind kind, std::uint64_t goodCalls) noexcept;
void cancelFault() noexcept;
bool hasFaultHappened() noexcept;

/// Whether this call of a seam must fail.
bool isNextFault(FaultKind kind) noexcept;

/// Throws CallbackFault where that is the planned fault.
void failInCallback();

/// During a call of cullet: only here seams count, on every thread.
class FaultScope
{
public:
    FaultScope() noexcept;
    ~FaultScope();
    FaultScope(const FaultScope&) = delete;
    FaultScope& operator=(const FaultScope&) = delete;
};

/// During code of the test that cullet calls: here seams of this thread do not count.
class FaultPause
{
public:
    FaultPause() noexcept;
    ~FaultPause();
    FaultPause(const FaultPause&) = delete;
    FaultPause& operator=(const FaultPause&) = delete;
};

/// Memory of Bullet that is not freed yet, in programs that link failing_bullet.cpp; else 0.
std::int64_t liveBulletCount() noexcept;
void countBulletMemory(std::int64_t change) noexcept;
}  // namespace cullet::test
