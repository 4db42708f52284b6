// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
/// Sorts things by hashes of theirs, equal ones in the order in which they were, in linear time.
///
/// Iterations converge by the order of contacts. One that follows space or creation has a side that comes first in each
/// iteration, so that errors add up; a shuffled one that stays the same in all steps has none.
template <class Thing>
class ShuffledOrder
{
public:
    /// @param hashOf 32 bits of a thing
    template <class HashOf>
    void sort(std::vector<Thing>& things, const HashOf& hashOf)
    {
        unsigned shift = 32;
        while (shift > 8 && (things.size() >> (32 - shift)) != 0)
            --shift;
        m_next.assign((std::size_t{1} << (32 - shift)) + 1, 0);
        for (const Thing& thing : things)
            ++m_next[bucketOf(hashOf(thing), shift) + 1];
        for (std::size_t bucket = 1; bucket < m_next.size(); ++bucket)
            m_next[bucket] += m_next[bucket - 1];
        m_sorted.resize(things.size());
        for (const Thing& thing : things)
            m_sorted[m_next[bucketOf(hashOf(thing), shift)]++] = thing;
        // The buckets are in order; few things are not alone in theirs.
        for (std::size_t i = 1; i < m_sorted.size(); ++i)
        {
            for (std::size_t k = i; k > 0 && hashOf(m_sorted[k]) < hashOf(m_sorted[k - 1]); --k)
                std::swap(m_sorted[k], m_sorted[k - 1]);
        }
        things.swap(m_sorted);
    }

private:
    static std::size_t bucketOf(std::uint32_t hash, unsigned shift)
    {
        return static_cast<std::size_t>(std::uint64_t{hash} >> shift);
    }

    std::vector<std::uint32_t> m_next;  ///< [bucket] place of its next thing
    std::vector<Thing> m_sorted;
};
}  // namespace cullet
