// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bins.h"

#include <cstdint>

/// The search with tiles: space is cut into blocks with room for some thousand boxes each, and a box is written into
/// every tile that it intersects. A block of a GPU's threads sorts a tile in shared memory and searches it there, so
/// that what the search reads many times is read from global memory once. Two steps, as with fixed bins, and worlds
/// of any size. For boxes of similar size: much larger ones would lie in too many tiles.
///
/// Of the tiles that contain both boxes of a pair, the one with the lower corner of their intersection reports it.
/// Any plan gives the same pairs: coordinates are clamped, and monotone before that.
namespace cullet::psap
{
/// The parameters of the launches of a search with tiles.
struct TileShape
{
    std::uint32_t tiles;  ///< 0: no tiles for these boxes
    std::uint32_t room;   ///< most boxes in a tile
    std::uint32_t cells;  ///< in a tile

    static constexpr std::uint32_t kMostTiles = 8192;
    static constexpr std::uint32_t kMostRoom = 3072;
};

/// Each axis is divided into steps; tiles begin and end at steps.
struct TileSteps
{
    static constexpr std::uint32_t kPerAxis = 1024;

    float origin[3];
    float inverse[3];         ///< steps per length
    std::uint32_t counts[3];  ///< tiles along an axis

    /// Monotone in x.
    CULLET_HOST_DEVICE std::uint32_t stepOf(std::uint32_t axis, float x) const
    {
        constexpr float kLast = kPerAxis - 1;
        const float step = (x - origin[axis]) * inverse[axis];
        return static_cast<std::uint32_t>(step > 0 ? (step < kLast ? step : kLast) : 0.0f);
    }
};

/// Tiles, and the cells in them. Axes in the order sweep axis, u, v.
struct alignas(16) TilePlan
{
    static constexpr std::uint32_t kMostPerAxis = 128;  ///< tiles
    /// Corners inside a tile are integers, in units called quanta, rounded down. log2 of the quanta per cell.
    static constexpr std::uint32_t kCellShift = 5;
    /// Upper bound of the longest edge, in quanta: less than a cell.
    static constexpr float kMostQuanta = 30.9f;

    Axes axes;
    float limit;  ///< longest edge of a box
    TileShape shape;
    TileSteps steps;
    std::uint32_t cells[3];      ///< cells in a tile
    std::uint32_t reach[3];      ///< most quanta along an edge of a box
    float scale[3];              ///< quanta per length
    std::uint32_t fullestBits;   ///< boxes in the fullest tile of the sample, for atomicMaxFloat()
    std::uint32_t entries;       ///< records of the sample, counted in each of their tiles
    float low[3][kMostPerAxis];  ///< where tiles begin
    std::uint8_t ofStep[3][TileSteps::kPerAxis];
};

/// The tiles that a box intersects, as a range along each axis.
struct TileRange
{
    std::uint32_t first[3], last[3];

    CULLET_HOST_DEVICE bool isOne() const
    {
        return first[0] == last[0] && first[1] == last[1] && first[2] == last[2];
    }

    /// The tile with the lower corner.
    CULLET_HOST_DEVICE std::uint32_t home(const TileSteps& steps) const
    {
        return (first[2] * steps.counts[1] + first[1]) * steps.counts[0] + first[0];
    }

    /// Calls visit(tile, begins) for each of them; bit a of `begins`: the lower end of the box along axis a lies in
    /// that tile.
    template <class Visit>
    CULLET_HOST_DEVICE void forEach(const TileSteps& steps, const Visit& visit) const
    {
        for (std::uint32_t v = first[2]; v <= last[2]; ++v)
            for (std::uint32_t u = first[1]; u <= last[1]; ++u)
                for (std::uint32_t s = first[0]; s <= last[0]; ++s)
                    visit((v * steps.counts[1] + u) * steps.counts[0] + s,
                          (s == first[0] ? 1u : 0u) | (u == first[1] ? 2u : 0u) | (v == first[2] ? 4u : 0u));
    }
};

/// `begins` for the tile with a box's lower corner.
inline constexpr std::uint32_t kBeginsThere = 7;

/// `bin` of a record in a tile. The low bits store along which axes the box begins in the tile, the other bits how
/// far it has moved since the last update, as a float rounded up.
struct TileMark
{
    CULLET_HOST_DEVICE static std::uint32_t of(float distance)
    {
        return (bitsOf(distance) + kBeginsThere) & ~kBeginsThere;
    }
    CULLET_HOST_DEVICE static float distance(std::uint32_t mark) { return floatOf(mark & ~kBeginsThere); }
    CULLET_HOST_DEVICE static std::uint32_t begins(std::uint32_t mark) { return mark & kBeginsThere; }
    CULLET_HOST_DEVICE static std::uint32_t with(std::uint32_t mark, std::uint32_t begins)
    {
        return (mark & ~kBeginsThere) | begins;
    }
};

/// @param ofStep TilePlan::ofStep, or a copy of it
CULLET_HOST_DEVICE inline TileRange tilesOf(const TileSteps& steps, const std::uint8_t* ofStep,
                                            const SortRecord& box)
{
    const auto tile = [&](std::uint32_t axis, float x) -> std::uint32_t
    { return ofStep[axis * TileSteps::kPerAxis + steps.stepOf(axis, x)]; };
    return {{tile(0, box.front.s0), tile(1, box.front.u0), tile(2, box.back.v0)},
            {tile(0, box.front.s1), tile(1, box.front.u1), tile(2, box.back.v1)}};
}

/// Step 1: writes boxes into their tiles. One index for each box; a GPU processes some thousand of them together.
struct PlaceInTiles
{
    /// Most boxes that are too large for tiles; they are treated as unbounded ones.
    static constexpr std::uint32_t kMostUnbounded = 32;

