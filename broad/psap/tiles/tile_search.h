// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bin_double_buffer.h"
#include "cullet/broad/psap/tiles/tile_planner.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cullet::psap
{
/// What a tile is sorted in on the CPU.
struct TileMemory
{
    explicit TileMemory(const TileShape& shape)
        : starts(shape.cells + 2), boxes(shape.room), records(shape.room)
    {
    }

    std::vector<std::uint32_t> starts;
    std::vector<TileBox> boxes;
    std::vector<std::uint32_t> records;  ///< of the tile, in the order of the boxes
};

/// Step 2: finds the pairs that a tile reports, and partners of its boxes on the side list.
template <class IsNew>
struct SearchTiles
{
    using Memory = TileMemory;

    RowPartners<IsNew, TestAtOnce> partners;  ///< without a plan
    const TilePlan* plan;
    RowBinSet set;
    RowBinSet other;  ///< set to 0 for the next update
    TileShape shape;
    std::uint64_t* pairCount;  ///< kSpilled where a tile was full

    /// Does for a tile what is to be done once.
    CULLET_HOST_DEVICE void begin(std::uint32_t tile) const
    {
        other.counts[tile] = 0;
        if (tile != 0)
            return;
        *other.totals = {};
        if (set.totals->spilled != 0)
            *pairCount = kSpilled;
    }

    /// How much there is to be searched.
    struct Counts
    {
        std::uint32_t boxes;  ///< in the tile
        std::uint32_t sides;  ///< on the side list
    };
    CULLET_HOST_DEVICE Counts countsOf(std::uint32_t tile) const
    {
        const std::uint32_t boxes = set.counts[tile];  // on its way while the other is read
        const BinTotals totals = *set.totals;
        return totals.spilled == 0 ? Counts{boxes, totals.sides} : Counts{0, 0};
    }

    CULLET_HOST_DEVICE const RowRecord* recordsOf(std::uint32_t tile) const
    {
        return partners.records + std::uint64_t{tile} * shape.room;
    }

    /// Whether that tile reports the pair, given the records that it has of both.
    template <class Test>
    CULLET_HOST_DEVICE bool reports(const RowRecord& a, const RowRecord& b, const Test& entryTest) const
    {
        if (TileMark::begins(a.back.bin | b.back.bin) != kBeginsThere || !meets(a, b))
            return false;
        const float ways = TileMark::way(a.back.bin) + TileMark::way(b.back.bin);
        return entryTest(RowPair{a.back.row, b.back.row}, ways, [&] { return overlapOf(a, b); });
    }

    /// Tests a box against the side list, in the tile where it begins.
    template <class Emit>
    CULLET_HOST_DEVICE void searchSides(const RowRecord& record, std::uint32_t sides, Emit& emit) const
    {
        if (TileMark::begins(record.back.bin) == kBeginsThere)
            partners.searchSide(record.back.row, 0, sides, 1, emit);
    }

    /// Tests every `tiles`-th box of the side list against those behind it.
    template <class Emit>
    CULLET_HOST_DEVICE void searchAmongSides(std::uint32_t tile, std::uint32_t sides, Emit& emit) const
    {
        for (std::uint32_t k = tile; k < sides; k += shape.tiles)
            partners.searchSide(partners.side[k], k + 1, sides, 1, emit);
    }

    /// All of it, on the CPU.
    template <class Emit>
    void operator()(std::uint32_t tile, TileMemory& memory, Emit& emit) const
    {
        begin(tile);
        const Counts counts = countsOf(tile);
        const RowRecord* records = recordsOf(tile);
        const TileFrame frame(*plan, tile);
        sort(frame, records, counts.boxes, memory);
        const auto entryTest = partners.isNew.ready();
        for (std::uint32_t slot = 0; slot < counts.boxes; ++slot)
        {
            const RowRecord& self = records[memory.records[slot]];
            const TileBox box = memory.boxes[slot];
            const TileRanges ranges(frame, plan->reach, memory.starts.data(), box, slot, true);
            for (int r = 0; r < TileRanges::kCount; ++r)
                for (std::uint32_t k = ranges.begin[r]; k < ranges.end[r]; ++k)
                {
                    emit.tested(1);
                    const RowRecord& partner = records[memory.records[k]];
                    if (box.mayMeet(memory.boxes[k]) && reports(self, partner, entryTest))
                        emit.push({self.back.row, partner.back.row});
                }
            searchSides(self, counts.sides, emit);
        }
        searchAmongSides(tile, counts.sides, emit);
    }

private:
    /// By cell.
    void sort(const TileFrame& frame, const RowRecord* records, std::uint32_t count, TileMemory& memory) const
    {
        // Starts of the cells come out one place early, where the ends of those before were counted.
        std::uint32_t* ends = memory.starts.data() + 1;
        std::fill(memory.starts.begin(), memory.starts.end(), 0u);
        for (std::uint32_t i = 0; i < count; ++i)
            ++ends[frame.cellOf(frame.lowCorner(records[i])) + 1];
        for (std::uint32_t cell = 0; cell + 1 < shape.cells; ++cell)
            ends[cell + 1] += ends[cell];
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const std::uint32_t low = frame.lowCorner(records[i]);
            const std::uint32_t slot = ends[frame.cellOf(low)]++;
            memory.boxes[slot] = {low, frame.highCorner(records[i])};
            memory.records[slot] = i;
        }
    }
};

