// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pairs/pair_keys.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Sorted keys of row pairs, the first row in the upper half, from which pairs are erased one by one.
///
/// Cost: O(1) per lookup where keys are spread, because their range is divided evenly into about as many parts as there
/// are pairs; O(log pairs) in any case.
class SortedPairs
{
public:
    /// @param keys [in, out] ascending, unique; swapped into the object, unspecified afterwards
    void take(PairKeys& keys)
    {
        m_keys.swap(keys);
        m_isErased.assign(m_keys.size(), 0);
        buildIndex();
    }

    /// Whether the pair was given to take() and has not been erased.
    bool contains(std::uint64_t key) const
    {
        const std::size_t place = placeOf(key);
        return place != m_keys.size() && m_isErased[place] == 0;
    }

    /// Erases the pair and returns whether it was contained.
    bool erase(std::uint64_t key)
    {
        const std::size_t place = placeOf(key);
        if (place == m_keys.size() || m_isErased[place] != 0)
            return false;
        m_isErased[place] = 1;
        return true;
    }

    /// Calls visit(key) for every pair that has not been erased.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (std::size_t place = 0; place < m_keys.size(); ++place)
        {
            if (m_isErased[place] == 0)
                visit(m_keys[place]);
        }
    }

    std::uint64_t bytes() const
    {
        return m_keys.capacity() * sizeof(std::uint64_t) + m_isErased.capacity() +
               m_begins.capacity() * sizeof(std::uint32_t);
    }

private:
    void buildIndex()
    {
        m_begins.clear();
        if (m_keys.empty())
            return;
        const std::uint64_t range = m_keys.back() - m_keys.front();
        for (m_shift = 0; range >> m_shift >= m_keys.size(); ++m_shift)
        {
        }
        m_begins.resize((range >> m_shift) + 2);
        std::size_t place = 0;
        for (std::size_t part = 0; part < m_begins.size(); ++part)
        {
            while (place < m_keys.size() && partOf(m_keys[place]) < part)
                ++place;
            m_begins[part] = static_cast<std::uint32_t>(place);
        }
    }

    std::size_t partOf(std::uint64_t key) const
    {
        return static_cast<std::size_t>((key - m_keys.front()) >> m_shift);
    }

    /// Index of a key in m_keys; the size of m_keys if the key is absent.
    std::size_t placeOf(std::uint64_t key) const
    {
        if (m_keys.empty() || key < m_keys.front() || key > m_keys.back())
            return m_keys.size();
        const std::uint32_t* const part = m_begins.data() + partOf(key);
        const auto end = m_keys.begin() + part[1];
        const auto found = std::lower_bound(m_keys.begin() + part[0], end, key);
        return found != end && *found == key ? static_cast<std::size_t>(found - m_keys.begin())
                                             : m_keys.size();
    }

    PairKeys m_keys;
    std::vector<std::uint8_t> m_isErased;  // [keys]
    std::vector<std::uint32_t> m_begins;   // [parts + 1] first key of each part
    std::uint32_t m_shift = 0;             // from a key, less the lowest key, to its part
};
}  // namespace cullet
