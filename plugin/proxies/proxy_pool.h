// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/huge_vector.h"
#include "cullet/plugin/core/box_convert.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A proxy and the copy of its filter words in the table: applications write the words of the base class directly.
///
/// If Bullet's vectors are not over-aligned (GCC, Clang) it fills one cache line in float builds, so that a setAabb()
/// with an unchanged box accesses nothing else.
struct alignas(sizeof(btScalar) == sizeof(float) ? 64 : 32) Proxy : btBroadphaseProxy
{
    Filter filter() const noexcept { return {m_collisionFilterGroup, m_collisionFilterMask}; }
    bool hasKnownFilter() const noexcept
    {
        return m_collisionFilterGroup == knownFilter.group && m_collisionFilterMask == knownFilter.mask;
    }
    /// Whether setAabb() with this box would change nothing.
    bool isUpToDate(const btVector3& aabbMin, const btVector3& aabbMax) const noexcept
    {
        return hasKnownFilter() && isSameBox(m_aabbMin, m_aabbMax, aabbMin, aabbMax);
    }

    Filter knownFilter{};
};
static_assert(sizeof(btBroadphaseProxy) != 56 || sizeof(Proxy) == 64, "one cache line");

/// The memory of proxies, indexed by row. A proxy never moves, and its row is computed from its address.
///
/// Chunks of 8 KiB are aligned to their size and begin with the row of their first proxy, so that finding a row costs
/// a mask and one load that is nearly always cached. A chunk is small, since a world of 100 bodies has one. From 4 MiB
/// on they come in blocks of that size, in pages of 2 MiB if the system has them: changed pairs read proxies in random
/// order, and would wait for a page table walk for each. Chunks are kept until clear(); the owner allocates the rows.
class ProxyPool
{
public:
    ProxyPool() = default;
    ~ProxyPool() { clear(); }
    ProxyPool(const ProxyPool&) = delete;
    ProxyPool& operator=(const ProxyPool&) = delete;

    static constexpr std::size_t kChunkBytes = 8192;
    static constexpr std::uint32_t kProxiesPerChunk = kChunkBytes / sizeof(Proxy) - 1;
    static constexpr std::size_t kChunksPerBlock = (std::size_t{4} << 20) / kChunkBytes;

    /// The proxy of a row; allocates the memory of a new row, and leaves the content of a reused one as it is.
    Proxy* make(std::uint32_t row);

    /// @pre make() was called for the row since clear()
    Proxy* at(std::uint32_t row) const noexcept
    {
        return m_chunks[row / kProxiesPerChunk]->proxies + row % kProxiesPerChunk;
    }

    /// Calls visit(proxy, row) for the rows from `begin` to before `end`.
    ///
    /// @pre as at(), for each of them
    template <class Visit>
    void forEach(std::uint32_t begin, std::uint32_t end, Visit visit) const
    {
        while (begin < end)
        {
            const std::uint32_t row = begin;
            Proxy* const first = at(row);
            begin = std::min(end, row - row % kProxiesPerChunk + kProxiesPerChunk);
            for (std::uint32_t i = 0; i < begin - row; ++i)
                visit(first + i, row + i);
        }
    }

    /// The row of a proxy of this pool.
    static std::uint32_t rowOf(const Proxy* proxy) noexcept
    {
        const auto address = reinterpret_cast<std::uintptr_t>(proxy);
        const auto* chunk = reinterpret_cast<const Chunk*>(address & ~(kChunkBytes - 1));
        return chunk->firstRow + static_cast<std::uint32_t>(proxy - chunk->proxies);
    }

    void clear() noexcept;

    std::uint64_t bytes() const noexcept
    {
        const std::size_t blocks = (m_chunks.size() + kChunksPerBlock - 1) / kChunksPerBlock;
        const std::size_t chunks = blocks > 1 ? blocks * kChunksPerBlock : m_chunks.size();
        return m_chunks.capacity() * sizeof(m_chunks[0]) + chunks * kChunkBytes;
    }

private:
    struct alignas(kChunkBytes) Chunk
    {
        // The header takes the space of one proxy, so that each proxy begins on a cache line.
        alignas(Proxy) std::uint32_t firstRow;
        Proxy proxies[kProxiesPerChunk];
    };
    static_assert(sizeof(Chunk) == kChunkBytes, "the row follows from the address by a mask");

    void* allocateChunk();

    std::vector<Chunk*> m_chunks;  ///< owned; the first ones one by one, the others as blocks
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
