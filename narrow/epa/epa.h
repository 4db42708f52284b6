// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/cached_surface.h"
#include "cullet/narrow/epa/epa_cache.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/epa/level_corner.h"
#include "cullet/narrow/epa/penetration_result.h"
#include "cullet/narrow/epa/polytope.h"
#include "cullet/narrow/epa/seed_tetrahedron.h"
#include "cullet/narrow/gjk/feature_pair.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/precise_hull.h"
#include "cullet/narrow/gjk/vertex_pairs.h"
#include "cullet/narrow/hull/moved_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

namespace cullet
{
/// Expanding polytope algorithm on one pair.
///
/// **The cached surface.** Its corners are pairs of vertices, which are points of A - B in any pose. If the origin is
/// on the inner side of every triangle, by more than rounding, the tetrahedra between the origin and the triangles
/// cover all directions, as the surface is closed; so no plane separates the origin from the corners, the tetrahedra
/// are parts of A - B, which is convex, and A - B contains the ball around the origin up to the closest plane of a
/// triangle: the depth is at least that distance, just as in a polytope. The dual gap bounds it from above. So one
/// support proves the depth while the closest triangle stays on the surface of A - B; otherwise the expansion continues
/// from the cached surface.
///
/// If the origin is within rounding of a plane, its side proves nothing: a surface that has become flat has the origin
/// in all its planes, however far apart the shapes are within that plane. Then the deepest point proves the contact:
/// the point of A - B where the ray along the normal leaves, a mean of corners, is the origin up to the gap.
template <class S, class A, class B>
class Penetration
{
public:
    Penetration(const A& a, const B& b, GjkCache<S>& cache, EpaCache* memory)
        : m_a(a), m_b(b), m_search(a, b), m_cache(cache), m_epaCache(memory), m_seed(m_search)
    {
    }

    PenetrationResult<S> run()
    {
        m_result.state = enclose();
        if (m_result.state == GjkState::Overlapping)
            measure();
        if (!isFinite())
            m_result = PenetrationResult<S>();
        return m_result;
    }

    /// Expands the cached surface only. If that proves nothing, empties the cache and returns NotConverged.
    PenetrationResult<S> runFromCache()
    {
        m_isFromCache = true;
        m_isChanged = false;
        const bool isProved = (expandCachedSurface() || expandCachedHull()) && isFinite();
        if (isProved)
        {
            m_result.state = GjkState::Overlapping;
            return m_result;
        }
        m_epaCache->vertexCount = 0;
        return PenetrationResult<S>();
    }

private:
    using Search = GjkSearch<A, B>;
    using Support = typename Search::Support;

    /// The certified gap, times the size, down to which an expansion continues, and up to which a stalled expansion is
    /// accepted. They depend on the precision of the answer.
    static constexpr double kGapWanted = sizeof(S) == sizeof(float) ? 1e-7 : 1e-12;
    static constexpr double kGapAccepted = sizeof(S) == sizeof(float) ? 1e-5 : 1e-10;
    /// How far the deepest point of the surface may be from the ray along the normal; times the size.
    static constexpr double kMissAccepted = sizeof(S) == sizeof(float) ? 1e-6 : 1e-10;
    /// A depth is unique where all other depths are larger by this, times the size.
    static constexpr double kDepthUncertainty = 4 * kTouchUncertainty;
    static constexpr double kFlat = SeedTetrahedron<Search>::kFlat;

    /// Finds a simplex that contains the origin: the cached tetrahedron, or the result of a search without axis tests.
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

    /// An infinite support seems to prove anything. A double may be too large for S; pointB depends on all other numbers
    /// of the result.
    bool isFinite() const { return m_search.isFinite() && m_result.pointB.allFinite(); }

    /// Finds the depth from the simplex that contains the origin.
    void measure()
    {
        if (m_seed.complete())
            enlarge();
        else
            finishFlat(m_seed.normal());
    }

