// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_bin_search.h"
#include "broad/psap_kernels.h"
#include "broad/psap_principal.h"
#include "broad/psap_row_groups.h"
#include "broad/psap_row_planner.h"
#include "broad/psap_rows.h"
#include "broad/psap_search_input.h"
#include "broad/psap_second_level.h"
#include "broad/psap_shifted.h"
#include "broad/psap_tile_search.h"

#include <algorithm>
#include <cstdint>

/// The order of the steps, for any executor.
///
/// An executor has: Buffer<T> with data() and size(); reserve(buffer, n), which may discard; upload, download, copy,
/// clear and wait; forEach(n, functor); forEachEmitting(n, functor, list); forEachTogether(n, functor, list);
/// forEachGrouped(n, functor, list);
/// forEachDealt<sharers>(bins, functor, list); hasSpareLanes; scan; scanLargest; sortPairs; sortKeys. Steps run one after the other. HostExec and CudaExec are
/// executors.
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

/// The thesis's search, step by step, with its options.
template <class Exec>
class CellSearch
{
public:
    CellSearch(const PsapOptions& options, PsapAxis axis)
        : m_options(options), m_axis(axis), m_isShifted(options.variant == PsapVariant::Shifted)
    {
    }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        clearPairCount(exec, input);
        reserveForBoxes(exec, input.count);
        const bool isTurned = m_axis == PsapAxis::Principal;
        m_placed = isTurned ? m_frame.project(exec, input) : input.boxes;
        m_statistics.collect(exec, {m_placed, input.count}, 1);
        exec.forEach(1,
                     PlanCells{m_statistics.moments(), m_statistics.sizes(), isTurned ? PsapAxis::X : m_axis,
                               m_options.cells, m_options.cellCount, m_plan.data()});

        exec.clear(m_sideCount.data(), 1);
        exec.clear(m_counts.data() + input.count, 1);
        exec.forEach(input.count, CountCells{input.boxes, m_placed, m_plan.data(), m_counts.data(),
                                             m_side.data(), m_sideCount.data()});
        exec.scan(m_counts.data(), m_offsets.data(), input.count + 1);
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

    void emit(Exec& exec, const EntryTest& isNew, const PairList& pairs)
    {
        if (m_isShifted)
            emitShifted(exec, isNew, pairs);
        else if (m_options.splitWork)
            exec.forEachEmitting(m_partCount, SweepPart{sweepWith(isNew), m_firstParts.data()}, pairs);
        else
            exec.forEachEmitting(m_entryCount, sweepWith(isNew), pairs);
        exec.forEachEmitting(
            m_input.count, TestSide{m_input.boxes, m_counts.data(), m_side.data(), m_sideCount.data(), isNew},
            pairs);
    }

