// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/query_index.h"

#include "cullet/broad/queries/query_trees.h"

#include <algorithm>
#include <atomic>
#include <cfloat>
#include <cmath>
#include <mutex>
#include <new>

namespace cullet
{
namespace
{
constexpr Aabb kEverywhere = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};

/// Beyond these magnitudes the float slabs would overflow, or underflow to 0 * inf.
constexpr double kLargest = 1e30;
constexpr double kSmallestInverse = 1e-30;
constexpr double kLongest = 1e20;
/// Largest inverse of a direction component. Times the extent of a plane's box in Bullet's double build, 1e30, it still
/// fits into a float and raises no overflow flag.
constexpr double kSteepestRay = 1e8;

/// Prepares one axis of a ray; false when float slabs cannot bound it.
///
/// Bullet computes ((plane - grow) - origin) * inverse with a rounding error of up to 2^-24 of the origin and of the
/// growth before the product (and relative errors, which the kernels allow for). The planes are moved apart by
/// eight times that, and the origins are rounded away from the box.
bool prepareAxis(const RaySegment& segment, int axis, RayQuery& ray) noexcept
{
    const double origin = segment.origin[axis];
    const double growMin = segment.growMin[axis];
    const double growMax = segment.growMax[axis];
    double inverse = segment.inverseDirection[axis];
    const double reach = std::abs(origin) + std::abs(growMin) + std::abs(growMax);
    // Written so that a NaN fails.
    if (!(reach <= kLargest && std::abs(inverse) >= kSmallestInverse))
        return false;
    double slack = reach * (8.0 / 16777216.0) + FLT_MIN;
    if (std::abs(inverse) > kSteepestRay)
    {
        // Parallel: the ray is inside for every lambda or for none. A distance that is beyond the ray's end at this
        // inverse represents both.
        inverse = std::copysign(kSteepestRay, inverse);
        slack += 2.0 * std::abs(segment.lambdaMax) / kSteepestRay;
    }
    const float low = roundUpToFloat(origin + growMax + slack);     // subtracted from minima
    const float high = roundDownToFloat(origin + growMin - slack);  // subtracted from maxima
    ray.nearOrigin[axis] = inverse < 0.0 ? high : low;
    ray.farOrigin[axis] = inverse < 0.0 ? low : high;
    ray.inverse[axis] = static_cast<float>(inverse);
    return true;
}

bool prepareRay(const RaySegment& segment, RayQuery& ray) noexcept
{
    const double lambdaMax = segment.lambdaMax;
    if (!(std::abs(lambdaMax) <= kLongest))
        return false;
    ray.limit = roundUpToFloat(lambdaMax + std::abs(lambdaMax) * 4e-6);
    return prepareAxis(segment, 0, ray) && prepareAxis(segment, 1, ray) && prepareAxis(segment, 2, ray);
}

/// True when Bullet's test is false for every box: a NaN in x reaches all its comparisons, one in y or z does not.
bool hitsNothing(const RaySegment& segment) noexcept
{
    return std::isnan(segment.inverseDirection[0]) || std::isnan(segment.origin[0]) ||
           std::isnan(segment.lambdaMax);
}

/// Ski rental: an update that would save scans is postponed until the scans have cost as much as the update.
class Rent
{
public:
    void add(std::uint64_t rows) noexcept { m_total.fetch_add(rows, std::memory_order_relaxed); }
    /// Rows scanned since the last update that they paid for.
    double rowsSinceUpdate() const noexcept
    {
        return static_cast<double>(total() - m_totalAtUpdate.load(std::memory_order_relaxed));
    }
    void recordUpdate() noexcept { m_totalAtUpdate.store(total(), std::memory_order_relaxed); }
    std::uint64_t total() const noexcept { return m_total.load(std::memory_order_relaxed); }

private:
    std::atomic<std::uint64_t> m_total{0};
    std::atomic<std::uint64_t> m_totalAtUpdate{0};
};
}  // namespace

struct QueryIndex::State
{
    State(ProxyTable& table_, const QueryOptions& options)
        : table(table_), mode(options.mode), kernels(queryKernels(options.baselineSimd))
    {
    }

