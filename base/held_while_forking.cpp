// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/held_while_forking.h"

#if defined(__unix__)
#include <pthread.h>
#endif

namespace cullet
{
#if defined(__unix__)
namespace
{
constexpr unsigned kMost = 8;

/// Zero before any code runs, and never destroyed.
std::mutex listMutex;
std::mutex* heldMutexes[kMost];
unsigned heldCount = 0;

/// No mutex is added while they are held.
void lockAll()
{
    listMutex.lock();
    for (unsigned i = 0; i < heldCount; ++i)
        heldMutexes[i]->lock();
}

void unlockAll()
{
    for (unsigned i = heldCount; i > 0; --i)
        heldMutexes[i - 1]->unlock();
    listMutex.unlock();
}
}  // namespace

void holdWhileForking(std::mutex& mutex) noexcept
{
    [[maybe_unused]] static const int isSet = pthread_atfork(lockAll, unlockAll, unlockAll);
    const std::lock_guard<std::mutex> lock(listMutex);
    if (heldCount < kMost)
        heldMutexes[heldCount++] = &mutex;
}
#else
void holdWhileForking(std::mutex&) noexcept {}
#endif
}  // namespace cullet
