// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

/// Closest point to the origin on a simplex of one to four points, by Voronoi regions.
///
/// Ericson 2005, "Real-Time Collision Detection", section 5.1, for the regions; van den Bergen 1999, "A Fast and Robust
/// GJK Implementation for Collision Detection of Convex Objects", theorem 2, for the reduction: if the last point is a
/// support point in the direction from the closest point of the others to the origin, it belongs to the new closest
/// subset, and of 15 regions of a tetrahedron only 7 and the inside remain. That premise fails for a simplex that was
/// remembered from another frame; closestOnSimplex() examines all regions.
///
/// Always in double, whatever the scalar of the points was: with float supports and a float solver about one query in
/// 8,000 came out wrong, with a double solver none. No tolerance is absolute: sizes from 1e-60 to 1e60 behave alike.
namespace cullet
{
/// Result of a solver.
struct ClosestOnSimplex
{
    Eigen::Vector3d point;  ///< closest point to the origin; meaningless if isInside
    double length2;       ///< of `point`, squared; infinite if no region was found since a coordinate is NaN
    unsigned subset = 0;  ///< bit i: point i is needed; the smallest subset whose hull has `point`
    bool isInside = false;  ///< the origin is inside the tetrahedron, or on its surface
};

using SimplexPoints = std::array<Eigen::Vector3d, 4>;

/// Keeps the candidate if it is closer. A NaN makes the comparison false.
inline void keepCloser(const Eigen::Vector3d& point, unsigned subset, ClosestOnSimplex& best)
{
    const double length2 = point.squaredNorm();
    if (length2 < best.length2)
        best = {point, length2, subset, false};
}

/// All three regions of the segment i, j. A segment without length is its first point.
inline void considerSegment(const SimplexPoints& p, int i, int j, ClosestOnSimplex& best)
{
    const Eigen::Vector3d edge = p[j] - p[i];
    const double along = -p[i].dot(edge);
    const double length2 = edge.squaredNorm();
    // Written so that a segment without length ends in the first branch.
    if (!(along > 0.0))
        keepCloser(p[i], 1u << i, best);
    else if (along >= length2)
        keepCloser(p[j], 1u << j, best);
    else
        keepCloser(p[i] + (along / length2) * edge, (1u << i) | (1u << j), best);
}

/// The inside region of the triangle i, j, k if the origin projects into it.
///
/// @return false when the origin projects outside, or the triangle is too thin for its normal to mean anything
inline bool considerInside(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& best)
{
    const Eigen::Vector3d ij = p[j] - p[i];
    const Eigen::Vector3d ik = p[k] - p[i];
    const Eigen::Vector3d normal = ij.cross(ik);
    const double area2 = normal.squaredNorm();
    // 1e-28: a relative height of 1e-14, some 50 roundings.
    if (!(area2 > 1e-28 * ij.squaredNorm() * ik.squaredNorm()))
        return false;
    const Eigen::Vector3d across = normal.cross(p[i]);
    const double wj = -ik.dot(across);
    const double wk = ij.dot(across);
    if (!(area2 - wj - wk > 0.0 && wj > 0.0 && wk > 0.0))
        return false;
    // Along the normal: p[i] times the normal is exact enough where the weighted sum would cancel.
    keepCloser(normal * (p[i].dot(normal) / area2), (1u << i) | (1u << j) | (1u << k), best);
    return true;
}

/// All seven regions of the triangle i, j, k.
inline void considerTriangle(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& best)
{
    if (considerInside(p, i, j, k, best))
        return;
    considerSegment(p, i, j, best);
    considerSegment(p, j, k, best);
    considerSegment(p, k, i, best);
}

/// The four regions of the triangle i, j, k that have the newest point k: vertex, two edges, inside.
inline void considerTriangleNewest(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& best)
{
    if (considerInside(p, i, j, k, best))
        return;
    considerSegment(p, k, i, best);
    considerSegment(p, k, j, best);
}

/// Two vectors side by side.
struct VectorPair
{
    using Lane = Lanes<double>::Vector;

    VectorPair(const Eigen::Vector3d& first, const Eigen::Vector3d& second)
        : x{first[0], second[0]}, y{first[1], second[1]}, z{first[2], second[2]}
    {
    }
    VectorPair(const Lane& ofX, const Lane& ofY, const Lane& ofZ) : x(ofX), y(ofY), z(ofZ) {}

    VectorPair operator-(const VectorPair& o) const { return {x - o.x, y - o.y, z - o.z}; }
    VectorPair cross(const VectorPair& o) const
    {
        return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x};
    }
    Lane dot(const VectorPair& o) const { return x * o.x + y * o.y + z * o.z; }

    Lane x, y, z;
};

/// Sides of the faces of a tetrahedron on which the origin lies; face f is opposite to point f.
struct TetrahedronSides
{
    unsigned outside;  ///< bit f: beyond face f
    bool isFlat;       ///< the volume is within rounding of zero: the sides mean nothing
};

/// Lane by lane.
inline VectorPair::Lane largerOf(const VectorPair::Lane& a, const VectorPair::Lane& b)
{
    return a > b ? a : b;
}

