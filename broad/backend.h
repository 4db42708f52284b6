// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/api.h"
#include "cullet/broad/array.h"
#include "cullet/broad/pair.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace cullet
{
/// Outcome of an update. Anything but Ok means: `delta` is empty, the backend's own state is invalid, and the caller
/// continues with another backend (or the same one) after restart().
enum class Status
{
    Ok,
    OutOfMemory,
    DeviceLost
};

/// Collision filter words in Bullet's sense: two proxies may pair when (a.group & b.mask) and (b.group & a.mask).
struct Filter
{
    std::int32_t group;
    std::int32_t mask;
};

CULLET_HOST_DEVICE inline bool passesFilter(Filter a, Filter b) noexcept
{
    return (a.group & b.mask) != 0 && (b.group & a.mask) != 0;
}

/// Bits of ProxyView::changes: what happened to a row since the last update.
enum RowChange : std::uint8_t
{
    kRowUnchanged = 0,
    kRowMoved = 1,    ///< the box differs from that of the last update (or was set to others and back)
    kRowCreated = 2,  ///< the row holds another proxy than in the last update; it has no pairs yet
    kRowDestroyed =
        4,  ///< the proxy was destroyed; its row keeps its id and an empty box until the update ends
    kRowRefiltered =
        8  ///< group or mask changed: pairs that the old words excluded may enter, none has to leave
};

/// Boxes and identities of all proxies, as rows of parallel arrays; valid until the owner changes.
///
/// Free rows and destroyed ones have an empty box, so that they overlap nothing. Rows are never moved.
struct ProxyView
{
    std::uint32_t size = 0;                    ///< rows, free ones included
    const Aabb* boxes = nullptr;               ///< [size] world-space boxes; empty ones overlap nothing
    const std::uint32_t* uniqueIds = nullptr;  ///< [size] unique id, 0 for free rows
    const Filter* filters =
        nullptr;  ///< [size] or null: every overlapping pair counts; restart() at a switch
    const std::uint8_t* changes = nullptr;  ///< [size] RowChange bits since the last update
    const std::uint32_t* dirty = nullptr;   ///< [dirtyCount] ascending rows with changes != 0
    std::uint32_t dirtyCount = 0;
    std::uint8_t anyChanges = 0;  ///< bitwise or of `changes`; 0: not computed
    /// Rows that `boxes` has memory for, when that is from BoxAllocator, so that a device may lock its pages; else 0.
    std::size_t lockableRows = 0;
    std::size_t lockableDirty = 0;  ///< rows that `dirty` has such memory for
    float margin = 0.0f;  ///< >= 0; a pair leaves when the boxes grown by it on every side no longer overlap
};

/// How long a part of an update took.
struct StageTime
{
    const char* name;
    double milliseconds;
};

/// Why the column grid took its path in the last update.
///
/// Costs are expected work in nanoseconds of a 2023 server core, of which only the ratios matter: they are computed
/// from counts and no clock, so that every thread count and machine decides alike.
struct GridDecision
{
    const char* reason = "";  ///< in words
    std::uint32_t strays =
        0;            ///< boxes that migrated to other columns, or are outside their skins (resting mode)
    double cost = 0;  ///< of the path that was taken
    double otherCost = 0;      ///< of the best one that was not
    float cellWidth = 0;       ///< of the finest level, world units
    double planCost = 0;       ///< of a refill with the levels and widths of the plan
    double oneLevelCost = 0;   ///< of a refill with one level of the best width
    double allLevelsCost = 0;  ///< of a refill with a level per octave of sizes, at most eight
};

/// What a backend did, for people and for benchmarks; all numbers are of the last update unless their names end in
/// Total.
struct BackendStats
{
    const char* path = "";         ///< which way the last update took, e.g. "idle", "incremental", "rebuild"
    std::uint64_t pairs = 0;       ///< pairs now held
    std::uint64_t candidates = 0;  ///< box tests that were made
    std::uint64_t entries = 0;     ///< rows times cells after duplication over cells
    std::uint64_t levels = 0;      ///< grid levels in use
    std::uint64_t unbounded = 0;   ///< unbounded boxes, which are in no cell
    std::uint64_t bytes = 0;       ///< memory held, bytes
    std::uint64_t rebuildsTotal = 0;  ///< updates that took the clear-and-rebuild path
    /// Sweep and prune on an executor: searches that were repeated because a list, a bin or a tile was too small.
    std::uint64_t retriesTotal = 0;
    std::uint64_t cellsVisited = 0;  ///< cells that were searched for partners
    std::uint64_t bytesMoved = 0;    ///< between the memory of the CPU and that of a device
    GridDecision decision;           ///< of the column grid
    Array<StageTime> stages;         ///< with PsapOptions::timeStages, in order
};

/// Finds the overlapping pairs of a set of boxes and reports how the set changed.
///
/// The pair set is defined by the history of boxes alone, so that all backends agree bit for bit:
/// a pair enters in the update in which both boxes are valid, overlap (closed intervals, overlaps()) and pass the
/// filter; it leaves in the update in which the boxes no longer overlap with the margin (overlapsWithMargin()) or one
/// of them is empty. The filter is evaluated only when a pair is about to enter. Lower id first in each pair.
///
/// Threads: one update at a time; a backend may use threads of its own inside it. Different backends are independent.
class CULLET_API Backend
{
public:
    virtual ~Backend() = default;

    /// Brings the pair set up to date with the boxes and reports the changes since the last update or restart().
    ///
    /// @param proxies rows; `dirty` must name every row that differs from the last update of *this* backend
    /// @param delta   [out] overwritten; sorted by (first, second), unique, disjoint
    /// @return Ok, or why the update failed; no exception leaves it
    virtual Status update(const ProxyView& proxies, PairDelta& delta) = 0;

    /// Discards all rows; the next update reads all of them and reports its delta relative to `known`.
    ///
    /// The next view may be of another table, with fewer rows. Estimates of costs may be kept.
    ///
    /// @param known sorted, unique pairs of ids that live in the next view or were destroyed since
    virtual void restart(const Pairs& known) = 0;

    /// Short name for logs and tables: "grid", "brute", ...
    virtual const char* name() const noexcept = 0;

    virtual BackendStats stats() const = 0;
};

/// Options of the grid. They change its speed, and never the pairs. All but `threads` are for tests and comparisons.
struct GridOptions
{
    /// Threads used inside an update; 0: as many as the machine has.
    int threads = 0;
    /// Buckets of the cell hash; 0: as many as needed, 1 forces every collision.
    std::uint32_t bucketCount = 0;
    /// Cell width in units of the largest box of its level; 0: tuned from counted work.
    float cellScale = 0.0f;
    /// Fraction of moved rows above which the grid is cleared and rebuilt instead of updated; negative: automatic,
    /// 0: always rebuild, 1: rebuild only when forced to.
    float rebuildFraction = -1.0f;
    /// False: no resting mode, that is no skins around boxes that rest; every update processes all rows.
    bool settles = true;
    /// Levels that the octaves of sizes are merged into, if there are as many; 0: automatic.
    std::uint32_t levels = 0;
    /// Use no instructions beyond the x86-64 baseline.
    bool baselineSimd = false;
    /// Rows up to which every changed box is tested against all others, without a grid; kMeasured: where that is faster
    /// on this processor.
    static constexpr std::uint32_t kMeasured = 0xffffffffu;
    std::uint32_t flatLimit = kMeasured;
};

/// How the sweep axis is chosen.
enum class PsapAxis
{
    Variance,  ///< the axis along which the centres of the boxes vary most
    X,
    Y,
    Z,
    Random  ///< by the seed, once per backend
};

/// How the boxes are sorted.
enum class PsapOrder
{
    Automatic,  ///< on a GPU bins for small worlds and tiles for larger ones of one size, else counting
    Counting,   ///< counts and offsets per bin
    Bins,       ///< into bins of fixed capacity, without counting; by counting in updates where a bin is full
    Tiles  ///< into blocks of space, each sorted and searched by itself; by counting where a block is full
};

/// How partners are searched where boxes are sorted, not put into bins of fixed capacity.
enum class PsapRowSearch
{
    Automatic,  ///< Grouped where boxes are many, and of sizes that need several levels or in many pairs; else Alone
    Alone,   ///< each box by itself
    Grouped  ///< the boxes of a warp cooperatively: their common surroundings are read once
};

/// Whether a neighbour list with skins is kept, so that updates in which boxes move little need no search.
enum class PsapNearPairs
{
    Automatic,  ///< unless it has not paid recently
    Never,
    Always  ///< whether it pays or not
};

/// In which order the CPU runs the indices of a step.
enum class PsapExecutor
{
    InOrder,
    Shuffled,  ///< by the seed: finds steps that depend on the order
    Threads
};

/// Options of the sweep-and-prune backend on a GPU. They change its speed, and never the pairs. All but `device` and
/// `threads` are for tests and comparisons.
struct PsapOptions
{
    int device = 0;  ///< CUDA device ordinal
    PsapAxis axis = PsapAxis::Variance;
    std::uint32_t seed = 1;  ///< for PsapAxis::Random and PsapExecutor::Shuffled
    /// Width of a cell and length of a bin in units of the longest box side of their level; 0: chosen by a cost model.
    float cellScale = 0.0f;
    float binScale = 0.0f;
    /// Updates until the next plan of cells, bins or tiles is begun; 0: 32, and 256 for tiles.
    std::uint32_t updatesPerPlan = 0;
    PsapOrder order = PsapOrder::Automatic;
    PsapRowSearch rowSearch = PsapRowSearch::Automatic;
    PsapNearPairs nearPairs = PsapNearPairs::Automatic;  ///< for updates that report deltas
    /// Initial capacity for pairs, entries and look-ups; every list grows when needed: 1 forces every growth.
    std::uint32_t initialCapacity = 1024;
    PsapExecutor executor = PsapExecutor::InOrder;  ///< of the backend on the CPU
    /// Threads that pack boxes for the executor, and of PsapExecutor::Threads; 0: as many as the machine has.
    int threads = 0;
    bool timeStages = false;  ///< BackendStats::stages; the device's clock around each stage
    /// CUDA: threads in a block of the steps whose indices do not cooperate, in warps of 32, up to 256, or 128 where
    /// steps find pairs. 0: the maximum.
    std::uint32_t blockThreads = 0;
};

CULLET_API std::unique_ptr<Backend> makeGridBackend(const GridOptions& options = {});

/// Tests every pair of boxes in every update: O(n^2), the oracle of the tests, and fine below about 100 boxes.
CULLET_API std::unique_ptr<Backend> makeBruteForceBackend();

/// The CUDA backend, or null with the reason in words in `*why`: no device, driver too old, built without CUDA.
CULLET_API std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions& options = {},
                                                        std::string* why = nullptr);
}  // namespace cullet
