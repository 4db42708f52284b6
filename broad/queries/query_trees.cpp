// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/query_trees.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Costs in units of scanning one box (about 0.6 ns on an otherwise idle machine), measured on 100,000 boxes.
constexpr double kCollectCost = 0.2;                       // per row of the table, when many changed
constexpr double kMoveCost = 60.0;                         // per changed row, one by one
constexpr double kRefitCost = 8.0;                         // per row of the tree, all at once
constexpr double kBuildCost = QueryTrees::kFirstSyncCost;  // per row

/// If more than this share of the tree's rows changed, one in so many, a refit is cheaper than single updates.
constexpr std::uint32_t kRefitShare = 8;
/// Up to this many changed rows are updated one by one even if the tree is empty.
constexpr std::uint32_t kFewRows = 8;

/// A degraded tree is rebuilt after kRefitsBetweenBuilds refits, a very degraded one after kFewestRefits: a build costs
/// as much as about ten refits. Single changes count as the share of a refit that they cost; a few rows that move far
/// can degrade a tree on their own, and must not cause one rebuild after the other.
constexpr double kRefitsBetweenBuilds = 10.0;
constexpr double kFewestRefits = 1.0 / 16.0;
constexpr double kDegraded = 1.4;
constexpr double kVeryDegraded = 3.0;

/// If fewer rows of the table are live than this share, one in so many, a rebuild collects its rows from the trees.
constexpr std::uint32_t kSparseShare = 16;

double buildCost(const SecondaryRows& secondary) noexcept
{
    return kBuildCost * (secondary.tree.rowCount() + static_cast<double>(secondary.listed.size()));
}

/// Enlarges a box for a few steps of a slow body, so that not every step changes the tree.
Aabb padded(Aabb box) noexcept
{
    constexpr float kShare = 1.0f / 8.0f;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float pad = kShare * (box.max[axis] - box.min[axis]);
        box.min[axis] -= pad;
        box.max[axis] += pad;
    }
    return box;
}

bool isBounded(const Aabb& box) noexcept
{
    return box.min[0] >= -kMaxTreeCoordinate && box.min[1] >= -kMaxTreeCoordinate &&
           box.min[2] >= -kMaxTreeCoordinate && box.max[0] <= kMaxTreeCoordinate &&
           box.max[1] <= kMaxTreeCoordinate && box.max[2] <= kMaxTreeCoordinate;
}
}  // namespace

void QueryTrees::appendRows(const Bvh& tree, std::vector<ProxyId>& rows)
{
    rows.reserve(rows.size() + tree.rowCount());
    for (std::uint32_t slot = 0; slot < tree.slotCount(); ++slot)
    {
        if (tree.rowAt(slot) != kNoRow)
            rows.push_back(tree.rowAt(slot));
    }
}

void QueryTrees::appendRows(const SecondaryRows& secondary, std::vector<ProxyId>& rows)
{
    appendRows(secondary.tree, rows);
    rows.insert(rows.end(), secondary.listed.begin(), secondary.listed.end());
}

double QueryTrees::secondTreeCost(const SecondaryRows& secondary) noexcept
{
    constexpr double kListedCost = 4.0;
    return buildCost(secondary) / kListedCost;
}

double QueryTrees::expectedSyncCost(const ProxyTable& table) const noexcept
{
    if (!m_isBuilt)
        return kBuildCost * table.liveCount();
    return std::min(kMoveCost * m_changedCount,
                    kRefitCost * m_main.slotCount() + kCollectCost * table.size() + buildCost(secondary()));
}

void QueryTrees::sync(ProxyTable& table)
{
    // m_isBuilt stays false until the end: after an exception the trees have only some of the changes. A table that
    // shrank was cleared.
    const bool wasBuilt = m_isBuilt && table.size() >= m_places.size();
    m_isBuilt = false;
    ++m_syncsTotal;
    table.collectQueryChanges(m_changed);
    m_changedCount = wasBuilt ? static_cast<std::uint32_t>(m_changed.size())
                              : 0;  // that all rows are new does not predict the next changes
    if (wasBuilt)
        applyChanges(table);
    else
        rebuild(table, findRows(table));
    m_isBuilt = true;
}

void QueryTrees::applyChanges(const ProxyTable& table)
{
    m_places.resize(table.size(), kNowhere);
    const bool isBulk = m_changed.size() > m_main.slotCount() / kRefitShare + kFewRows;
    if (isBulk)
        refit(table);
    else
        moveOneByOne(table);
    if (needsRebuild())
        rebuild(table, table.liveCount() < table.size() / kSparseShare ? placedRows() : findRows(table));
    else if (!secondary().isUpToDate &&
             (isBulk || buildCost(secondary()) <= 2.0 * kMoveCost * m_changedCount))
        rebuildSecondTree(table);
}

/// Applies all changes by one refit of the main tree; rebuildSecondTree() applies those of the second tree.
void QueryTrees::refit(const ProxyTable& table)
{
    m_refitsSinceBuild += 1.0;
    m_left.clear();
    m_main.refit(table.boxes(), m_left);
    for (const ProxyId row : m_left)
    {
        m_places[row] = kNowhere;
        list(row, table.box(row));
    }
    for (const ProxyId row : m_changed)
    {
        if (m_places[row] >= kListed)
            list(row, table.box(row));
        else if (m_places[row] >= kInSecondTree)
            currentSecondary().isUpToDate = false;
    }
}

