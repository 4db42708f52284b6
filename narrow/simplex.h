// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

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
/// Result of a solver. Weights are those of the points of the simplex in their order, 0 outside of the subset.
struct ClosestOnSimplex
{
    Eigen::Vector3d point;          ///< closest point to the origin; meaningless if isInside
    std::array<double, 4> weights;  ///< barycentric: not negative, sum 1; meaningless if isInside
    unsigned subset = 0;            ///< bit i: point i is needed; the smallest subset whose hull has `point`
    bool isInside = false;          ///< the origin is inside the tetrahedron, or on its surface
};

using SimplexPoints = std::array<Eigen::Vector3d, 4>;

inline ClosestOnSimplex closestOnVertex(const SimplexPoints& p, int i)
{
    ClosestOnSimplex result = {p[i], {}, 1u << i};
    result.weights[i] = 1.0;
    return result;
}

/// All three regions of the segment i, j. A segment without length is its first point.
inline ClosestOnSimplex closestOnSegment(const SimplexPoints& p, int i, int j)
{
    const Eigen::Vector3d edge = p[j] - p[i];
    const double along = -p[i].dot(edge);
    const double length2 = edge.squaredNorm();
    // Written so that a NaN or a segment without length ends in the first branch.
    if (!(along > 0.0))
        return closestOnVertex(p, i);
    if (along >= length2)
        return closestOnVertex(p, j);
    const double t = along / length2;
    ClosestOnSimplex result = {p[i] + t * edge, {}, (1u << i) | (1u << j)};
    result.weights[i] = 1.0 - t;
    result.weights[j] = t;
    return result;
}

inline const ClosestOnSimplex& closer(const ClosestOnSimplex& l, const ClosestOnSimplex& r)
{
    return r.point.squaredNorm() < l.point.squaredNorm() ? r : l;
}

/// The inside region of the triangle i, j, k if the origin projects into it.
///
/// @return false when the origin projects outside, or the triangle is too thin for its normal to mean anything
inline bool closestInsideTriangle(const SimplexPoints& p, int i, int j, int k, ClosestOnSimplex& result)
{
    const Eigen::Vector3d ij = p[j] - p[i];
    const Eigen::Vector3d ik = p[k] - p[i];
    const Eigen::Vector3d normal = ij.cross(ik);
    const double area2 = normal.squaredNorm();
    // 1e-28: a relative height of 1e-14, some 50 roundings.
    if (!(area2 > 1e-28 * ij.squaredNorm() * ik.squaredNorm()))
        return false;
    const double wj = normal.dot(ik.cross(p[i]));
    const double wk = normal.dot(p[i].cross(ij));
    const double wi = area2 - wj - wk;
    if (!(wi > 0.0 && wj > 0.0 && wk > 0.0))
        return false;
    // Along the normal: p[i] times the normal is exact enough where the weighted sum would cancel.
    result.point = normal * (p[i].dot(normal) / area2);
    result.weights = {};
    result.weights[i] = wi / area2;
    result.weights[j] = wj / area2;
    result.weights[k] = wk / area2;
    result.subset = (1u << i) | (1u << j) | (1u << k);
    result.isInside = false;
    return true;
}

/// All seven regions of the triangle i, j, k.
inline ClosestOnSimplex closestOnTriangle(const SimplexPoints& p, int i, int j, int k)
{
    ClosestOnSimplex result;
    if (closestInsideTriangle(p, i, j, k, result))
        return result;
    const ClosestOnSimplex ij = closestOnSegment(p, i, j);
    const ClosestOnSimplex jk = closestOnSegment(p, j, k);
    const ClosestOnSimplex ki = closestOnSegment(p, k, i);
    return closer(closer(ij, jk), ki);
}

/// The four regions of the triangle i, j, k that have the newest point k: vertex, two edges, inside.
inline ClosestOnSimplex closestOnTriangleNewest(const SimplexPoints& p, int i, int j, int k)
{
    ClosestOnSimplex result;
    if (closestInsideTriangle(p, i, j, k, result))
        return result;
    const ClosestOnSimplex ki = closestOnSegment(p, k, i);
    const ClosestOnSimplex kj = closestOnSegment(p, k, j);
    return closer(ki, kj);
}

