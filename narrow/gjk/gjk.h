// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/corner_cone.h"
#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/isa_gjk.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace cullet
{
/// Stores the closest points, whose difference is v.
template <class S>
[[gnu::always_inline]] inline void storePoints(const Eigen::Vector3d& v, double distance,
                                               const Eigen::Vector3d& pointA, GjkResult<S>& result)
{
    result.distance = static_cast<S>(distance);
    result.pointA = pointA.template cast<S>();
    result.pointB = (pointA - v).template cast<S>();
}

/// GJK: the distance between two convex shapes, up to maxDistance.
template <class S, class A, class B, class Observer>
class GjkDistance
{
public:
    GjkDistance(const A& a, const B& b, S maxDistance, GjkCache<S>& cache, Observer& observer)
        : m_search(a, b),
          m_limit(maxDistance > S(0) ? static_cast<double>(maxDistance) : 0.0),
          m_cache(cache),
          m_observer(observer)
    {
    }

    /// @param result [in, out] default-constructed
    void run(GjkStart start, GjkResult<S>& result)
    {
        const bool isSeeded = start == GjkStart::Memory && m_search.seed(m_cache, nullptr);
        m_isLikelyDone =
            isSeeded && (m_cache.state == GjkState::Near || m_cache.state == GjkState::Separated);
        if (start == GjkStart::FourDirections)
            m_search.startFromFour([this](const Eigen::Vector3d& v, const Support& s) { return see(v, s); });
        else if (!isSeeded)
            startFromAxis();
        if (isSeeded && m_search.isFinite() && m_search.isInside() && m_cache.count == 4 &&
            m_cache.state == GjkState::Overlapping)
        {
            result.state = GjkState::Overlapping;
            return;
        }
        iterate(result);
    }

private:
    using Search = GjkSearch<A, B>;
    using Support = typename Search::Support;

    struct Level
    {
        Search search;
        Support support;
        double lower;  ///< bound of the distance
    };

    void startFromAxis()
    {
        const Eigen::Vector3d axis(m_cache.axis[0], m_cache.axis[1], m_cache.axis[2]);
        const Eigen::Vector3d v = axis.isZero(0.0) ? m_search.centreDifference() : axis;
        const Support s = m_search.supportAgainst(v);
        see(v, s);
        m_search.start(s);
    }

    /// @return true
    bool see(const Eigen::Vector3d& v, const Support& s)
    {
        m_observer(v, v.dot(s.w));
        return true;
    }

    void iterate(GjkResult<S>& result)
    {
        for (; m_iterations < kGjkIterationLimit; ++m_iterations)
        {
            if (m_search.isTouching())
                return finish(GjkState::Overlapping, nullptr, result);
            const Eigen::Vector3d v = m_search.closest();
            const Support s = m_isLikelyDone ? m_search.supportNearSimplex() : m_search.supportAgainst(v);
            const double along = v.dot(s.w);
            m_observer(v, along);
            if (along > 0.0 && along * along > m_limit * m_limit * m_search.length2())
                return finish(GjkState::Separated, &s, result);
            const bool isClose = m_search.length2() - along <= kRelativeGap * m_search.length2();
            if (isClose)
                return finish(GjkState::Near, &s, result);
            if (m_search.has(s) || (!m_search.advance(s) && !advanceLevel(s, along)))
                return finishStalled(s, along, result);
        }
        finish(GjkState::NotConverged, nullptr, result);
    }

    /// With the stalled simplex that has the best lower bound.
    void finishStalled(Support s, double along, GjkResult<S>& result)
    {
        if (m_best && m_best->lower > along / std::sqrt(m_search.length2()))
        {
            m_search.take(m_best->search);
            s = m_best->support;
            along = m_search.closest().dot(s.w);
        }
        finish(m_search.stalledState(along), &s, result);
    }

    /// Goes on where no length shows that the search comes closer to the origin: faces that are nearly level have many
    /// normals of nearly one distance. The one with the best lower bound of the distance counts in the end.
    ///
    /// @param s     support against the closest point
    /// @param along of the closest point and s
    bool advanceLevel(const Support& s, double along)
    {
        Search next = m_search;
        if (++m_levelSteps > kMostLevelSteps || !next.advanceLevel(s))
            return false;
        keepBest(s, along);
        m_search.take(next);
        const Support first = m_search.supportAgainst(m_search.closest());
        keepBest(first, m_search.closest().dot(first.w));
        return true;
    }

    void keepBest(const Support& s, double along)
    {
        const double lower = along / std::sqrt(m_search.length2());
        if (!m_best || lower > m_best->lower)
            m_best.emplace(Level{m_search, s, lower});
    }

    void finish(GjkState state, const Support* along, GjkResult<S>& result)
    {
        result.iterations = m_iterations;
        if (!m_search.rememberOutcome(state, along, m_cache))
            return;
        result.state = state;
        if (state != GjkState::Near && state != GjkState::Separated)
            return;
        const double distance = std::sqrt(m_search.length2());
        result.axis = (m_search.closest() * (1.0 / distance)).template cast<S>();
        if (state == GjkState::Separated)
            return;
        storePoints(m_search.closest(), distance, m_search.pointOfA(), result);
    }

    /// Of |v|^2: the relative error of the distance is at most 1e-12.
    static constexpr double kRelativeGap = 1e-12;
    /// Four are seldom needed; rounding might repeat them.
    static constexpr int kMostLevelSteps = 8;

    Search m_search;
    double m_limit;
    GjkCache<S>& m_cache;
    Observer& m_observer;
    std::int32_t m_iterations = 0;
    int m_levelSteps = 0;
    std::optional<Level> m_best;
    bool m_isLikelyDone = false;  ///< the cached simplex is near the closest simplex, or is it
};

/// Ends a query with the closest point v of A - B.
template <class S>
[[gnu::always_inline]] inline void keepClosest(const Eigen::Vector3d& v, double length2, S maxDistance,
                                               const Eigen::Vector3d& pointA, GjkCache<S>& cache,
                                               GjkResult<S>& result)
{
    const double distance = squareRoot(length2);
    const bool isNear = distance <= static_cast<double>(maxDistance);
    result.state = cache.state = isNear ? GjkState::Near : GjkState::Separated;
    result.axis = (v * (1.0 / distance)).template cast<S>();
    if (isNear)
        storePoints(v, distance, pointA, result);
}

/// Answers from a simplex of one point, without a search: its two vertices are the closest points if each is the
/// support vertex against their difference, as for most pairs of hulls with large faces.
///
/// @return false if they are not, or that is unknown
template <class S, class H, class Observer>
[[gnu::always_inline]] inline bool gjkFromVertices(const PosedHull<H>& a, const PosedHull<H>& b,
                                                   S maxDistance, GjkCache<S>& cache, Observer& observer,
                                                   GjkResult<S>& result)
{
    const std::int32_t vertexA = cache.verticesA[0], vertexB = cache.verticesB[0];
    if (vertexA >= a.vertexCount() || vertexB >= b.vertexCount())
        return false;
    Eigen::Vector3d pointA, pointB;
    Placement<PosedHull<H>, PosedHull<H>>(a, b).place(vertexA, vertexB, pointA, pointB);
    const Eigen::Vector3d v = pointA - pointB - (b.origin() - a.origin());
    const double length2 = v.squaredNorm();
    // A NaN makes the comparisons false.
    if (!(length2 > 0.0 && length2 <= std::numeric_limits<double>::max()))
        return false;
    if (!PosedHull<H>::areSupports(a, b, PosedHull<H>::usableDirection(v), {vertexA, vertexB}))
        return false;
    observer(v, length2);
    keepClosest(v, length2, maxDistance, pointA, cache, result);
    GjkSearch<PosedHull<H>, PosedHull<H>>::rememberAxis(v, vertexA, vertexB, cache);
    return true;
}

/// Answers from a corner of A - B, without a support search: by the closest point of its cone. That succeeds for nearly
/// all pairs that were near or separated in the last frame. Not inlined, see gjkSearch().
///
/// @pre the cache has one to three vertex pairs
/// @return false if the shapes overlap, or the answer is unknown
template <class S, class H, class Observer>
[[gnu::noinline]] bool gjkFromCorner(const PosedHull<H>& a, const PosedHull<H>& b, S maxDistance,
                                     GjkCache<S>& cache, Observer& observer, GjkResult<S>& result)
{
    if (!a.isClimbable() || !b.isClimbable())
        return false;
    CornerCone<H> cone(a, b);
    if (!cone.find(cache))
        return false;
    const Eigen::Vector3d& v = cone.closest();
    observer(v, cone.length2());
    result.iterations += cone.steps();
    cone.remember(cache);
    GjkSearch<PosedHull<H>, PosedHull<H>>::rememberAxis(v, cone.vertexA(), cone.vertexB(), cache);
    keepClosest(v, cone.length2(), maxDistance, cone.pointOfA(), cache, result);
    return true;
}

/// Proves an overlap where no closest point was found from a corner: by four points around the origin, one of which is
/// the corner.
///
/// @return false if no overlap was proved; then the cache is unchanged
template <class S, class H, class Observer>
[[gnu::noinline]] bool gjkOverlapFromCorner(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache,
                                            Observer& observer, GjkResult<S>& result)
{
    AxisTest<H> failed;
    failed.along = H(-1);
    failed.vertexA = cache.verticesA[0];
    failed.vertexB = cache.verticesB[0];
    if (!a.isClimbable() || !b.isClimbable() || failed.vertexA >= a.vertexCount() ||
        failed.vertexB >= b.vertexCount())
        return false;
    const GjkCache<S> before = cache;
    if (isaGjkFromCorner(a, b, H(0), failed, cache, observer, result) &&
        result.state == GjkState::Overlapping)
        return true;
    // The cached simplex is a better start of a search than points that proved nothing.
    cache = before;
    return false;
}

/// Stores the support points along a separating axis as a corner. Not inlined, see gjkSearch().
template <class S, class H>
[[gnu::noinline]] void rememberCorner(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache)
{
    // The supports are unknown for hulls of few vertices.
    if (cache.startA >= a.vertexCount() || cache.startB >= b.vertexCount())
    {
        const auto [vertexA, vertexB] = PosedHull<H>::supportVertices(
            a, b, {H(cache.axis[0]), H(cache.axis[1]), H(cache.axis[2])}, {-1, -1});
        cache.startA = narrowId<S>(vertexA);
        cache.startB = narrowId<S>(vertexB);
    }
    cache.count = 1;
    cache.verticesA[0] = cache.startA;
    cache.verticesB[0] = cache.startB;
}

/// The boolean query without a cached tetrahedron. Not inlined, see gjkSearch().
template <class S, class H, class Observer>
[[gnu::noinline]] bool gjkFromAxis(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache,
                                   Observer& observer, GjkResult<S>& result)
{
    if (!a.isClimbable() || !b.isClimbable())
        return false;
    AxisTest<H> first;
    const bool isFresh = !remembersAxis(cache);
    if (!isFresh && isaGjkOnCachedAxis(a, b, H(0), cache, observer, first))
    {
        result = separatedOnAxis(first, cache);
        return true;
    }
    AxisTest<H> test = first;
    return isaGjkBeforeSearch(a, b, H(0), cache, observer, result, test, true, isFresh);
}

/// Answers a distance query of two hulls without a search. If the cache has neither a corner nor an edge or face of A -
/// B, the boolean query runs first: it finds an overlap sooner, and else a corner near the closest point.
///
/// @return false if there is no answer; then the cache has the points from which the search starts
template <class S, class H, class Observer>
[[gnu::always_inline]] inline bool gjkWithoutSearch(const PosedHull<H>& a, const PosedHull<H>& b,
                                                    S maxDistance, GjkCache<S>& cache, Observer& observer,
                                                    GjkResult<S>& result)
{
    if (static_cast<unsigned>(cache.count) - 1u >= 3u)
    {
        const bool isAnswered = remembersTetrahedron(cache)
                                    ? isaGjkFromTetrahedron(a, b, H(0), cache, observer, result)
                                    : gjkFromAxis(a, b, cache, observer, result);
        if (!isAnswered)
            return false;
        if (result.state == GjkState::Overlapping)
            return true;
        rememberCorner(a, b, cache);
    }
    return (cache.count == 1 && gjkFromVertices(a, b, maxDistance, cache, observer, result)) ||
           gjkFromCorner(a, b, maxDistance, cache, observer, result) ||
           gjkOverlapFromCorner(a, b, cache, observer, result);
}

/// Other shapes have no graph.
template <class S, class A, class B, class Observer>
bool gjkWithoutSearch(const A&, const B&, S, GjkCache<S>&, Observer&, GjkResult<S>&)
{
    return false;
}

/// The search. Not inlined, to keep the code path of gjkFromVertices() short.
template <class S, class A, class B, class Observer>
[[gnu::noinline]] void gjkSearch(const A& a, const B& b, S maxDistance, GjkCache<S>& cache,
                                 Observer& observer, GjkStart start, GjkResult<S>& result)
{
    result = GjkResult<S>();
    GjkDistance<S, A, B, Observer>(a, b, maxDistance, cache, observer).run(start, result);
}

/// Distance and closest points of two convex shapes.
///
/// Gilbert, Johnson and Keerthi 1988, in the form of van den Bergen 1999, section 4, and the thesis, Algorithm 2, with
/// Voronoi regions in double (simplex.h) instead of Johnson's algorithm, and the cache of isa_gjk.h: a query may use
/// the cache of another kind of query.
///
/// @param maxDistance length unit of the world: shapes farther apart than this are Separated, without distance and
///                    points. With infinity every distance is computed; with 0, negative or NaN, none.
/// @param cache       of this pair in this order; a default-constructed one for a pair without history
/// @param observer    called after each support, see NoObserver
/// @param start       where the search begins
/// Errors: NotConverged; never loops, since |v| strictly decreases, but for eight steps at most; never returns a NaN.
template <class S, class A, class B, class Observer>
GjkResult<S> gjkDistance(const A& a, const B& b, S maxDistance, GjkCache<S>& cache, Observer& observer,
                         GjkStart start = GjkStart::Memory)
{
    GjkResult<S> result;
    if (start == GjkStart::Memory && gjkWithoutSearch(a, b, maxDistance, cache, observer, result))
        return result;
    // One object for all code paths avoids a copy.
    gjkSearch(a, b, maxDistance, cache, observer, start, result);
    return result;
}

template <class S, class A, class B>
GjkResult<S> gjkDistance(const A& a, const B& b, S maxDistance, GjkCache<S>& cache)
{
    NoObserver observer;
    return gjkDistance(a, b, maxDistance, cache, observer);
}
}  // namespace cullet
