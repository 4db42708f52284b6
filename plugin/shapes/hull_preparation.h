// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct HullCacheStats
{
    std::uint64_t shapes = 0;       ///< registered shape addresses
    std::uint64_t graphs = 0;       ///< point sets of living shapes; each has a graph once one is needed
    std::uint64_t buildsTotal = 0;  ///< graphs built
    std::uint64_t pointSets = 0;    ///< graphs, and point sets of destroyed shapes that are still stored
};

/// Builds the graph of a shape now instead of when contacts need it (2 ms for 1,000 points), and keeps it until
/// invalidate(). Call it when a level is loaded. Without it, a shape of more than 4,096 points has no graph: each query
/// then scans its points, and makes one contact point as Bullet does, not a patch.
CULLET_API void prepare(const btConvexHullShape& shape);

/// For a shape with level faces, such as a box, whose points are rewritten in most steps: no graph is ever built for
/// it. Where its faces are level, a query then makes one contact point as Bullet does, not a patch. Without this call,
/// each change costs a graph when the shape touches another one, 3 microseconds per point. Other shapes do not need
/// it. Undo it with false, or with invalidate() before the shape is deleted.
CULLET_API void setDeforming(const btConvexHullShape& shape, bool isDeforming = true);

/// Undoes prepare() and setDeforming(), makes the next query compare the points again, and frees the graph if no pair
/// uses it. No other case needs this call: edited, deleted and reallocated shapes are recognised by their points; with
/// cullet::Dispatcher, shapes of its pairs are compared once per dispatch.
CULLET_API void invalidate(const btConvexHullShape& shape);

/// Frees at once all graphs that no pair uses and that were not prepared, for example after a level was unloaded.
/// Without this call, graphs of destroyed shapes stay until the added graphs are as large as those in use before, and
/// at least 260,000 points, about 100 MB. A prepared graph is never freed.
CULLET_API void trimHullCache();

CULLET_API HullCacheStats hullCacheStats();
}  // namespace CULLET_PRECISION
}  // namespace cullet
