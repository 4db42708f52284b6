// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bin_double_buffer.h"
#include "cullet/broad/psap/sorted/level_planner.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// The counting-sort search with bins of fixed room. Finds no pairs where a bin is full.
template <class Exec>
class FixedBinSearch
{
public:
    FixedBinSearch(const PsapOptions& options, PsapAxis axis)
        : m_room(std::clamp(options.initialCapacity, 1u, kBinRoom)), m_planner(options, axis, kPerBin)
    {
    }

    /// Whether so many boxes can be searched: indices of places have 32 bits.
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
        m_bins.begin(exec);
        const BinSet bins = m_bins.current();
        exec.forEach(input.count, PlaceInBins{{input.boxes, m_planner.plan(), m_unbounded.data(),
                                               &bins.totals->unboundedCount},
                                              bins,
                                              m_room,
                                              m_records.data(),
                                              input.pairCount});
    }

    /// @param isNew EveryPair, or another entry test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_input.count <= kMostBoxesOfFourSharers)
            emitSharing<4>(exec, isNew, pairs);
        else if (m_input.count <= kMostBoxesOfTwoSharers)
            emitSharing<2>(exec, isNew, pairs);
        else
            emitSharing<1>(exec, isNew, pairs);
        m_bins.markOtherClear();
    }

    /// Whether the next build() of the same number of boxes makes the same launches as the last but one.
    bool isRepeatable() const { return m_planner.hasPlan(); }

    /// Counts an update that repeated recorded launches instead of calling build().
    void countRepeat() { m_bins.swap(); }

    /// Index of the set of launches that the next update uses, of two.
    unsigned nextPhase() const { return m_bins.nextPhase(); }

    LevelPlanner<Exec>& planner() { return m_planner; }
    std::uint32_t levelCount() const { return m_planner.summary().levels; }
    const std::uint32_t* unboundedCount() const { return m_bins.unboundedCount(); }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // A block has a lane for each bin. With half a box per bin, the boxes of a block seldom need a second round.
    static constexpr double kPerBin = 0.5;
    static constexpr float kBinsPerBox = 2.25f;

    // Up to so many boxes a GPU has idle lanes: four for each box, or two.
    static constexpr std::uint64_t kMostBoxesOfFourSharers = 3u << 13;
    static constexpr std::uint64_t kMostBoxesOfTwoSharers = 3u << 14;

    template <std::uint32_t kSharers, class IsNew>
    void emitSharing(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.template forEachBinSlot<kSharers>(
            m_binCapacity,
            SearchFixedBins<IsNew, kSharers>{
                {m_records.data(), m_planner.plan(), m_input.boxes, m_unbounded.data(), isNew},
                m_bins.current(),
                m_bins.other(),
                m_room,
                pairs.count},
            pairs);
    }

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_unbounded, count);
        if (count > m_plannedCount + m_plannedCount / 4 || 2 * count < m_plannedCount)
        {
            m_binCapacity = binCapacityFor(count, kBinsPerBox);
            m_plannedCount = count;
            m_planner.forget();
            m_bins.forget();
        }
        m_bins.reserve(exec, m_binCapacity);
        const std::uint64_t places = (m_binCapacity + 1) * m_room + 1;
        if (m_records.size() < places)
        {
            exec.reserve(m_records, places);
            exec.clear(m_records.data(),
                       m_records.size());  // one record past the last of a bin is loaded but not used
        }
    }

    std::uint32_t m_room;
    SearchInput m_input{};
    std::uint64_t m_binCapacity = 0;
    std::uint64_t m_plannedCount = 0;
    LevelPlanner<Exec> m_planner;
    BinDoubleBuffer<Exec> m_bins;
    Buffer<SortRecord> m_records;
    Buffer<std::uint32_t> m_unbounded;
};
}  // namespace cullet::psap
