// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <limits>

namespace cullet
{
/// Entries that may be read behind the last row of a pool: a full vector of the widest kernel.
inline constexpr std::uint32_t kRowPadding = 16;

/// A row of the proxy table with two flags in the highest bits: the box begins in this cell along the first / second
/// tiled axis. Proxy tables hold fewer than 2^30 rows.
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

/// The boxes of one row (a cell of the two tiled axes), sorted by `x0`, as structure of arrays.
///
/// x is the sweep axis, y and z the tiled ones, whatever world axes these are. One sentinel with x0 = +infinity follows
/// the entries, so that scans need no end test; what lies behind it may be another row, at least kRowPadding readable
/// entries of anything.
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

/// No gap is below this.
inline constexpr float kReportAll = std::numeric_limits<float>::quiet_NaN();

/// Where kernels put what they find: a fixed buffer that is handed on whenever it might overflow.
///
/// The gap of two boxes is the largest of the six differences of their faces, each rounded once: boxes overlap when it
/// is not positive, and overlapsWithMargin() compares it with twice the margin.
struct alignas(64) PairBuffer
{
    static constexpr std::uint32_t kCapacity = 1024;
    FlaggedId first[kCapacity];
    FlaggedId second[kCapacity];
    float gap[kCapacity];
    std::uint32_t count = 0;
    // In rows without bounds pairs are left out whose gap is above `near` or not above `deep`. In rows with bounds those
    // whose gap is, on either side of zero, above the sum of the bounds of both; none of these is above near / 2.
    float near = 0;
    float deep = kReportAll;
    std::uint64_t tests = 0;   ///< box tests made, whole vectors
    std::uint64_t visits = 0;  ///< rows that were asked about single boxes
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

/// One box of a row, tiled axes first, as the row is gathered and sorted.
struct RowRecord
{
    float tile[4];  ///< min, max of the first tiled axis, then of the second
    float x0, x1;
    FlaggedId id;
    std::uint32_t place;  ///< for sorting
};

/// Where a box begins, and its record.
struct RowKey
{
    float x0;
    std::uint32_t index;
};

/// What buildRow() writes on its way.
struct RowScratch
{
    RowRecord* records;  ///< [2 * count + 4]
    RowKey* keys;        ///< [2 * count + 4]
};

/// The cell of a row as bounds of the tiled faces {min, max, min, max} of boxes.
struct CellEdges
{
    float low
        [4];  ///< a box touches the cell when its maxima are not below this; it begins there when its minima are not
    float high[4];  ///< a box touches the cell when its minima are below this
};

/// What buildRow() needs.
struct RowSource
{
    const FlaggedId* ids;  ///< [count] the first sortedCount nearly sorted by x0, the others in any order
    std::uint32_t count;
    std::uint32_t sortedCount;
    const Aabb* boxes;
    int sweepAxis;
    float sweepLow, sweepHigh;  ///< where most boxes begin; a guess costs time only
    float grow;                 ///< of the boxes in the record
    /// Null: the flags of the ids hold. Else they are made anew for this cell, and boxes outside of it are left out.
    const CellEdges* edges;
};

/// The cells that a box touches, first and last along both tiled axes.
struct TileRange
{
    std::int32_t j0, j1, k0, k1;

    bool contains(std::int32_t j, std::int32_t k) const { return j >= j0 && j <= j1 && k >= k0 && k <= k1; }
};

/// A box that is to be inserted.
struct Located
{
    TileRange cells;
    std::uint32_t id;
    std::int32_t level;
};

/// What locateBoxes() needs.
struct LocateSource
{
    const Aabb* boxes;         ///< row of the proxy table -> box
    const std::uint32_t* ids;  ///< rows, or null: 0, 1, ...
    int sweepAxis;
    float grow;                 ///< of the boxes
    float reach, inverseWidth;  ///< of the cells: CellBounds
    // Boxes that are empty, longer than this, or touch more cells than so many in a row are odd.
    float largestExtent;
    std::int32_t manyCells;

