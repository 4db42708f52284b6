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
inline constexpr std::uint32_t kRowPadding = 16;

/// Index in the ProxyTable with two flags in the highest bits: the box begins in this cell along the first / second
/// tiled axis. A ProxyTable has fewer than 2^30 rows.
using FlaggedId = std::uint32_t;
inline constexpr std::uint32_t kIdBits = 30;
inline constexpr std::uint32_t kIdMask = (1u << kIdBits) - 1;
inline constexpr FlaggedId kStartsHereY = 1u << kIdBits;
inline constexpr FlaggedId kStartsHereZ = 1u << (kIdBits + 1);
inline constexpr FlaggedId kOwnsPair = kStartsHereY | kStartsHereZ;

inline FlaggedId flagged(std::uint32_t id, bool startsY, bool startsZ)
{
    return id | (startsY ? kStartsHereY : 0u) | (startsZ ? kStartsHereZ : 0u);
}

/// The boxes of one column (a cell of the two tiled axes), sorted by `x0`, as structure of arrays.
///
/// x is the sweep axis, y and z the tiled ones, whatever world axes these are. One sentinel with x0 = +infinity
/// follows the entries, so that scans need no end test. At least kRowPadding entries behind it are readable; they
/// may belong to another column.
struct ColumnSoa
{
    float* x0;
    float* x1;
    float* y0;
    float* y1;
    float* z0;
    float* z1;
    FlaggedId* id;
    std::uint32_t count;
    float* bounds = nullptr;  ///< see PairBuffer::near; null: none
};

/// Value of PairBuffer::deep that excludes no pair: no comparison with NaN holds.
inline constexpr float kReportAll = std::numeric_limits<float>::quiet_NaN();

/// The pairs that a kernel finds: a buffer of fixed size, which is flushed before it can overflow.
///
/// The gap of two boxes is the largest of the six differences of their faces, each rounded once: boxes overlap when
/// it is not positive, and overlapsWithMargin() compares it with twice the margin.
struct alignas(64) PairBuffer
{
    static constexpr std::uint32_t kCapacity = 1024;
    FlaggedId first[kCapacity];
    FlaggedId second[kCapacity];
    float gap[kCapacity];
    std::uint32_t count = 0;
    // A column without bounds reports the pairs whose gap is above `deep` and not above `near`. A column with
    // bounds reports those whose absolute gap is at most the sum of both bounds; no bound is above near / 2.
    float near = 0;
    float deep = kReportAll;
    std::uint64_t tests = 0;   ///< box tests made, whole vectors
    std::uint64_t visits = 0;  ///< columns that were searched for single boxes
    void (*flush)(void* context, const PairBuffer& found) = nullptr;
    void* context = nullptr;

    RowPair pair(std::uint32_t index) const { return {first[index] & kIdMask, second[index] & kIdMask}; }

    void handOn()
    {
        if (count != 0)
            flush(context, *this);
        count = 0;
    }

    /// Makes room for one vector of hits.
    void ensureRoom()
    {
        if (count + kRowPadding > kCapacity)
            handOn();
    }
};

/// One box of a column while the column is gathered and sorted; tiled axes first.
struct RowRecord
{
    float tile[4];  ///< min, max of the first tiled axis, then of the second
    float x0, x1;
    FlaggedId id;
    std::uint32_t place;  ///< bucket of the sort
};

/// Sort key: where a box begins, and the index of its RowRecord.
struct RowKey
{
    float x0;
    std::uint32_t index;
};

/// Scratch memory of buildRow().
struct RowScratch
{
    RowRecord* records;  ///< [2 * count + 4]
    RowKey* keys;        ///< [2 * count + 4]
};

/// The cell of a column as bounds of the tiled faces {min, max, min, max} of boxes.
struct CellEdges
{
    float low
        [4];  ///< a box touches the cell when its maxima are not below this; it begins there when its minima are not
    float high[4];  ///< a box touches the cell when its minima are below this
};

/// Input of buildRow().
struct RowSource
{
    const FlaggedId* ids;  ///< [count] the first sortedCount nearly sorted by x0, the others in any order
    std::uint32_t count;
    std::uint32_t sortedCount;
    const Aabb* boxes;
    int sweepAxis;
    float sweepLow, sweepHigh;  ///< most boxes begin between them; a wrong guess costs time only
    float grow;                 ///< enlarges the boxes on every side
    /// Null: the flags in `ids` are valid. Else they are computed for this cell, and boxes outside it dropped.
    const CellEdges* edges;
};

/// The cells that a box touches, first and last along both tiled axes.
struct TileRange
{
    std::int32_t j0, j1, k0, k1;

    bool contains(std::int32_t j, std::int32_t k) const { return j >= j0 && j <= j1 && k >= k0 && k <= k1; }
};

/// A box to be inserted, with the cells that it touches.
struct Located
{
    TileRange cells;
    std::uint32_t id;
    std::int32_t level;
};

