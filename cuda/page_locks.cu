// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/box_memory.h"
#include "cuda/page_locks.h"

#include <cuda_runtime_api.h>

#include <map>
#include <mutex>

namespace cullet
{
namespace
{
constexpr std::uint64_t kFewestBytes = 1u << 20;

/// What is locked, by address.
class PageLocks
{
public:
    bool lock(const void* memory, std::uint64_t bytes)
    {
        const std::lock_guard<std::mutex> guard(m_mutex);
        const auto known = m_bytes.find(memory);
        if (known != m_bytes.end() && known->second >= bytes)
            return true;
        if (known != m_bytes.end())
            unlock(known);
        const auto entry = m_bytes.emplace(memory, bytes).first;
        if (cudaHostRegister(const_cast<void*>(memory), bytes, cudaHostRegisterPortable) == cudaSuccess)
            return true;
        cudaGetLastError();
        m_bytes.erase(entry);
        return false;
    }

    void release(const void* memory) noexcept
    {
        const std::lock_guard<std::mutex> guard(m_mutex);
        const auto known = m_bytes.find(memory);
        if (known != m_bytes.end())
            unlock(known);
    }

private:
    using Bytes = std::map<const void*, std::uint64_t>;

    void unlock(Bytes::iterator entry) noexcept
    {
        cudaHostUnregister(const_cast<void*>(entry->first));
        cudaGetLastError();
        m_bytes.erase(entry);
    }

    std::mutex m_mutex;
    Bytes m_bytes;
};

/// Never destroyed: arrays may be given back by destructors of static objects.
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
