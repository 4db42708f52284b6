// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bin_double_buffer.h"
#include "cullet/broad/psap/tiles/tile_planner.h"
#include "cullet/broad/psap/tiles/tile_sort.h"

#include <cstdint>
#include <vector>

namespace cullet::psap
{
/// The block of one thread that sorts a tile on the CPU, and its memory.
class TileMemory
{
public:
    explicit TileMemory(const TileShape& shape)
        : m_starts(2 * SortedTile::twosFor(shape.cells)),
          m_boxes(shape.room),
          m_ids(shape.room),
          m_owned(shape.room)
    {
    }

    SortedTile tile() { return {m_starts.data(), m_boxes.data(), m_ids.data()}; }

    std::uint32_t threads() const { return 1; }
    std::uint32_t thread() const { return 0; }
    void sync() const {}
    std::uint32_t exclusiveSum(std::uint32_t) const { return 0; }
    template <class Body>
    void forEach(std::uint32_t count, const Body& body) const
    {
        for (std::uint32_t i = 0; i < count; ++i)
            body(i);
    }
    template <class Body>
    void forEachOwned(std::uint32_t count, const Body& body)
    {
        for (std::uint32_t i = 0; i < count; ++i)
            body(i, m_owned[i]);
    }

private:
    std::vector<std::uint16_t> m_starts;
    std::vector<TileBox> m_boxes;
    std::vector<std::uint16_t> m_ids;
    std::vector<std::uint32_t> m_owned;
};

/// Step 2: finds the pairs that a tile reports, and the unbounded partners of its boxes.
template <class IsNew>
struct SearchTiles
{
    using Memory = TileMemory;

    PartnerSearch<IsNew> partners;  ///< its plan is null
    const TilePlan* plan;
    BinSet set;
    BinSet other;  ///< cleared for the next update
    TileShape shape;
    std::uint64_t* pairCount;  ///< set to kOverflowed where a tile was full

    /// Does the work that a tile needs once.
    CULLET_HOST_DEVICE void begin(std::uint32_t tile) const
    {
        other.counts[tile] = 0;
        if (tile != 0)
            return;
        *other.totals = {};
        if (set.totals->overflowed != 0)
            *pairCount = kOverflowed;
    }

    /// Numbers of boxes to search.
    struct Counts
    {
        std::uint32_t boxes;           ///< in the tile
        std::uint32_t unboundedCount;  ///< unbounded boxes
    };
    CULLET_HOST_DEVICE Counts countsOf(std::uint32_t tile) const
    {
        const std::uint32_t boxes = set.counts[tile];  // loaded together with the totals
        const BinTotals totals = *set.totals;
        return totals.overflowed == 0 ? Counts{boxes, totals.unboundedCount} : Counts{0, 0};
    }

    CULLET_HOST_DEVICE const SortRecord* recordsOf(std::uint32_t tile) const
    {
        return partners.records + std::uint64_t{tile} * shape.room;
    }

    /// Whether this tile reports the pair, if it isHome() for it.
    ///
    /// @param a, b the records that the tile has of both boxes
    template <class Test>
    CULLET_HOST_DEVICE bool reports(const SortRecord& a, const SortRecord& b, const Test& entryTest) const
    {
        if (!meets(a, b))
            return false;
        const float distance = TileMark::distance(a.back.bin) + TileMark::distance(b.back.bin);
        return entryTest(RowPair{a.back.row, b.back.row}, distance, [&] { return overlapOf(a, b); });
    }

    /// Tests a box against the unbounded boxes, in the tile that contains its lower corner.
    template <class Emit>
    CULLET_HOST_DEVICE void testAgainstUnbounded(const SortRecord& record, std::uint32_t unboundedCount,
                                                 Emit& emit) const
    {
        if (TileMark::begins(record.back.bin) == kBeginsThere)
            partners.searchUnbounded(record.back.row, 0, unboundedCount, 1, emit);
    }

    /// Tests every `tiles`-th unbounded box against the unbounded boxes after it.
    template <class Emit>
    CULLET_HOST_DEVICE void searchAmongUnbounded(std::uint32_t tile, std::uint32_t unboundedCount,
                                                 Emit& emit) const
    {
        for (std::uint32_t k = tile; k < unboundedCount; k += shape.tiles)
            partners.searchUnbounded(partners.unbounded[k], k + 1, unboundedCount, 1, emit);
    }

