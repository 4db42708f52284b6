// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/faults/support/faults.h"

#include "cullet/tests/support/process/failing_new.h"

#include <atomic>

namespace cullet::test
{
namespace
{
constexpr int kNone = -1;
std::atomic<int> plannedKind{kNone};
std::atomic<std::int64_t> goodCallsLeft{0};
std::atomic<int> scopes{0};
std::atomic<std::int64_t> bulletCount{0};
thread_local int pauses = 0;

bool isNewToFail() noexcept
{
    return isNextFault(FaultKind::New);
}
}  // namespace

const char* nameOf(FaultKind kind) noexcept
{
    constexpr const char* kNames[] = {"new",      "Bullet's allocation", "thread start", "file write",
                                      "callback", "device memory",       "device loss"};
    return kNames[static_cast<int>(kind)];
}

void planFault(FaultKind kind, std::uint64_t goodCalls) noexcept
{
    goodCallsLeft.store(static_cast<std::int64_t>(goodCalls));
    plannedKind.store(static_cast<int>(kind));
    setNewFault(isNewToFail);
}

void cancelFault() noexcept
{
    plannedKind.store(kNone);
    goodCallsLeft.store(0);
    setNewFault(nullptr);
}

bool hasFaultHappened() noexcept
{
    return goodCallsLeft.load() < 0;
}

bool isNextFault(FaultKind kind) noexcept
{
    if (plannedKind.load(std::memory_order_relaxed) != static_cast<int>(kind) || pauses != 0 ||
        scopes.load(std::memory_order_relaxed) == 0)
        return false;
    return goodCallsLeft.fetch_sub(1) == 0;
}

void failInCallback()
{
    if (isNextFault(FaultKind::Callback))
        throw CallbackFault();
}

FaultScope::FaultScope() noexcept
{
    ++scopes;
}

FaultScope::~FaultScope()
{
    --scopes;
}

FaultPause::FaultPause() noexcept
{
    ++pauses;
}

FaultPause::~FaultPause()
{
    --pauses;
}

std::int64_t liveBulletCount() noexcept
{
    return bulletCount.load();
}

void countBulletMemory(std::int64_t change) noexcept
{
    bulletCount += change;
}
}  // namespace cullet::test