/// Sides of the faces of a tetrahedron on which the origin lies; face f is opposite to point f.
struct TetrahedronSides
{
    std::array<bool, 4> isOutside;
    bool isFlat;  ///< the volume is within rounding of zero: the sides mean nothing
};

inline TetrahedronSides tetrahedronSides(const SimplexPoints& p)
{
    const Eigen::Vector3d a = p[0] - p[3];
    const Eigen::Vector3d b = p[1] - p[3];
    const Eigen::Vector3d c = p[2] - p[3];
    const Eigen::Vector3d bc = b.cross(c);
    const Eigen::Vector3d ca = c.cross(a);
    const Eigen::Vector3d ab = a.cross(b);
    const double volume = a.dot(bc);
    // 1e-28 of the product of squared lengths: a relative height of 1e-14.
    const double size2 = a.squaredNorm() * b.squaredNorm() * c.squaredNorm();
    // Barycentric weights of the origin times the volume.
    const double wa = -p[3].dot(bc);
    const double wb = -p[3].dot(ca);
    const double wc = -p[3].dot(ab);
    // The last weight from its own face: volume - wa - wb - wc would lose what the others have lost.
    const double wd = p[0].dot((p[1] - p[0]).cross(p[2] - p[0]));
    const double sign = volume < 0.0 ? -1.0 : 1.0;
    return {{sign * wa < 0.0, sign * wb < 0.0, sign * wc < 0.0, sign * wd < 0.0},
            !(volume * volume > 1e-28 * size2)};
}

/// Points of the face opposite to point f.
inline constexpr std::array<std::array<int, 3>, 4> kTetrahedronFaces = {
    {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}};

template <bool kNewestOnly>
ClosestOnSimplex closestOnTetrahedron(const SimplexPoints& p)
{
    const TetrahedronSides sides = tetrahedronSides(p);
    ClosestOnSimplex best;
    double bestLength2 = std::numeric_limits<double>::infinity();
    best.isInside = true;
    for (int face = 0; face < 4; ++face)
    {
        if (!sides.isOutside[face] && !sides.isFlat)
            continue;
        const auto [i, j, k] = kTetrahedronFaces[face];
        // The face without the newest point is left out in exact arithmetic; rounding can make it the only one.
        const ClosestOnSimplex candidate = kNewestOnly && face != 3 && !sides.isFlat
                                               ? closestOnTriangleNewest(p, i, j, k)
                                               : closestOnTriangle(p, i, j, k);
        const double length2 = candidate.point.squaredNorm();
        if (length2 < bestLength2)
        {
            best = candidate;
            bestLength2 = length2;
        }
    }
    return best;
}

/// Closest point on the first `count` points, examining every region.
/// @pre 1 <= count <= 4
inline ClosestOnSimplex closestOnSimplex(const SimplexPoints& points, int count)
{
    switch (count)
    {
        case 1:
            return closestOnVertex(points, 0);
        case 2:
            return closestOnSegment(points, 0, 1);
        case 3:
            return closestOnTriangle(points, 0, 1, 2);
        default:
            return closestOnTetrahedron<false>(points);
    }
}

/// The same when the last point is the newest support point: only regions that have it (1 of 1, 2 of 3, 4 of 7, 7 of
/// 14), plus one check of the face without it for a tetrahedron.
/// @pre 1 <= count <= 4; the last point was found as the support point opposite to the closest point of the others
inline ClosestOnSimplex closestOnSimplexNewest(const SimplexPoints& points, int count)
{
    switch (count)
    {
        case 1:
            return closestOnVertex(points, 0);
        case 2:
            return closestOnSegment(points, 1, 0);
        case 3:
            return closestOnTriangleNewest(points, 0, 1, 2);
        default:
            return closestOnTetrahedron<true>(points);
    }
}
}  // namespace cullet
