// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

/// Distance or depth of the convex hulls of a few points by trying every direction in which it can lie, in long double:
/// no search, no simplex, no faces.
namespace cullet::test
{
using LongVector = Eigen::Matrix<long double, 3, 1>;
using LongMatrix = Eigen::Matrix<long double, 3, 3>;
using LongPoints = std::vector<LongVector>;

/// How far a hull reaches along a direction.
struct Reach
{
    Reach(const LongPoints& points, const LongVector& direction)
    {
        for (const LongVector& point : points)
        {
            const long double at = direction.dot(point);
            lowest = std::min(lowest, at);
            highest = std::max(highest, at);
        }
    }
    long double lowest = std::numeric_limits<long double>::infinity();
    long double highest = -lowest;
};

/// The gap of A and B along a direction from B to A; negative: how deep they overlap along it.
inline long double gapAlong(const LongPoints& a, const LongPoints& b, const LongVector& direction)
{
    return (Reach(a, direction).lowest - Reach(b, direction).highest) / direction.norm();
}

/// The largest gap over all directions: the distance of the hulls, or minus their depth.
///
/// Every direction bounds it from below. It is reached along the line between two points, the perpendicular of a point
/// on an edge, or the normal of three points of one hull or of two edges. Edges are all pairs of points, and planes all
/// triples.
class SignedDistance
{
public:
    /// @param size of both hulls, to tell directions from rounding
    SignedDistance(const LongPoints& a, const LongPoints& b, long double size)
        : m_a(a), m_b(b), m_least(1e-14L * size)
    {
        const std::vector<Edge> edgesA = edgesOf(a), edgesB = edgesOf(b);
        for (const LongVector& p : a)
        {
            for (const LongVector& q : b)
                tryDirection(p - q, m_least);
        }
        tryPerpendiculars(edgesA, b);
        tryPerpendiculars(edgesB, a);
        for (const Edge& edge : edgesA)
        {
            for (const Edge& other : edgesB)
                tryAcross(edge.along.cross(other.along), kLeastSine);
        }
        tryPlanes(edgesA);
        tryPlanes(edgesB);
    }

    /// Length unit of the points.
    long double gap() const { return m_isInLine ? std::max(m_gap, 0.0L) : m_gap; }
    /// From B to A, unit; zero if there is none.
    const LongVector& normal() const { return m_normal; }

private:
    struct Edge
    {
        LongVector from, along;  ///< a point, and the unit vector towards another
    };

    static constexpr long double kLeastSine = 1e-9L;

    std::vector<Edge> edgesOf(const LongPoints& points) const
    {
        std::vector<Edge> edges;
        for (std::size_t i = 0; i < points.size(); ++i)
        {
            for (std::size_t j = i + 1; j < points.size(); ++j)
            {
                const LongVector along = points[j] - points[i];
                if (along.norm() > m_least)
                    edges.push_back({points[i], along.normalized()});
            }
        }
        return edges;
    }

    void tryPerpendiculars(const std::vector<Edge>& edges, const LongPoints& others)
    {
        for (const Edge& edge : edges)
        {
            for (const LongVector& q : others)
            {
                const LongVector between = q - edge.from;
                tryAcross(between - between.dot(edge.along) * edge.along, m_least);
            }
        }
    }

    /// Edges with a common start span the planes of all triples.
    void tryPlanes(const std::vector<Edge>& edges)
    {
        for (std::size_t i = 0; i < edges.size(); ++i)
        {
            for (std::size_t j = i + 1; j < edges.size() && edges[j].from == edges[i].from; ++j)
                tryAcross(edges[i].along.cross(edges[j].along), kLeastSine);
        }
    }

    /// A direction across a line in which points of A and B lie.
    void tryAcross(const LongVector& direction, long double least)
    {
        if (!(direction.norm() > least))
            return;
        // Hulls in one line overlap along it, but have no depth.
        m_isInLine = false;
        tryDirection(direction, least);
    }

    /// @param least a shorter direction is mostly rounding
    void tryDirection(const LongVector& direction, long double least)
    {
        if (!(direction.norm() > least))
            return;
        const LongVector unit = direction.normalized();
        const Reach ofA(m_a, unit), ofB(m_b, unit);
        keepLarger(unit, ofA.lowest - ofB.highest);
        keepLarger(-unit, ofB.lowest - ofA.highest);
    }

    void keepLarger(const LongVector& unit, long double gap)
    {
        if (!(gap > m_gap))
            return;
        m_gap = gap;
        m_normal = unit;
    }

    const LongPoints& m_a;
    const LongPoints& m_b;
    const long double m_least;
    bool m_isInLine = true;
    long double m_gap = -std::numeric_limits<long double>::infinity();
    LongVector m_normal = LongVector::Zero();
};
}  // namespace cullet::test
