// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/query_trees.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Costs in the time of scanning one box (about 0.6 ns on a quiet core), measured on 100,000 boxes.
constexpr double kCollectCost = 0.2;  // per row of the table
constexpr double kMoveCost = 60.0;    // per changed row, one by one
constexpr double kRefitCost = 8.0;    // per row of the tree, all at once
constexpr double kBuildCost = 70.0;   // per row

/// More changed rows than this share of the tree are cheaper to take in all at once.
constexpr std::uint32_t kRefitShare = 8;

/// A worn tree is built anew after so many syncs, a very worn one at once: building costs as much as about ten syncs.
constexpr std::uint32_t kSyncsBetweenBuilds = 10;
constexpr double kWorn = 1.4;
constexpr double kVeryWorn = 3.0;

/// Room for a few steps of a slow body, so that not each of them changes the tree.
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
    return box.min[0] >= -kTreeReach && box.min[1] >= -kTreeReach && box.min[2] >= -kTreeReach &&
           box.max[0] <= kTreeReach && box.max[1] <= kTreeReach && box.max[2] <= kTreeReach;
}
}  // namespace

double QueryTrees::expectedSyncCost(std::uint32_t rowCount) const noexcept
{
    if (!m_isBuilt)
        return kBuildCost * rowCount;
    const double update = std::min(kMoveCost * m_changedCount, kRefitCost * m_main.slotCount());
    const double recent = m_isRecentStale ? kBuildCost * static_cast<double>(m_recentRows.size()) : 0.0;
    return kCollectCost * rowCount + update + recent;
}

void QueryTrees::sync(ProxyTable& table)
{
    // Until the end nothing is built: an exception on the way must not leave half of the changes behind. A table that
    // shrank was cleared.
    const bool wasBuilt = m_isBuilt && table.size() >= m_places.size();
    m_isBuilt = false;
    ++m_syncsTotal;
    ++m_syncsSinceBuild;
    table.collectQueryChanges(m_changed);
    m_changedCount = static_cast<std::uint32_t>(m_changed.size());
    if (wasBuilt)
        followChanges(table);
    if (!wasBuilt || needsRebuild())
        rebuild(table);
    if (!wasBuilt)
        m_changedCount = 0;  // that all rows are new says nothing about the next time
    m_isBuilt = true;
}

void QueryTrees::followChanges(const ProxyTable& table)
{
    m_places.resize(table.size(), kNowhere);
    m_isRecentStale = false;
    m_isUnboundedStale = false;
    const bool isBulk = m_changed.size() > m_main.slotCount() / kRefitShare;
    if (isBulk)
        refitMain(table);
    for (const ProxyId row : m_changed)
    {
        if (m_places[row] >= kUnbounded)
            put(row, table.box(row));
        else if (!isBulk)
            moveInMain(row, table.box(row));
    }
    const auto tidy = [this](std::vector<ProxyId>& rows, std::uint32_t place)
    {
        rows.erase(
            std::remove_if(rows.begin(), rows.end(), [&](ProxyId row) { return m_places[row] != place; }),
            rows.end());
    };
    if (m_isUnboundedStale)
        tidy(m_unbounded, kUnbounded);
    if (!m_isRecentStale)
        return;
    tidy(m_recentRows, kRecent);
    if (!needsRebuild())
        m_recent.build(table.boxes(), m_recentRows);
}

void QueryTrees::refitMain(const ProxyTable& table)
{
    m_left.clear();
    m_main.refit(table.boxes(), m_left);
    for (const ProxyId row : m_left)
        put(row, table.box(row));
}

void QueryTrees::moveInMain(ProxyId row, const Aabb& box)
{
    const std::uint32_t slot = m_places[row];
    if (m_main.holds(slot, box))
        return;
    if (m_main.fits(slot, box))
    {
        m_main.move(slot, padded(box));
        return;
    }
    m_main.remove(slot);
    put(row, box);
}

void QueryTrees::put(ProxyId row, const Aabb& box)
{
    const std::uint32_t old = m_places[row];
    const std::uint32_t place = !isValid(box) ? kNowhere : isBounded(box) ? kRecent : kUnbounded;
    m_isRecentStale |= old == kRecent || place == kRecent;
    m_isUnboundedStale |= old == kUnbounded || place == kUnbounded;
    if (old == place)
        return;
    m_places[row] = place;
    if (place == kRecent)
        m_recentRows.push_back(row);
    if (place == kUnbounded)
        m_unbounded.push_back(row);
}

bool QueryTrees::needsRebuild() const noexcept
{
    const std::size_t rows = m_main.rowCount();
    if (m_recentRows.size() > rows / 16 + 64)
        return true;
    if (m_main.slotCount() > 2 * rows + 64)
        return true;
    const double wear = m_syncsSinceBuild < kSyncsBetweenBuilds ? kVeryWorn : kWorn;
    return m_main.leafArea() > wear * m_main.leafAreaAtBuild();
}

void QueryTrees::rebuild(const ProxyTable& table)
{
    m_places.assign(table.size(), kNowhere);
    m_unbounded.clear();
    m_recentRows.clear();
    for (ProxyId row = 0; row < table.size(); ++row)
    {
        if (isValid(table.box(row)))
            put(row, table.box(row));
    }
    m_main.build(table.boxes(), m_recentRows);
    for (std::uint32_t slot = 0; slot < m_main.slotCount(); ++slot)
    {
        if (m_main.rowAt(slot) != kNoRow)
            m_places[m_main.rowAt(slot)] = slot;
    }
    m_recentRows.clear();
    m_recentRows.shrink_to_fit();
    m_recent.build(table.boxes(), m_recentRows);
    m_syncsSinceBuild = 0;
    ++m_buildsTotal;
}

std::uint64_t QueryTrees::bytes() const noexcept
{
    return m_main.bytes() + m_recent.bytes() + m_places.capacity() * sizeof(std::uint32_t) +
           (m_recentRows.capacity() + m_unbounded.capacity() + m_changed.capacity() + m_left.capacity()) *
               sizeof(ProxyId);
}
}  // namespace cullet
