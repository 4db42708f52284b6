// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"

#include <cstddef>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The pairs of an array in descending order of (first, second), compared as int as Bullet does
/// (btBroadphasePairSortPredicate); reuses its memory from sort to sort.
class PairOrder
{
public:
    struct Entry
    {
        Pair ids;
        std::uint32_t index;  ///< of the pair in the array
    };

    /// Whether the order belongs to this version of the array.
    bool isOf(std::uint64_t version) const noexcept { return m_version == version; }

    /// Removes all entries and reserves memory for `count` new ones. May throw std::bad_alloc.
    void reserve(std::size_t count);

    /// @pre reserve() was called with enough entries
    void add(const Entry& entry) noexcept { m_entries.push_back(entry); }

    /// Stable radix sort, least significant digit first, over the digits in which the ids differ. O(entries).
    ///
    /// @param version for isOf(); not 0
    void sort(std::uint64_t version) noexcept;

    const Array<Entry>& entries() const noexcept { return m_entries; }

    std::uint64_t bytes() const noexcept
    {
        return (m_entries.capacity() + m_scratch.capacity()) * sizeof(Entry);
    }

private:
    void scatter(std::uint32_t Pair::*id, int shift);

    Array<Entry> m_entries;
    Array<Entry> m_scratch;
    std::uint64_t m_version = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