/// Two faces at a time, from the points: vectors that are made in memory and read side by side wait for their stores.
inline TetrahedronSides tetrahedronSides(const SimplexPoints& p)
{
    using Lane = VectorPair::Lane;
    const VectorPair p33(p[3], p[3]), p30(p[3], p[0]), p12(p[1], p[2]);
    // With the edges a, b and c from point 3 to the others.
    const VectorPair bAndC = p12 - p33;
    const VectorPair cAndA = VectorPair(p[2], p[0]) - p33;
    const VectorPair aAndEdge1 = VectorPair(p[0], p[1]) - p30;
    const VectorPair bAndEdge2 = p12 - p30;
    const VectorPair normals01 = bAndC.cross(cAndA), normals23 = aAndEdge1.cross(bAndEdge2);
    const double volume = aAndEdge1.dot(normals01)[0];
    // 1e-28 of the product of squared lengths: a relative height of 1e-14.
    const Lane lengths2 = bAndC.dot(bAndC);
    const double size2 = aAndEdge1.dot(aAndEdge1)[0] * lengths2[0] * lengths2[1];
    // And 1e-30 of those of the coordinates, whose rounding moves a point by so much towards or from a face.
    const Lane normals2 = largerOf(normals01.dot(normals01), normals23.dot(normals23));
    const Lane points2 = largerOf(p12.dot(p12), p30.dot(p30));
    const double noise2 = std::max(normals2[0], normals2[1]) * std::max(points2[0], points2[1]);
    // Barycentric weights of the origin times the volume. The last one from its own face: what the others leave of the volume
    // would lose what they have lost.
    const double sign = volume < 0.0 ? -1.0 : 1.0;
    const Lane weights01 = p33.dot(normals01) * -sign, weights23 = p30.dot(normals23) * Lane{-sign, sign};
    return {laneBits(weights01 < Lane{}) | laneBits(weights23 < Lane{}) << 2,
            !(volume * volume > 1e-28 * size2) || !(volume * volume > 1e-30 * noise2)};
}

/// Points of the face opposite to point f.
inline constexpr std::array<std::array<int, 3>, 4> kTetrahedronFaces = {
    {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}};

template <bool kNewestOnly>
void considerTetrahedron(const SimplexPoints& p, ClosestOnSimplex& best)
{
    const TetrahedronSides sides = tetrahedronSides(p);
    bool isInside = true;
    for (int face = 0; face < 4; ++face)
    {
        if ((sides.outside >> face & 1u) == 0 && !sides.isFlat)
            continue;
        isInside = false;
        const auto [i, j, k] = kTetrahedronFaces[face];
        // The face without the newest point is left out in exact arithmetic; rounding can make it the only one.
        if (kNewestOnly && face != 3 && !sides.isFlat)
            considerTriangleNewest(p, i, j, k, best);
        else
            considerTriangle(p, i, j, k, best);
    }
    best.isInside = isInside;
}

/// Nothing found yet, and the subset to name if nothing ever is.
inline ClosestOnSimplex nothingOnSimplex(const SimplexPoints& points, int count)
{
    return {points[count - 1], std::numeric_limits<double>::infinity(), 1u << (count - 1), false};
}

/// Closest point on the first `count` points, examining every region.
/// @pre 1 <= count <= 4
inline ClosestOnSimplex closestOnSimplex(const SimplexPoints& points, int count)
{
    ClosestOnSimplex best = nothingOnSimplex(points, count);
    switch (count)
    {
        case 1:
            keepCloser(points[0], 1u, best);
            break;
        case 2:
            considerSegment(points, 0, 1, best);
            break;
        case 3:
            considerTriangle(points, 0, 1, 2, best);
            break;
        default:
            considerTetrahedron<false>(points, best);
    }
    return best;
}

/// The same when the last point is the newest support point: only regions that have it (1 of 1, 2 of 3, 4 of 7, 7 of
/// 14), plus one check of the face without it for a tetrahedron.
/// @pre 1 <= count <= 4; the last point was found as the support point opposite to the closest point of the others
inline ClosestOnSimplex closestOnSimplexNewest(const SimplexPoints& points, int count)
{
    ClosestOnSimplex best = nothingOnSimplex(points, count);
    switch (count)
    {
        case 1:
            keepCloser(points[0], 1u, best);
            break;
        case 2:
            considerSegment(points, 1, 0, best);
            break;
        case 3:
            considerTriangleNewest(points, 0, 1, 2, best);
            break;
        default:
            considerTetrahedron<true>(points, best);
    }
    return best;
}

/// Barycentric weights of the closest point of a subset of one to three points that was found to be the smallest: not
/// negative, sum 1; in the order of `points`, 0 outside of the subset.
inline std::array<double, 4> simplexWeights(const SimplexPoints& points, unsigned subset)
{
    std::array<double, 4> weights = {};
    std::array<int, 4> members = {};
    int count = 0;
    for (int i = 0; i < 4; ++i)
    {
        if ((subset >> i & 1u) != 0)
            members[count++] = i;
    }
    const auto [i, j, k, unused] = members;
    weights[i] = 1.0;
    if (count == 2)
    {
        const Eigen::Vector3d edge = points[j] - points[i];
        weights[j] = -points[i].dot(edge) / edge.squaredNorm();
        weights[i] = 1.0 - weights[j];
    }
    if (count == 3)
    {
        const Eigen::Vector3d ij = points[j] - points[i];
        const Eigen::Vector3d ik = points[k] - points[i];
        const Eigen::Vector3d normal = ij.cross(ik);
        const double area2 = normal.squaredNorm();
        const Eigen::Vector3d across = normal.cross(points[i]);
        const double wj = -ik.dot(across);
        const double wk = ij.dot(across);
        weights[i] = (area2 - wj - wk) / area2;
        weights[j] = wj / area2;
        weights[k] = wk / area2;
    }
    return weights;
}
}  // namespace cullet
