// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace cullet
{
/// Counts of pairs of table rows: a hash table with open addressing and linear probing. It contains a pair while the
/// count of that pair is not 0. All O(1) except forEach().
class PairCounts
{
public:
    void add(std::uint32_t a, std::uint32_t b)
    {
        if (2 * (m_used + 1) > m_slots.size())
            grow();
        Slot& slot = m_slots[find(keyOf(a, b))];
        if (slot.count++ != 0)
            return;
        slot.key = keyOf(a, b);
        ++m_used;
    }

    /// @pre the count of the pair is not 0
    void subtract(std::uint32_t a, std::uint32_t b)
    {
        const std::size_t place = find(keyOf(a, b));
        if (--m_slots[place].count == 0)
            shiftBack(place);
    }

    /// Calls visit(a, b) for every pair. O(slots).
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (const Slot& slot : m_slots)
        {
            if (slot.count != 0)
                visit(static_cast<std::uint32_t>(slot.key >> 32), static_cast<std::uint32_t>(slot.key));
        }
    }

    std::size_t size() const { return m_used; }
    std::uint64_t bytes() const { return m_slots.capacity() * sizeof(Slot); }

    void clear()
    {
        m_slots.clear();
        m_used = 0;
    }

private:
    struct Slot
    {
        std::uint64_t key = 0;
        std::uint32_t count = 0;  ///< 0: free
    };

    static std::uint64_t keyOf(std::uint32_t a, std::uint32_t b)
    {
        return a < b ? static_cast<std::uint64_t>(a) << 32 | b : static_cast<std::uint64_t>(b) << 32 | a;
    }

    std::size_t home(std::uint64_t key) const
    {
        const std::uint64_t hash = key * 0x9E3779B97F4A7C15ull;
        return static_cast<std::size_t>((hash ^ hash >> 32) * 0xD6E8FEB86659FD93ull >> 20) &
               (m_slots.size() - 1);
    }

    std::size_t next(std::size_t place) const { return (place + 1) & (m_slots.size() - 1); }

    std::size_t find(std::uint64_t key) const
    {
        std::size_t place = home(key);
        while (m_slots[place].count != 0 && m_slots[place].key != key)
            place = next(place);
        return place;
    }

    void shiftBack(std::size_t hole)
    {
        const std::size_t mask = m_slots.size() - 1;
        for (std::size_t place = next(hole); m_slots[place].count != 0; place = next(place))
        {
            if (((place - home(m_slots[place].key)) & mask) < ((place - hole) & mask))
                continue;
            m_slots[hole] = m_slots[place];
            hole = place;
        }
        m_slots[hole] = {};
        --m_used;
    }

    void grow()
    {
        std::vector<Slot> old(m_slots.empty() ? 64 : 2 * m_slots.size());
        old.swap(m_slots);
        for (const Slot& slot : old)
        {
            if (slot.count != 0)
                m_slots[find(slot.key)] = slot;
        }
    }

    std::vector<Slot> m_slots;  ///< their number is 0 or a power of two
    std::size_t m_used = 0;
};
}  // namespace cullet