/// The fast search with tiles. Ends without pairs where a tile is full.
template <class Exec>
class TileSearch
{
public:
    TileSearch(const PsapOptions& options, PsapAxis axis) : m_planner(options, axis) {}

    /// Whether so many boxes can be searched.
    static bool canHold(std::uint64_t count) { return count != 0 && count <= TilePlanner<Exec>::kMostBoxes; }

    /// Sees to a plan for these boxes.
    ///
    /// @return whether there is one and build() may follow
    bool prepare(Exec& exec, const SearchInput& input)
    {
        m_planner.prepare(exec, input);
        if (m_planner.shape().tiles == 0 || !exec.canSearchTiles(m_planner.shape()))
            return false;
        if (m_launches != m_planner.launches())
            reserveForShape(exec);
        return true;
    }

    /// @pre prepare() has just told so
    void build(Exec& exec, const SearchInput& input)
    {
        m_input = input;
        m_tiles.begin(exec);
        exec.placeInTiles(PlaceInTiles{input.boxes, input.count, m_planner.plan(), m_planner.shape(),
                                       m_tiles.current(), m_side.data(), m_records.data(), input.pairCount,
                                       input.copies});
    }

    /// @param isNew EveryPair, or another test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        exec.searchTiles(SearchTiles<IsNew>{{m_records.data(), nullptr, m_input.boxes, m_side.data(), isNew},
                                            m_planner.plan(),
                                            m_tiles.current(),
                                            m_tiles.other(),
                                            m_planner.shape(),
                                            pairs.count},
                         pairs);
        m_tiles.noteSearched();
    }

    TilePlanner<Exec>& planner() { return m_planner; }
    /// Whether prepare() would say what it said, and the next build() make the same launches as the last but one.
    bool isRepeatable(const SearchInput& input) const { return m_planner.isSettled(input); }

    /// Counts a repetition that happened without prepare() and build().
    void countRepeat() { m_tiles.swap(); }

    /// A tile was full: there will be another plan.
    ///
    /// @return whether that one had been as good as new
    bool noteSpill() { return m_planner.giveUp(); }

    unsigned nextPhase() const { return m_tiles.nextPhase(); }
    /// Changes where launches of an earlier build() are not those of the next one.
    std::uint32_t launches() const { return m_planner.launches(); }

    const std::uint32_t* sideCount() const { return m_tiles.sideCount(); }
    std::uint64_t entryCount() const { return m_input.count; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserveForShape(Exec& exec)
    {
        const TileShape shape = m_planner.shape();
        exec.reserve(m_side, PlaceInTiles::kMostSides);
        m_tiles.reserve(exec, shape.tiles);
        m_tiles.forget();
        exec.reserve(m_records, std::uint64_t{shape.tiles} * shape.room);
        m_launches = m_planner.launches();
    }

    SearchInput m_input{};
    TilePlanner<Exec> m_planner;
    std::uint32_t m_launches = 0;  ///< that there is room for
    BinDoubleBuffer<Exec> m_tiles;
    Buffer<RowRecord> m_records;
    Buffer<std::uint32_t> m_side;
};
}  // namespace cullet::psap
