// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa_cache.h"
#include "cullet/narrow/epa/polytope.h"
#include "cullet/narrow/gjk/gjk_types.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

/// Conversions from a polytope to an EpaCache and from support points to a polytope.
namespace cullet
{
/// Stores the vertices and faces of a polytope in the cache; empties the cache if there are too many, or if one is a
/// vertex of a hull whose id the cache cannot store.
///
/// @param supports of the polytope's vertices
template <class S, class Supports>
void rememberSurface(const Polytope& polytope, const Supports& supports, EpaCache& memory)
{
    memory.vertexCount = memory.faceCount = 0;
    if (polytope.faceCount() > EpaCache::kFaces)
        return;
    std::array<std::int16_t, Polytope::kMaxVertices> places;
    std::fill_n(places.begin(), polytope.vertexCount(), std::int16_t(-1));
    int count = 0;
    for (int i = 0; i < polytope.faceCount(); ++i)
    {
        const Polytope::Corners& c = polytope.corners(i);
        for (const std::int16_t v : c)
        {
            if (places[v] >= 0)
                continue;
            places[v] = static_cast<std::int16_t>(count);
            memory.verticesA[count] = narrowId<S>(supports[v].vertexA);
            memory.verticesB[count] = narrowId<S>(supports[v].vertexB);
            if (std::max(memory.verticesA[count], memory.verticesB[count]) == GjkCache<S>::kUnknown)
                return;
            ++count;
        }
        memory.setCorners(i, places[c[0]], places[c[1]], places[c[2]]);
    }
    memory.vertexCount = static_cast<std::uint8_t>(count);
    memory.faceCount = static_cast<std::uint8_t>(polytope.faceCount());
}

/// Adds the support points from `first` to `count` that lie outside of a polytope.
///
/// @param supports [out] of the polytope's vertices
template <class Points, class P, class Supports>
void addPoints(const Points& points, int first, int count, P& polytope, Supports& supports)
{
    for (int i = first; i < count; ++i)
    {
        const auto k = static_cast<std::size_t>(i);
        if (const int vertex = polytope.add(points[k].w); vertex >= 0)
            supports[static_cast<std::size_t>(vertex)] = points[k];
    }
}

/// Makes an empty polytope the tetrahedron of the first four support points, which span space.
///
/// @param supports [out] of the polytope's vertices
template <class Points, class P, class Supports>
void wrapFour(const Points& points, P& polytope, Supports& supports)
{
    polytope.setTetrahedron({points[0].w, points[1].w, points[2].w, points[3].w});
    std::copy_n(points.begin(), 4, supports.begin());
}

/// Makes an empty polytope the convex hull of support points, the first four of which span space.
///
/// @param supports [out] of the polytope's vertices
template <class Points, class P, class Supports>
void wrapPoints(const Points& points, int count, P& polytope, Supports& supports)
{
    wrapFour(points, polytope, supports);
    addPoints(points, 4, count, polytope, supports);
}

/// Moves four support points that span space to the front: the first, the one farthest from it, the one farthest from
/// the line through both, and the one farthest from the plane through the three.
///
/// @return six times the volume of their tetrahedron; 0 for fewer than four points
template <class Points>
double spreadFour(Points& points, int count)
{
    if (count < 4)
        return 0.0;
    const auto bring = [&](int place, const auto& extent)
    {
        int best = place;
        for (int i = place + 1; i < count; ++i)
            best = extent(points[i].w) > extent(points[best].w) ? i : best;
        std::swap(points[place], points[best]);
        return extent(points[place].w);
    };
    const Eigen::Vector3d first = points[0].w;
    bring(1, [&](const Eigen::Vector3d& p) { return (p - first).squaredNorm(); });
    const Eigen::Vector3d along = points[1].w - first;
    bring(2, [&](const Eigen::Vector3d& p) { return (p - first).cross(along).squaredNorm(); });
    const Eigen::Vector3d normal = (points[2].w - first).cross(along);
    return bring(3, [&](const Eigen::Vector3d& p) { return std::abs((p - first).dot(normal)); });
}
}  // namespace cullet
