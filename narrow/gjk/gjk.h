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

namespace cullet
{
/// The closest points, whose difference is v.
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

    /// @param result [in, out] nothing yet
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
            const Support s = m_isLikelyDone ? m_search.supportAmongOwn() : m_search.supportAgainst(v);
            const double along = v.dot(s.w);
            m_observer(v, along);
            if (along > 0.0 && along * along > m_limit * m_limit * m_search.length2())
                return finish(GjkState::Separated, &s, result);
            const bool isClose = m_search.length2() - along <= kRelativeGap * m_search.length2();
            if (isClose)
                return finish(GjkState::Near, &s, result);
            if (m_search.has(s) || !m_search.advance(s))
                return finish(m_search.stalledState(along), &s, result);
        }
        finish(GjkState::NotConverged, nullptr, result);
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

    /// Of |v|^2: the distance is then wrong by 1e-12 of itself at most.
    static constexpr double kRelativeGap = 1e-12;

    Search m_search;
    double m_limit;
    GjkCache<S>& m_cache;
    Observer& m_observer;
    std::int32_t m_iterations = 0;
    bool m_isLikelyDone = false;  ///< the remembered simplex is near the closest one, if not it
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

/// From a simplex of one point, with less than a search: its two vertices are the closest points if each is the support
/// vertex against their difference. So it is for most pairs of hulls with large faces.
///
/// @return false if they are not, or it is not known
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

/// From a corner of A - B, without a support: the closest point of its cone. So it is for nearly all pairs that have been near
/// or apart in the last frame. Out of line, as below.
///
/// @pre the cache has one to three vertex pairs
/// @return false if the shapes overlap, or it is not known
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

/// Where no closest point was found from a corner, shapes that have come to overlap: four points around the origin, one of them
/// the corner.
///
/// @return false if that is not proved; then nothing has changed
template <class S, class H, class Observer>
[[gnu::noinline]] bool gjkInCorner(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache,
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
    // The remembered simplex is a better start of a search than what proves nothing.
    cache = before;
    return false;
}

/// Makes a corner of the support points along an axis that separates. Out of line, as below.
template <class S, class H>
[[gnu::noinline]] void rememberCorner(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache)
{
    // Unknown where there are few vertices.
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

/// The boolean query, but for a remembered tetrahedron. Out of line, as below.
template <class S, class H, class Observer>
[[gnu::noinline]] bool gjkFromAxis(const PosedHull<H>& a, const PosedHull<H>& b, GjkCache<S>& cache,
                                   Observer& observer, GjkResult<S>& result)
{
    if (!a.isClimbable() || !b.isClimbable())
        return false;
    AxisTest<H> first;
    const bool isFresh = !remembersAxis(cache);
    if (!isFresh && isaGjkOnAxis(a, b, H(0), cache, observer, first))
    {
        result = separatedOnAxis(first, cache);
        return true;
    }
    AxisTest<H> test = first;
    return isaGjkOffAxis(a, b, H(0), cache, observer, result, test, true, isFresh);
}

/// What can be told of two hulls without a search. Where neither a corner nor an edge or face of A - B is remembered, the
/// boolean query comes first: it finds an overlap sooner, and else a corner that is near.
///
/// @return false if that is nothing; then the cache has what was found for the search
template <class S, class H, class Observer>
[[gnu::always_inline]] inline bool gjkWithoutSearch(const PosedHull<H>& a, const PosedHull<H>& b,
                                                    S maxDistance, GjkCache<S>& cache, Observer& observer,
                                                    GjkResult<S>& result)
{
    if (static_cast<unsigned>(cache.count) - 1u >= 3u)
    {
        const bool isTold = remembersTetrahedron(cache)
                                ? isaGjkFromTetrahedron(a, b, H(0), cache, observer, result)
                                : gjkFromAxis(a, b, cache, observer, result);
        if (!isTold)
            return false;
        if (result.state == GjkState::Overlapping)
            return true;
        rememberCorner(a, b, cache);
    }
    return (cache.count == 1 && gjkFromVertices(a, b, maxDistance, cache, observer, result)) ||
           gjkFromCorner(a, b, maxDistance, cache, observer, result) ||
           gjkInCorner(a, b, cache, observer, result);
}

/// Other shapes have no neighbours.
template <class S, class A, class B, class Observer>
bool gjkWithoutSearch(const A&, const B&, S, GjkCache<S>&, Observer&, GjkResult<S>&)
{
    return false;
}

/// The search. Out of line, to keep the path of two vertices short.
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
/// what another kind of query remembered.
///
/// @param maxDistance length unit of the world: shapes farther apart than this come back as Separated, without distance and
///                    points. Infinity asks for every distance; with 0, negative or NaN, none is ever told.
/// @param cache       of this pair in this order; a default-constructed one for a pair without history
/// @param observer    called after each support, see NoObserver
/// @param start       where the search begins
/// Errors: NotConverged; never loops, since |v| strictly decreases, and never returns a NaN.
template <class S, class A, class B, class Observer>
GjkResult<S> gjkDistance(const A& a, const B& b, S maxDistance, GjkCache<S>& cache, Observer& observer,
                         GjkStart start = GjkStart::Memory)
{
    GjkResult<S> result;
    if (start == GjkStart::Memory && gjkWithoutSearch(a, b, maxDistance, cache, observer, result))
        return result;
    // One object on all paths, or it would be copied.
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
