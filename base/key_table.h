// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline constexpr std::uint64_t kFreeKey = ~0ull;  ///< no key

/// Table of 64-bit keys: open addressing with linear probing. All O(1), except forEach().
///
/// @tparam Slot a `std::uint64_t key = kFreeKey` and what is stored with it
template <class Slot>
class KeyTable
{
public:
    /// Empties the table and allocates memory for `count` keys.
    void reset(std::size_t count)
    {
        std::size_t capacity = 16;
        while (capacity < 2 * count)
            capacity *= 2;
        m_slots.assign(capacity, Slot{});
        m_mask = capacity - 1;
        m_count = 0;
    }

    bool isEmpty() const { return m_count == 0; }
    std::size_t count() const { return m_count; }

    /// The slot of a key; null if the table does not contain it.
    Slot* find(std::uint64_t key) { return contains(key) ? &m_slots[place(key)] : nullptr; }
    bool contains(std::uint64_t key) const { return m_count != 0 && m_slots[place(key)].key == key; }

    /// Adds the key if the table does not contain it, and returns its slot.
    Slot& insert(std::uint64_t key)
    {
        if (2 * (m_count + 1) > m_slots.size())
            grow();
        Slot& slot = m_slots[place(key)];
        m_count += slot.key != key ? 1 : 0;
        slot.key = key;
        return slot;
    }

    /// Removes the key and returns whether the table contained it. Backward-shift deletion leaves no tombstones.
    bool erase(std::uint64_t key)
    {
        if (m_count == 0)
            return false;
        std::size_t hole = place(key);
        if (m_slots[hole].key != key)
            return false;
        --m_count;
        for (std::size_t next = (hole + 1) & m_mask; m_slots[next].key != Slot{}.key;
             next = (next + 1) & m_mask)
        {
            const std::size_t distanceToHome = (next - home(m_slots[next].key)) & m_mask;
            if (distanceToHome < ((next - hole) & m_mask))
                continue;
            m_slots[hole] = m_slots[next];
            hole = next;
        }
        m_slots[hole] = {};
        return true;
    }

    /// Calls visit(slot) for every key, in no particular order; visit() must not change the table.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (const Slot& slot : m_slots)
        {
            if (slot.key != Slot{}.key)
                visit(slot);
        }
    }

    std::uint64_t bytes() const { return m_slots.capacity() * sizeof(Slot); }

private:
    std::size_t home(std::uint64_t key) const
    {
        std::uint64_t hash = key * 0x9E3779B97F4A7C15ull;
        hash ^= hash >> 32;
        return static_cast<std::size_t>(hash * 0xD6E8FEB86659FD93ull >> 20) & m_mask;
    }

    /// Where the key is, or would be. @pre there is a free slot
    std::size_t place(std::uint64_t key) const
    {
        std::size_t slot = home(key);
        while (m_slots[slot].key != key && m_slots[slot].key != Slot{}.key)
            slot = (slot + 1) & m_mask;
        return slot;
    }

    void grow()
    {
        std::vector<Slot> old;
        old.swap(m_slots);
        reset(old.empty() ? 8 : old.size());
        for (const Slot& slot : old)
        {
            if (slot.key != Slot{}.key)
                insert(slot.key) = slot;
        }
    }

    std::vector<Slot> m_slots;
    std::size_t m_mask = 0;
    std::size_t m_count = 0;
};

struct KeySlot
{
    std::uint64_t key = kFreeKey;
};

using KeySet = KeyTable<KeySlot>;
}  // namespace cullet
