// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <LinearMath/btTransform.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <vector>

namespace cullet::test
{
/// Distances of convex hulls of a few points from triangles, by brute force in 64 bits of mantissa.
namespace oracle
{
using Point = std::array<long double, 3>;
using Points = std::vector<Point>;

inline Point pointOf(const btVector3& v)
{
    return {{v.x(), v.y(), v.z()}};
}
inline Point minus(const Point& a, const Point& b)
{
    return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}
inline Point along(const Point& from, const Point& way, long double share)
{
    return {{from[0] + share * way[0], from[1] + share * way[1], from[2] + share * way[2]}};
}
inline long double dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b)
{
    return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

inline long double shareWithin(long double numerator, long double denominator)
{
    return denominator > 0 ? std::clamp(numerator / denominator, 0.0L, 1.0L) : 0.0L;
}

inline long double pointFromEdge2(const Point& p, const Point& a, const Point& b)
{
    const Point edge = minus(b, a);
    const Point apart = minus(along(a, edge, shareWithin(dot(minus(p, a), edge), dot(edge, edge))), p);
    return dot(apart, apart);
}

/// Squared distance of two segments: where they cross within both, else at an end.
inline long double edgeFromEdge2(const Point& a, const Point& b, const Point& c, const Point& d)
{
    long double least = std::min(
        {pointFromEdge2(a, c, d), pointFromEdge2(b, c, d), pointFromEdge2(c, a, b), pointFromEdge2(d, a, b)});
    const Point u = minus(b, a), v = minus(d, c), w = minus(c, a), normal = cross(u, v);
    const long double across2 = dot(normal, normal);
    const long double s = dot(cross(w, v), normal), t = dot(cross(w, u), normal);
    if (across2 > 0 && s >= 0 && s <= across2 && t >= 0 && t <= across2)
    {
        const long double height = dot(w, normal);
        least = std::min(least, height * height / across2);
    }
    return least;
}

/// Squared height of a point over a triangle, if its foot is within; else infinity.
inline long double pointOverFace2(const Point& p, const Point& a, const Point& b, const Point& c)
{
    constexpr long double kNone = std::numeric_limits<long double>::infinity();
    const Point normal = cross(minus(b, a), minus(c, a));
    const long double length2 = dot(normal, normal);
    if (!(length2 > 0))
        return kNone;
    const Point* const corners[] = {&a, &b, &c};
    for (int i = 0; i < 3; ++i)
    {
        const Point &from = *corners[i], &to = *corners[(i + 1) % 3];
        if (dot(cross(normal, minus(to, from)), minus(p, from)) < 0)
            return kNone;
    }
    const long double height = dot(minus(p, a), normal);
    return height * height / length2;
}

/// Whether an edge crosses the inside of a triangle.
inline bool doesEdgeCross(const Point& from, const Point& to, const Point& a, const Point& b, const Point& c)
{
    const auto side = [&](const Point& p, const Point& q, const Point& r, const Point& s)
    { return dot(minus(s, p), cross(minus(q, p), minus(r, p))); };
    if (!(side(a, b, c, from) * side(a, b, c, to) < 0))
        return false;
    const long double first = side(from, to, a, b), second = side(from, to, b, c),
                      third = side(from, to, c, a);
    return (first > 0 && second > 0 && third > 0) || (first < 0 && second < 0 && third < 0);
}

/// Whether a point is in the hull: in a tetrahedron of four of its points.
inline bool isInside(const Points& hull, const Point& p)
{
    const auto volume = [](const Point& a, const Point& b, const Point& c, const Point& d)
    { return dot(minus(d, a), cross(minus(b, a), minus(c, a))); };
    const std::size_t count = hull.size();
    for (std::size_t i = 0; i < count; ++i)
    {
        for (std::size_t k = i + 1; k < count; ++k)
        {
            for (std::size_t m = k + 1; m < count; ++m)
            {
                for (std::size_t n = m + 1; n < count; ++n)
                {
                    const long double all = volume(hull[i], hull[k], hull[m], hull[n]);
                    const long double parts[] = {
                        volume(p, hull[k], hull[m], hull[n]), volume(hull[i], p, hull[m], hull[n]),
                        volume(hull[i], hull[k], p, hull[n]), volume(hull[i], hull[k], hull[m], p)};
                    if (all != 0 && std::all_of(std::begin(parts), std::end(parts),
                                                [&](long double part) { return part * all >= 0; }))
                        return true;
                }
            }
        }
    }
    return false;
}

/// The distance of a hull of points from a triangle; 0 if they overlap.
///
/// Edges and faces are all pairs and triples of points: those inside of the hull are never closer than its surface.
inline long double distance(const Points& hull, const Point (&triangle)[3])
{
    long double least2 = std::numeric_limits<long double>::infinity();
    if (isInside(hull, triangle[0]))
        return 0;
    for (std::size_t i = 0; i < hull.size(); ++i)
    {
        least2 = std::min(least2, pointOverFace2(hull[i], triangle[0], triangle[1], triangle[2]));
        for (int c = 0; c < 3; ++c)
        {
            least2 = std::min(least2, pointFromEdge2(hull[i], triangle[c], triangle[(c + 1) % 3]));
            for (std::size_t k = i + 1; k < hull.size(); ++k)
            {
                least2 =
                    std::min(least2, edgeFromEdge2(hull[i], hull[k], triangle[c], triangle[(c + 1) % 3]));
                if (c == 0 && doesEdgeCross(hull[i], hull[k], triangle[0], triangle[1], triangle[2]))
                    return 0;
                for (std::size_t m = k + 1; m < hull.size(); ++m)
                {
                    if (doesEdgeCross(triangle[c], triangle[(c + 1) % 3], hull[i], hull[k], hull[m]))
                        return 0;
                    least2 = std::min(least2, pointOverFace2(triangle[c], hull[i], hull[k], hull[m]));
                }
            }
        }
    }
    return std::sqrt(least2);
}
}  // namespace oracle
}  // namespace cullet::test
