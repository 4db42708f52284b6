// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/corner_fan.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/hull_pair.h"
#include "cullet/narrow/gjk/isa_gjk_search.h"
#include "cullet/narrow/gjk/simplex_steps.h"
#include "cullet/narrow/gjk/tetrahedron_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace cullet
{
/// From the centre of B to that of A, largest component 1.
template <class A, class B>
std::array<float, 3> firstAxis(const A& a, const B& b)
{
    const Eigen::Vector3d v = a.centre() - b.centre() - (b.origin() - a.origin());
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (!(largest > 0.0))
        return {1.0f, 0.0f, 0.0f};
    const double scale = 1.0 / largest;
    return {static_cast<float>(v[0] * scale), static_cast<float>(v[1] * scale),
            static_cast<float>(v[2] * scale)};
}

/// The search in double.
template <class S, class A, class B, class Observer, class Shape>
[[gnu::noinline]] GjkResult<S> isaGjkSearch(const A& a, const B& b, double limit, GjkCache<S>& cache,
                                            Observer& observer, const AxisTest<Shape>& test,
                                            IsaGjkVariant variant)
{
    return IsaGjk<S, A, B, Observer>(a, b, limit, cache, observer, variant).run(test);
}

/// Stores the outcome of a query that the cached axis answers.
template <class S, class H>
void keepSeparated(const Eigen::Matrix<S, 3, 1>& axis, const AxisTest<H>& test, GjkCache<S>& cache,
                   GjkResult<S>& result)
{
    result.state = cache.state = GjkState::Separated;
    result.axis = axis;
    cache.startA = narrowId<S>(test.vertexA);
    cache.startB = narrowId<S>(test.vertexB);
}

/// keepSeparated() with another axis, which is stored in the cache.
template <class S, class H>
void keepAxis(const Eigen::Matrix<H, 3, 1>& axis, const AxisTest<H>& test, GjkCache<S>& cache,
              GjkResult<S>& result)
{
    rememberAxis(axis, cache);
    keepSeparated<S>(axis.template cast<S>(), test, cache, result);
}

/// Portal refinement from four vertex pairs.
///
/// @param isRemembered the cache has these pairs already
/// @return false if nothing was proved; then the cache has the points for the search in double
template <class S, class H, class Observer>
[[gnu::always_inline]] inline bool isaGjkWalk(const HullPair<H>& pair, H limit2,
                                              const std::array<std::int32_t, 4>& verticesA,
                                              const std::array<std::int32_t, 4>& verticesB, bool isRemembered,
                                              GjkCache<S>& cache, Observer& observer, GjkResult<S>& result)
{
    TetrahedronWalk<H, Observer> walk(pair, limit2, observer);
    result.state = walk.run(verticesA, verticesB);
    result.iterations = walk.iterations();
    if (!isRemembered || result.state != GjkState::Overlapping || walk.iterations() > 0)
        walk.remember(result.state, cache);
    if (result.state == GjkState::Separated)
        result.axis = {S(walk.axis()[0]), S(walk.axis()[1]), S(walk.axis()[2])};
    return result.state != GjkState::NotConverged;
}

using FourIds = Lanes<float>::Mask;

/// Widens four ids in one vector operation: a vector load after four scalar stores would stall.
inline void widenIds(const std::array<std::uint16_t, 4>& narrow, FourIds& wide)
{
    VectorOf<std::uint16_t, 4>::Type ids;
    std::memcpy(&ids, narrow.data(), sizeof(ids));
    wide = __builtin_convertvector(ids, FourIds);
}

/// Portal refinement from the cached tetrahedron. Not inlined, to keep the code path of a separated pair short.
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkFromTetrahedron(const PosedHull<H>& a, const PosedHull<H>& b, H limit2,
                                             GjkCache<S>& cache, Observer& observer, GjkResult<S>& result)
{
    FourIds idsA, idsB;
    widenIds(cache.verticesA, idsA);
    widenIds(cache.verticesB, idsB);
    if (laneBits((idsA < a.vertexCount()) & (idsB < b.vertexCount())) != 15)
        return false;
    std::array<std::int32_t, 4> verticesA, verticesB;
    std::memcpy(&verticesA, &idsA, sizeof(idsA));
    std::memcpy(&verticesB, &idsB, sizeof(idsB));
    const HullPair<H> pair(a, b);
    return isaGjkWalk(pair, limit2, verticesA, verticesB, true, cache, observer, result);
}

/// Other shapes have no vertices for portal refinement.
template <class S, class A, class B, class H, class Observer>
bool isaGjkFromTetrahedron(const A&, const B&, H, GjkCache<S>&, Observer&, GjkResult<S>&)
{
    return false;
}

/// Answers from the corner of A - B where an axis has failed, that is, does not separate, or by less than the limit. In
/// the second case A - B is moved along the axis by the limit, and a little more since the new axis differs.
///
/// @return false if nothing was proved
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkFromCorner(const PosedHull<H>& a, const PosedHull<H>& b, H limit2,
                                        const AxisTest<H>& test, GjkCache<S>& cache, Observer& observer,
                                        GjkResult<S>& result)
{
    if (!a.hull().hasNeighbours() || !b.hull().hasNeighbours())
        return false;
    using Vector = Eigen::Matrix<H, 3, 1>;
    const HullPair<H> pair(a, b);
    const bool isNear = test.along >= H(0);
    Vector shift = Vector::Zero();
    if (isNear)
    {
        const Vector failed(cache.axis[0], cache.axis[1], cache.axis[2]);
        const H length2 = failed.squaredNorm();
        if (!(length2 > H(0)))
            return false;
        shift = failed * (H(-1.001) * squareRoot(limit2 / length2));
    }
    const CornerFan<H> fan(pair, test.vertexA, test.vertexB, shift[0], shift[1], shift[2]);
    if (!fan.isComplete() || (isNear && fan.isCone()))
        return false;
    if (fan.isCone())
        return isaGjkWalk(pair, limit2, fan.verticesA(), fan.verticesB(), false, cache, observer, result);
    const Vector axis = scaledAxis(fan.axis());
    const AxisTest<H> again = pair.test(axis, limit2, fan.corner().a, fan.corner().b);
    if (again.vertexA >= 0)
        observer(axis.template cast<double>(), static_cast<double>(again.along));
    if (!again.isProved)
        return false;
    keepAxis(axis, again, cache, result);
    return true;
}

/// Improves an axis that separates by less than the limit with one Newton step towards the best axis, as if A - B were
/// a ball of its size at the support point. The step is right for round hulls and too short for others.
///
/// @param again [out] the new axis
/// @return false if nothing was proved
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkGradientStep(const HullPair<H>& pair, H limit2, const AxisTest<H>& test,
                                          GjkCache<S>& cache, Observer& observer, GjkResult<S>& result,
                                          AxisTest<H>& again)
{
    using Vector = Eigen::Matrix<H, 3, 1>;
    const Vector failed(cache.axis[0], cache.axis[1], cache.axis[2]);
    const H length2 = failed.squaredNorm(), length = squareRoot(length2);
    const Vector lateral = pair.point(test.vertexA, test.vertexB) - failed * (test.along / length2);
    const Vector axis = scaledAxis<H>(failed + lateral * (length / (pair.size() + test.along / length)));
    again = pair.test(axis, limit2, test.vertexA, test.vertexB);
    if (again.vertexA >= 0)
        observer(axis.template cast<double>(), static_cast<double>(again.along));
    if (!again.isProved)
        return false;
    keepAxis(axis, again, cache, result);
    return true;
}

/// Answers from the cached simplex and the support points of axes that separate by less than the limit.
///
/// @return false if nothing was proved
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkFromSimplex(const HullPair<H>& pair, H limit2, const AxisTest<H>& test,
                                         const AxisTest<H>& again, GjkCache<S>& cache, Observer& observer,
                                         GjkResult<S>& result)
{
    SimplexSteps<H> steps(pair, limit2, test, again);
    if (!steps.run(cache, observer))
        return false;
    steps.remember(cache);
    result.iterations = steps.steps();
    keepAxis(steps.axis(), steps.test(), cache, result);
    // A small tilt, since the axis is nearly the best; none for hulls of few vertices, which are scanned.
    constexpr H kTilt = H(0.1);
    if (!pair.a().hasFewVertices() || !pair.b().hasFewVertices())
        rememberAxis(scaledAxis(pair.tilted(steps.axis(), steps.test(), kTilt)), cache);
    return true;
}

/// Whether the hulls have so many vertices that neighbouring support points are close to each other.
template <class H>
bool isRound(const PosedHull<H>& a, const PosedHull<H>& b)
{
    return std::max(a.vertexCount(), b.vertexCount()) > 48;
}

/// Whether the corner where an axis fails is worth testing. An axis that separates by nearly the limit must be replaced
/// by the best axis, which the corner seldom yields; for large hulls, whose supports are expensive, it is tested
/// anyway.
template <class H>
bool isCornerPromising(const PosedHull<H>& a, const PosedHull<H>& b, const AxisTest<H>& test,
                       const Eigen::Matrix<H, 3, 1>& axis, H limit2)
{
    constexpr std::int32_t kLarge = 100;
    if (test.along >= H(0) && !(limit2 > H(0)))
        return false;
    return test.along < H(0) || test.along * test.along < H(0.8) * limit2 * axis.squaredNorm() ||
           std::max(a.vertexCount(), b.vertexCount()) > kLarge;
}

/// Tries to replace an axis that separates by less than the limit, without a search in double. Not inlined, see
/// isaGjkFromTetrahedron().
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkWidenGap(const HullPair<H>& pair, const Eigen::Matrix<H, 3, 1>& axis, H limit2,
                                      const AxisTest<H>& test, GjkCache<S>& cache, Observer& observer,
                                      GjkResult<S>& result)
{
    const bool areRound = isRound(pair.a(), pair.b());
    AxisTest<H> again;
    if (areRound ? isaGjkGradientStep(pair, limit2, test, cache, observer, result, again)
                 : isaGjkFromSimplex(pair, limit2, test, again, cache, observer, result))
        return true;
    if (isCornerPromising(pair.a(), pair.b(), test, axis, limit2) &&
        isaGjkFromCorner(pair.a(), pair.b(), limit2, test, cache, observer, result))
        return true;
    return areRound && isaGjkFromSimplex(pair, limit2, test, again, cache, observer, result);
}

/// Tries to answer from a failed axis, without a search in double. Not inlined, see isaGjkFromTetrahedron().
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkRepairAxis(const HullPair<H>& pair, const Eigen::Matrix<H, 3, 1>& axis, H limit2,
                                        const AxisTest<H>& test, GjkCache<S>& cache, Observer& observer,
                                        GjkResult<S>& result)
{
    if (test.along > H(0) && limit2 > H(0))
        return isaGjkWidenGap(pair, axis, limit2, test, cache, observer, result);
    return isCornerPromising(pair.a(), pair.b(), test, axis, limit2) &&
           isaGjkFromCorner(pair.a(), pair.b(), limit2, test, cache, observer, result);
}

/// Chooses and tests the first axis of two hulls without a cache. Not inlined, to keep the code path of a cached pair
/// short.
///
/// @param test [out] how the axis failed
/// @return whether it proves the gap
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkOnFirstAxis(const PosedHull<H>& a, const PosedHull<H>& b, H limit2,
                                         GjkCache<S>& cache, Observer& observer, GjkResult<S>& result,
                                         AxisTest<H>& test)
{
    // Test results are about the cache's axis, which has float coordinates; only for float hulls is it the axis between
    // the centres up to its length.
    if (sizeof(H) != sizeof(float))
    {
        cache.axis = firstAxis(a, b);
        return false;
    }
    const HullPair<H> pair(a, b);
    const Eigen::Matrix<H, 3, 1> between = pair.betweenCentres();
    const H scale =
        scaleBelowOne(std::max({std::abs(between[0]), std::abs(between[1]), std::abs(between[2])}));
    const Eigen::Matrix<H, 3, 1> scaled =
        scale > H(0) ? Eigen::Matrix<H, 3, 1>(between * scale) : Eigen::Matrix<H, 3, 1>(1, 0, 0);
    rememberAxis(scaled, cache);
    // Tested unscaled where possible, since the scale would add latency.
    const bool isUnscaled = HullPair<H>::isTestable(between);
    const AxisTest<H> balls = pair.testBalls(isUnscaled ? between : scaled, limit2);
    if (balls.isProved)
    {
        keepSeparated<S>(scaled.template cast<S>(), balls, cache, result);
        return true;
    }
    const AxisTest<H> first = pair.testFirstAxis(isUnscaled ? between : scaled, limit2);
    const H along = isUnscaled ? first.along * scale : first.along;
    if (first.isProved)
    {
        observer(scaled.template cast<double>(), static_cast<double>(along));
        keepSeparated<S>(scaled.template cast<S>(), first, cache, result);
        return true;
    }
    test.along = along;
    test.vertexA = first.vertexA;
    test.vertexB = first.vertexB;
    return false;
}

/// The first test of a query of two hulls, which ends most queries.
///
/// @param test [in, out] a failed test of the cache's axis, if there is one; then the result of the test, with vertices
///             that may be -1
/// @return whether it proves the gap
template <class S, class H, class Observer>
[[gnu::always_inline]] inline bool isaGjkOnCachedAxis(const PosedHull<H>& a, const PosedHull<H>& b, H limit2,
                                                      const GjkCache<S>& cache, Observer& observer,
                                                      AxisTest<H>& test)
{
    if (test.vertexA >= 0)
        return false;
    const Eigen::Matrix<H, 3, 1> axis(cache.axis[0], cache.axis[1], cache.axis[2]);
    test = HullPair<H>::testCachedAxis(a, b, axis, limit2, cache.startA, cache.startB);
    if (test.isProved)
        observer(axis.template cast<double>(), static_cast<double>(test.along));
    return test.isProved;
}

/// The result of a query that the cache's axis answers.
template <class S, class H>
[[gnu::always_inline]] inline GjkResult<S> separatedOnAxis(const AxisTest<H>& test, GjkCache<S>& cache)
{
    GjkResult<S> result;
    keepSeparated({cache.axis[0], cache.axis[1], cache.axis[2]}, test, cache, result);
    return result;
}

/// Answers queries of two hulls that the first test does not end, without a search in double. Not inlined, see
/// isaGjkFromTetrahedron().
///
/// @param usesCorner whether to use the corner where the axis fails
/// @param test        [in, out] see isaGjkOnCachedAxis()
template <class S, class H, class Observer>
[[gnu::noinline]] bool isaGjkFromFailedAxis(const PosedHull<H>& a, const PosedHull<H>& b, H limit2,
                                            GjkCache<S>& cache, Observer& observer, GjkResult<S>& result,
                                            AxisTest<H>& test, bool usesCorner)
{
    const Eigen::Matrix<H, 3, 1> axis(cache.axis[0], cache.axis[1], cache.axis[2]);
    const HullPair<H> pair(a, b);
    if (test.vertexA < 0 || test.vertexB < 0)
    {
        const AxisTest<H> tested = pair.testWithoutStart(axis, limit2);
        if (tested.isProved)
        {
            observer(axis.template cast<double>(), static_cast<double>(tested.along));
            keepSeparated<S>(axis.template cast<S>(), tested, cache, result);
            return true;
        }
        test.along = tested.along;
        test.vertexA = tested.vertexA;
        test.vertexB = tested.vertexB;
    }
    if (test.vertexA < 0)
        return false;
    observer(axis.template cast<double>(), static_cast<double>(test.along));
    return usesCorner && isaGjkRepairAxis(pair, axis, limit2, test, cache, observer, result);
}

/// The scalar of a shape's own arithmetic.
template <class A>
struct ShapeScalar
{
    using Type = double;
};

template <class H>
struct ShapeScalar<PosedHull<H>>
{
    using Type = H;
};

/// Other shapes always need the search.
template <class S, class A, class B, class H, class Observer>
bool isaGjkOnFirstAxis(const A& a, const B& b, H, GjkCache<S>& cache, Observer&, GjkResult<S>&, AxisTest<H>&)
{
    cache.axis = firstAxis(a, b);
    return false;
}

template <class S, class A, class B, class H, class Observer>
bool isaGjkOnCachedAxis(const A&, const B&, H, const GjkCache<S>&, Observer&, AxisTest<H>&)
{
    return false;
}

template <class S, class A, class B, class H, class Observer>
bool isaGjkFromFailedAxis(const A&, const B&, H, GjkCache<S>&, Observer&, GjkResult<S>&, AxisTest<H>&, bool)
{
    return false;
}

/// Whether the cache has the tetrahedron that contained the origin, which is tested before the axis.
template <class S>
bool remembersTetrahedron(const GjkCache<S>& cache)
{
    return cache.state == GjkState::Overlapping && cache.count == 4;
}

template <class S>
bool remembersAxis(const GjkCache<S>& cache)
{
    return cache.axis != std::array<float, 3>{};
}

/// Answers without a search in double where the cached axis does not: by the last tetrahedron, or by the first axis of
/// a pair without history and the corner where an axis fails.
///
/// @param isFresh     the cache has no axis
/// @param test        [in, out] see isaGjkOnCachedAxis()
/// @param usesCorner see isaGjkFromFailedAxis()
/// @return false if nothing was proved
template <class S, class A, class B, class H, class Observer>
[[gnu::always_inline]] inline bool isaGjkBeforeSearch(const A& a, const B& b, H limit2, GjkCache<S>& cache,
                                                      Observer& observer, GjkResult<S>& result,
                                                      AxisTest<H>& test, bool usesCorner, bool isFresh)
{
    if (remembersTetrahedron(cache))
    {
        if (isaGjkFromTetrahedron(a, b, limit2, cache, observer, result))
            return true;
        if (isFresh)
            cache.axis = firstAxis(a, b);
        return false;
    }
    return (isFresh && isaGjkOnFirstAxis(a, b, limit2, cache, observer, result, test)) ||
           isaGjkFromFailedAxis(a, b, limit2, cache, observer, result, test, usesCorner);
}

/// The part of isaGjk() after the first test. A separate function, so that its objects are not in memory earlier and
/// its result is not copied.
///
/// @param first   see isaGjkOnCachedAxis()
/// @param isFresh the cache has no axis
template <class S, class A, class B, class H, class Observer>
[[gnu::always_inline]] inline GjkResult<S> isaGjkAfterCachedAxis(const A& a, const B& b, H limit,
                                                                 GjkCache<S>& cache, Observer& observer,
                                                                 IsaGjkVariant variant,
                                                                 const AxisTest<H>& first, bool isFresh)
{
    GjkResult<S> result;
    AxisTest<H> test = first;
    if (variant.start == GjkStart::Memory)
    {
        if (isaGjkBeforeSearch(a, b, squareOfLimit(limit), cache, observer, result, test,
                               variant.reflections <= 0, isFresh))
            return result;
    }
    else if (isFresh)
        cache.axis = firstAxis(a, b);
    result = isaGjkSearch<S>(a, b, static_cast<double>(limit), cache, observer, test, variant);
    return result;
}

/// Determines whether two convex shapes are farther apart than maxDistance, with an axis as proof.
///
/// Van den Bergen 1999, "A Fast and Robust GJK Implementation for Collision Detection of Convex Objects", section 5
/// (ISA-GJK), and the thesis, Algorithm 3. Differences: the cache starts the search from the last axis (two climbs of
/// one or two steps answer most pairs), from the last enclosing tetrahedron (no support at all), else from the last
/// simplex; the solver works in double; maxDistance > 0 requires a gap instead of any axis. For hulls the last axis,
/// the corner where it fails and the last tetrahedron are first tried in their own precision, with proof (hull_pair.h,
/// corner_fan.h, tetrahedron_walk.h).
///
/// @param maxDistance length unit of the world; with 0, negative or NaN only an overlap is determined. The state is
///                    Separated if the distance is larger, Near if it is positive and not larger.
/// @param cache       of this pair in this order; a default-constructed one for a pair without history
/// @param observer    called after each support, see NoObserver
/// @param variant     for comparison: where the search begins, and reflections
/// @param failed      the failed test of the cache's axis for this query, if there is one
/// Cost: with a valid axis two coherent supports; else those and the neighbours of two vertices answer most pairs of
/// hulls; else one support of each shape per simplex, 2 to 10 simplices.
/// Errors: NotConverged; never loops, since |v| strictly decreases, and never returns a NaN.
template <class S, class A, class B, class Observer>
[[gnu::always_inline]] inline GjkResult<S> isaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache,
                                                  Observer& observer, IsaGjkVariant variant,
                                                  const AxisTest<typename ShapeScalar<A>::Type>& failed)
{
    using Scalar = typename ShapeScalar<A>::Type;
    const Scalar limit = maxDistance > S(0) ? static_cast<Scalar>(maxDistance) : Scalar(0);
    AxisTest<Scalar> first = failed;
    const bool isFresh = !remembersAxis(cache);
    if (variant.start == GjkStart::Memory && !isFresh && !remembersTetrahedron(cache) &&
        isaGjkOnCachedAxis(a, b, squareOfLimit(limit), cache, observer, first))
        return separatedOnAxis(first, cache);
    return isaGjkAfterCachedAxis(a, b, limit, cache, observer, variant, first, isFresh);
}

template <class S, class A, class B, class Observer>
[[gnu::always_inline]] inline GjkResult<S> isaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache,
                                                  Observer& observer, IsaGjkVariant variant = {})
{
    return isaGjk(a, b, maxDistance, cache, observer, variant, AxisTest<typename ShapeScalar<A>::Type>());
}

template <class S, class A, class B>
GjkResult<S> isaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache)
{
    NoObserver observer;
    return isaGjk(a, b, maxDistance, cache, observer);
}
}  // namespace cullet
