// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_row_bins.h"
#include "broad/psap_row_planner.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// The fast search with bins of fixed room. Ends without pairs where a bin is full.
template <class Exec>
class BinSearch
{
public:
    BinSearch(const PsapOptions& options, PsapAxis axis)
        : m_room(std::clamp(options.initialCapacity, 1u, kBinRoom)), m_planner(options, axis, kPerBin)
    {
    }

    /// Whether so many boxes can be searched: places have 32 bits.
    static bool canHold(std::uint64_t count)
    {
        return count != 0 && binCapacityFor(count, kBinsPerBox) < 0xffffffffu / kBinRoom - 2;
    }

    /// @pre canHold(input.count)
    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        reserveForBoxes(exec, input.count);
        m_planner.prepare(exec, input, m_binCapacity);
        m_current = 1 - m_current;
        // The search leaves the others clear.
        if (!m_isClear)
            clear(exec);
        m_isClear = false;
        const RowBinSet bins = set(m_current);
        exec.forEach(input.count,
                     PlaceRows{{input.boxes, m_planner.plan(), m_side.data(), &bins.totals->sides},
                               bins,
                               m_room,
                               m_records.data(),
                               input.pairCount});
    }

    void emit(Exec& exec, const EntryTest& isNew, const PairList& pairs)
    {
        if (isNew.takeAll)
            emitTesting(exec, EveryPair{}, pairs);
        else
            emitTesting(exec, isNew, pairs);
        m_isClear = true;
    }

    /// Whether the next build() of as many boxes makes the same launches as the last but one.
    bool isRepeatable() const { return !m_planner.isStale(); }

    /// Counts a repetition that happened without build().
    void countRepeat()
    {
        m_planner.countUse();
        m_current = 1 - m_current;
    }

    /// Which of two sets of launches the next update is.
    unsigned nextPhase() const { return 1 - m_current; }

    std::uint32_t levelCount() const { return m_planner.levelCount(); }
    const std::uint32_t* sideCount() const { return &m_totals[m_current].data()->sides; }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // A block has a lane for each bin, and half as many boxes then: those of a full one would often take a second turn.
    static constexpr double kPerBin = 0.5;
    static constexpr float kBinsPerBox = 2.25f;

    // Up to so many boxes a GPU has lanes to spare: four for each, or two.
    static constexpr std::uint64_t kBoxesOfFour = 3u << 13;
    static constexpr std::uint64_t kBoxesOfTwo = 3u << 14;

    RowBinSet set(unsigned which) const { return {m_counts[which].data(), m_totals[which].data()}; }

    template <class IsNew>
    void emitTesting(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_input.count <= kBoxesOfFour)
            emitSharing<4>(exec, isNew, pairs);
        else if (m_input.count <= kBoxesOfTwo)
            emitSharing<2>(exec, isNew, pairs);
        else
            emitSharing<1>(exec, isNew, pairs);
    }

    template <std::uint32_t kSharers, class IsNew>
    void emitSharing(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.template forEachDealt<kSharers>(
            m_binCapacity,
            SearchBins<IsNew, kSharers>{
                {m_records.data(), m_planner.plan(), m_input.boxes, m_side.data(), isNew},
                set(m_current),
                set(1 - m_current),
                m_room,
                pairs.count},
            pairs);
    }

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_side, count);
        if (count > m_plannedCount + m_plannedCount / 4 || 2 * count < m_plannedCount)
        {
            m_binCapacity = binCapacityFor(count, kBinsPerBox);
            m_plannedCount = count;
            m_planner.forget();
            m_isClear = false;
        }
        for (int which = 0; which < 2; ++which)
        {
            exec.reserve(m_counts[which], m_binCapacity);
            exec.reserve(m_totals[which], 1);
        }
        const std::uint64_t places = (m_binCapacity + 1) * m_room + 1;
        if (m_records.size() < places)
        {
            exec.reserve(m_records, places);
            exec.clear(m_records.data(),
                       m_records.size());  // one behind those of a bin is read, whatever it says
        }
    }

    void clear(Exec& exec)
    {
        for (int which = 0; which < 2; ++which)
        {
            exec.clear(m_counts[which].data(), m_binCapacity);
            exec.clear(m_totals[which].data(), 1);
        }
    }

    std::uint32_t m_room;
    SearchInput m_input{};
    std::uint64_t m_binCapacity = 0;
    std::uint64_t m_plannedCount = 0;
    RowPlanner<Exec> m_planner;
    unsigned m_current = 0;
    Buffer<std::uint32_t> m_counts[2];
    Buffer<BinTotals> m_totals[2];
    Buffer<RowRecord> m_records;
    Buffer<std::uint32_t> m_side;
    bool m_isClear = false;  ///< the set that comes next
};
}  // namespace cullet::psap
