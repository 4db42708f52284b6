// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Set of pairs of table rows: open addressing with linear probing on 64-bit keys. Insert, erase and lookup are O(1).
class PairSet
{
public:
    static std::uint64_t keyOf(std::uint32_t a, std::uint32_t b) { return pairKey(makePair(a, b)); }

    /// Empties the set and allocates memory for `count` pairs.
    void reset(std::size_t count)
    {
        std::size_t capacity = 16;
        while (capacity < 2 * count)
            capacity *= 2;
        m_slots.assign(capacity, kFree);
        m_mask = capacity - 1;
        m_count = 0;
    }

    bool isEmpty() const { return m_count == 0; }

    void insert(std::uint64_t key)
    {
        if (2 * (m_count + 1) > m_slots.size())
            grow();
        std::size_t slot = home(key);
        while (m_slots[slot] != kFree)
        {
            if (m_slots[slot] == key)
                return;
            slot = (slot + 1) & m_mask;
        }
        m_slots[slot] = key;
        ++m_count;
    }

    std::size_t count() const { return m_count; }

    /// Calls visit(key) for every pair, in no particular order; visit() must not change the set.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (const std::uint64_t key : m_slots)
        {
            if (key != kFree)
                visit(key);
        }
    }

    bool contains(std::uint64_t key) const { return m_count != 0 && m_slots[find(key)] == key; }

    /// Removes the key and returns whether the set contained it. Backward-shift deletion leaves no tombstones.
    bool erase(std::uint64_t key)
    {
        if (m_count == 0)
            return false;
        std::size_t hole = find(key);
        if (m_slots[hole] != key)
            return false;
        --m_count;
        for (std::size_t next = (hole + 1) & m_mask; m_slots[next] != kFree; next = (next + 1) & m_mask)
        {
            const std::size_t distanceToHome = (next - home(m_slots[next])) & m_mask;
            if (distanceToHome < ((next - hole) & m_mask))
                continue;
            m_slots[hole] = m_slots[next];
            hole = next;
        }
        m_slots[hole] = kFree;
        return true;
    }

    std::uint64_t bytes() const { return m_slots.capacity() * sizeof(std::uint64_t); }

private:
    static constexpr std::uint64_t kFree = ~0ull;  // not the key of any pair

    std::size_t home(std::uint64_t key) const
    {
        std::uint64_t hash = key * 0x9E3779B97F4A7C15ull;
        hash ^= hash >> 32;
        return static_cast<std::size_t>(hash * 0xD6E8FEB86659FD93ull >> 20) & m_mask;
    }

    std::size_t find(std::uint64_t key) const
    {
        std::size_t slot = home(key);
        while (m_slots[slot] != key && m_slots[slot] != kFree)
            slot = (slot + 1) & m_mask;
        return slot;
    }

    void grow()
    {
        std::vector<std::uint64_t> old;
        old.swap(m_slots);
        reset(old.empty() ? 8 : old.size());
        for (const std::uint64_t key : old)
        {
            if (key != kFree)
                insert(key);
        }
    }

    std::vector<std::uint64_t> m_slots;
    std::size_t m_mask = 0;
    std::size_t m_count = 0;
};
}  // namespace cullet
