// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/search_input.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/thesis/bit_strings.h"
#include "cullet/comparison/thesis/cell_steps.h"
#include "cullet/comparison/thesis/principal_axis.h"
#include "cullet/comparison/thesis/workspace_shift.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// Finds the principal directions of a scene and projects the boxes onto them.
template <class Exec>
class PrincipalFrame
{
public:
    /// Returns the projections. Waits for the executor.
    const Aabb* project(Exec& exec, SearchInput input)
    {
        const std::uint64_t parts = std::clamp<std::uint64_t>(input.count / 64, 1, 1024);
        exec.reserve(m_parts, parts);
        exec.reserve(m_sums, 1);
        exec.reserve(m_projections, input.count);
        exec.forEach(parts, SumCentres{input.boxes, input.count, parts, m_parts.data()});
        exec.forEach(1, AddCentres{m_parts.data(), parts, m_sums.data()});
        CentreSums sums;
        exec.download(&sums, m_sums.data(), 1);
        exec.wait();
        exec.forEach(input.count, ProjectBox{input.boxes, principalDirections(sums), m_projections.data()});
        return m_projections.data();
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    Buffer<CentreSums> m_parts, m_sums;
    Buffer<Aabb> m_projections;
};

/// The thesis's search, with its options. Has the members of Search.
template <class Exec>
class CellSearch
{
public:
    explicit CellSearch(const ThesisOptions& options)
        : m_options(options), m_isShifted(options.isShifted && !options.isAxisPrincipal)
    {
    }

    // Every build() plans anew, with the boxes that it gets.
    void poll(Exec&) {}
    void advanceNextPlan(Exec&) {}
    void forgetPlans() {}
    void countRepeat() {}
    static constexpr unsigned kPhases = 1;
    unsigned nextPhase() const { return 0; }
    std::uint32_t launches() const { return 0; }
    /// build() waits for the number of entries.
    bool isRepeatable(const Exec&, const SearchInput&) const { return false; }
    /// emit() never reports kOverflowed.
    void buildByCounting(Exec& exec, const Aabb* boxes)
    {
        m_input.boxes = boxes;
        build(exec, m_input);
    }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        clearPairCount(exec, input);
        reserveForBoxes(exec, input.count);
        if (input.copies.now != nullptr)
            exec.forEach(input.count, CopyBox{input.boxes, input.copies});
        const bool isTurned = m_options.isAxisPrincipal;
        m_placed = isTurned ? m_mode.project(exec, input) : input.boxes;
        m_statistics.collect(exec, {m_placed, input.count}, 1);
        exec.forEach(1, PlanCells{m_statistics.moments(), m_statistics.sizes(),
                                  isTurned ? PsapAxis::X : sweepAxis(m_options), m_options.cells,
                                  m_options.cellCount, m_plan.data()});

        exec.clear(m_unboundedCount.data(), 1);
        exec.clear(m_counts.data() + input.count, 1);
        exec.forEach(input.count, CountCells{input.boxes, m_placed, m_plan.data(), m_counts.data(),
                                             m_unbounded.data(), m_unboundedCount.data()});
        exec.exclusiveSum(m_counts.data(), m_offsets.data(), input.count + 1);
        readEntryCount(exec);
        exec.forEach(input.count, FillEntries{m_placed, m_plan.data(), m_counts.data(), m_offsets.data(),
                                              m_keys[0].data(), m_rows[0].data()});
        if (m_isShifted)
            exec.forEach(m_entryCount, ShiftKey{m_plan.data(), m_placed, m_rows[0].data(), m_keys[0].data()});
        exec.sortPairs(m_keys[0].data(), m_keys[1].data(), m_rows[0].data(), m_rows[1].data(), m_entryCount,
                       64);
        if (!m_isShifted)
            prepareSweep(exec);
    }