    /// Finds the depth from the tetrahedron: by expansion with or without a corner, with more capacity, or exactly.
    void enlarge()
    {
        const bool hasCorner = m_shouldAddCorner = hasCorners();
        bool isProved = expandSeed();
        // The points of a corner may break the surface: where edges of A and B are parallel, some of them are
        // collinear.
        if (!isProved && hasCorner && !m_shouldAddCorner)
            isProved = expandSeed();
        if (!isProved)
            solveExactly();
    }

    /// Whether both shapes are hulls whose graphs may be used.
    bool hasCorners() const
    {
        if constexpr (HasVertexAmong<A, B>::value)
            return m_a.isClimbable() && m_b.isClimbable();
        else
            return false;
    }

    /// Not inlined, so that the stack frame has one polytope.
    [[gnu::noinline]] bool expandSeed()
    {
        Polytope polytope(size());
        wrapFour(m_seed.points(), polytope, m_supports);
        return expand(polytope, m_supports) || (polytope.isFull() && expandFurther());
    }

    void finishFlat(const Eigen::Vector3d& normal)
    {
        m_result.method = PenetrationMethod::Flat;
        // Products of coordinates below 1e-160 underflow to zero; any direction is as good for so small a shape.
        m_result.axis =
            (normal.isZero(0.0) ? Eigen::Vector3d(Eigen::Vector3d::UnitX()) : normal).template cast<S>();
        // The point where the search found the shapes to touch.
        m_result.pointA = m_search.pointOfA().template cast<S>();
        m_result.pointB = m_result.pointA;
    }

    bool expandCachedSurface()
    {
        EpaCache& memory = *m_epaCache;
        for (int i = 0; i < memory.vertexCount; ++i)
        {
            if (memory.verticesA[i] >= m_a.vertexCount() || memory.verticesB[i] >= m_b.vertexCount())
                memory.vertexCount = 0;
            else
                m_supports[i] = m_search.supportOf(memory.verticesA[i], memory.verticesB[i]);
        }
        if (memory.vertexCount == 0 || !m_search.isFinite())
            return false;
        Polytope polytope(size());
        for (int i = 0; i < memory.vertexCount; ++i)
            polytope.addVertex(m_supports[i].w);
        for (int i = 0; i < memory.faceCount; i += 2)
        {
            const int left = std::min(2, memory.faceCount - i);
            polytope.addFaces({{memory.corners(i), memory.corners(i + left - 1)}}, left);
        }
        return expand(polytope, m_supports);
    }

    /// Adds the points of a corner whose faces are likely the closest, so that little is left to expand.
    template <class P, class Supports>
    void addCorner(P& polytope, Supports& supports)
    {
        if constexpr (HasVertexAmong<A, B>::value)
        {
            const LevelCorner<Search> corner(m_a, m_b, m_cache, m_search);
            addPoints(corner.points, 0, corner.count, polytope, supports);
        }
    }

    /// expandCachedSurface() from the convex hull of the cached points, for a cached surface with dents that no
    /// support point closes.
    bool expandCachedHull()
    {
        const int count = m_isSeparated || !m_search.isFinite() ? 0 : m_epaCache->vertexCount;
        std::array<Support, EpaCache::kVertices> left;
        std::copy_n(m_supports.begin(), count, left.begin());
        if (!(spreadFour(left, count) > kFlat * m_search.size2() * size()))
            return false;
        Polytope polytope(size());
        wrapPoints(left, count, polytope, m_supports);
        m_isChanged = true;
        return expand(polytope, m_supports);
    }

    /// expandSeed() with more capacity, from the points that have filled the first polytope: where the centres of round
    /// shapes nearly coincide, all of their corners are at about the same depth. Throws std::bad_alloc.
    bool expandFurther()
    {
        struct Surface
        {
            explicit Surface(double size) : polytope(size) {}
            BasicPolytope<2048> polytope;
            std::array<Support, 2048> supports;
        };
        const auto surface = std::make_unique<Surface>(size());
        wrapPoints(m_supports, Polytope::kMaxVertices, surface->polytope, surface->supports);
        return expand(surface->polytope, surface->supports);
    }