    const std::uint32_t* sideCount() const { return m_sideCount.data(); }
    std::uint64_t entryCount() const { return m_entryCount; }
    std::uint64_t falsePairCount() const { return m_falsePairCount; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_plan, 1);
        exec.reserve(m_sideCount, 1);
        exec.reserve(m_falsePairs, 1);
        exec.reserve(m_counts, count + 1);
        exec.reserve(m_offsets, count + 1);
        exec.reserve(m_side, count);
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
        exec.reserve(m_isLonely, room);
    }

    std::uint64_t roomForEntries() const
    {
        return std::max<std::uint64_t>(m_entryCount, m_options.initialCapacity);
    }

    void prepareSweep(Exec& exec)
    {
        exec.forEach(m_entryCount, MarkLonely{m_keys[1].data(), m_entryCount, m_isLonely.data()});
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
        exec.forEach(m_entryCount + 1, CountParts{sweepWith({}), m_parts.data()});
        exec.scan(m_parts.data(), m_firstParts.data(), m_entryCount + 1);
        exec.download(&m_partCount, m_firstParts.data() + m_entryCount, 1);
        exec.wait();
    }

    SweepCell sweepWith(const EntryTest& isNew) const
    {
        return {m_keys[1].data(),
                m_rows[1].data(),
                m_isLonely.data(),
                m_options.bitStrings ? m_bits.data() : nullptr,
                m_entryCount,
                m_input.boxes,
                m_placed,
                m_plan.data(),
                isNew};
    }

    void emitShifted(Exec& exec, const EntryTest& isNew, const PairList& pairs)
    {
        exec.clear(m_falsePairs.data(), 1);
        exec.forEachEmitting(m_entryCount,
                             SweepShifted{m_keys[1].data(), m_rows[1].data(), m_entryCount, m_input.boxes,
                                          m_plan.data(), isNew, m_falsePairs.data()},
                             pairs);
        exec.download(&m_falsePairCount, m_falsePairs.data(), 1);
        exec.wait();
    }

    PsapOptions m_options;
    PsapAxis m_axis;
    bool m_isShifted;
    SearchInput m_input{};
    const Aabb* m_placed = nullptr;  ///< the boxes or their projections
    std::uint64_t m_entryCount = 0;
    std::uint64_t m_partCount = 0;
    std::uint64_t m_falsePairCount = 0;
    PrincipalFrame<Exec> m_frame;
    Statistics<Exec> m_statistics;
    Buffer<CellPlan> m_plan;
    Buffer<std::uint64_t> m_counts, m_offsets;
    Buffer<std::uint32_t> m_side, m_sideCount;
    Buffer<std::uint64_t> m_keys[2];  ///< as filled, and sorted
    Buffer<std::uint32_t> m_rows[2];
    Buffer<std::uint8_t> m_isLonely;
    Buffer<std::uint64_t> m_bits;                 ///< second-level bit strings
    Buffer<std::uint64_t> m_parts, m_firstParts;  ///< of the split work
    Buffer<std::uint64_t> m_falsePairs;
};

/// The fast search. The plan is made from a sample and used for some updates.
template <class Exec>
class RowSearch
{
public:
    RowSearch(const PsapOptions& options, PsapAxis axis) : m_options(options), m_planner(options, axis, 0) {}

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        if (m_isGrouped != groupsNext())
            setGrouped(!m_isGrouped);
        reserveForBoxes(exec, input.count);
        m_planner.prepare(exec, input, m_binCapacity);

