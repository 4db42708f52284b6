// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <limits>

namespace cullet
{
/// Entries that may be read behind the last column of a pool: a full vector of the widest kernel.
inline constexpr std::uint32_t kColumnPadding = 16;

/// Index in the ProxyTable with two flags in the highest bits: the box begins in this cell along the first / second
/// tiled axis. A ProxyTable has fewer than 2^30 rows.
using TaggedRow = std::uint32_t;
inline constexpr std::uint32_t kRowBits = 30;
inline constexpr std::uint32_t kRowMask = (1u << kRowBits) - 1;
inline constexpr TaggedRow kStartsHereY = 1u << kRowBits;
inline constexpr TaggedRow kStartsHereZ = 1u << (kRowBits + 1);
inline constexpr TaggedRow kOwnsPair = kStartsHereY | kStartsHereZ;

inline TaggedRow tagRow(std::uint32_t proxyRow, bool startsY, bool startsZ)
{
    return proxyRow | (startsY ? kStartsHereY : 0u) | (startsZ ? kStartsHereZ : 0u);
}

/// The boxes of one column (a cell of the two tiled axes), sorted by `x0`, as structure of arrays.
///
/// x is the sweep axis, y and z the tiled ones, whatever world axes these are. One sentinel with x0 = +infinity
/// follows the entries, so that scans need no end test. At least kColumnPadding entries behind it are readable; they
/// may belong to another column.
struct ColumnSoa
{
    float* x0;
    float* x1;
    float* y0;
    float* y1;
    float* z0;
    float* z1;
    TaggedRow* proxyRow;
    std::uint32_t count;
    float* bounds = nullptr;  ///< see PairBuffer::maxGap; null: none
};

/// Value of PairBuffer::minGap that excludes no pair: no comparison with NaN holds.
inline constexpr float kNoMinGap = std::numeric_limits<float>::quiet_NaN();

/// The pairs that a kernel finds: a buffer of fixed size, which is flushed before it can overflow.
///
/// The gap of two boxes is the largest of the six differences of their faces, each rounded once: boxes overlap when
/// it is not positive, and overlapsWithMargin() compares it with twice the margin.
struct alignas(64) PairBuffer
{
    static constexpr std::uint32_t kCapacity = 1024;
    TaggedRow first[kCapacity];
    TaggedRow second[kCapacity];
    float gap[kCapacity];
    std::uint32_t count = 0;
    // A column without bounds reports the pairs whose gap is above `minGap` and not above `maxGap`. A column with
    // bounds reports those whose absolute gap is at most the sum of both bounds; no bound is above maxGap / 2.
    float maxGap = 0;
    float minGap = kNoMinGap;
    std::uint64_t tests = 0;   ///< box tests made, whole vectors
    std::uint64_t visits = 0;  ///< columns that were searched for single boxes
    void (*flush)(void* context, const PairBuffer& found) = nullptr;
    void* context = nullptr;

    RowPair pair(std::uint32_t index) const { return {first[index] & kRowMask, second[index] & kRowMask}; }

    void deliver()
    {
        if (count != 0)
            flush(context, *this);
        count = 0;
    }

    /// Makes room for one vector of hits.
    void ensureRoom()
    {
        if (count + kColumnPadding > kCapacity)
            deliver();
    }
};

/// One box of a column while the column is gathered and sorted; tiled axes first.
struct ColumnEntry
{
    float tile[4];  ///< min, max of the first tiled axis, then of the second
    float x0, x1;
    TaggedRow proxyRow;
    std::uint32_t slot;  ///< bucket of the sort
};

/// Sort key: where a box begins, and the index of its ColumnEntry.
struct SortKey
{
    float x0;
    std::uint32_t index;
};

/// Scratch memory of buildColumn().
struct ColumnScratch
{
    ColumnEntry* entries;  ///< [2 * count + 4]
    SortKey* keys;         ///< [2 * count + 4]
};

/// The cell of a column as bounds of the tiled faces {min, max, min, max} of boxes.
struct CellEdges
{
    float low
        [4];  ///< a box touches the cell when its maxima are not below this; it begins there when its minima are not
    float high[4];  ///< a box touches the cell when its minima are below this
};

/// Input of buildColumn().
struct ColumnSource
{
    const TaggedRow*
        proxyRows;  ///< [count] the first sortedCount nearly sorted by x0, the others in any order
    std::uint32_t count;
    std::uint32_t sortedCount;
    const Aabb* boxes;
    int sweepAxis;
    float sweepLow, sweepHigh;  ///< most boxes begin between them; a wrong guess costs time only
    float grow;                 ///< enlarges the boxes on every side
    /// Null: the flags in `proxyRows` are valid. Else they are computed for this cell, and boxes outside it dropped.
    const CellEdges* edges;
};

/// The cells that a box touches, first and last along both tiled axes.
struct CellRect
{
    std::int32_t j0, j1, k0, k1;

    bool contains(std::int32_t j, std::int32_t k) const { return j >= j0 && j <= j1 && k >= k0 && k <= k1; }
};

/// A box to be inserted, with the cells that it touches.
struct LocatedBox
{
    CellRect cells;
    std::uint32_t proxyRow;
    std::int32_t level;
};

/// Input of locateBoxes().
struct LocateSource
{
    const Aabb* boxes;               ///< [rows of the ProxyTable]
    const std::uint32_t* proxyRows;  ///< rows, or null: 0, 1, ...
    int sweepAxis;
    float grow;                    ///< enlarges the boxes on every side
    float cellSkin, inverseWidth;  ///< CellBounds of the cells
    // Outliers are boxes that are empty, longer than largestExtent, or touch more than manyCells cells along an axis.
    float largestExtent;
    std::int32_t manyCells;