    bool isFresh() const noexcept;
    bool refresh();
    double syncCost() const noexcept;
    bool paysToSync() const noexcept;
    void rebuildSecondTreeIfItPays();
    void start(QueryCursor& cursor);
    void scanAll(QueryCursor& cursor) noexcept;
    QueryCursor::Stage stageAfter(const QueryCursor& cursor) const noexcept;
    std::uint32_t advance(QueryCursor& cursor, ProxyId* rows) const noexcept;

    ProxyTable& table;
    const QueryMode mode;
    const QueryKernels& kernels;
    QueryTrees trees{kernels};
    std::mutex mutex;  // locked by the one thread that changes the trees
    // False before the first sync and during one; otherwise the trees match the table as it was when last clean.
    std::atomic<bool> isReady{false};
    Rent scans;                                  // rows of whole scans, instead of a sync
    Rent listScans;                              // rows of list scans, instead of rebuildSecondTree()
    std::atomic<std::uint64_t> sourceUpdate{0};  // update in which sourceCost was counted
    std::atomic<std::uint64_t> sourceCost{0};
    std::atomic<double> syncCostPerRow{QueryTrees::kFirstSyncCost};
};

/// True when the trees may be read. The table cannot become dirty while queries run, so the result stays true.
///
/// refresh() clears isReady before the table becomes clean (release). A thread that reads the table as clean (acquire)
/// therefore reads isReady as false, or as true again after the trees are finished.
bool QueryIndex::State::isFresh() const noexcept
{
    if (table.hasQueryChanges())
        return false;
    return isReady.load(std::memory_order_acquire);
}

