// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_directory.h"

#include <algorithm>

namespace cullet
{
namespace
{
std::uint32_t roundUpToPowerOfTwo(std::uint32_t value)
{
    std::uint32_t power = 1;
    while (power < value)
        power *= 2;
    return power;
}

bool sameCell(const CellKey& a, const CellKey& b)
{
    return a.j == b.j && a.k == b.k && a.level == b.level;
}
}  // namespace

void RowDirectory::reset(std::uint32_t capacity, std::uint32_t bucketCount)
{
    m_bucketCount = bucketCount != 0 ? bucketCount : roundUpToPowerOfTwo(2 * capacity);
    m_bucketMask = (m_bucketCount & (m_bucketCount - 1)) == 0 ? m_bucketCount - 1 : 0;
    if (m_bucketCount > m_headCapacity)
    {
        m_heads = std::make_unique<std::atomic<std::uint32_t>[]>(m_bucketCount);
        m_headCapacity = m_bucketCount;
    }
    for (std::uint32_t i = 0; i < m_bucketCount; ++i)
        m_heads[i].store(kNone, std::memory_order_relaxed);
    if (m_nodes.size() < capacity)
        m_nodes.resize(capacity);
    m_capacity = capacity;
    m_size.store(0, std::memory_order_relaxed);
}

std::uint32_t RowDirectory::bucket(const CellKey& key) const
{
    const std::uint32_t hash = static_cast<std::uint32_t>(key.j) * 73856093u ^
                               static_cast<std::uint32_t>(key.k) * 19349663u ^
                               static_cast<std::uint32_t>(key.level) * 83492791u;
    return m_bucketMask != 0 ? (hash ^ hash >> 15) & m_bucketMask : hash % m_bucketCount;
}

std::uint32_t RowDirectory::findInChain(std::uint32_t node, std::uint32_t end, const CellKey& key) const
{
    while (node != end && !sameCell(m_nodes[node].key, key))
        node = m_nodes[node].next;
    return node == end ? kNone : node;
}

std::uint32_t RowDirectory::findOrInsert(const CellKey& key)
{
    std::atomic<std::uint32_t>& head = m_heads[bucket(key)];
    std::uint32_t first = head.load(std::memory_order_acquire);
    const std::uint32_t found = findInChain(first, kNone, key);
    if (found != kNone)
        return found;

    const std::uint32_t node = m_size.fetch_add(1, std::memory_order_relaxed);
    if (node >= m_capacity)
        return kNone;
    m_nodes[node].key = key;
    for (;;)
    {
        m_nodes[node].next = first;
        const std::uint32_t seen = first;
        if (head.compare_exchange_weak(first, node, std::memory_order_release, std::memory_order_acquire))
            return node;
        // Another thread was first: only what it put in front is new. If it is our cell, our node stays unused.
        const std::uint32_t other = findInChain(first, seen, key);
        if (other != kNone)
            return other;
    }
}

std::uint32_t RowDirectory::find(const CellKey& key) const
{
    return findInChain(m_heads[bucket(key)].load(std::memory_order_relaxed), kNone, key);
}

std::uint32_t RowDirectory::size() const
{
    return std::min(m_size.load(std::memory_order_relaxed), m_capacity);
}

std::uint64_t RowDirectory::bytes() const
{
    return static_cast<std::uint64_t>(m_headCapacity) * sizeof(std::uint32_t) +
           m_nodes.capacity() * sizeof(Node);
}
}  // namespace cullet
