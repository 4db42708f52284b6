// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/debug_draw.h"

#include "cullet/broad/cell_visitor.h"
#include "cullet/plugin/core/box_convert.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr btScalar kFarthest = btScalar(0x1p50);  // the same limit as in the grids
constexpr btScalar kMuchLarger = 8;

bool isBounded(const btVector3& min, const btVector3& max)
{
    return isValidBox(min, max) && min[min.minAxis()] >= -kFarthest && max[max.maxAxis()] <= kFarthest;
}

btScalar longestSide(const btVector3& min, const btVector3& max)
{
    const btVector3 sides = max - min;
    return sides[sides.maxAxis()];
}

btVector3 nearestPoint(const btVector3& min, const btVector3& max, const btVector3& point)
{
    btVector3 nearest = point;
    nearest.setMax(min);
    nearest.setMin(max);
    return nearest;
}
}  // namespace

DebugDrawing::DebugDrawing(const ProxyStore& store, btIDebugDraw& drawer, const DebugDrawOptions& options)
    : m_store(store),
      m_drawer(drawer),
      m_options(options),
      m_min(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT),
      m_max(-m_min)
{
    m_store.forEach(
        [&](const Proxy* proxy, std::uint32_t)
        {
            if (!isBounded(proxy->m_aabbMin, proxy->m_aabbMax))
                return;
            m_min.setMin(proxy->m_aabbMin);
            m_max.setMax(proxy->m_aabbMax);
        });
}

void DebugDrawing::draw(const btOverlappingPairCache& cache, const Backend& backend) const
{
    const btBroadphasePair* const pairs = cache.getOverlappingPairArrayPtr();
    const int pairCount = cache.getNumOverlappingPairs();
    if (m_options.cells)
        drawCells(backend);
    if (m_options.boxes)
        drawBoxes(pairs, pairCount);
    for (int i = 0; m_options.pairs && i < pairCount; ++i)
        drawPair(*pairs[i].m_pProxy0, *pairs[i].m_pProxy1);
}

/// Clips a box to the bounds; false if nothing is left, or if the box contains a NaN.
bool DebugDrawing::clipToBounds(btVector3& min, btVector3& max) const
{
    if (!isValidBox(min, max))
        return false;
    min.setMax(m_min);
    max.setMin(m_max);
    return isValidBox(min, max);
}

void DebugDrawing::drawBoxes(const btBroadphasePair* pairs, int pairCount) const
{
    std::vector<bool> hasPair(m_store.table().size());
    for (int i = 0; i < pairCount; ++i)
    {
        // A cache may also hold proxies of another broad phase that uses it.
        for (const btBroadphaseProxy* proxy : {pairs[i].m_pProxy0, pairs[i].m_pProxy1})
        {
            if (m_store.owns(proxy))
                hasPair[ProxyStore::rowOf(static_cast<const Proxy*>(proxy))] = true;
        }
    }
    m_store.forEach(
        [&](const Proxy* proxy, std::uint32_t row)
        {
            btVector3 min = proxy->m_aabbMin, max = proxy->m_aabbMax;
            if (clipToBounds(min, max))
                m_drawer.drawAabb(min, max, hasPair[row] ? m_options.pairedBoxColor : m_options.boxColor);
        });
}

void DebugDrawing::drawCells(const Backend& backend) const
{
    const auto* const source = dynamicCast<const CellSource>(&backend);
    if (source == nullptr)
        return;
    source->forEachCell(
        [&](const Aabb& cell, std::uint32_t)
        {
            const btVector3& origin = m_store.origin().place();
            btVector3 min = origin + btVector3(cell.min[0], cell.min[1], cell.min[2]);
            btVector3 max = origin + btVector3(cell.max[0], cell.max[1], cell.max[2]);
            if (clipToBounds(min, max))
                m_drawer.drawAabb(min, max, m_options.cellColor);
        });
}

void DebugDrawing::drawPair(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const
{
    btVector3 minA = a.m_aabbMin, maxA = a.m_aabbMax, minB = b.m_aabbMin, maxB = b.m_aabbMax;
    if (!clipToBounds(minA, maxA) || !clipToBounds(minB, maxB))
        return;
    btVector3 from = (minA + maxA) / 2, to = (minB + maxB) / 2;
    if (longestSide(minA, maxA) > kMuchLarger * longestSide(minB, maxB))
        from = nearestPoint(minA, maxA, to);
    else if (longestSide(minB, maxB) > kMuchLarger * longestSide(minA, maxA))
        to = nearestPoint(minB, maxB, from);
    m_drawer.drawLine(from, to, m_options.pairColor);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