    const Aabb* boxes;
    std::uint64_t count;
    const TilePlan* plan;
    TileShape shape;
    BinSet set;                ///< its bins are tiles
    std::uint32_t* unbounded;  ///< [kMostUnbounded, out]
    SortRecord* records;       ///< [tiles * room, out]; `bin` is a TileMark
    std::uint64_t* pairCount;  ///< set to 0, or null
    BoxCopies copies;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        begin(i);
        const Aabb box = loadBox(boxes, i);
        const std::uint32_t mark = keepCopy(i, box);
        if (!accepts(i, box))
            return;
        SortRecord record = recordOf(box, plan->axes, static_cast<std::uint32_t>(i), mark);
        tilesOf(plan->steps, plan->ofStep[0], record)
            .forEach(plan->steps,
                     [&](std::uint32_t tile, std::uint32_t begins)
                     {
                         const std::uint32_t place = reserve(tile, 1);
                         record.back.bin = TileMark::with(mark, begins);
                         if (place != kNoPlace)
                             records[place] = record;
                     });
    }

    CULLET_HOST_DEVICE void begin(std::uint64_t i) const
    {
        if (i == 0 && pairCount != nullptr)
            *pairCount = 0;
    }

    /// @return the TileMark for the tile in which the box begins
    CULLET_HOST_DEVICE std::uint32_t keepCopy(std::uint64_t i, const Aabb& box) const
    {
        const float distance = copies.now != nullptr && i < count ? copies.keep(i, box) : kInfinity;
        return TileMark::with(TileMark::of(distance), kBeginsThere);
    }

    /// Whether the box belongs into tiles. Larger boxes are appended to the list of unbounded boxes, invalid ones to
    /// none.
    CULLET_HOST_DEVICE bool accepts(std::uint64_t i, const Aabb& box) const
    {
        if (!isValid(box))
            return false;
        if (boundedExtent(box) <= plan->limit)
            return true;
        const std::uint32_t place = fetchAdd(&set.totals->unboundedCount, 1u);
        if (place < kMostUnbounded)
            unbounded[place] = static_cast<std::uint32_t>(i);
        else
            countOverflow();
        return false;
    }

    /// @return first of so many places for records of a tile, or kNoPlace
    CULLET_HOST_DEVICE std::uint32_t reserve(std::uint32_t tile, std::uint32_t wanted) const
    {
        const std::uint32_t rank = fetchAdd(&set.counts[tile], wanted);
        if (rank + wanted <= shape.room)
            return tile * shape.room + rank;
        countOverflow();
        return kNoPlace;
    }

    CULLET_HOST_DEVICE void countOverflow() const { fetchAdd(&set.totals->overflowed, 1u); }
};

/// A box in quanta of its tile: 10 + 10 + 9 bits for each corner, with a zero guard bit above each number.
struct alignas(8) TileBox
{
    std::uint32_t low, high;

    static constexpr std::uint32_t kBitsS = 10, kBitsU = 10, kBitsV = 9;
    static constexpr std::uint32_t kShiftU = kBitsS + 1, kShiftV = kShiftU + kBitsU + 1;
    static constexpr std::uint32_t kGuards =
        1u << kBitsS | 1u << (kShiftU + kBitsU) | 1u << (kShiftV + kBitsV);

    CULLET_HOST_DEVICE static std::uint32_t packed(std::uint32_t s, std::uint32_t u, std::uint32_t v)
    {
        return s | u << kShiftU | v << kShiftV;
    }
    CULLET_HOST_DEVICE static std::uint32_t s(std::uint32_t corner) { return corner & ((1u << kBitsS) - 1); }
    CULLET_HOST_DEVICE static std::uint32_t u(std::uint32_t corner)
    {
        return corner >> kShiftU & ((1u << kBitsU) - 1);
    }
    CULLET_HOST_DEVICE static std::uint32_t v(std::uint32_t corner) { return corner >> kShiftV; }