/// Input of locateBoxes().
struct LocateSource
{
    const Aabb* boxes;         ///< [rows of the ProxyTable]
    const std::uint32_t* ids;  ///< rows, or null: 0, 1, ...
    int sweepAxis;
    float grow;                 ///< enlarges the boxes on every side
    float reach, inverseWidth;  ///< CellBounds of the cells
    // Outliers are boxes that are empty, longer than largestExtent, or touch more than manyCells cells along an axis.
    float largestExtent;
    std::int32_t manyCells;

    std::uint32_t id(std::uint32_t index) const { return ids != nullptr ? ids[index] : index; }
};

struct LocatedCounts
{
    std::uint32_t plain;
    std::uint32_t odd;
};

/// Input of compareBoxes().
struct MotionSource
{
    const Aabb* boxes;   ///< [rows of the ProxyTable]
    const Aabb* before;  ///< [rows of the ProxyTable] boxes of the last scan
    int sweepAxis;
    float reach, inverseWidth;  ///< CellBounds of the cells
    float limit;                ///< a box that moved farther counts as migrated
    float* motions;             ///< [out, rows] largest motion of a face of each box; or null
};

/// Motions of some boxes.
struct MotionSums
{
    std::uint32_t* octaves;  ///< [256] boxes by the exponent of their motion; each call adds to it
    std::uint32_t*
        strays;  ///< [as many as boxes] touch other cells than before, or moved farther than the limit
    std::uint32_t strayCount = 0;  ///< of the last call
    float largest = 0;             ///< motion within the limit, of all calls
};

/// Input of findOutside().
struct ShellSource
{
    const Aabb* boxes;      ///< [rows of the ProxyTable]
    const Aabb* reference;  ///< [rows of the ProxyTable] centre of each skin
    float slack;            ///< thickness of the skins
};

/// Input of findStirred().
struct WatchSource
{
    const Aabb* boxes;           ///< [rows of the ProxyTable]
    const RowPair* pairs;        ///< [count]
    const std::uint8_t* states;  ///< [count] state of each pair
    std::uint32_t count;
    /// [state] a pair in this state changes when its gap is above the limit; in state `open`, when it is not.
    float limits[4];
    std::uint8_t open;  ///< state whose pairs change when their boxes overlap
};

/// The inner loops, one set per instruction set; every set finds the same pairs.
///
/// Duplicates over cells are dropped by the owner rule: the cell that holds (max of the y minima, max of the z
/// minima) reports the pair. Inside a cell that is true exactly when, on both axes, one of the two begins in it.
struct ColumnKernels
{
    const char* name;

    /// Finds the pairs inside one column. Forward sweep: tests each entry against those behind it that begin at most
    /// `near` beyond its end.
    void (*scanSelf)(const ColumnSoa& row, PairBuffer& out);

    /// Finds the pairs between two columns of the same cell.
    void (*scanCross)(const ColumnSoa& a, const ColumnSoa& b, PairBuffer& out);

    /// Finds the entries of `row` from `begin` on that pair with entry `index` of `query`; ends at the first entry
    /// that begins beyond it.
    void (*scanOne)(const ColumnSoa& query, std::uint32_t index, const ColumnSoa& row, std::uint32_t begin,
                    PairBuffer& out);

    /// Loads the boxes of a column, sorts them by x0 and lays them out for the scans. The sort is fast when they are
    /// nearly in order.
    ///
    /// @param row [in, out] memory for count + 4 boxes and for whole vectors of four `ids`; receives the boxes
    void (*buildRow)(const RowSource& source, const RowScratch& scratch, ColumnSoa& row);

    /// Finds the cells of the boxes [begin, end) of the source in a grid of one level.
    ///
    /// @param block [out, end - begin] boxes that are no outliers
    /// @param odd   [out, end - begin] indices of the others
    LocatedCounts (*locateBoxes)(const LocateSource& source, std::uint32_t begin, std::uint32_t end,
                                 Located* block, std::uint32_t* odd);

    /// Measures how the boxes of some rows of the ProxyTable moved, and lists those that migrated.
    void (*compareBoxes)(const MotionSource& source, const std::uint32_t* rows, std::uint32_t count,
                         MotionSums& sums);

    /// Finds the rows of [begin, end) whose boxes are not inside their skins: isInsideShell().
    ///
    /// @param outside [out, end - begin] ascending
    /// @return how many
    std::uint32_t (*findOutside)(const ShellSource& source, std::uint32_t begin, std::uint32_t end,
                                 std::uint32_t* outside);

    /// Finds the pairs of [begin, end) whose boxes contradict their state. A few of the pairs found may not change.
    ///
    /// @param stirred [out, end - begin] indices, ascending
    /// @return how many
    std::uint32_t (*findStirred)(const WatchSource& source, std::uint32_t begin, std::uint32_t end,
                                 std::uint32_t* stirred);
};

extern const ColumnKernels kRowKernelsBaseline;
#if defined(__x86_64__)
extern const ColumnKernels kRowKernelsAvx2;
extern const ColumnKernels kRowKernelsAvx512;
#endif

/// Returns the widest set that this processor runs, or the baseline set if `baseline`.
const ColumnKernels& chooseRowKernels(bool baseline);
}  // namespace cullet
