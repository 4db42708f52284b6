// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/box_memory.h"
#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/pinned_pages.h"

#include <cuda_runtime_api.h>

#include <map>
#include <mutex>

namespace cullet
{
namespace
{
// Locking takes as long as copying a few megabytes, once per array; packing 64 KiB in each update takes longer.
constexpr std::uint64_t kFewestBytes = kLockableBytes;

/// The memory that is locked, or could not be locked, by address.
class PageLocks
{
public:
    bool lock(const void* memory, std::uint64_t bytes)
    {
        const std::lock_guard<std::mutex> guard(m_mutex);
        const auto known = m_locks.find(memory);
        // Memory that could not be locked is not tried again in each update.
        if (known != m_locks.end() && known->second.bytes >= bytes)
            return known->second.isLocked;
        if (known != m_locks.end())
            forget(known);
        Lock& lock = m_locks.emplace(memory, Lock{bytes, false}).first->second;
        lock.isLocked = CULLET_CUDA_RESULT(cudaHostRegister(
                            const_cast<void*>(memory), bytes,
                            cudaHostRegisterPortable | cudaHostRegisterMapped)) == cudaSuccess;
        cudaGetLastError();
        return lock.isLocked;
    }

    void release(const void* memory) noexcept
    {
        const std::lock_guard<std::mutex> guard(m_mutex);
        const auto known = m_locks.find(memory);
        if (known != m_locks.end())
            forget(known);
    }

private:
    struct Lock
    {
        std::uint64_t bytes;
        bool isLocked;
    };
    using Locks = std::map<const void*, Lock>;

    void forget(Locks::iterator entry) noexcept
    {
        if (entry->second.isLocked)
            cudaHostUnregister(const_cast<void*>(entry->first));
        cudaGetLastError();
        m_locks.erase(entry);
    }

    std::mutex m_mutex;
    Locks m_locks;
};

/// Never destroyed: destructors of static objects may free arrays.
PageLocks& pageLocks()
{
    static PageLocks* locks = new PageLocks;
    return *locks;
}
}  // namespace

bool lockPages(const void* memory, std::uint64_t bytes) noexcept
{
    if (bytes < kFewestBytes)
        return false;
    try
    {
        boxMemoryRelease().store([](const void* released) { pageLocks().release(released); },
                                 std::memory_order_release);
        return pageLocks().lock(memory, bytes);
    }
    catch (...)
    {
        return false;  // no memory for the list
    }
}
}  // namespace cullet