    std::uint32_t id(std::uint32_t index) const { return ids != nullptr ? ids[index] : index; }
};

struct LocatedCounts
{
    std::uint32_t plain;
    std::uint32_t odd;
};

/// What compareBoxes() needs.
struct MotionSource
{
    const Aabb* boxes;   ///< row of the proxy table -> box
    const Aabb* before;  ///< ... and the one of the last scan
    int sweepAxis;
    float reach, inverseWidth;  ///< of the cells: CellBounds
    float limit;                ///< boxes that moved farther are strays
    float* motions;             ///< [out, rows] how far any face of a box moved; or null
};

/// How some boxes moved.
struct MotionSums
{
    std::uint32_t* octaves;  ///< [256] boxes by the exponent of their motion, added up
    std::uint32_t*
        strays;  ///< [as many as boxes]: touch other cells than before, or moved farther than the limit
    std::uint32_t strayCount = 0;  ///< of the last call
    float largest = 0;             ///< motion within the limit, of all calls
};

/// What findOutside() needs.
struct ShellSource
{
    const Aabb* boxes;      ///< row of the proxy table -> box
    const Aabb* reference;  ///< ... and the centre of its shell
    float slack;            ///< thickness of the shells
};

/// What findStirred() needs.
struct WatchSource
{
    const Aabb* boxes;           ///< row of the proxy table -> box
    const RowPair* pairs;        ///< [count] those that are watched among them
    const std::uint8_t* states;  ///< ... and the state of each
    std::uint32_t count;
    /// State -> gap beyond which such a pair changes; of open ones, up to which it does.
    float limits[4];
    std::uint8_t open;  ///< state of pairs that change when they overlap
};

/// The inner loops, one set per instruction set; every set finds the same pairs.
///
/// Duplicates over cells are dropped by the owner rule: the cell that holds (max of the y minima, max of the z
/// minima) reports the pair. Inside a cell that is true exactly when, on both axes, one of the two begins in it.
struct ColumnKernels
{
    const char* name;

    /// Pairs inside one row. Forward sweep: for each entry, the entries behind it that begin not beyond `near` of its end.
    void (*scanSelf)(const ColumnSoa& row, PairBuffer& out);

    /// Pairs between two rows of the same cell.
    void (*scanCross)(const ColumnSoa& a, const ColumnSoa& b, PairBuffer& out);

    /// Entries of `row` from `begin` on that are near entry `index` of `query`; ends at the first that begins beyond it.
    void (*scanOne)(const ColumnSoa& query, std::uint32_t index, const ColumnSoa& row, std::uint32_t begin,
                    PairBuffer& out);

    /// Loads the boxes of a row, sorts them by x0, fast when the ids are nearly in that order, and lays them out for the scans.
    ///
    /// @param row [in, out] room for count + 4 boxes and for whole vectors of four ids; on return its boxes
    void (*buildRow)(const RowSource& source, const RowScratch& scratch, ColumnSoa& row);

    /// Finds the cells of the boxes [begin, end) of the source in a grid of one level.
    ///
    /// @param block [out, end - begin] boxes that are not odd
    /// @param odd   [out, end - begin] indices of the others
    LocatedCounts (*locateBoxes)(const LocateSource& source, std::uint32_t begin, std::uint32_t end,
                                 Located* block, std::uint32_t* odd);

    /// Tells how the boxes of some rows of the table moved, and which of them strayed.
    void (*compareBoxes)(const MotionSource& source, const std::uint32_t* rows, std::uint32_t count,
                         MotionSums& sums);

    /// Finds the rows of [begin, end) whose boxes are not inside their shells: isInsideShell().
    ///
    /// @param outside [out, end - begin] ascending
    /// @return how many
    std::uint32_t (*findOutside)(const ShellSource& source, std::uint32_t begin, std::uint32_t end,
                                 std::uint32_t* outside);

    /// Finds the pairs [begin, end) whose boxes say something else than their state; a few of them may not change.
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

/// The widest set that this processor runs; the baseline one if asked for.
const ColumnKernels& chooseRowKernels(bool baseline);
}  // namespace cullet
