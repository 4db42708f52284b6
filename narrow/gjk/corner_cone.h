// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/cone_edges.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/hull/placement.h"
#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/hull/support.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cullet
{
/// The point of A - B closest to the origin, from one of its corners and without a support search.
///
/// **Why it is the closest.** A lies in the cone spanned by the edges at any of its vertices a, and B in the cone at b.
/// So A - B lies in the cone at w = a - b of the edges at a and the mirrored edges at b. If the cone's point closest to
/// the origin belongs to A - B, it is the closest point of A - B, too. It belongs to A - B if it is the corner, or on
/// an edge and not beyond its end, or in the triangle of two edges of one hull, or in the parallelogram of an edge of
/// each hull. Any corner of the closest feature will do, and from frame to frame one mostly persists; else the search
/// continues at the end of an edge beyond which the point lies.
///
/// **The search** is GJK with a corner that is never removed, and at most two edges. Of all neighbours of a and b, the
/// one with the smallest product with the closest point so far gives a new edge; the next closest point is on that edge
/// alone, or between it and one of the previous edges (van den Bergen 1999, theorem 2). The distance decreases
/// strictly, or the search gives up, as it does where the origin is in the cone.
///
/// Neighbours are compared in the scalar of the hulls. Where rounding leaves the order open, as in a face of many
/// corners, they are compared in double, the precision of all points, and a support search confirms the answer.
///
/// Cost: independent of the size of the hulls, one pass over the neighbours of a and b for each added edge and one
/// more: one to three passes for pairs that move from frame to frame, at most 16.
template <class S>
class CornerCone
{
public:
    /// @pre both hulls have graphs
    CornerCone(const PosedHull<S>& a, const PosedHull<S>& b)
        : m_a(a),
          m_b(b),
          m_placement(a, b),
          m_offset(b.origin() - a.origin()),
          m_pointError(S(kPointError) * (a.size() + b.size()))
    {
    }

    /// @param cache has one to three vertex pairs: a corner and the ends of its edges; else the first pair is the
    ///              corner
    /// @return false if the point was not found; then no other result is valid
    template <class C>
    [[gnu::always_inline]] bool find(const GjkCache<C>& cache)
    {
        if (!start(cache))
            return false;
        for (int corners = 1;; ++corners)
        {
            if (!solve())
                return false;
            if (isReached())
                return isPerpendicular();
            if (corners == kMaxCorners ||
                !setCorner(beyond(m_edges.endA, m_vertexA), beyond(m_edges.endB, m_vertexB)))
                return false;
        }
    }

    /// From B to A.
    const Eigen::Vector3d& closest() const { return m_closest; }
    double length2() const { return m_length2; }
    /// Edges added.
    std::int32_t steps() const { return m_steps; }
    /// Passes over the neighbours that were repeated in double, at several times the cost.
    std::int32_t levelPasses() const { return m_levelPasses; }
    /// The corner: a support vertex of each hull along closest().
    std::int32_t vertexA() const { return m_vertexA; }
    std::int32_t vertexB() const { return m_vertexB; }

    /// Relative to the origin of A; the point of B is this minus closest().
    Eigen::Vector3d pointOfA() const
    {
        Eigen::Vector3d point = m_cornerOfA;
        for (int i = 0; i < m_count; ++i)
        {
            const double weight = m_edges.endA[i] != ConeEdges::kNone ? m_weights[i] : 0.0;
            point += weight * Eigen::Vector3d(m_edges.x[i], m_edges.y[i], m_edges.z[i]);
        }
        return point;
    }

    template <class C>
    void remember(GjkCache<C>& cache) const
    {
        cache.count = static_cast<std::uint8_t>(1 + m_count);
        cache.verticesA[0] = narrowId<C>(m_vertexA);
        cache.verticesB[0] = narrowId<C>(m_vertexB);
        // The bound of 2 avoids a compiler warning.
        for (int i = 0; i < std::min(m_count, 2); ++i)
        {
            cache.verticesA[i + 1] =
                narrowId<C>(m_edges.endA[i] != ConeEdges::kNone ? m_edges.endA[i] : m_vertexA);
            cache.verticesB[i + 1] =
                narrowId<C>(m_edges.endB[i] != ConeEdges::kNone ? m_edges.endB[i] : m_vertexB);
        }
    }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;
    using QuadVector = typename Quad<S>::Vector;
    using Pair = Lanes<double>::Vector;
    using Edge = ConeEdge;
    using Wedges = ConeWedges;
    using Ends = ConeEdges::Ends;

    static constexpr int kMaxCorners = 8;
    static constexpr std::int32_t kMaxSteps = 16;
    /// Squared lengths for which the scalar of the hulls represents the direction, for bases of usual sizes. Other
    /// lengths are left to GJK.
    static constexpr double kMin2 = 1e-16, kMax2 = 1e16;
    /// Times the sizes: some roundings of the vertices and products that make a point of A - B.
    static constexpr double kPointError = 32 * std::numeric_limits<double>::epsilon();
    /// Times the squared distance of the corner: the tolerance of GjkSearch.
    static constexpr double kTouching2 = 1e-20;

    /// Whether a cached vertex pair shares exactly one vertex with each of the other pairs.
    template <class C>
    static bool isCommon(const GjkCache<C>& cache, int corner)
    {
        bool isCommon = true;
        for (int i = 0; i < cache.count; ++i)
        {
            const bool isSameA = cache.verticesA[i] == cache.verticesA[corner];
            isCommon &= i == corner || isSameA != (cache.verticesB[i] == cache.verticesB[corner]);
        }
        return isCommon;
    }

    template <class C>
    [[gnu::noinline]] bool start(const GjkCache<C>& cache)
    {
        int corner = 0;
        while (corner < cache.count && !isCommon(cache, corner))
            ++corner;
        const bool hasEdges = corner < cache.count;
        corner = hasEdges ? corner : 0;
        if (!setCorner(cache.verticesA[corner], cache.verticesB[corner]))
            return false;
        if (!hasEdges || cache.count == 1)
            return true;
        const int first = corner == 0 ? 1 : 0, second = cache.count == 3 ? 3 - corner - first : first;
        if (areVertices(cache.verticesA[first], cache.verticesB[first]) &&
            areVertices(cache.verticesA[second], cache.verticesB[second]))
            addCachedEdges(edgeTo(cache.verticesA[first], cache.verticesB[first]), cache.verticesA[second],
                           cache.verticesB[second], second != first);
        return isAwayFromOrigin();
    }

    /// Adds cached edges if they bring the point closer.
    [[gnu::always_inline]] void addCachedEdges(const Edge& edge, std::int32_t a, std::int32_t b,
                                               bool isAnother)
    {
        if (!isAnother)
        {
            if (edge.fall > 0.0 && isUsable(edge))
                setEdge(edge);
            return;
        }
        const Edge other = edgeTo(a, b);
        if (!isUsable(edge) || !isUsable(other))
            return;
        m_edges.set(0, edge, m_vertexA, m_vertexB);
        const Wedges w = wedgesOf(m_edges, other);
        if ((w.inner & 1u) != 0)
            return setWedge(w, 0, other);
        const Edge& better = edge.fall > other.fall ? edge : other;
        if (better.fall > 0.0)
            setEdge(better);
        else
            m_edges.endA[0] = m_edges.endB[0] = ConeEdges::kNone;
    }

    bool areVertices(std::int32_t a, std::int32_t b) const
    {
        return a < m_a.hull().blockCount() && b < m_b.hull().blockCount();
    }

    bool setCorner(std::int32_t a, std::int32_t b)
    {
        if (!areVertices(a, b))
            return false;
        Eigen::Vector3d ofB;
        m_placement.place(a, b, m_cornerOfA, ofB);
        m_corner = m_cornerOfA - ofB - m_offset;
        m_vertexA = a;
        m_vertexB = b;
        m_edges.endA = m_edges.endB = {ConeEdges::kNone, ConeEdges::kNone};
        m_count = 0;
        m_closest = m_corner;
        m_length2 = m_corner.squaredNorm();
        m_least2 = std::max(kMin2, kTouching2 * m_length2);
        return isAwayFromOrigin();
    }

    /// The closest point is neither the origin, within rounding, nor too far away, nor NaN.
    bool isAwayFromOrigin() const { return m_length2 > m_least2 && m_length2 < kMax2; }

    [[gnu::always_inline]] Edge edgeTo(std::int32_t a, std::int32_t b) const
    {
        Edge e = {a, b, m_placement.edgeVector(m_vertexA, m_vertexB, a, b), 0.0, 0.0};
        e.length2 = e.edgeVector.squaredNorm();
        e.fall = -m_corner.dot(e.edgeVector);
        return e;
    }

    static bool isUsable(const Edge& e) { return e.length2 < kMax2; }

    [[gnu::always_inline]] void setEdge(const Edge& e)
    {
        m_weights[0] = e.fall / e.length2;
        m_closest = m_corner + m_weights[0] * e.edgeVector;
        m_length2 = m_closest.squaredNorm();
        m_count = 1;
        m_edges.set(0, e, m_vertexA, m_vertexB);
        m_edges.endA[1] = m_edges.endB[1] = ConeEdges::kNone;
    }

    /// @param old index of the edge that is kept
    [[gnu::always_inline]] void setWedge(const Wedges& w, int old, const Edge& e)
    {
        const double inverse = 1.0 / w.scale[old];
        m_weights = {w.weight[old] * inverse, w.newWeight[old] * inverse};
        if (old == 1)
            m_edges.moveDown();
        // The normal is perpendicular to both edges up to rounding; a weighted sum of the edges would not be where
        // their angle is small.
        const Eigen::Vector3d normal =
            Eigen::Vector3d(m_edges.x[0], m_edges.y[0], m_edges.z[0]).cross(e.edgeVector);
        m_closest = normal * (m_corner.dot(normal) / normal.squaredNorm());
        m_length2 = m_closest.squaredNorm();
        m_count = 2;
        m_edges.set(1, e, m_vertexA, m_vertexB);
    }

    /// @return false if the point does not get closer, or touches the origin
    [[gnu::noinline]] bool addEdge(std::int32_t a, std::int32_t b)
    {
        const double before = m_length2;
        const Edge e = edgeTo(a, b);
        Wedges w;
        w.inner = 0;
        if (m_count > 0)
            w = wedgesOf(m_edges, e);
        w.inner &= (1u << m_count) - 1u;
        if (!isUsable(e) || (w.inner == 0 && !(e.fall > 0.0)))
            return false;
        if (w.inner == 0)
            setEdge(e);
        else
            setWedge(
                w, w.inner == 1 || (w.inner == 3 && w.gain[0] * w.scale[1] >= w.gain[1] * w.scale[0]) ? 0 : 1,
                e);
        return m_length2 < before && isAwayFromOrigin();
    }

    /// @return false if the closest point of the cone was not found
    bool solve()
    {
        for (; m_steps < kMaxSteps; ++m_steps)
        {
            std::int32_t a = m_vertexA, b = m_vertexB;
            if (!findRise(a, b))
                return true;
            if (!addEdge(a, b))
                return false;
        }
        return false;
    }

    bool isOfOneHull() const
    {
        return (m_edges.endA[0] == ConeEdges::kNone) == (m_edges.endA[1] == ConeEdges::kNone);
    }

    bool isReached() const
    {
        const double first = m_count > 0 ? m_weights[0] : 0.0, second = m_count > 1 ? m_weights[1] : 0.0;
        return m_count == 2 && isOfOneHull() ? first + second <= 1.0 : first <= 1.0 && second <= 1.0;
    }

    /// The point is perpendicular to its edges, which findRise() skips, to enough digits. False where the corner is 1e8
    /// times as far away.
    bool isPerpendicular() const
    {
        constexpr double kPerpendicular2 = 1e-16;
        const Pair along = m_edges.x * m_closest[0] + m_edges.y * m_closest[1] + m_edges.z * m_closest[2];
        const unsigned oblique = laneBits(along * along > kPerpendicular2 * m_length2 * m_edges.length2);
        return (oblique & ((1u << m_count) - 1u)) == 0;
    }

    /// The vertex of a hull at the end of an edge beyond which the closest point lies, or the corner's vertex.
    std::int32_t beyond(const Ends& ends, std::int32_t corner) const
    {
        const int far = m_count == 2 && m_weights[1] > m_weights[0] ? 1 : 0;
        for (const int i : {far, 1 - far})
        {
            const bool isBeyond = m_weights[i] > 1.0 || (i == far && m_count == 2 && isOfOneHull());
            if (i < m_count && ends[i] != ConeEdges::kNone && isBeyond)
                return ends[i];
        }
        return corner;
    }

    /// The largest rise along a direction from a vertex to its neighbours, except for two known ones.
    struct Rise
    {
        S height;
        std::int32_t neighbour;
    };

    [[gnu::always_inline]] static Rise riseAround(const Hull<S>& hull, std::int32_t vertex,
                                                  const LaneDirection<S>& d, const Ends& known)
    {
        constexpr int kVectors = 8 / L::kWidth;
        constexpr S kLowest = -std::numeric_limits<S>::infinity();
        Rise rise = {kLowest, vertex};
        std::int32_t index = vertex;
        do
        {
            const NeighbourBlock<S>& block = hull.block(index);
            Vector rises[kVectors];
            for (int k = 0; k < kVectors; ++k)
            {
                Mask id;
                loadIds(&block.id[k * L::kWidth], id);
                const Mask isKnown = (id == Mask{} + known[0]) | (id == Mask{} + known[1]);
                rises[k] = productsOf(block, k * L::kWidth, d);
                rises[k] = isKnown ? L::fill(kLowest) : rises[k];
            }
            const S own = rises[0][0];
            rises[0] = withoutLaneZero(rises[0]);
            const BestNeighbour<S> best = bestNeighbour(block, rises);
            const bool isHigher = best.height - own > rise.height;
            rise.height = isHigher ? best.height - own : rise.height;
            rise.neighbour = isHigher ? best.id : rise.neighbour;
            index = block.id[0];
        } while (index >= 0);
        return rise;
    }

    static void loadIds(const std::int32_t* p, Mask& ids)
    {
        if constexpr (L::kWidth == 4)
            std::memcpy(&ids, p, sizeof(ids));
        else
            ids = L::loadIds(p);
    }

    /// Bounds the error of a rise from rounding of the direction, of two products and of the closest point. The closest
    /// point is perpendicular to its edges only up to that error, which, where shapes nearly touch, exceeds the rise of
    /// neighbours collinear with these edges.
    S riseErrorOf(const PosedHull<S>& shape, S length) const
    {
        return shape.norm() *
               (S(1.5) * shape.hull().tieBand() * length + S(2) * shape.hull().reach() * m_pointError);
    }

    /// Finds the neighbour of the corner with the largest rise against closest().
    ///
    /// @param a, b [in, out] the corner; then the end of the edge
    /// @return false if there is none
    [[gnu::noinline]] bool findRise(std::int32_t& a, std::int32_t& b)
    {
        const S x = static_cast<S>(m_closest[0]), y = static_cast<S>(m_closest[1]),
                z = static_cast<S>(m_closest[2]);
        const QuadVector localA = -(m_a.row(0) * x + m_a.row(1) * y + m_a.row(2) * z);
        const QuadVector localB = m_b.row(0) * x + m_b.row(1) * y + m_b.row(2) * z;
        const Rise ofA = riseAround(m_a.hull(), a, LaneDirection<S>(localA), m_edges.endA);
        const Rise ofB = riseAround(m_b.hull(), b, LaneDirection<S>(localB), m_edges.endB);
        const S length = std::abs(x) + std::abs(y) + std::abs(z);
        const S errorA = riseErrorOf(m_a, length), errorB = riseErrorOf(m_b, length);
        // Bitwise & of integers, since && would add a branch.
        if ((static_cast<int>(ofA.height < -errorA) & static_cast<int>(ofB.height < -errorB)) != 0)
            return false;
        const bool isOfA = ofA.height > ofB.height;
        if (!(isOfA ? ofA.height > errorA : ofB.height > errorB))
            return findLevelRise(a, b);
        a = isOfA ? ofA.neighbour : a;
        b = isOfA ? b : ofB.neighbour;
        return true;
    }

    /// findRise() in double. Neighbours level with the corner may hardly span their cone, as points on an edge that
    /// rounding has moved off it; then a support search decides.
    [[gnu::noinline]] bool findLevelRise(std::int32_t& a, std::int32_t& b)
    {
        ++m_levelPasses;
        EdgeRise best = {0.0, a, b};
        for (const std::int32_t neighbour : m_a.hull().neighbours(m_vertexA))
            keepHigher(neighbour, m_vertexB, best);
        for (const std::int32_t neighbour : m_b.hull().neighbours(m_vertexB))
            keepHigher(m_vertexA, neighbour, best);
        if (!(best.height > 0.0))
        {
            const VertexPair support = PosedHull<S>::supportVertices(
                m_a, m_b, PosedHull<S>::usableDirection(m_closest), {m_vertexA, m_vertexB});
            keepHigher(support.a, m_vertexB, best);
            keepHigher(m_vertexA, support.b, best);
        }
        a = best.endA;
        b = best.endB;
        return best.height > 0.0;
    }

    struct EdgeRise
    {
        double height;
        std::int32_t endA, endB;
    };

    void keepHigher(std::int32_t endA, std::int32_t endB, EdgeRise& best) const
    {
        // Relative and squared; some hundred roundings.
        constexpr double kLevel2 = 1e-26;
        for (int i = 0; i < m_count; ++i)
        {
            if (endA == m_edges.endA[i] || endB == m_edges.endB[i])
                return;
        }
        const Edge e = edgeTo(endA, endB);
        const double height = -m_closest.dot(e.edgeVector);
        if (height > best.height && height * height > kLevel2 * m_length2 * e.length2)
            best = {height, endA, endB};
    }

    const PosedHull<S>& m_a;
    const PosedHull<S>& m_b;
    Placement<PosedHull<S>, PosedHull<S>> m_placement;
    Eigen::Vector3d m_offset;
    std::int32_t m_vertexA = 0, m_vertexB = 0;
    Eigen::Vector3d m_corner, m_cornerOfA;
    ConeEdges m_edges;
    std::array<double, 2> m_weights = {};
    int m_count = 0;  ///< edges
    std::int32_t m_steps = 0;
    std::int32_t m_levelPasses = 0;
    Eigen::Vector3d m_closest;
    double m_length2 = 0.0;
    double m_least2 = 0.0;
    S m_pointError;  ///< bound of the rounding error of the closest point
};
}  // namespace cullet