        // The search leaves both clear.
        if (!m_isClear || input.count == 0)
        {
            exec.clear(m_binCounts.data(), m_binCapacity + 1);
            exec.clear(m_totals.data(), 1);
            clearPairCount(exec, input);
        }
        m_isClear = false;
        isRadix() ? sortByRadix(exec) : sortByCounting(exec);
    }

    void emit(Exec& exec, const EntryTest& isNew, const PairList& pairs)
    {
        if (isNew.takeAll)
            emitTesting(exec, EveryPair{}, pairs);
        else
            emitTesting(exec, isNew, pairs);
        m_isClear = m_input.count != 0;
    }

    /// Whether the next build() of as many boxes makes the same launches as the last one, without allocation or wait.
    bool isRepeatable() const
    {
        return m_input.count != 0 && !m_planner.isStale() && m_isGrouped == groupsNext();
    }

    /// Counts a repetition that happened without build().
    void countRepeat() { m_planner.countUse(); }

    std::uint32_t levelCount() const { return m_planner.levelCount(); }
    const std::uint32_t* sideCount() const { return &m_totals.data()->sides; }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr float kBinsPerBox = 1.25f;
    static constexpr float kBinsPerBoxOfGroup = 0.5f;
    static constexpr std::uint64_t kBoxesForGroups = 1u << 17;
    static constexpr std::uint64_t kBoxesForRadix = 6u << 20;
    static constexpr std::uint64_t kMostBinsOfThreePasses = (1u << 24) - 1;
    // Up to here a GPU has lanes to spare.
    static constexpr std::uint64_t kBoxesWithSharers = 1u << 15;

    bool isRadix() const
    {
        return m_options.order == PsapOrder::Radix ||
               (m_options.order == PsapOrder::Automatic && m_input.count >= kBoxesForRadix);
    }

    /// Whether the boxes of the input search in groups. With one or two levels a box alone has fewer records to look at, above
    /// all where small ones lie much denser than the plan thinks.
    bool groupsNext() const
    {
        constexpr std::uint32_t kLevelsForGroups = 4;  // the last one is empty
        return m_options.rowSearch == PsapRowSearch::Grouped ||
               (m_options.rowSearch == PsapRowSearch::Automatic && m_input.count >= kBoxesForGroups &&
                m_planner.levelCount() >= kLevelsForGroups);
    }

    void setGrouped(bool isGrouped)
    {
        m_isGrouped = isGrouped;
        m_planner.planForGroups(isGrouped);
        m_binCapacity = 0;
    }

    void sortByCounting(Exec& exec)
    {
        const std::uint64_t count = m_input.count;
        exec.forEach(count, CountRows{rowBins(), m_places.data(), m_binCounts.data()});
        exec.scan(m_binCounts.data(), m_binStarts.data(), m_binCapacity + 1);
        exec.forEach(count, ScatterRows{m_input.boxes, m_planner.plan(), m_places.data(), m_binStarts.data(),
                                        m_binCapacity, m_records.data(), tidying()});
    }

    void sortByRadix(Exec& exec)
    {
        const std::uint64_t count = m_input.count;
        const std::uint32_t none = static_cast<std::uint32_t>(m_binCapacity);
        exec.forEach(count, FillRowKeys{rowBins(), none, m_keys[0].data(), m_rows[0].data()});
        int bits = 1;
        while (bits < 32 && none >> bits != 0)
            ++bits;
        exec.sortPairs(m_keys[0].data(), m_keys[1].data(), m_rows[0].data(), m_rows[1].data(), count, bits);
        exec.forEach(count, GatherRows{m_input.boxes, m_planner.plan(), m_keys[1].data(), m_rows[1].data(),
                                       count, none, m_records.data(), m_binCounts.data(), tidying()});
        exec.scanLargest(m_binCounts.data(), m_binStarts.data(), m_binCapacity + 1);
    }

    template <class IsNew>
    void emitTesting(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        if (m_isGrouped)
            exec.forEachGrouped(m_input.count,
                                SearchGroups<IsNew>{partners<TestPackedFirst>(isNew), rowOrder()}, pairs);
        else if (exec.hasSpareLanes() && m_input.count <= kBoxesWithSharers)
            emitSharing<TestInTurn, 4>(exec, isNew, pairs);
        else if (isRadix())
            emitSharing<TestAtOnce, 1>(exec, isNew, pairs);
        else
            emitSharing<TestInTurn, 1>(exec, isNew, pairs);
    }

    template <class Tests, std::uint32_t kSharers, class IsNew>
    void emitSharing(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.forEachTogether(kSharers * m_input.count,
                             SearchRows<IsNew, Tests, kSharers>{partners<Tests>(isNew), rowOrder()}, pairs);
    }

    template <class Tests, class IsNew>
    RowPartners<IsNew, Tests> partners(const IsNew& isNew) const
    {
        return {m_records.data(), m_planner.plan(), m_input.boxes, m_side.data(), isNew};
    }
    RowOrder rowOrder() const
    {
        return {m_binStarts.data(), m_binCapacity, m_totals.data(), m_input.count, m_binCounts.data()};
    }

    RowBins rowBins() const
    {
        return {m_input.boxes, m_planner.plan(), m_side.data(), &m_totals.data()->sidesFound};
    }
    RowTidying tidying() const { return {m_totals.data(), m_input.pairCount}; }

    void reserveForBoxes(Exec& exec, std::uint64_t count)
    {
        exec.reserve(m_side, count);
        if (m_records.size() <= count)
        {
            exec.reserve(m_records, count + 1);
            exec.clear(m_records.data(), m_records.size());  // one behind the last is read, whatever it says
        }
        if (!isRadix())
            exec.reserve(m_places, count);
        for (int side = 0; side < 2 && isRadix(); ++side)
        {
            exec.reserve(m_keys[side], count);
            exec.reserve(m_rows[side], count);
        }
        if (count > m_plannedCount + m_plannedCount / 4 || 2 * count < m_plannedCount)
            m_binCapacity = 0;
        if (m_binCapacity == 0)
        {
            m_binCapacity = binCapacityFor(count, m_isGrouped ? kBinsPerBoxOfGroup : kBinsPerBox);
            // A fourth pass for a few more bins does not pay.
            if (isRadix() && count < 5 * kMostBinsOfThreePasses / 4)
                m_binCapacity = std::min(m_binCapacity, kMostBinsOfThreePasses);
            m_plannedCount = count;
            m_planner.forget();
            m_isClear = false;
        }
        exec.reserve(m_binCounts, m_binCapacity + 1);
        exec.reserve(m_totals, 1);
        exec.reserve(m_binStarts, m_binCapacity + 1);
    }

    PsapOptions m_options;
    SearchInput m_input{};
    std::uint64_t m_binCapacity = 0;
    std::uint64_t m_plannedCount = 0;
    RowPlanner<Exec> m_planner;
    bool m_isGrouped = false;
    Buffer<RowPlace> m_places;
    Buffer<std::uint32_t> m_keys[2], m_rows[2];  ///< for the radix sort: as filled, and sorted
    Buffer<std::uint32_t> m_binCounts, m_binStarts;
    Buffer<RowRecord> m_records;
    Buffer<std::uint32_t> m_side;
    Buffer<RowTotals> m_totals;
    bool m_isClear = false;  ///< m_binCounts and sidesFound of m_totals
};

