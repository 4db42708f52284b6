// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_sync/pair_map.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Pairs that the backend holds and the pair cache lacks, and the conditions for re-evaluating them.
///
/// A pair is deferred because the filter refused it (or the application removed it from the cache), or because the
/// exact boxes are separated although the rounded ones overlap or are within the margin. A pair of the second kind is
/// re-evaluated whenever one of its boxes changes. The first kind follows btDbvtBroadphase, which calls the filter
/// again when it reinserts a leaf into its tree: when a box leaves the box that it had at the last evaluation, grown
/// by the margin, or when a filter word changes.
///
/// DBVT remembers no refusal. So that many cost no more here, refused pairs are listed up to a limit only. Beyond it
/// the rows that have some are marked, and the owner finds the pairs of a marked row that is due by a box query, those
/// within the margin too: the backend still holds a refused pair there. What the filter allows of these is listed until
/// the boxes overlap. Refused pairs are listed again when no row is marked any more. Where they are a large share of all
/// pairs, AllowedPairs takes over.
///
/// Unchanged rows cost nothing.
class DeferredPairs
{
public:
    enum Reason : std::uint8_t
    {
        kRefused,
        kSeparated,
        kNear  ///< as kSeparated, but the backend may not hold the pair
    };

    /// Adds the pair, or changes its reason; a refused one marks its rows if rows are marked. `boxes` are the current
    /// boxes by row.
    void insert(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, Reason reason, const Aabb* boxes,
                float margin);

    bool erase(Pair pair) noexcept { return m_set.erase(pair); }
    void eraseAllOf(std::uint32_t uniqueId, std::uint32_t row) noexcept;
    bool contains(Pair pair) const noexcept { return m_set.size() != 0 && m_set.contains(pair); }

    /// Whether the pair is listed and the backend may not hold it.
    bool isNear(Pair pair) const noexcept;
    /// The backend holds the pair, which need not be listed.
    void confirmHeld(Pair pair) noexcept;

    /// Whether the pair is listed as refused and neither box has left its grown box since.
    bool isRefusalCurrent(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond,
                          const Aabb* boxes) const;

    /// Appends the listed pairs to re-evaluate after the changes of the view, each at least once, and the ids of the
    /// marked rows that are due: their refused pairs are to be re-evaluated, too.
    void collectToReevaluate(const ProxyView& view, Pairs& toReevaluate, std::vector<std::uint32_t>& due);

    /// Whether a marked row is due, and takeDue() has not been called for it.
    bool isDue(std::uint32_t row) const noexcept { return row < m_marks.size() && m_marks[row] == Mark::Due; }
    void takeDue(std::uint32_t row) noexcept { setMark(row, Mark::None); }

    /// Whether more refused pairs are listed than should be: markRows() is to be called.
    bool isFull() const noexcept
    {
        return m_set.size() > kFewPairs + kPairsPerRow * m_grownBoxes.size() && m_markedRows == 0;
    }

    /// Marks the rows of the refused pairs instead of listing these. May throw std::bad_alloc and then changes nothing.
    ///
    /// @param rowOf returns the row of an id, or a number above all rows
    template <class RowOf>
    void markRows(RowOf rowOf)
    {
        PairMap separated;
        for (std::uint32_t index = 0; index < m_set.size(); ++index)
        {
            if (m_set.tag(index) != kRefused)
                separated.insert(m_set.pairs()[index], m_set.tag(index));
        }
        for (std::uint32_t index = 0; index < m_set.size(); ++index)
        {
            if (m_set.tag(index) != kRefused)
                continue;
            mark(rowOf(m_set.pairs()[index].first));
            mark(rowOf(m_set.pairs()[index].second));
        }
        m_set = std::move(separated);
    }

    /// Marks the rows of a refused pair, which is then not listed. `boxes` are the current boxes by row.
    void mark(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, const Aabb* boxes, float margin);

    /// Whether refused pairs exist that are not listed.
    bool hasMarkedRows() const noexcept { return m_markedRows != 0; }
    /// The backend holds the listed pairs, all of them, and none of the refused ones that are not listed.
    void followRestart() noexcept;

    /// Whether there are pairs, listed or not.
    bool mayHavePairs() const noexcept { return m_set.size() != 0 || m_markedRows != 0; }
    const Pairs& pairs() const noexcept { return m_set.pairs(); }
    std::size_t size() const noexcept { return m_set.size(); }
    std::uint64_t bytes() const noexcept
    {
        return m_set.bytes() + m_grownBoxes.capacity() * sizeof(Aabb) + m_marks.capacity();
    }

private:
    /// What is known of the refused pairs of a row that are not listed.
    enum class Mark : std::uint8_t
    {
        None,    ///< there are none
        Marked,  ///< there may be some
        Due      ///< and they are to be re-evaluated in this update
    };

    /// Up to so many pairs, and this many per row, refused pairs are listed: about as much memory as the rows take.
    static constexpr std::size_t kFewPairs = 1024, kPairsPerRow = 2;

    void storeGrownBox(std::uint32_t uniqueId, std::uint32_t row, const Aabb* boxes, float margin);
    void collectToReevaluateOf(std::uint32_t uniqueId, bool includesRefused, Pairs& toReevaluate) const;
    void mark(std::uint32_t row) noexcept
    {
        if (row < m_marks.size() && m_marks[row] == Mark::None)
            setMark(row, Mark::Marked);
    }
    void setMark(std::uint32_t row, Mark mark) noexcept;

    PairMap m_set;
    std::vector<Mark> m_marks;       // by row
    std::vector<Aabb> m_grownBoxes;  // by row, for rows with pairs: the grown box
    std::uint32_t m_markedRows = 0;  // other than Mark::None
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