/// Updates the trees; returns false if another thread is updating them, where a scan is faster, or memory is short.
bool QueryIndex::State::refresh()
{
    std::unique_lock<std::mutex> lock(mutex, std::defer_lock);
    // After a few changes, a scan of all rows takes longer than waiting for the other thread.
    if (syncCost() < table.size())
        lock.lock();
    else if (!lock.try_lock())
        return false;
    if (isFresh())
        return true;
    isReady.store(false, std::memory_order_relaxed);
    scans.recordUpdate();
    try
    {
        trees.sync(table);
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    const double rows = std::max(1u, table.liveCount());
    syncCostPerRow.store(trees.expectedSyncCost(table) / rows, std::memory_order_relaxed);
    isReady.store(true, std::memory_order_release);
    return true;
}

double QueryIndex::State::syncCost() const noexcept
{
    return syncCostPerRow.load(std::memory_order_relaxed) * table.liveCount();
}

bool QueryIndex::State::paysToSync() const noexcept
{
    if (mode != QueryMode::Automatic)
        return mode == QueryMode::Tree;
    return scans.rowsSinceUpdate() + table.size() > syncCost();
}

/// Called by a query that is about to read the trees while rows are listed that a tree could store.
void QueryIndex::State::rebuildSecondTreeIfItPays()
{
    listScans.add(trees.secondary().listed.size());
    if (listScans.rowsSinceUpdate() < QueryTrees::secondTreeCost(trees.secondary()))
        return;
    const std::unique_lock<std::mutex> lock(mutex, std::try_to_lock);
    if (!lock.owns_lock() || trees.secondary().isUpToDate)
        return;
    listScans.recordUpdate();
    try
    {
        trees.rebuildSecondTree(table);
    }
    catch (const std::bad_alloc&)
    {
        // Queries continue with the list.
    }
}

void QueryIndex::State::start(QueryCursor& cursor)
{
    if (table.size() == 0)
        return;
    if (mode == QueryMode::Scan || !(isFresh() || (paysToSync() && refresh())))
    {
        scanAll(cursor);
        return;
    }
    if (!trees.secondary().isUpToDate)
        rebuildSecondTreeIfItPays();
    cursor.secondary = &trees.secondary();
    cursor.enter(QueryCursor::Stage::Main);
}

void QueryIndex::State::scanAll(QueryCursor& cursor) noexcept
{
    scans.add(table.size());
    cursor.enter(QueryCursor::Stage::Scan);
}

QueryCursor::Stage QueryIndex::State::stageAfter(const QueryCursor& cursor) const noexcept
{
    using Stage = QueryCursor::Stage;
    if (cursor.stage == Stage::Main && cursor.secondary->tree.rowCount() != 0)
        return Stage::SecondTree;
    if ((cursor.stage == Stage::Main || cursor.stage == Stage::SecondTree) &&
        !cursor.secondary->listed.empty())
        return Stage::Listed;
    return Stage::Done;
}

std::uint32_t QueryIndex::State::advance(QueryCursor& cursor, ProxyId* rows) const noexcept
{
    using Stage = QueryCursor::Stage;
    if (cursor.stage == Stage::Main || cursor.stage == Stage::SecondTree)
    {
        const BoxTreeView& tree =
            (cursor.stage == Stage::Main ? trees.mainTree() : cursor.secondary->tree).view();
        return cursor.isRay ? kernels.treeRay(tree, cursor.ray, cursor.tree, rows)
                            : kernels.treeOverlap(tree, cursor.finiteBox, cursor.tree, rows);
    }
    ScanView view = {table.boxes(), nullptr, table.size()};
    if (cursor.stage == Stage::Listed)
    {
        view.rows = cursor.secondary->listed.data();
        view.size = static_cast<std::uint32_t>(cursor.secondary->listed.size());
    }
    return cursor.isRay ? kernels.scanRay(view, cursor.ray, cursor.position, rows)
                        : kernels.scanOverlap(view, cursor.box, cursor.position, rows);
}

QueryIndex::QueryIndex(ProxyTable& table, const QueryOptions& options)
    : m_state(std::make_unique<State>(table, options))
{
}

QueryIndex::~QueryIndex() = default;

bool QueryIndex::prefersSource(std::uint64_t update) const
{
    // Below this a scan is as fast.
    constexpr std::uint32_t kFewRows = 4096;
    State& state = *m_state;
    if (state.mode != QueryMode::Automatic || state.table.size() < kFewRows || state.isFresh())
        return false;
    if (state.sourceUpdate.load(std::memory_order_relaxed) != update)
    {
        state.sourceCost.store(0, std::memory_order_relaxed);
        state.sourceUpdate.store(update, std::memory_order_relaxed);
    }
    return static_cast<double>(state.sourceCost.load(std::memory_order_relaxed)) < state.syncCost();
}

void QueryIndex::countSource(std::uint32_t cost) const
{
    m_state->sourceCost.fetch_add(cost, std::memory_order_relaxed);
}

std::uint64_t QueryIndex::bytes() const
{
    const std::lock_guard<std::mutex> lock(m_state->mutex);
    return m_state->trees.bytes();
}

std::uint64_t QueryIndex::buildsTotal() const
{
    const std::lock_guard<std::mutex> lock(m_state->mutex);
    return m_state->trees.buildsTotal();
}

std::uint64_t QueryIndex::syncsTotal() const
{
    const std::lock_guard<std::mutex> lock(m_state->mutex);
    return m_state->trees.syncsTotal();
}

std::uint64_t QueryIndex::scannedRowsTotal() const
{
    return m_state->scans.total() + m_state->listScans.total();
}

std::uint64_t QueryIndex::builtRowsTotal() const
{
    const std::lock_guard<std::mutex> lock(m_state->mutex);
    return m_state->trees.builtRowsTotal();
}

void QueryIndex::startOverlap(const Aabb& box, QueryCursor& cursor) const
{
    if (!isValid(box))
        return;
    cursor.isRay = false;
    cursor.box = box;
    cursor.finiteBox = finitePart(box);
    m_state->start(cursor);
}

void QueryIndex::startScan(const Aabb& box, QueryCursor& cursor) const
{
    if (!isValid(box))
        return;
    cursor.isRay = false;
    cursor.box = box;
    cursor.enter(QueryCursor::Stage::Scan);
}

void QueryIndex::startRay(const RaySegment& ray, QueryCursor& cursor) const
{
    if (hitsNothing(ray))
        return;
    cursor.isRay = true;
    if (prepareRay(ray, cursor.ray))
    {
        m_state->start(cursor);
        return;
    }
    cursor.isRay = false;
    cursor.box = kEverywhere;
    m_state->scanAll(cursor);
}

std::uint32_t QueryIndex::next(QueryCursor& cursor, ProxyId* rows) const
{
    while (cursor.stage != QueryCursor::Stage::Done)
    {
        const std::uint32_t count = m_state->advance(cursor, rows);
        if (count != 0)
            return count;
        cursor.enter(m_state->stageAfter(cursor));
    }
    return 0;
}
}  // namespace cullet
