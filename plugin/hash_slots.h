// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Open-addressing multimap from 32-bit hash values to 32-bit values below kNone; the caller supplies the hash.
///
/// A slot is `hash << 32 | value`. The home slot of a hash is hash * capacity / 2^32, which does not decrease with the
/// hash, and probing is linear without wrapping round (a short tail behind the last home slot takes the overflow), so
/// that all slots stay sorted by hash. Hence a search ends at the first slot that is not smaller, growing is one pass
/// over both arrays, any capacity will do, and the layout depends on the content only.
/// Linear probing in sorted order: Amble and Knuth 1974, "Ordered hash tables"; removal shifts the followers back, there
/// are no tombstones.
///
/// Load: at most 3/4, at least 1/2 after growing, so 11 to 16 bytes per entry. It never shrinks.
/// Threads: const methods may run concurrently.
class HashSlots
{
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// Position of the first slot whose hash is not smaller, which may be an empty one.
    std::size_t lowerBound(std::uint32_t hash) const noexcept
    {
        const std::uint64_t smallest = pack(hash, 0);
        std::size_t position = home(hash);
        while (m_slots[position] < smallest)
            ++position;
        return position;
    }

    bool holds(std::size_t position, std::uint32_t hash) const noexcept
    {
        return hashAt(position) == hash && m_slots[position] != kEmpty;
    }

    /// Position of the slot with this hash and value. @pre there is one
    std::size_t positionOf(std::uint32_t hash, std::uint32_t value) const noexcept
    {
        std::size_t position = lowerBound(hash);
        while (m_slots[position] != pack(hash, value))
            ++position;
        return position;
    }

    std::uint32_t value(std::size_t position) const noexcept
    {
        return static_cast<std::uint32_t>(m_slots[position]);
    }

    void setValue(std::size_t position, std::uint32_t value) noexcept
    {
        m_slots[position] = pack(hashAt(position), value);
    }

    bool hasRoom(std::size_t count) const noexcept
    {
        return m_count + count <= m_limit && m_slots[m_slots.size() - 1 - count] == kEmpty;
    }

    /// Room for `count` more entries, at most two without a new call. May throw std::bad_alloc and then changes nothing.
    void makeRoom(std::size_t count)
    {
        if (!hasRoom(count))
            grow(std::max<std::size_t>(m_count + count, kSmallest));
    }

    /// Room for `count` entries in all as far as the load goes. May throw std::bad_alloc and then changes nothing.
    void reserve(std::size_t count)
    {
        if (count > m_limit)
            rebuild(std::max(count, kSmallest) * 3 / 2, m_tail);
    }

    /// @pre hasRoom(1); position is lowerBound(hash)
    void insert(std::size_t position, std::uint32_t hash, std::uint32_t value) noexcept
    {
        std::uint64_t moving = pack(hash, value);
        for (; moving != kEmpty; ++position)
            std::swap(moving, m_slots[position]);
        ++m_count;
    }

    void erase(std::size_t position) noexcept
    {
        std::size_t next = position + 1;
        for (; m_slots[next] != kEmpty && home(hashAt(next)) != next; ++next)
            m_slots[next - 1] = m_slots[next];
        m_slots[next - 1] = kEmpty;
        --m_count;
    }

    void clear() noexcept
    {
        std::fill(m_slots.begin(), m_slots.end(), kEmpty);
        m_count = 0;
    }

    void prefetch(std::uint32_t hash) const noexcept { __builtin_prefetch(&m_slots[home(hash)], 1); }

    std::size_t size() const noexcept { return m_count; }
    std::size_t capacity() const noexcept { return m_capacity; }
    std::uint64_t rehashes() const noexcept { return m_rehashes; }
    std::uint64_t bytes() const noexcept { return m_slots.capacity() * sizeof(std::uint64_t); }

    /// Calls `visit(slots)` for every entry with the number of slots that a search for it looks at. O(capacity).
    template <class Visit>
    void forEachProbe(Visit visit) const
    {
        for (std::size_t position = 0; position < m_slots.size(); ++position)
        {
            if (m_slots[position] != kEmpty)
                visit(position - home(hashAt(position)) + 1);
        }
    }

private:
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};  // sorts behind every entry
    static constexpr std::size_t kSmallest = 12;

    static std::uint64_t pack(std::uint32_t hash, std::uint32_t value) noexcept
    {
        return static_cast<std::uint64_t>(hash) << 32 | value;
    }

    std::uint32_t hashAt(std::size_t position) const noexcept
    {
        return static_cast<std::uint32_t>(m_slots[position] >> 32);
    }

    std::size_t home(std::uint32_t hash) const noexcept { return hash * m_capacity >> 32; }

    void grow(std::size_t count)
    {
        // A full tail at a low load: many equal or nearly equal hashes at the upper end.
        const bool tailIsFull = count <= m_limit;
        rebuild(tailIsFull ? m_capacity : 2 * count, tailIsFull ? 2 * m_tail : m_tail);
    }

    void rebuild(std::size_t capacity, std::size_t tail)
    {
        while (!tryRebuild(capacity, tail))
            tail *= 2;
        m_tail = tail;
        ++m_rehashes;
    }

    /// False when the entries leave less than half of the tail's slots free.
    bool tryRebuild(std::size_t capacity, std::size_t tail)
    {
        std::vector<std::uint64_t> slots(capacity + tail, kEmpty);
        std::size_t next = 0;
        for (const std::uint64_t slot : m_slots)
        {
            if (slot == kEmpty)
                continue;
            next = std::max<std::size_t>(next, (slot >> 32) * capacity >> 32);
            if (next >= capacity + tail / 2)
                return false;
            slots[next++] = slot;
        }
        m_slots.swap(slots);
        m_capacity = capacity;
        m_limit = capacity / 4 * 3;
        return true;
    }

    std::vector<std::uint64_t> m_slots = {kEmpty};  // home slots, tail; the last one stays empty
    std::uint64_t m_capacity = 0;                   // home slots
    std::size_t m_limit = 0;                        // entries that the load allows
    std::size_t m_tail = 64;
    std::size_t m_count = 0;
    std::uint64_t m_rehashes = 0;
};

/// Hash value of a pair of ids, over all 64 bits of the pair.
///
/// The lecture's ID1*p1 + ID2*p2 with odd 64-bit multipliers, then one multiply-xorshift round, because the sum alone
/// keeps the regularity of consecutive ids.
inline std::uint32_t hashOfPair(std::uint32_t id0, std::uint32_t id1) noexcept
{
    std::uint64_t sum = id0 * 0x9e3779b97f4a7c15u + id1 * 0xc2b2ae3d27d4eb4fu;
    sum = (sum ^ sum >> 32) * 0xd6e8feb86659fd93u;
    return static_cast<std::uint32_t>(sum >> 32);
}

/// Hash value of one id; a different one for every id. Eight consecutive ids (8k to 8k + 7) stay together, so that
/// proxies made one after the other share cache lines.
inline std::uint32_t hashOfId(std::uint32_t id) noexcept
{
    constexpr std::uint32_t kMask = 0x1fffffffu;  // 29 bits
    std::uint32_t block = (id >> 3) * 0x1e3779b1u & kMask;
    block = (block ^ block >> 15) * 0x05ebca6bu & kMask;
    return (block ^ block >> 14) << 3 | (id & 7);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
