// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <vector>

/// Distance, depth and facets of small sets of lattice points, by trying every direction that can be the answer. All
/// signs are exact: coordinates of at most 2^13 keep every product below 2^60.
namespace cullet::test
{
template <class T>
using Vector3 = std::array<T, 3>;
using Lattice = Vector3<std::int64_t>;
using LatticePoints = std::vector<Lattice>;

template <class T>
Vector3<T> minus(const Vector3<T>& a, const Vector3<T>& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

template <class T>
T dot(const Vector3<T>& a, const Vector3<T>& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
Vector3<T> cross(const Vector3<T>& a, const Vector3<T>& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class T>
bool isZero(const Vector3<T>& a)
{
    return a[0] == T(0) && a[1] == T(0) && a[2] == T(0);
}

template <class T>
long double lengthOf(const Vector3<T>& a)
{
    const auto at = [&a](std::size_t i) { return static_cast<long double>(a[i]); };
    return std::sqrt(at(0) * at(0) + at(1) * at(1) + at(2) * at(2));
}

template <class T>
T lowest(const std::vector<Vector3<T>>& points, const Vector3<T>& direction)
{
    T least = dot(points[0], direction);
    for (const Vector3<T>& point : points)
        least = std::min(least, dot(point, direction));
    return least;
}

template <class T>
T highest(const std::vector<Vector3<T>>& points, const Vector3<T>& direction)
{
    T most = dot(points[0], direction);
    for (const Vector3<T>& point : points)
        most = std::max(most, dot(point, direction));
    return most;
}

/// The vectors between all points, one of each pair of opposite ones.
template <class T>
std::vector<Vector3<T>> edgesOf(const std::vector<Vector3<T>>& points)
{
    std::vector<Vector3<T>> edges;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
        for (std::size_t j = 0; j < i; ++j)
        {
            const Vector3<T> edge = minus(points[i], points[j]);
            if (!isZero(edge))
                edges.push_back(edge);
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

/// Calls `see` with a normal of every plane through three points of A or of B, or along an edge of each.
template <class T, class See>
void forEachNormal(const std::vector<Vector3<T>>& a, const std::vector<Vector3<T>>& b, const See& see)
{
    const std::vector<Vector3<T>> edgesA = edgesOf(a), edgesB = edgesOf(b);
    const auto seeAll = [&see](const auto& first, const auto& second)
    {
        for (const auto& e : first)
        {
            for (const auto& f : second)
            {
                const auto normal = cross(e, f);
                if (!isZero(normal))
                    see(normal);
            }
        }
    };
    seeAll(edgesA, edgesB);
    for (const auto* points : {&a, &b})
    {
        for (std::size_t i = 0; i < points->size(); ++i)
        {
            const Vector3<T>& origin = (*points)[i];
            for (std::size_t j = 0; j < i; ++j)
            {
                for (std::size_t k = 0; k < j; ++k)
                {
                    const auto normal = cross(minus((*points)[j], origin), minus((*points)[k], origin));
                    if (!isZero(normal))
                        see(normal);
                }
            }
        }
    }
}

/// What is true of A - B, in units of the lattice.
struct LatticeTruth
{
    bool isSeparated = false;  ///< exact
    bool isFlat = true;        ///< A - B has no volume
    long double distance = 0;  ///< 0 where not separated
    long double depth = 0;     ///< 0 where separated or flat
    long double size = 0;      ///< largest length of a point of A - B
};

/// The distance is the largest gap along any direction; one that has it is perpendicular to a face or an edge of A - B,
/// or leads to a corner. The depth is the least extent along a normal of a face.
template <class T>
LatticeTruth solveLattice(const std::vector<Vector3<T>>& a, const std::vector<Vector3<T>>& b)
{
    LatticeTruth truth;
    long double gap = -1, depth = std::numeric_limits<long double>::infinity();
    const auto seeGap = [&](const Vector3<T>& direction)
    {
        const T along = lowest(a, direction) - highest(b, direction);
        if (along > T(0))
            gap = std::max(gap, static_cast<long double>(along) / lengthOf(direction));
    };
    const auto seeNormal = [&](const Vector3<T>& normal)
    {
        const T gapUp = lowest(a, normal) - highest(b, normal);
        const T gapDown = lowest(b, normal) - highest(a, normal);
        const long double length = lengthOf(normal);
        gap = std::max(gap, static_cast<long double>(std::max(gapUp, gapDown)) / length);
        depth = std::min(depth, static_cast<long double>(std::min(-gapUp, -gapDown)) / length);
        truth.isFlat = truth.isFlat && gapUp == -gapDown;
    };
    forEachNormal(a, b, seeNormal);
    std::vector<Vector3<T>> edges = edgesOf(a);
    const std::vector<Vector3<T>> edgesB = edgesOf(b);
    edges.insert(edges.end(), edgesB.begin(), edgesB.end());
    for (const Vector3<T>& p : a)
    {
        for (const Vector3<T>& q : b)
        {
            const Vector3<T> w = minus(p, q);
            truth.size = std::max(truth.size, lengthOf(w));
            if (isZero(w))
                continue;
            seeGap(w);
            for (const Vector3<T>& e : edges)
            {
                const T ee = dot(e, e), we = dot(w, e);
                const Vector3<T> across = {w[0] * ee - e[0] * we, w[1] * ee - e[1] * we,
                                           w[2] * ee - e[2] * we};
                if (!isZero(across))
                    seeGap(across);
            }
        }
    }
    truth.isSeparated = gap > 0;
    truth.distance = truth.isSeparated ? gap : 0;
    truth.depth = truth.isSeparated || truth.isFlat ? 0 : depth;
    return truth;
}

/// Dimension of the span of points: 0 to 3.
inline int dimensionOf(const LatticePoints& points)
{
    int dimension = 0;
    Lattice first = {}, normal = {};
    for (const Lattice& point : points)
    {
        const Lattice e = minus(point, points[0]);
        if (dimension == 0 && !isZero(e))
        {
            first = e;
            dimension = 1;
        }
        else if (dimension == 1 && !isZero(cross(first, e)))
        {
            normal = cross(first, e);
            dimension = 2;
        }
        else if (dimension == 2 && dot(normal, e) != 0)
            return 3;
    }
    return dimension;
}

/// The corners of the hull of points in a plane: each has a line through it and another point with all other points on
/// one side, or beyond.
inline std::set<std::int32_t> cornersAmong(const LatticePoints& points, const std::vector<std::int32_t>& flat,
                                           const Lattice& normal)
{
    std::set<std::int32_t> corners;
    for (const std::int32_t p : flat)
    {
        const auto isExtreme = [&](std::int32_t q)
        {
            const Lattice edge = minus(points[q], points[p]);
            return q != p && std::all_of(flat.begin(), flat.end(),
                                         [&](std::int32_t x)
                                         {
                                             const Lattice other = minus(points[x], points[p]);
                                             const std::int64_t side = dot(normal, cross(edge, other));
                                             return x == p || side > 0 || (side == 0 && dot(edge, other) > 0);
                                         });
        };
        if (std::any_of(flat.begin(), flat.end(), isExtreme))
            corners.insert(p);
    }
    return corners;
}

/// The facets of the hull of distinct points that span space: corners as indices of the points, and an outer normal of
/// any length.
using Facets = std::map<std::set<std::int32_t>, Lattice>;

inline void addFacet(const LatticePoints& points, const Lattice& normal, Facets& facets)
{
    const std::int64_t offset = highest(points, normal);
    std::vector<std::int32_t> flat;
    for (std::size_t p = 0; p < points.size(); ++p)
    {
        if (dot(normal, points[p]) == offset)
            flat.push_back(static_cast<std::int32_t>(p));
    }
    const std::set<std::int32_t> corners = cornersAmong(points, flat, normal);
    if (corners.size() > 2)
        facets[corners] = normal;
}

inline Facets facetsOf(const LatticePoints& points)
{
    Facets facets;
    forEachNormal(points, {},
                  [&](const Lattice& normal)
                  {
                      addFacet(points, normal, facets);
                      addFacet(points, {-normal[0], -normal[1], -normal[2]}, facets);
                  });
    return facets;
}
}  // namespace cullet::test
