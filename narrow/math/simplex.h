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
/// subset, and of 15 regions of a tetrahedron only 7 and the inside remain. That premise fails for a simplex from the
/// cache of another frame; closestOnSimplex() examines all regions.
///
/// The solver works in double whatever the scalar of the points was: with float supports and a float solver about one
/// query in 8,000 was wrong, with a double solver none. No tolerance is absolute: sizes from 1e-60 to 1e60 behave
/// alike.
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

/// Replaces the best point by the candidate if that is closer. A NaN makes the comparison false.
inline void keepCloser(const Eigen::Vector3d& point, unsigned subset, ClosestOnSimplex& best)
{
    const double length2 = point.squaredNorm();
    if (length2 < best.length2)
        best = {point, length2, subset, false};
}

/// Examines all three regions of the segment i, j. A segment of length zero counts as its first point.
inline void considerSegment(const SimplexPoints& p, int i, int j, ClosestOnSimplex& best)
{
    const Eigen::Vector3d edge = p[j] - p[i];
    const double along = -p[i].dot(edge);
    const double length2 = edge.squaredNorm();
    // The negated form sends a segment of length zero into the first branch.
    if (!(along > 0.0))
        keepCloser(p[i], 1u << i, best);
    else if (along >= length2)
        keepCloser(p[j], 1u << j, best);
    else
        keepCloser(p[i] + (along / length2) * edge, (1u << i) | (1u << j), best);
}

/// Examines the inside region of the triangle i, j, k if the origin projects into it.
///
/// @return false when the origin projects outside, or the triangle is so thin that its normal is mostly rounding
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
    // The product of p[i] and the normal is accurate where the weighted sum of the points would cancel.
    keepCloser(normal * (p[i].dot(normal) / area2), (1u << i) | (1u << j) | (1u << k), best);
    return true;
}

/// Examines all seven regions of the triangle i, j, k.
inline void considerTriangle(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& best)
{
    if (considerInside(p, i, j, k, best))
        return;
    considerSegment(p, i, j, best);
    considerSegment(p, j, k, best);
    considerSegment(p, k, i, best);
}

/// Examines the four regions of the triangle i, j, k that have the newest point k: vertex, two edges, inside.
inline void considerTriangleNewest(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& best)
{
    if (considerInside(p, i, j, k, best))
        return;
    considerSegment(p, k, i, best);
    considerSegment(p, k, j, best);
}

/// Two vectors, one in each lane.
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
    bool isFlat;       ///< the volume is zero within rounding: the sides are not valid
};

/// Two faces at a time. The lanes are filled from the points, since vectors read back from memory would wait for their
/// stores.
inline TetrahedronSides tetrahedronSides(const SimplexPoints& p)
{
    using Lane = VectorPair::Lane;
    const VectorPair p33(p[3], p[3]), p30(p[3], p[0]), p12(p[1], p[2]);
    // a, b and c are the edges from point 3 to points 0, 1 and 2.
    const VectorPair bAndC = p12 - p33;
    const VectorPair cAndA = VectorPair(p[2], p[0]) - p33;
    const VectorPair aAndEdge1 = VectorPair(p[0], p[1]) - p30;
    const VectorPair bAndEdge2 = p12 - p30;
    const VectorPair normals01 = bAndC.cross(cAndA), normals23 = aAndEdge1.cross(bAndEdge2);
    const double volume = aAndEdge1.dot(normals01)[0];
    // 1e-28 of the product of squared lengths: a relative height of 1e-14.
    const Lane lengths2 = bAndC.dot(bAndC);
    const double size2 = aAndEdge1.dot(aAndEdge1)[0] * lengths2[0] * lengths2[1];
    // 1e-30 of the products with the squared coordinates, whose rounding moves a point towards a face or away from it.
    const Lane normals2 = largerOf(normals01.dot(normals01), normals23.dot(normals23));
    const Lane points2 = largerOf(p12.dot(p12), p30.dot(p30));
    const double noise2 = std::max(normals2[0], normals2[1]) * std::max(points2[0], points2[1]);
    // Barycentric weights of the origin times the volume. The last weight is computed from its own face: the volume
    // minus the other weights would inherit their rounding errors.
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
        // In exact arithmetic the face without the newest point needs no test; after rounding it may be the only one
        // outside.
        if (kNewestOnly && face != 3 && !sides.isFlat)
            considerTriangleNewest(p, i, j, k, best);
        else
            considerTriangle(p, i, j, k, best);
    }
    best.isInside = isInside;
}

/// Result before the first region: infinitely far, with the subset to return if no region is found.
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

/// closestOnSimplex() for a last point that is the newest support point: examines only regions that have it (1 of 1, 2
/// of 3, 4 of 7, 7 of 14), and the face without it for a tetrahedron.
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

/// Barycentric weights of the closest point, for the smallest subset of one to three points: not negative, sum 1, in
/// the order of `points`, 0 outside of the subset.
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