    /// @param isNew EveryPair, or another entry test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_isShifted)
            emitShifted(exec, isNew, pairs);
        else if (m_options.splitWork)
            exec.forEachAppend(m_partCount, SweepPart<IsNew>{sweepWith(isNew), m_firstParts.data()}, pairs);
        else
            exec.forEachAppend(m_entryCount, sweepWith(isNew), pairs);
        exec.forEachAppend(m_input.count,
                           TestUnbounded<IsNew>{m_input.boxes, m_counts.data(), m_unbounded.data(),
                                                m_unboundedCount.data(), isNew},
                           pairs);
    }

    const std::uint32_t* unboundedCount() const { return m_unboundedCount.data(); }
    std::uint64_t entryCount() const { return m_entryCount; }
    std::uint64_t falsePairCount() const { return m_falsePairCount; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_plan, 1);
        exec.reserve(m_unboundedCount, 1);
        exec.reserve(m_falsePairs, 1);
        exec.reserve(m_counts, count + 1);
        exec.reserve(m_offsets, count + 1);
        exec.reserve(m_unbounded, count);
    }

    void readEntryCount(Exec& exec)
    {
        exec.download(&m_entryCount, m_offsets.data() + m_input.count, 1);
        exec.wait();
        const std::uint64_t room = roomForEntries();
        for (int side = 0; side < 2; ++side)
        {
            exec.reserve(m_keys[side], room);
            exec.reserve(m_rows[side], room);
        }
        exec.reserve(m_isSingle, room);
    }

    std::uint64_t roomForEntries() const
    {
        return std::max<std::uint64_t>(m_entryCount, m_options.initialCapacity);
    }

    void prepareSweep(Exec& exec)
    {
        exec.forEach(m_entryCount, MarkSingle{m_keys[1].data(), m_entryCount, m_isSingle.data()});
        if (m_options.bitStrings)
            markSecondLevel(exec);
        if (m_options.splitWork)
            splitWork(exec);
    }

    void markSecondLevel(Exec& exec)
    {
        exec.reserve(m_bits, roomForEntries());
        exec.forEach(m_entryCount, MarkSecondLevel{m_keys[1].data(), m_rows[1].data(), m_placed,
                                                   m_plan.data(), m_bits.data()});
    }

    void splitWork(Exec& exec)
    {
        exec.reserve(m_parts, roomForEntries() + 1);
        exec.reserve(m_firstParts, roomForEntries() + 1);
        exec.forEach(m_entryCount + 1, CountParts<EveryPair>{sweepWith(EveryPair{}), m_parts.data()});
        exec.exclusiveSum(m_parts.data(), m_firstParts.data(), m_entryCount + 1);
        exec.download(&m_partCount, m_firstParts.data() + m_entryCount, 1);
        exec.wait();
    }

    template <class IsNew>
    SweepCell<IsNew> sweepWith(const IsNew& isNew) const
    {
        return {m_keys[1].data(),
                m_rows[1].data(),
                m_isSingle.data(),
                m_options.bitStrings ? m_bits.data() : nullptr,
                m_entryCount,
                m_input.boxes,
                m_placed,
                m_plan.data(),
                isNew};
    }

    template <class IsNew>
    void emitShifted(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.clear(m_falsePairs.data(), 1);
        exec.forEachAppend(m_entryCount,
                           SweepShifted<IsNew>{m_keys[1].data(), m_rows[1].data(), m_entryCount,
                                               m_input.boxes, m_plan.data(), isNew, m_falsePairs.data()},
                           pairs);
        exec.download(&m_falsePairCount, m_falsePairs.data(), 1);
        exec.wait();
    }

    ThesisOptions m_options;
    bool m_isShifted;
    SearchInput m_input{};
    const Aabb* m_placed = nullptr;  ///< the boxes or their projections
    std::uint64_t m_entryCount = 0;
    std::uint64_t m_partCount = 0;
    std::uint64_t m_falsePairCount = 0;
    PrincipalFrame<Exec> m_mode;
    Statistics<Exec> m_statistics;
    Buffer<CellPlan> m_plan;
    Buffer<std::uint64_t> m_counts, m_offsets;
    Buffer<std::uint32_t> m_unbounded, m_unboundedCount;
    Buffer<std::uint64_t> m_keys[2];  ///< unsorted and sorted
    Buffer<std::uint32_t> m_rows[2];
    Buffer<std::uint8_t> m_isSingle;
    Buffer<std::uint64_t> m_bits;                 ///< second-level bit strings
    Buffer<std::uint64_t> m_parts, m_firstParts;  ///< parts of the split work
    Buffer<std::uint64_t> m_falsePairs;
};
}  // namespace cullet::psap
