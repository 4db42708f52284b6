// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btAlignedAllocator.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Memory for the algorithm of a mesh's triangle on threads other than the dispatch's, in place of Bullet's pool, which
/// has no lock. Such an algorithm is destroyed before the next is created.
class ChildMemory
{
public:
    /// Of the calling thread; null: it uses the pool.
    static ChildMemory* ofThisThread() { return t_current; }

    ChildMemory() { t_current = this; }
    ~ChildMemory() { t_current = nullptr; }
    ChildMemory(const ChildMemory&) = delete;
    ChildMemory& operator=(const ChildMemory&) = delete;

    void* allocate(std::size_t size)
    {
        if (m_isTaken || size > sizeof(m_bytes))
            return btAlignedAlloc(size, 16);
        m_isTaken = true;
        return m_bytes;
    }
    void free(void* memory)
    {
        if (memory == m_bytes)
            m_isTaken = false;
        else
            btAlignedFree(memory);
    }

private:
    static inline thread_local ChildMemory* t_current = nullptr;

    alignas(64) unsigned char m_bytes[256];
    bool m_isTaken = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
