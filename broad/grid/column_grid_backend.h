// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/column_grid.h"
#include "cullet/broad/grid/resting/mode_policy.h"
#include "cullet/broad/grid/resting/neighbour_lists.h"
#include "cullet/broad/grid/resting/verlet_pairs.h"
#include "cullet/broad/huge_vector.h"
#include "cullet/broad/pairs/pair_set.h"
#include "cullet/broad/pairs/pair_sort.h"
#include "cullet/broad/pairs/sorted_pairs.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace cullet
{
class CollectingSink;

/// The production CPU backend: a column grid with a mode in which unmoved and slowly moving boxes are nearly free.
///
/// *Moving mode*: every update sweeps all columns of the grid. It is cleared and refilled ("clear and rehash when
/// many move", thesis 5.1.1) only when too many boxes migrated to other cells. The grid reports the pairs whose gap
/// or depth is within the motion since the last update, since no other pair can have changed; their previous and
/// current boxes are compared. There is no list and no hash of all pairs; only while some boxes teleport, the pairs
/// of the last update are listed.
///
/// *Resting mode*: the grid of the last refill is frozen. Each box has a skin of thickness `m_skin` around its
/// reference position; while it stays inside, only its changeable pairs (VerletPairs) can change. A box that leaves
/// its skin becomes *awake*. A second, small grid pairs awake boxes with each other, and neighbour lists
/// (NeighbourList) pair them with resting ones; a query makes a list anew when its box has left the skin of the list.
/// When too many boxes are awake, the whole grid is refilled.
///
/// Both modes are exact: the pair set is that of Backend's definition, bit for bit.
class ColumnGridBackend final : public Backend, public CellSource, public RowSource
{
public:
    explicit ColumnGridBackend(const GridOptions& options);
    ~ColumnGridBackend() override;

    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "grid"; }
    BackendStats stats() const override;
    void forEachCell(const CellVisitor& visit) const override;
    std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const override;
    std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const override;

    /// The pairs held, or those given to restart() if there was no update since; sorted.
    ///
    /// @param view of the coming update, in which destroyed rows still have their ids
    Pairs heldPairs(const ProxyView& view);

private:
    enum class Mode : std::uint8_t
    {
        Moving,
        Resting
    };

    enum class RowState : std::uint8_t
    {
        Absent,   ///< no box, or none in the frozen grid
        Resting,  ///< inside its skin
        Awake     ///< left its skin, or was created
    };

    enum class RestingOutcome : std::uint8_t
    {
        Done,
        Refill  ///< nothing was reported; refill everything
    };

    class MovingSink;
    class TeleportedSink;
    class NeighbourSink;

    /// Changes of pairs that one thread records in moving mode, besides m_added and m_removed.
    struct alignas(64) ThreadDelta
    {
        std::vector<RowPair> hysteresis;  ///< hysteresis pairs: held, overlap with the margin only
        KeyList held;                     ///< overlap and are held; while they are listed
        std::vector<std::uint64_t>
            newlyExempt;  ///< overlap and are held although the filter words reject them
        std::vector<std::uint64_t> noLongerExempt;  ///< exempt from the filter so far, no longer overlap
        std::vector<std::uint64_t> kept;            ///< when most boxes teleported: overlap as before
    };

    /// Octave of the smallest motion bound: 2^-63, so that its multiples are no denormals, which are slow.
    static constexpr std::uint32_t kLeastBoundOctave = 64;

    /// Boxes are enlarged by a little more than the skin, for the rounding of sums and differences.
    static constexpr float kGrowFactor = 1.0001f;

    /// The box, or NaN for an empty one: no comparison holds for NaN, not even with an infinite box.
    static Aabb nanIfEmpty(const Aabb& box)
    {
        constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
        return isValidBranchless(box) ? box : Aabb{{kNan, kNan, kNan}, {kNan, kNan, kNan}};
    }

    // column_grid_backend.cpp: common steps of all updates, and the choice of the mode
    void updateOrThrow(const ProxyView& view);
    bool knowsPlaces() const;
    void takeAwake(const Aabb* boxes, RowSink& sink) const;
    void writeChanges(PairDelta& delta);
    void countWork();
    std::uint64_t bytes() const;
    void forgetRows();
    void prepareRows(const ProxyView& view, bool hasCreated);
    void rememberFilterWords(const ProxyView& view, bool all);
    bool shouldBeginResting(const ProxyView& view);
    std::uint32_t countFreshMovers(const ProxyView& view);
    void recordDecision(const char* reason, std::size_t strays, double cost, double otherCost)
    {
        m_stats.decision.reason = reason;
        m_stats.decision.strays = static_cast<std::uint32_t>(strays);
        m_stats.decision.cost = cost;
        m_stats.decision.otherCost = otherCost;
    }
    static bool mayEnter(const ProxyView& view, RowPair pair)
    {
        return view.filters == nullptr || passesFilter(view.filters[pair.a], view.filters[pair.b]);
    }
    static RowPair rowsOf(std::uint64_t key)
    {
        return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
    }
    static std::uint64_t idsOf(const ProxyView& view, RowPair pair)
    {
        return pairKey(makePair(view.uniqueIds[pair.a], view.uniqueIds[pair.b]));
    }
    void reportAdded(const ProxyView& view, RowPair pair) { m_added[0].push(idsOf(view, pair)); }
    void reportRemoved(const ProxyView& view, RowPair pair) { m_removed[0].push(idsOf(view, pair)); }

    // moving_update.cpp
    void updateMoving(const ProxyView& view);
    void compareBoxes(const ProxyView& view);
    static bool isOverlapping(const ProxyView& view, RowPair pair)
    {
        const Aabb& a = view.boxes[pair.a];
        const Aabb& b = view.boxes[pair.b];
        return overlapsBranchless(a, b) && isValidBranchless(a) && isValidBranchless(b);
    }
    /// overlapsWithMargin() without branches.
    static bool isWithinMargin(const ProxyView& view, RowPair pair)
    {
        const Aabb& a = view.boxes[pair.a];
        const Aabb& b = view.boxes[pair.b];
        return overlapsWithMarginBranchless(a, b, view.margin) && isValidBranchless(a) &&
               isValidBranchless(b);
    }
    bool areStillTeleporting(const ProxyView& view);
    void listOverlapping(std::vector<std::uint64_t>& held);
    bool scanMoving(const ProxyView& view, bool isListing, bool mayFollow, PairSink& sink);
    bool follow(const ProxyView& view, const GridInput& input);
    void examineHysteresisPairs(const ProxyView& view);
    void examineOverlapping(const ProxyView& view);
    void rememberBoxes(const ProxyView& view);
    void rememberSample(const ProxyView& view);

    // thread_deltas.cpp
    void clearThreadDeltas();
    void separatePair(const ProxyView& view, RowPair pair, bool isWithinMargin, unsigned worker);
    void mergeThreadDeltas();
    void mergeOverlapping(bool isListing);

    // motion_bound.cpp
    void chooseMotionBound(const GridMotion& motion, std::uint32_t rows);
    std::uint32_t bestBoundOctave(const GridMotion& motion, std::uint32_t rows) const;
    bool isBoundAllowed(std::uint32_t octave) const;
    float* prepareMotions(const ProxyView& view);

    // teleport_update.cpp: moving mode when most boxes teleported
    void updateTeleported(const ProxyView& view, bool isComparisonSkipped);
    void sortOverlapping();
    std::uint32_t firstRowOf(const ProxyView& view, unsigned task, unsigned tasks) const;
    void compareLists(const ProxyView& view, std::uint32_t begin, std::uint32_t end, unsigned worker);
    void separateOldPairs(const ProxyView& view, const std::uint64_t* old, const std::uint64_t* end,
                          unsigned worker);
    void recordOldPair(const ProxyView& view, std::uint64_t key, bool isWithinMargin, ThreadDelta& delta);

    // column_grid_rebuild.cpp: refill from any state, with a list of the held pairs
    void rebuild(const ProxyView& view, bool settle);
    void sortOldPairs(const std::vector<RowPair>& pairs);
    void collectHeld(std::vector<RowPair>& held);
    void collectKnown(const ProxyView& view, std::vector<RowPair>& held);
    void rebuildMoving(const ProxyView& view, const std::vector<RowPair>& held);
    void rebuildResting(const ProxyView& view, const std::vector<RowPair>& held);
    void classifyPairs(const ProxyView& view, const CollectingSink& candidates,
                       const std::vector<RowPair>& held, VerletPairs& pairs);

    // resting_update.cpp
    RestingOutcome updateResting(const ProxyView& view);
    void classifyChangedBoxes(const ProxyView& view);
    std::uint32_t classifyFewChangedBoxes(const ProxyView& view);
    std::uint32_t classifyAllBoxes(const ProxyView& view);
    void wakeBox(std::uint32_t row);
    void updateRestingPairs(const ProxyView& view);
    void updateChangeablePairs(const ProxyView& view, VerletPairs& pairs, unsigned worker);
    bool isPersistent(const VerletPairs& pairs, const Aabb& a, const Aabb& b) const;
    void updatePairState(const ProxyView& view, VerletPairs& pairs, std::size_t index, unsigned worker);

    // awake_boxes.cpp
    void updateAwake(const ProxyView& view);
    bool areAwakePairsValid() const;
    void scanAwake(const ProxyView& view, CollectingSink& sink);
    void findPairsWithUnbounded(const ProxyView& view, CollectingSink& sink) const;
    void chooseAwakePairsSkin();
    void rebuildAwakePairs(const ProxyView& view, const CollectingSink& sink);

    // neighbour_list_update.cpp
    TaskRange rangeOf(unsigned part) const;
    void beginList(std::uint32_t row);
    void orderAwake(const ProxyView& view, unsigned parts);
    void updateLists(const ProxyView& view, unsigned part, unsigned worker);
    void expireAwakePartners(NeighbourPart& to) const;
    void prepareListQuery(const ProxyView& view, std::uint32_t index, NeighbourPart& to);
    void makeLists(const ProxyView& view, unsigned part, unsigned worker);
    void compactLists(unsigned part);
    static void moveList(const VerletPairs& from, NeighbourList& list, VerletPairs& to);

    GridOptions m_options;
    const ColumnKernels& m_kernels;
    ParallelLoops m_workers;
    ParallelLoops m_serialLoops;  ///< a single thread
    ColumnGrid m_grid;            ///< all boxes (moving mode), or the resting ones (resting mode)
    ColumnGrid m_awakeGrid;       ///< pairs of awake boxes
    Mode m_mode = Mode::Moving;
    bool m_restarted = true;
    bool m_hadFilter = false;
    Pairs m_known;  ///< pairs handed over by restart()
    HugeVector<Aabb>
        m_reference;  ///< [rows] boxes of the last update (moving mode), or centres of the skins (resting mode)
    std::vector<RowState> m_states;  ///< [rows] valid in resting mode

    std::vector<Filter> m_filterWords;  ///< [rows] filter words as of the last update; empty without filter

    // Moving mode. The pair set has the pairs that overlap and pass the filter, and these:
    PairSet m_filterExempt;                    ///< overlap, held although the filter words reject them by now
    std::vector<RowPair> m_hysteresisPairs;    ///< hysteresis pairs: overlap with the margin only
    std::vector<std::uint64_t> m_overlapping;  ///< held pairs that overlap, while m_hasOverlapping
    bool m_hasOverlapping = false;
    bool m_isOverlappingSorted = false;  ///< by row, the lower one first
    bool m_isReferenceOld = false;       ///< m_reference is not of the last update, except for a sample
    bool m_hasTeleported = false;        ///< most boxes teleported in the last update; the grid was refilled
    std::vector<KeyList> m_found;  ///< [threads] when most boxes teleported: pairs that overlap and are held
    std::vector<std::uint64_t> m_nextOverlapping;  ///< the pairs of m_found, sorted; the next m_overlapping
    std::vector<ThreadDelta> m_threadDeltas;       ///< [threads]
    GridMotion m_motion;
    std::vector<float>
        m_motions;  ///< [rows] while motions differ much: how far each box moved in this update
    bool m_areMotionsUneven = false;                     ///< in the last update; see prepareMotions()
    std::uint32_t m_boundOctave = kLeastBoundOctave;     ///< see chooseMotionBound()
    std::uint32_t m_comparedOctave = kLeastBoundOctave;  ///< m_boundOctave that m_motion was measured with
    std::uint32_t m_calmUpdates = 0;
    std::uint32_t m_scannedRows = 0;  ///< rows of the table in the last scan

    float m_skin = 0;  ///< thickness of the skins in resting mode
    float m_restingMargin = 0;
    float m_persistentGap = 0;  ///< held pairs whose reference boxes have at most this gap are persistent
    VerletPairs m_restingPairs;
    std::vector<std::uint32_t> m_awake;
    std::size_t m_orderedCount = 0;       ///< awake boxes when they were ordered along the columns
    std::uint32_t m_orderedAge = 0;       ///< updates since the ordering
    std::vector<NeighbourList> m_lists;   ///< [m_awake]
    std::vector<NeighbourPart> m_parts;   ///< the lists, divided for tasks
    VerletPairs m_awakePairs;             ///< pairs of awake boxes with each other, and with unbounded boxes
    std::vector<Aabb> m_awakePairsBoxes;  ///< [m_awake] boxes when m_awakePairs was made
    std::uint32_t m_awakePairsAge = 0;    ///< updates since m_awakePairs was made
    std::uint32_t m_awakePairsWait = 0;   ///< updates until m_awakePairs gets a skin again
    float m_awakePairsSkin = 0;           ///< skin of m_awakePairs: how far each box may move
    // Memory of refills and of rebuildAwakePairs():
    SortedPairs m_oldPairs;
    std::vector<std::uint64_t> m_oldKeys;  // memory for the next m_oldPairs
    bool m_hasFewChanges = true;
    std::vector<std::uint32_t>
        m_insideSkin;                   ///< rows that moved inside their skin; filled if m_hasFewChanges
    std::size_t m_insideSkinCount = 0;  ///< rows that moved inside their skin
    std::vector<std::uint32_t> m_outsideSkin;  ///< rows that left their skin
    double m_wasted = 0;                       ///< work spent on awake boxes that do not move any more
    ModePolicy m_policy;

    std::vector<Aabb> m_anchors;  ///< moving mode: a sample of the boxes some updates ago
    std::uint32_t m_anchorStride = 1;
    std::uint32_t m_anchorAge = 0;
    std::vector<std::uint32_t>
        m_moverStamps;               ///< [rows] stamp of the last count in which each had changed, if few do
    std::uint32_t m_moverStamp = 1;  ///< stamp of the last count

    // [threads] keys by unique ids. A hysteresis pair that overlaps again is among the added ones twice, which
    // cancels.
    std::vector<KeyList> m_added;
    std::vector<KeyList> m_removed;
    PairSort m_sorts[2];
    BackendStats m_stats;
};
}  // namespace cullet