void QueryTrees::moveOneByOne(const ProxyTable& table)
{
    if (m_main.slotCount() != 0)
        m_refitsSinceBuild += static_cast<double>(m_changed.size()) * kRefitShare / m_main.slotCount();
    for (const ProxyId row : m_changed)
    {
        const std::uint32_t place = m_places[row];
        if (place < kInSecondTree)
            moveInTree(m_main, place, row, table.box(row));
        else if (place < kListed)
            moveInTree(currentSecondary().tree, place - kInSecondTree, row, table.box(row));
        else
            list(row, table.box(row));
    }
}

void QueryTrees::moveInTree(Bvh& tree, std::uint32_t slot, ProxyId row, const Aabb& box)
{
    if (tree.holds(slot, box))
        return;
    if (tree.fits(slot, box))
    {
        tree.move(slot, padded(box));
        return;
    }
    tree.remove(slot);
    m_places[row] = kNowhere;
    list(row, box);
}

/// Lists a row that is in no tree. A listed row stays listed, whatever its box is now.
void QueryTrees::list(ProxyId row, const Aabb& box)
{
    SecondaryRows& secondary = currentSecondary();
    if (m_places[row] == kListed)
    {
        secondary.isUpToDate &= isValid(box) && !isBounded(box);
        return;
    }
    if (!isValid(box))
        return;
    secondary.listed.push_back(row);
    m_places[row] = kListed;
    secondary.isUpToDate = false;
}

bool QueryTrees::needsRebuild() const noexcept
{
    const std::size_t rows = m_main.rowCount();
    if (secondary().tree.rowCount() + secondary().listed.size() - secondary().unboundedCount > rows / 16 + 64)
        return true;
    if (m_main.slotCount() > 2 * rows + 64)
        return true;
    if (m_refitsSinceBuild < kFewestRefits)
        return false;
    const double degradation = m_refitsSinceBuild < kRefitsBetweenBuilds ? kVeryDegraded : kDegraded;
    return m_main.leafArea() > degradation * m_main.leafAreaAtBuild();
}

void QueryTrees::rebuildSecondTree(const ProxyTable& table)
{
    m_isBuilt = false;
    std::vector<ProxyId> rows;
    appendRows(secondary(), rows);
    const std::uint32_t other = 1 - m_current.load(std::memory_order_relaxed);
    fill(table, rows, m_secondary[other].tree, m_secondary[other]);
    recordPlaces(m_secondary[other].tree, kInSecondTree);
    m_current.store(other, std::memory_order_release);
    m_isBuilt = true;
}

/// Resets the places of all rows and returns the rows with valid boxes.
std::vector<ProxyId> QueryTrees::findRows(const ProxyTable& table)
{
    m_places.assign(table.size(), kNowhere);
    std::vector<ProxyId> rows;
    rows.reserve(table.liveCount());
    for (ProxyId row = 0; row < table.size(); ++row)
    {
        if (isValid(table.box(row)))
            rows.push_back(row);
    }
    return rows;
}

/// Returns the rows that are in a tree or listed.
std::vector<ProxyId> QueryTrees::placedRows() const
{
    std::vector<ProxyId> rows;
    appendRows(m_main, rows);
    appendRows(secondary(), rows);
    return rows;
}

void QueryTrees::rebuild(const ProxyTable& table, std::vector<ProxyId> rows)
{
    for (SecondaryRows& secondary : m_secondary)
    {
        secondary.tree.build(table.boxes(), {});
        std::vector<ProxyId>().swap(secondary.listed);  // frees it: after many changes it was long
    }
    fill(table, rows, m_main, currentSecondary());
    recordPlaces(m_main, 0);
    m_refitsSinceBuild = 0.0;
    ++m_buildsTotal;
}

/// Builds a tree of those of `rows` that it can store, and lists the others.
///
/// @param rows [in, out] each once; afterwards those in the tree
/// @param secondary [out] its list receives the others; its tree may be the one that is built
void QueryTrees::fill(const ProxyTable& table, std::vector<ProxyId>& rows, Bvh& tree,
                      SecondaryRows& secondary)
{
    secondary.listed.clear();
    const auto isNotForTree = [&](ProxyId row)
    {
        const Aabb& box = table.box(row);
        m_places[row] = isValid(box) ? kListed : kNowhere;
        if (isValid(box) && !isBounded(box))
            secondary.listed.push_back(row);
        return !isValid(box) || !isBounded(box);
    };
    rows.erase(std::remove_if(rows.begin(), rows.end(), isNotForTree), rows.end());
    secondary.unboundedCount = static_cast<std::uint32_t>(secondary.listed.size());
    secondary.isUpToDate = true;
    tree.build(table.boxes(), rows);
    m_builtRowsTotal += rows.size();
}

void QueryTrees::recordPlaces(const Bvh& tree, std::uint32_t firstPlace) noexcept
{
    for (std::uint32_t slot = 0; slot < tree.slotCount(); ++slot)
    {
        if (tree.rowAt(slot) != kNoRow)
            m_places[tree.rowAt(slot)] = firstPlace + slot;
    }
}

std::uint64_t QueryTrees::bytes() const noexcept
{
    std::uint64_t bytes = m_main.bytes() + m_places.capacity() * sizeof(std::uint32_t) +
                          (m_changed.capacity() + m_left.capacity()) * sizeof(ProxyId);
    for (const SecondaryRows& secondary : m_secondary)
        bytes += secondary.tree.bytes() + secondary.listed.capacity() * sizeof(ProxyId);
    return bytes;
}
}  // namespace cullet