    /// Whether the boxes may overlap: subtracting a number that is not larger leaves the guard bit above it set.
    CULLET_HOST_DEVICE bool mayMeet(const TileBox& other) const
    {
        return (((high | kGuards) - other.low) & ((other.high | kGuards) - low) & kGuards) == kGuards;
    }
};

/// The local coordinates of a tile.
struct TileFrame
{
    float low[3], scale[3], most[3];
    std::uint32_t cells[2];  ///< number along s and u

    CULLET_HOST_DEVICE TileFrame(const TilePlan& plan, std::uint32_t tile)
    {
        const std::uint32_t rows = tile / plan.steps.counts[0];
        low[0] = plan.low[0][tile % plan.steps.counts[0]];
        low[1] = plan.low[1][rows % plan.steps.counts[1]];
        low[2] = plan.low[2][rows / plan.steps.counts[1]];
        for (int axis = 0; axis < 3; ++axis)
        {
            scale[axis] = plan.scale[axis];
            most[axis] = static_cast<float>((plan.cells[axis] << TilePlan::kCellShift) - 1);
        }
        cells[0] = plan.cells[0];
        cells[1] = plan.cells[1];
    }

    CULLET_HOST_DEVICE std::uint32_t lowCorner(const SortRecord& box) const
    {
        return TileBox::packed(quanta(0, box.front.s0), quanta(1, box.front.u0), quanta(2, box.back.v0));
    }
    CULLET_HOST_DEVICE std::uint32_t highCorner(const SortRecord& box) const
    {
        return TileBox::packed(quanta(0, box.front.s1), quanta(1, box.front.u1), quanta(2, box.back.v1));
    }
    CULLET_HOST_DEVICE std::uint32_t cellOf(std::uint32_t corner) const
    {
        constexpr std::uint32_t kShift = TilePlan::kCellShift;
        const std::uint32_t row = (TileBox::v(corner) >> kShift) * cells[1] + (TileBox::u(corner) >> kShift);
        return row * cells[0] + (TileBox::s(corner) >> kShift);
    }

private:
    /// Monotone, whatever the rounding does.
    CULLET_HOST_DEVICE std::uint32_t quanta(int axis, float x) const
    {
        const float quanta = (x - low[axis]) * scale[axis];
        return static_cast<std::uint32_t>(quanta > 0 ? (quanta < most[axis] ? quanta : most[axis]) : 0.0f);
    }
};

/// Ranges of the sorted boxes of a tile that contain the partners of a box: the later boxes in its line of cells, the
/// next line in the same layer, and up to three lines in the next layer. A box is smaller than a cell, so that there
/// are no other partners.
struct TileRanges
{
    static constexpr int kCount = 5;

    std::uint32_t begin[kCount], end[kCount];

    /// @param starts [cells + 1] first box of each cell
    /// @param slot   index of the box among the sorted ones
    CULLET_HOST_DEVICE TileRanges(const TileFrame& frame, const std::uint32_t (&reach)[3],
                                  const std::uint16_t* starts, const TileBox& box, std::uint32_t slot,
                                  bool isBox)
    {
        constexpr std::uint32_t kShift = TilePlan::kCellShift;
        const std::uint32_t s0 = before(TileBox::s(box.low), reach[0]) >> kShift;
        const std::uint32_t s1 = (TileBox::s(box.high) >> kShift) + 1;
        const std::uint32_t u = TileBox::u(box.low) >> kShift;
        const std::uint32_t v = TileBox::v(box.low) >> kShift;
        const bool hasRight = isBox && TileBox::u(box.high) >> kShift > u;
        const bool hasNext = isBox && TileBox::v(box.high) >> kShift > v;
        const bool hasLeft = hasNext && before(TileBox::u(box.low), reach[1]) >> kShift < u;
        const std::uint32_t row = (v * frame.cells[1] + u) * frame.cells[0];
        const std::uint32_t right = row + frame.cells[0];
        const std::uint32_t next = row + frame.cells[1] * frame.cells[0];
        begin[0] = slot + 1;
        end[0] = isBox ? starts[row + s1] : 0;
        setRange(1, hasRight, starts, right + s0, right + s1);
        setRange(2, hasLeft, starts, next - frame.cells[0] + s0, next - frame.cells[0] + s1);
        setRange(3, hasNext, starts, next + s0, next + s1);
        setRange(4, hasNext && hasRight, starts, next + frame.cells[0] + s0, next + frame.cells[0] + s1);
    }

private:
    CULLET_HOST_DEVICE static std::uint32_t before(std::uint32_t quanta, std::uint32_t reach)
    {
        return quanta > reach ? quanta - reach : 0;
    }

    CULLET_HOST_DEVICE void setRange(int range, bool isThere, const std::uint16_t* starts,
                                     std::uint32_t first, std::uint32_t last)
    {
        begin[range] = isThere ? starts[first] : 0;
        end[range] = isThere ? starts[last] : 0;
    }
};
}  // namespace cullet::psap