    /// @param supports of the polytope's vertices
    /// @return false if the answer could not be proved
    template <class P, class Supports>
    bool expand(P& polytope, Supports& supports)
    {
        const double scale = size();
        while (polytope.isValid())
        {
            const PolytopeParts::Face face = polytope.closestFace();
            const bool isOutside = !(face.distance > -kFlat * scale);
            if (isOutside && !m_isFromCache)
                return false;
            const Support& corner = supports[face.vertex[0]];
            const Support s =
                m_isFromCache ? m_search.supportAgainst(-face.scaledNormal, corner.vertexA, corner.vertexB)
                              : m_search.supportAgainst(-face.scaledNormal);
            if (!m_search.isFinite())
                return false;
            const double gap = face.scaledNormal.dot(s.w) / face.length - face.distance;
            // The origin is beyond a face of the cached surface, but perhaps not of A - B. A NaN makes the comparison
            // false.
            m_isSeparated = isOutside && !(face.scaledNormal.dot(s.w) > 0.0);
            if (m_isSeparated)
                return false;
            const bool isDone = !isOutside && gap <= kGapWanted * scale;
            if (m_isFromCache && !isDone && polytope.lift(face))
            {
                m_isChanged = true;
                continue;
            }
            if (!isDone && std::exchange(m_shouldAddCorner, false))
            {
                addCorner(polytope, supports);
                continue;
            }
            const int vertex = isDone ? -1 : polytope.add(s.w);
            if (vertex >= 0)
            {
                supports[vertex] = s;
                ++m_result.iterations;
                m_isChanged = true;
                continue;
            }
            // A NaN makes the comparison false.
            if (isOutside || !(gap <= kGapAccepted * scale))
                return false;
            return finish(polytope, supports, face, std::max(gap, 0.0), s);
        }
        return false;
    }

    /// @param along support along the face's normal
    /// @return false if the points could not be proved
    template <class P, class Supports>
    bool finish(P& polytope, const Supports& supports, const PolytopeParts::Face& face, double gap,
                const Support& along)
    {
        const Eigen::Vector3d normal = face.scaledNormal / face.length;
        store(normal, face.distance + gap, gap, along);
        if (solveFromFace(face, supports) || solveFromTouch(-normal, face.distance + gap))
            m_result.isSettled =
                polytope.isOnlyClosestPlane(face, face.distance + gap + kDepthUncertainty * size());
        else if (!findPoints(polytope, supports, face, gap))
            return false;
        m_result.method = PenetrationMethod::Expansion;
        if (m_isFromCache)
            rememberTriangle(face, -normal, along);
        // The surface of a large polytope cannot be made small enough for the cache.
        if constexpr (std::is_same_v<P, Polytope>)
        {
            if (m_epaCache != nullptr && m_isChanged)
                remember(polytope, face);
        }
        return true;
    }

    /// @return false if the points could not be proved
    template <class P, class Supports>
    bool findPoints(P& polytope, const Supports& supports, const PolytopeParts::Face& face, double gap)
    {
        // The gap is only as accurate as the support, which was found in S.
        const PolytopeParts::Foot foot = polytope.footOf(face, gap + kGapAccepted * size());
        // False for slivers that are mostly rounding. A NaN makes the comparison false.
        const bool isOnRay = foot.miss <= gap + kMissAccepted * size();
        if (!isOnRay && m_isFromCache)
            return false;
        Eigen::Vector3d pointA = Eigen::Vector3d::Zero();
        for (int k = 0; k < 3; ++k)
            pointA += foot.weights[k] * supports[foot.vertex[k]].a;
        const Eigen::Vector3d axis = face.scaledNormal * (-1.0 / face.length);
        storePoints(isOnRay ? pointA : touchAfter(axis, face.distance + gap, pointA));
        return true;
    }

