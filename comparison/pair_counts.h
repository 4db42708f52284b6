// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/key_table.h"
#include "cullet/broad/pairs/pair_tests.h"

#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Counts of pairs of table rows. It contains a pair while the count of that pair is not 0. All O(1) except forEach().
class PairCounts
{
public:
    void add(std::uint32_t a, std::uint32_t b) { ++m_table.insert(rowKey({a, b})).count; }

    /// @pre the count of the pair is not 0
    void subtract(std::uint32_t a, std::uint32_t b)
    {
        const std::uint64_t key = rowKey({a, b});
        if (--m_table.find(key)->count == 0)
            m_table.erase(key);
    }

    /// Calls visit(a, b) for every pair. O(slots).
    template <class Visit>
    void forEach(Visit visit) const
    {
        m_table.forEach(
            [&](const Slot& slot)
            { visit(static_cast<std::uint32_t>(slot.key >> 32), static_cast<std::uint32_t>(slot.key)); });
    }

    std::size_t size() const { return m_table.count(); }
    std::uint64_t bytes() const { return m_table.bytes(); }
    void clear() { m_table.reset(0); }

private:
    struct Slot
    {
        std::uint64_t key = kFreeKey;
        std::uint32_t count = 0;
    };

    KeyTable<Slot> m_table;
};
}  // namespace cullet
