// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/exact_penetration.h"
#include "narrow/gjk_search.h"
#include "narrow/gjk_types.h"
#include "narrow/polytope.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace cullet
{
/// How a depth was found.
enum class PenetrationMethod : std::uint8_t
{
    None,       ///< no depth: the shapes do not overlap, or the state is NotConverged
    Expansion,  ///< expanding polytope, proved by its dual gap
    Exact,      ///< all faces and pairs of edges, after the expansion could not prove its answer
    Flat        ///< the Minkowski difference has no volume: depth 0 along its normal
};

template <class S>
struct PenetrationResult
{
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// Overlapping, and all else is valid; or what the distance query would say, and nothing else is.
    GjkState state = GjkState::NotConverged;
    PenetrationMethod method = PenetrationMethod::None;
    std::int32_t iterations = 0;   ///< points added to the polytope
    S depth = S(0);                ///< length of the shortest translation of A that leaves a touching contact
    S dualGap = S(0);              ///< the true depth is between depth - dualGap and depth
    Vector axis = Vector::Zero();  ///< unit, from B to A, world axes: A moved by depth * axis only touches
    Vector pointA = Vector::Zero();  ///< deepest point of A, world axes, relative to the origin of A
    Vector pointB = Vector::Zero();  ///< deepest point of B, same frame; pointB - pointA = depth * axis
};

/// Expanding polytope algorithm on one pair.
template <class S, class A, class B>
class Penetration
{
public:
    Penetration(const A& a, const B& b, GjkCache<S>& cache) : m_a(a), m_b(b), m_search(a, b), m_cache(cache)
    {
    }

    PenetrationResult<S> run()
    {
        m_result.state = enclose();
        if (m_result.state != GjkState::Overlapping)
            return m_result;
        Eigen::Vector3d normal;
        if (!completeTetrahedron(normal))
            return finishFlat(normal);
        if (!expand())
            solveExactly();
        return m_result;
    }

private:
    using Search = GjkSearch<A, B>;
    using Support = typename Search::Support;

    /// The certified gap up to which an expansion goes on, and up to which it is accepted when it cannot; times the size.
    static constexpr double kGapWanted = 1e-7;
    static constexpr double kGapAccepted = 1e-5;
    /// Times the size: extents below this have no volume in double.
    static constexpr double kFlat = 1e-10;

    /// A simplex with the origin in it: the remembered tetrahedron, or a search without axis tests.
    GjkState enclose()
    {
        if (!(m_cache.count == 4 && m_search.seed(m_cache, nullptr)))
            m_search.start(m_search.supportAgainst(m_search.centreDifference()));
        for (int i = 0; i < kGjkIterationLimit; ++i)
        {
            if (!m_search.isFinite())
                return GjkState::NotConverged;
            if (m_search.isTouching())
            {
                m_search.remember(GjkState::Overlapping, m_cache);
                return GjkState::Overlapping;
            }
            const Eigen::Vector3d v = m_search.closest();
            const Support s = m_search.supportAgainst(v);
            if (v.dot(s.w) > 0.0)
                return GjkState::Separated;
            if (m_search.has(s) || !m_search.advance(s))
                break;
        }
        const double upper2 = m_search.length2();
        return m_search.isFinite() && upper2 <= kGjkAccuracy * kGjkAccuracy * m_search.size2()
                   ? GjkState::Overlapping
                   : GjkState::NotConverged;
    }

    double size() const { return std::sqrt(m_search.size2()); }

    /// Adds support points until four span space. The origin stays in the hull of the first ones, hence of all.
    ///
    /// @param normal [out] unit direction without extent, if false is returned
    bool completeTetrahedron(Eigen::Vector3d& normal)
    {
        int count = m_search.count();
        for (int i = 0; i < count; ++i)
            m_seed[i] = m_search.support(i);
        const double flat = kFlat * size();
        normal = Eigen::Vector3d::UnitX();
        if (count == 1 && !addFarthest(count, {1.0, 0.0, 0.0}, flat) &&
            !addFarthest(count, {0.0, 1.0, 0.0}, flat) && !addFarthest(count, {0.0, 0.0, 1.0}, flat))
            return false;
        if (count == 2)
        {
            const Eigen::Vector3d side = (m_seed[1].w - m_seed[0].w).stableNormalized().unitOrthogonal();
            const Eigen::Vector3d other = (m_seed[1].w - m_seed[0].w).stableNormalized().cross(side);
            normal = side;
            if (!addFarthest(count, side, flat) && !addFarthest(count, other, flat))
                return false;
        }
        if (count == 3)
        {
            normal = (m_seed[1].w - m_seed[0].w).cross(m_seed[2].w - m_seed[0].w).stableNormalized();
            return addFarthest(count, normal, flat);
        }
        return true;
    }

    /// The support point along +way or -way, whichever is farther from the points so far; their extent along it is 0.
    bool addFarthest(int& count, const Eigen::Vector3d& way, double flat)
    {
        const Support up = m_search.supportAgainst(-way);
        const Support down = m_search.supportAgainst(way);
        const double high = way.dot(up.w - m_seed[0].w);
        const double low = -way.dot(down.w - m_seed[0].w);
        if (!(std::max(high, low) > flat))
            return false;
        m_seed[count++] = high > low ? up : down;
        return true;
    }

    PenetrationResult<S> finishFlat(const Eigen::Vector3d& normal)
    {
        m_result.method = PenetrationMethod::Flat;
        m_result.axis = normal.template cast<S>();
        m_result.pointA = m_seed[0].a.template cast<S>();
        m_result.pointB = m_result.pointA;
        return m_result;
    }

    bool expand()
    {
        const double scale = size();
        Polytope polytope({m_seed[0].w, m_seed[1].w, m_seed[2].w, m_seed[3].w}, scale);
        std::array<Eigen::Vector3d, Polytope::kMaxVertices> pointsOfA;
        for (int i = 0; i < 4; ++i)
            pointsOfA[i] = m_seed[i].a;
        while (polytope.isValid())
        {
            const Polytope::Face face = polytope.closestFace();
            const Support s = m_search.supportAgainst(-face.normal);
            const double gap = face.normal.dot(s.w) - face.distance;
            const bool isDone = gap <= kGapWanted * scale;
            const int vertex = isDone ? -1 : polytope.add(s.w);
            if (vertex >= 0)
            {
                pointsOfA[vertex] = s.a;
                ++m_result.iterations;
                continue;
            }
            // A NaN makes the comparison false.
            if (!(gap <= kGapAccepted * scale))
                return false;
            store(face.normal, face.distance + std::max(gap, 0.0), std::max(gap, 0.0));
            const Eigen::Vector3d weights = polytope.weights(face);
            Eigen::Vector3d pointA = Eigen::Vector3d::Zero();
            for (int k = 0; k < 3; ++k)
                pointA += weights[k] * pointsOfA[face.vertex[k]];
            storePoints(pointA);
            m_result.method = PenetrationMethod::Expansion;
            return true;
        }
        return false;
    }

    /// @param normal outer normal of A - B, along which B comes out
    void store(const Eigen::Vector3d& normal, double depth, double gap)
    {
        m_result.depth = static_cast<S>(std::max(depth, 0.0));
        m_result.dualGap = static_cast<S>(gap);
        m_result.axis = (-normal).template cast<S>();
    }

    void storePoints(const Eigen::Vector3d& pointA)
    {
        m_result.pointA = pointA.template cast<S>();
        m_result.pointB = m_result.pointA + m_result.depth * m_result.axis;
    }

    void solveExactly()
    {
        Eigen::Vector3d normal;
        double depth;
        if (!exactPenetration(m_a, m_b, normal, depth))
        {
            m_result = PenetrationResult<S>();
            return;
        }
        store(normal, depth, 0.0);
        const Support s = m_search.supportAgainst(-normal);
        storePoints(s.a);
        m_result.method = PenetrationMethod::Exact;
    }

    const A& m_a;
    const B& m_b;
    Search m_search;
    GjkCache<S>& m_cache;
    std::array<Support, 4> m_seed;
    PenetrationResult<S> m_result;
};

/// Penetration depth and deepest points of two overlapping convex shapes.
///
/// Van den Bergen 2001, "Proximity Queries and Penetration Depth Computation on 3D Game Objects" (EPA), in double,
/// started from the tetrahedron that the cache remembers. Two differences: an answer counts only with its dual gap, the
/// support along the normal minus the distance of the closest face, which bounds the error from both sides; and without
/// such a proof all faces and pairs of edges are examined (exact_penetration.h, hulls only).
///
/// @param cache of this pair in this order, best after a query that said Overlapping
/// Cost: about one support of each shape and a scan of the polytope's faces per point, 5 to 60 points.
/// Errors: NotConverged for shapes that are no hulls when the expansion fails, and for inputs that are not finite.
template <class S, class A, class B>
PenetrationResult<S> penetration(const A& a, const B& b, GjkCache<S>& cache)
{
    return Penetration<S, A, B>(a, b, cache).run();
}
}  // namespace cullet
