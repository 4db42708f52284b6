// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/core/debug_draw_options.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <LinearMath/btIDebugDraw.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One call of Broadphase::debugDraw(), where its requirements are documented; no state is kept between calls.
///
/// Boxes are those of the last setAabb(), pairs and cells those of the last calculateOverlappingPairs(). A box or a
/// cell is drawn as twelve lines by btIDebugDraw::drawAabb(), and a pair as one line by drawLine(): from the centre of
/// one box to the centre of the other, or to the nearest point of a box that is more than eight times as large, such
/// as a floor. Boxes and cells are clipped to the bounds of all bounded boxes (those within 2^50 of the origin), since
/// the box of a plane is unbounded; invalid boxes and boxes outside of the bounds are left out. Cells are drawn if the
/// backend is a CellSource: the grid on the CPU from a few hundred bodies on.
///
/// Cost: O(bodies + pairs + cells) calls of the drawer.
class DebugDrawing
{
public:
    DebugDrawing(const ProxyStore& store, btIDebugDraw& drawer, const DebugDrawOptions& options);

    void draw(const btOverlappingPairCache& cache, const Backend& backend) const;

private:
    bool clipToBounds(btVector3& min, btVector3& max) const;
    void drawBoxes(const btBroadphasePair* pairs, int pairCount) const;
    void drawCells(const Backend& backend) const;
    void drawPair(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const;

    const ProxyStore& m_store;
    btIDebugDraw& m_drawer;
    const DebugDrawOptions& m_options;
    btVector3 m_min, m_max;  ///< bounds of all bounded boxes; min > max if there is none
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