    /// Stores the closest triangle in the GjkCache, where a distance query begins once the shapes have separated.
    void rememberTriangle(const PolytopeParts::Face& face, const Eigen::Vector3d& axis, const Support& along)
    {
        m_cache.state = GjkState::Overlapping;
        m_cache.count = 3;
        for (int k = 0; k < 3; ++k)
        {
            const Support& corner = m_supports[face.vertex[k]];
            m_cache.verticesA[k] = narrowId<S>(corner.vertexA);
            m_cache.verticesB[k] = narrowId<S>(corner.vertexB);
        }
        Search::rememberAxis(axis, along.vertexA, along.vertexB, m_cache);
    }

    /// Stores the surface that proves the depth; if it is too large for the cache, a smaller surface inside of it that
    /// proves the depth too.
    void remember(Polytope& polytope, const PolytopeParts::Face& face)
    {
        if (polytope.faceCount() > EpaCache::kFaces)
            shrink(polytope, face);
        rememberSurface<S>(polytope, m_supports, *m_epaCache);
    }

    /// Removes vertices farther from the origin than the depth and some allowance, so that the shapes may move before
    /// the next query reaches the cut.
    void shrink(Polytope& polytope, const PolytopeParts::Face& face)
    {
        const double reach = 1.2 * face.distance + 0.005 * size();
        for (std::int16_t v = 0; v < polytope.vertexCount(); ++v)
        {
            if (v != face.vertex[0] && v != face.vertex[1] && v != face.vertex[2])
                polytope.removeVertex(v, reach * reach);
        }
    }

    /// @param normal outer normal of A - B: the direction along which B leaves A
    /// @param along support along the normal
    void store(const Eigen::Vector3d& normal, double depth, double gap, const Support& along)
    {
        m_result.vertexA = along.vertexA;
        m_result.vertexB = along.vertexB;
        m_result.depth = static_cast<S>(std::max(depth, 0.0));
        m_result.dualGap = static_cast<S>(gap);
        m_result.axis = (-normal).template cast<S>();
    }

    /// Computes the answer from the features of a face alone, so that it does not depend on the path of the search.
    template <class Supports>
    bool solveFromFace(const PolytopeParts::Face& face, const Supports& supports)
    {
        VertexPairs pairs;
        pairs.count = 3;
        for (std::size_t k = 0; k < 3; ++k)
        {
            const Support& corner = supports[static_cast<std::size_t>(face.vertex[k])];
            pairs.a[k] = corner.vertexA;
            pairs.b[k] = corner.vertexB;
        }
        return solveFromFeatures(pairs, -face.scaledNormal, std::numeric_limits<double>::infinity());
    }

    /// solveFromFace() where the face is only near the features, which rounding hides from the expansion: those that
    /// touch once A has been moved out. Not inlined, so that the stack frame of an expansion stays small.
    [[gnu::noinline]] bool solveFromTouch(const Eigen::Vector3d& axis, double depth)
    {
        if constexpr (HasVertexAmong<A, B>::value)
        {
            using Scalar = typename A::Scalar;
            const PreciseHull<Scalar> a(m_a), b(m_b);
            GjkCache<double> cache;
            return searchTouch(a, b, axis, depth, cache).state == GjkState::Near &&
                   solveFromFeatures(pairsOf(cache), axis, depth + kGapWanted * size());
        }
        else
            return false;
    }

