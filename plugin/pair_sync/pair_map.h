// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_cache/pair_hash.h"
#include "cullet/plugin/pair_cache/pair_links.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Pairs of unique ids, each with a tag byte of the owner, and for every id the list of its pairs.
///
/// Insert, find and erase in O(1); all pairs of an id in O(its pairs). The order is arbitrary but depends on the
/// sequence of operations only. About 40 bytes per pair.
class PairMap
{
public:
    static constexpr std::uint32_t kNone = PairHash::kNone;

    std::size_t size() const noexcept { return m_pairs.size(); }
    const Pairs& pairs() const noexcept { return m_pairs; }
    std::uint8_t tag(std::uint32_t index) const noexcept { return m_tags[index]; }
    void setTag(std::uint32_t index, std::uint8_t tag) noexcept { m_tags[index] = tag; }

    /// Index into pairs(), valid until the next change, or kNone.
    std::uint32_t find(Pair pair) const noexcept;
    bool contains(Pair pair) const noexcept { return find(pair) != kNone; }
    bool hasPairsOf(std::uint32_t id) const noexcept { return m_links.first(id) != kNone; }

    /// Adds the pair, or replaces the tag of an existing one. May throw std::bad_alloc and then changes nothing.
    void insert(Pair pair, std::uint8_t tag = 0);

    /// False when there is no such pair.
    bool erase(Pair pair) noexcept;
    void eraseAllOf(std::uint32_t id) noexcept;
    void clear() noexcept;

    /// Calls visit(index) for every pair of the id; the map must not change during the call.
    template <class Visit>
    void forEachOf(std::uint32_t id, Visit visit) const
    {
        for (std::uint32_t node = m_links.first(id); node != PairLinks::kNone; node = m_links.next(node))
            visit(PairLinks::pairOf(node));
    }

    std::uint64_t bytes() const noexcept;

private:
    void makeRoom();
    void eraseAt(std::uint32_t index) noexcept;

    Pairs m_pairs;
    std::vector<std::uint8_t> m_tags;
    PairHash m_hash;  // pair -> index
    PairLinks m_links;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