/// One of the searches, as the options and the number of boxes say.
template <class Exec>
class Search
{
public:
    explicit Search(const PsapOptions& options)
        : m_order(options.order),
          m_isLiteral(options.variant != PsapVariant::Rows),
          m_cells(options, resolve(options)),
          m_rows(options, axisOfRows(options)),
          m_bins(options, axisOfRows(options)),
          m_tiles(options, axisOfRows(options))
    {
    }

    /// To be called before each build() or repetition: what the executor has told since then counts from now on.
    void look() { m_tiles.look(); }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        m_way = nextWay(exec, input);
        if (m_way == Way::Tiles && !m_tiles.prepare(exec, input))
            m_way = Way::Rows;
        countUpdate();
        if (m_way == Way::Cells)
            m_cells.build(exec, input);
        else if (m_way == Way::Rows)
            m_rows.build(exec, input);
        else if (m_way == Way::Bins)
            m_bins.build(exec, input);
        else
            m_tiles.build(exec, input);
    }

    /// Again, where emit() found kSpilled pairs.
    void buildByCounting(Exec& exec)
    {
        // The next plan of tiles knows better, but not what this one of some frames ago did not.
        const bool isWaiting = m_way == Way::Tiles ? m_tiles.noteSpill() : true;
        m_updatesByCounting = m_order == PsapOrder::Automatic && isWaiting ? kUpdatesByCounting : 0;
        m_way = Way::Rows;
        m_rows.build(exec, m_input);
    }

    void emit(Exec& exec, const EntryTest& isNew, const PairList& pairs)
    {
        if (m_way == Way::Cells)
            m_cells.emit(exec, isNew, pairs);
        else if (m_way == Way::Rows)
            m_rows.emit(exec, isNew, pairs);
        else if (m_way == Way::Bins)
            m_bins.emit(exec, isNew, pairs);
        else
            m_tiles.emit(exec, isNew, pairs);
    }

    /// Whether the next build() of as many boxes makes the same launches as an earlier one of the same nextPhase(), without
    /// allocation or wait.
    bool isRepeatable(const Exec& exec, const SearchInput& input) const
    {
        const Way next = nextWay(exec, input);
        if (m_way == Way::Cells || !isSameWay(next) || (next == Way::Tiles && !m_tiles.isRepeatable(input)))
            return false;
        return m_way == Way::Tiles || (m_way == Way::Rows ? m_rows.isRepeatable() : m_bins.isRepeatable());
    }

    /// Counts a repetition that happened without build().
    void countRepeat()
    {
        countUpdate();
        if (m_way == Way::Rows)
        {
            m_rows.countRepeat();
            m_tiles.countUse();
        }
        else
            m_way == Way::Bins ? m_bins.countRepeat() : m_tiles.countRepeat();
    }

    static constexpr unsigned kPhases = 5;
    unsigned nextPhase() const
    {
        return m_way == Way::Rows ? 0 : m_way == Way::Bins ? 1 + m_bins.nextPhase() : 3 + m_tiles.nextPhase();
    }
    /// Changes where what a phase launches is not what it did before.
    std::uint32_t launches() const { return m_tiles.launches(); }

    const std::uint32_t* sideCount() const
    {
        return m_way == Way::Cells  ? m_cells.sideCount()
               : m_way == Way::Rows ? m_rows.sideCount()
               : m_way == Way::Bins ? m_bins.sideCount()
                                    : m_tiles.sideCount();
    }
    std::uint64_t entryCount() const { return m_way == Way::Cells ? m_cells.entryCount() : m_input.count; }
    std::uint64_t falsePairCount() const { return m_cells.falsePairCount(); }

