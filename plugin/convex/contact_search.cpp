// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/contact_search.h"

#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/facing_faces.h"
#include "cullet/narrow/gjk/feature_pair.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/narrow/gjk/precise_hull.h"

#include <limits>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
Touch touchAt(const ConvexCores& cores, const PenetrationResult<btScalar>& deep)
{
    Touch touch = {deep.axis.cast<double>().normalized(), -double(deep.depth), deep.pointB.cast<double>(),
                   deep.vertexA, deep.vertexB};
    const Eigen::Vector3d apart =
        cores.a->centre() - cores.b->centre() + cores.a->origin() - cores.b->origin();
    // Without volume both normals are valid; Bullet's choice is the one that keeps the centres apart.
    if (deep.method == PenetrationMethod::Flat && touch.normal.dot(apart) < 0.0)
    {
        touch.normal = -touch.normal;
        touch.vertexA = touch.vertexB = -1;
    }
    return touch;
}

/// Normalises an axis whose length is 1 up to rounding: one Newton step, with an error of the square of the rounding,
/// instead of a root and divisions.
Eigen::Vector3d renormalized(const Eigen::Matrix<btScalar, 3, 1>& axis)
{
    const Eigen::Vector3d v = axis.cast<double>();
    return v * (1.5 - 0.5 * v.squaredNorm());
}

std::int32_t idOf(std::uint16_t cached)
{
    return cached == GjkCache<btScalar>::kUnknown ? -1 : std::int32_t(cached);
}

Touch touchAt(const GjkResult<btScalar>& near, const GjkCache<btScalar>& cache)
{
    Touch touch = {renormalized(near.axis), double(near.distance), near.pointB.cast<double>(),
                   idOf(cache.startA), idOf(cache.startB)};
    touch.areCorners =
        cache.count == 1 && cache.verticesA[0] == cache.startA && cache.verticesB[0] == cache.startB;
    return touch;
}

using Features = FeaturePair<btScalar>;

Touch touchAt(const Features& features)
{
    return {features.normal(),  features.distance(), features.pointOfB(),
            features.vertexA(), features.vertexB(),  features.areCorners()};
}

/// Distance and closest points by the features that a search has found, maybe in an earlier pose.
///
/// @param about see FeaturePair
bool solveFeatures(Features& features, const VertexPairs& pairs, const Eigen::Vector3d& about, Touch& touch)
{
    if (!features.solve(pairs, about, false))
        return false;
    touch = touchAt(features);
    return true;
}

GjkState stateOf(const Touch& touch, btScalar limit)
{
    return touch.distance <= double(limit) ? GjkState::Near : GjkState::Separated;
}

Eigen::Vector3d axisOf(const GjkCache<btScalar>& cache)
{
    return {cache.axis[0], cache.axis[1], cache.axis[2]};
}

void rememberTouch(const Touch& touch, btScalar limit, GjkCache<btScalar>& cache)
{
    GjkSearch<PosedShape, PosedShape>::rememberAxis(touch.normal, touch.vertexA, touch.vertexB, cache);
    cache.state = stateOf(touch, limit);
}

/// Saves the search if the closest features are those of the last query.
bool solveLastFeatures(const ConvexCores&, Features& features, btScalar limit, GjkCache<btScalar>& cache,
                       Touch& touch)
{
    if (!solveFeatures(features, pairsOf(cache), axisOf(cache), touch))
        return false;
    rememberTouch(touch, limit, cache);
    return true;
}

/// solveLastFeatures() for features that are not level.
bool solveLastEdges(const ConvexCores&, Features& features, btScalar limit, GjkCache<btScalar>& cache,
                    Touch& touch)
{
    if (!features.solveStrict(pairsOf(cache), axisOf(cache)))
        return false;
    touch = touchAt(features);
    rememberTouch(touch, limit, cache);
    return true;
}

/// Continues a search whose last features rounding has decided, with supports in double.
///
/// @param near [in, out] unchanged if the search finds no distance
/// @return whether it found one
template <class S>
bool refine(const PosedHull<S>& a, const PosedHull<S>& b, S limit, GjkCache<S>& cache, GjkResult<S>& near)
{
    if constexpr (sizeof(S) < sizeof(double))
    {
        GjkCache<S> refined = cache;
        const GjkResult<S> result = gjkDistance(PreciseHull<S>(a), PreciseHull<S>(b), limit, refined);
        if (result.state != GjkState::Near)
            return false;
        cache = refined;
        near = result;
        return true;
    }
    // All searches of hulls in double compare in double.
    return false;
}

/// Distance and closest points if one hull lies on a face of the other.
///
/// @param cache [in, out] its features may be those of an earlier pose
bool solveNearFaces(const ConvexCores&, Features& features, btScalar limit, GjkCache<btScalar>& cache,
                    Touch& touch)
{
    // In double, a tilt of some roundings may be level or not by the face that the last axis is nearest to.
    if constexpr (sizeof(btScalar) == sizeof(double))
        return false;
    const VertexPairs last = pairsOf(cache);
    if (!features.solveNearFaces(idOf(cache.startA), idOf(cache.startB), axisOf(cache),
                                 distinctVertices(last.a, last.count).count == 3))
        return false;
    touch = touchAt(features);
    rememberTouch(touch, limit, cache);
    rememberPairs(features.pairs(), cache);
    return true;
}