    /// The whole step, on the CPU.
    template <class Emit>
    void operator()(std::uint32_t tile, TileMemory& memory, Emit& emit) const
    {
        begin(tile);
        const Counts counts = countsOf(tile);
        const SortRecord* records = recordsOf(tile);
        const TileFrame frame(*plan, tile);
        const SortedTile sorted = memory.tile();
        sortTile(memory, frame, records, counts.boxes, shape.cells, sorted);
        const auto entryTest = partners.isNew.preloaded();
        for (std::uint32_t slot = 0; slot < counts.boxes; ++slot)
        {
            const SortRecord& self = records[SortedTile::recordOf(sorted.ids[slot])];
            const TileBox box = sorted.boxes[slot];
            const TileRanges ranges(frame, plan->reach, sorted.starts, box, slot, true);
            for (int r = 0; r < TileRanges::kCount; ++r)
                for (std::uint32_t k = ranges.begin[r]; k < ranges.end[r]; ++k)
                {
                    emit.tested(1);
                    const SortRecord& partner = records[SortedTile::recordOf(sorted.ids[k])];
                    if (box.mayMeet(sorted.boxes[k]) && SortedTile::isHome(sorted.ids[slot], sorted.ids[k]) &&
                        reports(self, partner, entryTest))
                        emit.push({self.back.row, partner.back.row});
                }
            testAgainstUnbounded(self, counts.unboundedCount, emit);
        }
        searchAmongUnbounded(tile, counts.unboundedCount, emit);
    }
};

/// The search with tiles. Finds no pairs where a tile is full.
template <class Exec>
class TileSearch
{
public:
    TileSearch(const PsapOptions& options, PsapAxis axis) : m_planner(options, axis) {}

    /// Whether so many boxes can be searched.
    static bool canHold(std::uint64_t count) { return count != 0 && count <= TilePlanner<Exec>::kMostBoxes; }

    /// Makes or adopts a plan for these boxes, where necessary.
    ///
    /// @return whether there is one, so that build() may follow
    bool prepare(Exec& exec, const SearchInput& input)
    {
        m_planner.prepare(exec, input);
        if (m_planner.shape().tiles == 0 || !exec.canSearchTiles(m_planner.shape()))
            return false;
        if (m_launches != m_planner.launches())
            reserveForShape(exec);
        return true;
    }

    /// @pre prepare() has returned true
    void build(Exec& exec, const SearchInput& input)
    {
        m_input = input;
        m_tiles.begin(exec);
        exec.placeInTiles(PlaceInTiles{input.boxes, input.count, m_planner.plan(), m_planner.shape(),
                                       m_tiles.current(), m_unbounded.data(), m_records.data(),
                                       input.pairCount, input.copies});
    }

    /// @param isNew EveryPair, or another entry test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.searchTiles(
            SearchTiles<IsNew>{{m_records.data(), nullptr, m_input.boxes, m_unbounded.data(), isNew},
                               m_planner.plan(),
                               m_tiles.current(),
                               m_tiles.other(),
                               m_planner.shape(),
                               pairs.count},
            pairs);
        m_tiles.markOtherClear();
    }

    TilePlanner<Exec>& planner() { return m_planner; }
    /// Whether prepare() would return the same result, and the next build() make the same launches as the last but
    /// one.
    bool isRepeatable(const SearchInput& input) const { return m_planner.isPlanCurrent(input); }

    /// Counts an update that repeated recorded launches instead of calling prepare() and build().
    void countRepeat() { m_tiles.swap(); }

    /// Discards the plan after a tile was full.
    ///
    /// @return whether the plan was nearly new
    bool recordOverflow() { return m_planner.giveUp(); }

    unsigned nextPhase() const { return m_tiles.nextPhase(); }
    /// Changes when the launches of build() change.
    std::uint32_t launches() const { return m_planner.launches(); }

    const std::uint32_t* unboundedCount() const { return m_tiles.unboundedCount(); }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserveForShape(Exec& exec)
    {
        const TileShape shape = m_planner.shape();
        exec.reserve(m_unbounded, PlaceInTiles::kMostUnbounded);
        m_tiles.reserve(exec, shape.tiles);
        m_tiles.forget();
        exec.reserve(m_records, std::uint64_t{shape.tiles} * shape.room);
        m_launches = m_planner.launches();
    }

    SearchInput m_input{};
    TilePlanner<Exec> m_planner;
    std::uint32_t m_launches = 0;  ///< version of the launches for which memory is reserved
    BinDoubleBuffer<Exec> m_tiles;
    Buffer<SortRecord> m_records;
    Buffer<std::uint32_t> m_unbounded;
};
}  // namespace cullet::psap
