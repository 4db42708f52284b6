// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bin_double_buffer.h"
#include "cullet/broad/psap/sorted/level_planner.h"

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
        m_bins.begin(exec);
        const RowBinSet bins = m_bins.current();
        exec.forEach(input.count,
                     PlaceRows{{input.boxes, m_planner.plan(), m_side.data(), &bins.totals->sides},
                               bins,
                               m_room,
                               m_records.data(),
                               input.pairCount});
    }

    /// @param isNew EveryPair, or another test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_input.count <= kBoxesOfFour)
            emitSharing<4>(exec, isNew, pairs);
        else if (m_input.count <= kBoxesOfTwo)
            emitSharing<2>(exec, isNew, pairs);
        else
            emitSharing<1>(exec, isNew, pairs);
        m_bins.noteSearched();
    }

    /// Whether the next build() of as many boxes makes the same launches as the last but one.
    bool isRepeatable() const { return m_planner.hasPlan(); }

    /// Counts a repetition that happened without build().
    void countRepeat() { m_bins.swap(); }

    /// Which of two sets of launches the next update is.
    unsigned nextPhase() const { return m_bins.nextPhase(); }

    LevelPlanner<Exec>& planner() { return m_planner; }
    std::uint32_t levelCount() const { return m_planner.told().levels; }
    const std::uint32_t* sideCount() const { return m_bins.sideCount(); }
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

    template <std::uint32_t kSharers, class IsNew>
    void emitSharing(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.template forEachDealt<kSharers>(
            m_binCapacity,
            SearchBins<IsNew, kSharers>{
                {m_records.data(), m_planner.plan(), m_input.boxes, m_side.data(), isNew},
                m_bins.current(),
                m_bins.other(),
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
            m_bins.forget();
        }
        m_bins.reserve(exec, m_binCapacity);
        const std::uint64_t places = (m_binCapacity + 1) * m_room + 1;
        if (m_records.size() < places)
        {
            exec.reserve(m_records, places);
            exec.clear(m_records.data(),
                       m_records.size());  // one behind those of a bin is read, whatever it says
        }
    }

    std::uint32_t m_room;
    SearchInput m_input{};
    std::uint64_t m_binCapacity = 0;
    std::uint64_t m_plannedCount = 0;
    LevelPlanner<Exec> m_planner;
    BinDoubleBuffer<Exec> m_bins;
    Buffer<RowRecord> m_records;
    Buffer<std::uint32_t> m_side;
};
}  // namespace cullet::psap