    /// @param about see FeaturePair
    /// @param most  features with a larger depth are refused
    bool solveFromFeatures(const VertexPairs& pairs, const Eigen::Vector3d& about, double most)
    {
        if constexpr (HasVertexAmong<A, B>::value)
        {
            FeaturePair<typename A::Scalar> features(m_a, m_b);
            if (!features.solve(pairs, about, true) || -features.distance() > most)
                return false;
            m_result.vertexA = features.vertexA();
            m_result.vertexB = features.vertexB();
            m_result.depth = static_cast<S>(-features.distance());
            m_result.axis = features.normal().template cast<S>();
            m_result.pointB = features.pointOfB().template cast<S>();
            m_result.pointA = m_result.pointB - m_result.depth * m_result.axis;
            return true;
        }
        else
            return false;
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
        const Support s = m_search.supportAgainst(-normal);
        store(normal, depth, 0.0, s);
        if (!solveFromTouch(-normal, depth))
            storePoints(touchAfter(-normal, depth, s.a));
        m_result.method = PenetrationMethod::Exact;
    }

    /// The point of A that touches B once A has been moved out by the depth.
    ///
    /// @param otherwise returned if no such point is found
    Eigen::Vector3d touchAfter(const Eigen::Vector3d& axis, double depth,
                               const Eigen::Vector3d& otherwise) const
    {
        GjkCache<double> cache;
        const GjkResult<double> near = searchTouch(m_a, m_b, axis, depth, cache);
        return near.state == GjkState::Near ? near.pointA : otherwise;
    }

    /// A is moved a little farther than the depth, so that there is a gap, whose closest points are the touching ones.
    template <class ShapeA, class ShapeB>
    GjkResult<double> searchTouch(const ShapeA& a, const ShapeB& b, const Eigen::Vector3d& axis, double depth,
                                  GjkCache<double>& cache) const
    {
        const MovedShape<ShapeA> out(a, axis * (depth + 1e-3 * size()));
        return gjkDistance(out, b, std::numeric_limits<double>::infinity(), cache);
    }

    const A& m_a;
    const B& m_b;
    Search m_search;
    GjkCache<S>& m_cache;
    EpaCache* m_epaCache;
    bool m_isFromCache = false;
    bool m_isChanged = true;  ///< the surface differs from the cached one
    bool m_shouldAddCorner = false;
    bool m_isSeparated = false;  ///< a separating axis was found
    SeedTetrahedron<Search> m_seed;
    std::array<Support, Polytope::kMaxVertices> m_supports;  ///< of the polytope's vertices
    PenetrationResult<S> m_result;
};

/// Penetration depth and deepest points of two overlapping convex shapes.
///
/// Van den Bergen 2001, "Proximity Queries and Penetration Depth Computation on 3D Game Objects" (EPA), in double,
/// started from the tetrahedron in the cache and, for hulls, the corner along the cached axis with its most level edges
/// (level_corner.h). Two more differences: an answer needs its dual gap, the support along the normal minus the
/// distance of the closest face, which bounds the error from both sides; and without that proof all faces and pairs of
/// edges are examined (exact_penetration.h, hulls only).
///
/// @param cache of this pair in this order, best after a query that returned Overlapping
/// @param memory of this pair in this order, or null: receives the surface from which rememberedPenetration() starts
/// Cost: about one support of each shape and a scan of the polytope's faces per point, none to 60 points; up to 2,048,
/// and an allocation, for round shapes whose centres nearly coincide.
/// Errors: std::bad_alloc; NotConverged for shapes that are no hulls when the expansion fails, and for inputs that are
/// not finite.
template <class S, class A, class B>
PenetrationResult<S> penetration(const A& a, const B& b, GjkCache<S>& cache, EpaCache* memory = nullptr)
{
    return Penetration<S, A, B>(a, b, cache, memory).run();
}

/// penetration() from the surface that the last query stored in `memory`, without a preceding query that returned
/// Overlapping.
///
/// @return NotConverged if the surface proves no depth, or the shapes no longer overlap; then `memory` is empty
/// Cost: one support of each shape and the transformation of up to eleven points, while the closest feature stays the
/// same.
template <class S, class A, class B>
PenetrationResult<S> rememberedPenetration(const A& a, const B& b, GjkCache<S>& cache, EpaCache& memory)
{
    return Penetration<S, A, B>(a, b, cache, &memory).runFromCache();
}
}  // namespace cullet