/// Distance and closest points if a corner or an edge of a face of one hull is over a face of the other: those at which the
/// last search ended.
bool solveFacingFaces(const ConvexCores& cores, Features& features, btScalar limit, GjkCache<btScalar>& cache,
                      Touch& touch)
{
    const Eigen::Vector3d about = axisOf(cache);
    const FacingFaces<btScalar> faces(*cores.a, *cores.b, idOf(cache.startA), idOf(cache.startB), about);
    if (!faces.isFound() || !features.solveStrict(faces.pairs(), about))
        return false;
    touch = touchAt(features);
    rememberTouch(touch, limit, cache);
    rememberPairs(faces.pairs(), cache);
    return true;
}

/// Saves the search if the closest features are those of the last query, or of the same faces. What is most likely is
/// tried first; any order gives the same result.
bool solveKnownFeatures(const ConvexCores& cores, btScalar limit, GjkCache<btScalar>& cache, Touch& touch)
{
    Features features(*cores.a, *cores.b);
    const auto solves = [&](auto... functions)
    { return (functions(cores, features, limit, cache, touch) || ...); };
    const VertexPairs last = pairsOf(cache);
    const int ofA = distinctVertices(last.a, last.count).count,
              ofB = distinctVertices(last.b, last.count).count;
    if (ofA == 3 || ofB == 3)
        return solves(solveNearFaces, solveLastFeatures, solveFacingFaces);
    // Two level faces are remembered by a vertex of each.
    if (ofA == 1 && ofB == 1)
        return solves(solveLastFeatures, solveFacingFaces, solveNearFaces);
    return solves(solveLastEdges, solveFacingFaces, solveLastFeatures, solveNearFaces);
}

ContactSearchResult solveNearFeatures(const ConvexCores& cores, btScalar limit, btScalar paddedLimit,
                                      GjkResult<btScalar>& near, GjkCache<btScalar>& cache, Touch& touch)
{
    Features features(*cores.a, *cores.b);
    const auto solve = [&]
    { return solveFeatures(features, pairsOf(cache), near.axis.cast<double>(), touch); };
    const bool isSettled = solve() || (refine(*cores.a, *cores.b, paddedLimit, cache, near) && solve()) ||
                           solveNearFaces(cores, features, limit, cache, touch);
    if (!isSettled)
        touch = touchAt(near, cache);
    cache.state = stateOf(touch, limit);
    return {cache.state, isSettled};
}
}  // namespace

double radiusOf(const ConvexSide& side, const std::optional<PosedShape>& core)
{
    if (core)
        return double(core->size());
    btVector3 centre;
    btScalar radius;
    side.shape.getBoundingSphere(centre, radius);
    return double(centre.length()) + double(radius);
}

btScalar padLimit(const ConvexPair& pair, const ConvexCores& cores, btScalar limit)
{
    const btVector3 between = pair.a.transform.getOrigin() - pair.b.transform.getOrigin();
    const double size =
        radiusOf(pair.a, cores.a) + radiusOf(pair.b, cores.b) + double(between.length()) + double(limit);
    return limit + static_cast<btScalar>(8 * double(std::numeric_limits<btScalar>::epsilon()) * size);
}

GjkState testSeparation(const ConvexPair& pair, const ConvexCores& cores, btScalar paddedLimit,
                        const AxisTest<btScalar>& failed, GjkCache<btScalar>& cache)
{
    if (cores.a && cores.b)
    {
        NoObserver observer;
        return isaGjk(*cores.a, *cores.b, paddedLimit, cache, observer, {}, failed).state;
    }
    const PosedSupport a(pair.a.shape, pair.a.transform, cores.anchor),
        b(pair.b.shape, pair.b.transform, cores.anchor);
    if (cores.a)
        return isaGjk(*cores.a, b, paddedLimit, cache).state;
    return cores.b ? isaGjk(a, *cores.b, paddedLimit, cache).state : isaGjk(a, b, paddedLimit, cache).state;
}

ContactSearchResult measure(const ConvexCores& cores, btScalar limit, btScalar paddedLimit,
                            GjkCache<btScalar>& cache, EpaCache* depthCache, Touch& touch,
                            ThreadCounter& exactTotal)
{
    if (depthCache != nullptr && depthCache->vertexCount > 0)
    {
        const PenetrationResult<btScalar> deep =
            rememberedPenetration(*cores.a, *cores.b, cache, *depthCache);
        if (deep.state == GjkState::Overlapping)
        {
            touch = touchAt(cores, deep);
            return {deep.state, deep.isSettled};
        }
    }
    if (cache.state == GjkState::Near && solveKnownFeatures(cores, limit, cache, touch))
        return {cache.state, true};
    GjkResult<btScalar> near = gjkDistance(*cores.a, *cores.b, paddedLimit, cache);
    if (near.state == GjkState::Near)
        return solveNearFeatures(cores, limit, paddedLimit, near, cache, touch);
    if (near.state != GjkState::Overlapping)
        return {near.state, near.state == GjkState::Separated};
    const PenetrationResult<btScalar> deep = penetration(*cores.a, *cores.b, cache, depthCache);
    // The two queries may disagree about shapes that only touch.
    if (deep.state != GjkState::Overlapping)
        return {GjkState::NotConverged, false};
    if (deep.method == PenetrationMethod::Exact)
        exactTotal.add(1);
    touch = touchAt(cores, deep);
    return {GjkState::Overlapping, deep.isSettled};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
