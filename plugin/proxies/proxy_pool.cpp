// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/proxy_pool.h"

#include "cullet/base/trim_capacity.h"

#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
Proxy* ProxyPool::make(std::uint32_t row)
{
    while (row / kProxiesPerChunk >= m_chunks.size())
    {
        growCapacity(m_chunks);
        auto* const chunk = new (allocateChunk()) Chunk();
        chunk->firstRow = static_cast<std::uint32_t>(m_chunks.size()) * kProxiesPerChunk;
        m_chunks.push_back(chunk);
    }
    return at(row);
}

/// The memory of the next chunk.
void* ProxyPool::allocateChunk()
{
    const std::size_t index = m_chunks.size();
    if (index < kChunksPerBlock)
        return ::operator new(sizeof(Chunk), std::align_val_t(alignof(Chunk)));
    if (index % kChunksPerBlock == 0)
        return HugeAllocator<Chunk>().allocate(kChunksPerBlock);
    return m_chunks.back() + 1;
}

void ProxyPool::clear() noexcept
{
    for (std::size_t i = 0; i < m_chunks.size(); ++i)
    {
        if (i < kChunksPerBlock)
            ::operator delete(m_chunks[i], std::align_val_t(alignof(Chunk)));
        else if (i % kChunksPerBlock == 0)
            HugeAllocator<Chunk>().deallocate(m_chunks[i], kChunksPerBlock);
    }
    m_chunks.clear();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