private:
    enum class Way
    {
        Cells,
        Rows,
        Bins,
        Tiles  ///< or rows, where there is no plan, or none that is worth it
    };

    static constexpr std::uint64_t kMostBoxesInBins = 1u << 16;
    static constexpr std::uint64_t kMostWorkOfOneSize = 5u << 15;  // boxes and pairs
    static constexpr std::uint64_t kMostWork = 1u << 15;
    // After a bin or a tile was full: trying in vain costs half an update.
    static constexpr std::uint32_t kUpdatesByCounting = 256;

    Way nextWay(const Exec& exec, const SearchInput& input) const
    {
        if (m_isLiteral)
            return Way::Cells;
        if (isForTiles(exec, input) && TileSearch<Exec>::canHold(input.count))
            return Way::Tiles;
        const bool isChosen =
            m_order == PsapOrder::Bins || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                           isForBins(input) && m_updatesByCounting == 0);
        return isChosen && BinSearch<Exec>::canHold(input.count) ? Way::Bins : Way::Rows;
    }

    bool isSameWay(Way next) const { return m_way == next || (m_way == Way::Rows && next == Way::Tiles); }

    bool isForTiles(const Exec& exec, const SearchInput& input) const
    {
        return m_order == PsapOrder::Tiles || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                               input.count > kMostBoxesInBins && m_updatesByCounting == 0);
    }

    /// Whether the steps saved cost more than what bins of fixed room cost: cache for empty places, and more of them around
    /// a box, which is worst where there are many pairs or many sizes.
    bool isForBins(const SearchInput& input) const
    {
        const std::uint32_t levels = m_way == Way::Bins ? m_bins.levelCount() : m_rows.levelCount();
        const bool isOfOneSize = levels <= 2;  // the last one is empty
        return input.count <= kMostBoxesInBins &&
               input.count + input.expectedPairs <= (isOfOneSize ? kMostWorkOfOneSize : kMostWork);
    }

    void countUpdate()
    {
        if (m_way == Way::Rows && m_updatesByCounting != 0)
            --m_updatesByCounting;
    }

    static PsapAxis resolve(const PsapOptions& options)
    {
        constexpr PsapAxis kAxes[3] = {PsapAxis::X, PsapAxis::Y, PsapAxis::Z};
        return options.axis == PsapAxis::Random ? kAxes[(options.seed * 2654435761u >> 16) % 3]
                                                : options.axis;
    }

    static PsapAxis axisOfRows(const PsapOptions& options)
    {
        return resolve(options) == PsapAxis::Principal ? PsapAxis::Variance : resolve(options);
    }

    PsapOrder m_order;
    bool m_isLiteral;
    SearchInput m_input{};
    Way m_way = Way::Rows;
    std::uint32_t m_updatesByCounting = 0;  ///< before bins or tiles are tried again
    CellSearch<Exec> m_cells;
    RowSearch<Exec> m_rows;
    BinSearch<Exec> m_bins;
    TileSearch<Exec> m_tiles;
};
}  // namespace cullet::psap
