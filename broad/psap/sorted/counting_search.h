// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/records.h"
#include "cullet/broad/psap/sorted/level_planner.h"
#include "cullet/broad/psap/sorted/warp_search.h"

#include <cstdint>

namespace cullet::psap
{
/// The counting-sort search. A plan is made from a sample and used for several updates.
template <class Exec>
class CountingSearch
{
public:
    CountingSearch(const PsapOptions& options, PsapAxis axis)
        : m_rowSearch(options.rowSearch), m_planner(options, axis, 0)
    {
    }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        if (m_isWarpSearch != isWarpSearchNext(input))
            setWarpSearch(!m_isWarpSearch);
        reserveForBoxes(exec, input.count);
        m_planner.prepare(exec, input, m_binCapacity);

        // The search clears both.
        if (!m_isClear || input.count == 0)
        {
            exec.clear(m_binCounts.data(), m_binCapacity + 1);
            exec.clear(m_totals.data(), 1);
            clearPairCount(exec, input);
        }
        m_isClear = false;
        sort(exec);
    }

    /// @param isNew EveryPair, or another entry test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_isWarpSearch)
            exec.forEachWarp(m_input.count, SearchByWarp<IsNew>{partners(isNew), sortedBins()}, pairs);
        else if (exec.hasSpareLanes() && m_input.count <= kBoxesWithSharers)
            emitSharing<4>(exec, isNew, pairs);
        else
            emitSharing<1>(exec, isNew, pairs);
        m_isClear = m_input.count != 0;
    }

    /// Whether build() of this input, with the same number of boxes as before, makes the same launches, without
    /// allocation or wait.
    bool isRepeatable(const SearchInput& input) const
    {
        return m_input.count != 0 && m_planner.hasPlan() && m_isWarpSearch == isWarpSearchNext(input);
    }
    /// Changes when build() launches something else, or with other memory.
    std::uint32_t launches() const { return m_launches; }

    LevelPlanner<Exec>& planner() { return m_planner; }
    std::uint32_t levelCount() const { return m_planner.summary().levels; }
    const std::uint32_t* unboundedCount() const { return &m_totals.data()->unboundedCount; }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr float kBinsPerBox = 1.25f;
    static constexpr float kBinsPerBoxForWarps = 0.5f;
    static constexpr std::uint64_t kBoxesForWarps = 1u << 15;
    // Pairs per box at which the warp search begins, and below which it ends: it gains 13 to 23 % at 7.2 and loses 4
    // to 5 % at 1.
    static constexpr std::uint64_t kPairsForWarps = 4;
    static constexpr std::uint64_t kLeastPairsForWarps = 3;
    // Up to so many boxes a GPU has idle lanes.
    static constexpr std::uint64_t kBoxesWithSharers = 1u << 15;

    /// Whether the records of a warp search together: with many levels, or with many pairs everywhere. Otherwise a
    /// box alone visits fewer records, above all where small boxes are much denser than the plan assumes.
    bool isWarpSearchNext(const SearchInput& input) const
    {
        if (m_rowSearch != PsapRowSearch::Automatic)
            return m_rowSearch == PsapRowSearch::Grouped;
        constexpr std::uint32_t kLevelsForWarps = 4;  // the last one is the overflow level
        const PlanSummary summary = m_planner.summary();
        const std::uint64_t pairs = m_isWarpSearch ? kLeastPairsForWarps : kPairsForWarps;
        return input.count >= kBoxesForWarps &&
               (summary.levels >= kLevelsForWarps || (summary.isCrowded && input.count > kBoxesWithSharers &&
                                                      input.expectedPairs >= pairs * input.count));
    }

    void setWarpSearch(bool isWarpSearch)
    {
        m_isWarpSearch = isWarpSearch;
        m_planner.planForWarps(isWarpSearch);
        m_binCapacity = 0;
    }

    void sort(Exec& exec)
    {
        const std::uint64_t count = m_input.count;
        exec.forEach(count, CountIntoBins{binFinder(), m_places.data(), m_binCounts.data()});
        exec.exclusiveSum(m_binCounts.data(), m_binStarts.data(), m_binCapacity + 1);
        exec.forEach(count,
                     ScatterToBins{m_input.boxes, m_planner.plan(), m_places.data(), m_binStarts.data(),
                                   m_binCapacity, m_records.data(), makeCleanup()});
    }

    template <std::uint32_t kSharers, class IsNew>
    void emitSharing(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.forEachAppendWarp(kSharers * m_input.count,
                               SearchSorted<IsNew, kSharers>{partners(isNew), sortedBins()}, pairs);
    }

    template <class IsNew>
    PartnerSearch<IsNew> partners(const IsNew& isNew) const
    {
        return {m_records.data(), m_planner.plan(), m_input.boxes, m_unbounded.data(), isNew};
    }
    SortedBins sortedBins() const
    {
        return {m_binStarts.data(), m_binCapacity, m_totals.data(), m_input.count, m_binCounts.data()};
    }

    BinFinder binFinder() const
    {
        return {m_input.boxes, m_planner.plan(), m_unbounded.data(), &m_totals.data()->unboundedFound};
    }
    SortCleanup makeCleanup() const { return {m_totals.data(), m_input.pairCount}; }

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_unbounded, count);
        if (m_records.size() <= count)
        {
            exec.reserve(m_records, count + 1);
            exec.clear(m_records.data(), m_records.size());  // the record past the last is loaded, not used
        }
        exec.reserve(m_places, count);
        if (count > m_plannedCount + m_plannedCount / 4 || 2 * count < m_plannedCount)
            m_binCapacity = 0;
        if (m_binCapacity == 0)
        {
            m_binCapacity = binCapacityFor(count, m_isWarpSearch ? kBinsPerBoxForWarps : kBinsPerBox);
            m_plannedCount = count;
            ++m_launches;
            m_planner.forget();
            m_isClear = false;
        }
        exec.reserve(m_binCounts, m_binCapacity + 1);
        exec.reserve(m_totals, 1);
        exec.reserve(m_binStarts, m_binCapacity + 1);
    }

    PsapRowSearch m_rowSearch;
    SearchInput m_input{};
    std::uint64_t m_binCapacity = 0;
    std::uint64_t m_plannedCount = 0;
    LevelPlanner<Exec> m_planner;
    bool m_isWarpSearch = false;
    std::uint32_t m_launches = 0;  ///< version of the launches
    Buffer<BinRank> m_places;
    Buffer<std::uint32_t> m_binCounts, m_binStarts;
    Buffer<SortRecord> m_records;
    Buffer<std::uint32_t> m_unbounded;
    Buffer<SortTotals> m_totals;
    bool m_isClear = false;  ///< m_binCounts, and unboundedFound of m_totals, are 0
};
}  // namespace cullet::psap