    std::uint32_t proxyRow(std::uint32_t index) const
    {
        return proxyRows != nullptr ? proxyRows[index] : index;
    }
};

struct LocatedCounts
{
    std::uint32_t plain;
    std::uint32_t outliers;
};

/// Input of compareBoxes().
struct MotionSource
{
    const Aabb* boxes;   ///< [rows of the ProxyTable]
    const Aabb* before;  ///< [rows of the ProxyTable] boxes of the last scan
    int sweepAxis;
    float cellSkin, inverseWidth;  ///< CellBounds of the cells
    float limit;                   ///< a box that moved farther counts as migrated
    float* motions;                ///< [out, rows] largest motion of a face of each box; or null
};

/// Motions of some boxes.
struct MotionSums
{
    std::uint32_t* octaves;  ///< [256] boxes by the exponent of their motion; each call adds to it
    std::uint32_t*
        migrated;  ///< [as many as boxes] touch other cells than before, or moved farther than the limit
    std::uint32_t migratedCount = 0;  ///< of the last call
    float largest = 0;                ///< motion within the limit, of all calls
};

/// Input of findBoxesOutsideSkin().
struct SkinSource
{
    const Aabb* boxes;      ///< [rows of the ProxyTable]
    const Aabb* reference;  ///< [rows of the ProxyTable] centre of each skin
    float skin;             ///< thickness of the skins
};

/// Input of findChangedPairs().
struct PairStateSource
{
    const Aabb* boxes;           ///< [rows of the ProxyTable]
    const RowPair* pairs;        ///< [count]
    const std::uint8_t* states;  ///< [count] state of each pair
    std::uint32_t count;
    /// [state] a pair in this state changes when its gap is above the limit; in state `candidate`, when it is not.
    float limits[4];
    std::uint8_t candidate;  ///< state whose pairs change when their boxes overlap
};

/// The inner loops, one set per instruction set; every set finds the same pairs.
///
/// Duplicates over cells are dropped by the owner rule: the cell that holds (max of the y minima, max of the z
/// minima) reports the pair. Inside a cell that is true exactly when, on both axes, one of the two begins in it.
struct ColumnKernels
{
    const char* name;

    /// Finds the pairs inside one column. Forward sweep: tests each entry against those behind it that begin at most
    /// `maxGap` beyond its end.
    void (*scanSelf)(const ColumnSoa& column, PairBuffer& out);

    /// Finds the pairs between two columns of the same cell.
    void (*scanCross)(const ColumnSoa& a, const ColumnSoa& b, PairBuffer& out);

    /// Finds the entries of `column` from `begin` on that pair with entry `index` of `query`; ends at the first entry
    /// that begins beyond it.
    void (*scanOne)(const ColumnSoa& query, std::uint32_t index, const ColumnSoa& column, std::uint32_t begin,
                    PairBuffer& out);

    /// Loads the boxes of a column, sorts them by x0 and lays them out for the scans. The sort is fast when they are
    /// nearly in order.
    ///
    /// @param column [in, out] memory for count + 4 boxes and for whole vectors of four `proxyRows`; receives the boxes
    void (*buildColumn)(const ColumnSource& source, const ColumnScratch& scratch, ColumnSoa& column);

    /// Finds the cells of the boxes [begin, end) of the source in a grid of one level.
    ///
    /// @param block [out, end - begin] boxes that are no outliers
    /// @param outliers   [out, end - begin] indices of the others
    LocatedCounts (*locateBoxes)(const LocateSource& source, std::uint32_t begin, std::uint32_t end,
                                 LocatedBox* block, std::uint32_t* outliers);

    /// Measures how the boxes of some rows of the ProxyTable moved, and lists those that migrated.
    void (*compareBoxes)(const MotionSource& source, const std::uint32_t* rows, std::uint32_t count,
                         MotionSums& sums);

    /// Finds the rows of [begin, end) whose boxes are not inside their skins: isInsideSkin().
    ///
    /// @param outside [out, end - begin] ascending
    /// @return how many
    std::uint32_t (*findBoxesOutsideSkin)(const SkinSource& source, std::uint32_t begin, std::uint32_t end,
                                          std::uint32_t* outside);

    /// Finds the pairs of [begin, end) whose boxes contradict their state. A few of the pairs found may not change.
    ///
    /// @param changed [out, end - begin] indices, ascending
    /// @return how many
    std::uint32_t (*findChangedPairs)(const PairStateSource& source, std::uint32_t begin, std::uint32_t end,
                                      std::uint32_t* changed);
};

extern const ColumnKernels kColumnKernelsBaseline;
#if defined(__x86_64__)
extern const ColumnKernels kColumnKernelsAvx2;
extern const ColumnKernels kColumnKernelsAvx512;
#endif

/// Returns the widest set that this processor runs, or the baseline set if `baseline`.
const ColumnKernels& chooseColumnKernels(bool baseline);
}  // namespace cullet
