// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/gjk_types.h"
#include "narrow/lanes.h"
#include "narrow/placement.h"
#include "narrow/posed_hull.h"
#include "narrow/support.h"

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
/// **Why it is the closest.** A lies in the cone that the edges at any of its vertices a span, and B in that at b. So A - B lies
/// in the cone at w = a - b of the edges at a and, mirrored, those at b. If the cone's point closest to the origin belongs to
/// A - B, it is the closest of A - B, too. It does where it is the corner, or on an edge and not beyond its end, or in the
/// triangle of two edges of one hull, or in the parallelogram of an edge of each. Any corner of the feature that has the
/// closest point will do, and from frame to frame one mostly stays; else the search goes on where an edge ends that the
/// point lies beyond.
///
/// **The search** is GJK's with a corner that always stays, and at most two edges. Of all neighbours of a and b, the one
/// against which the closest point so far leads most gives a new edge; the closest point is then on it alone, or between it
/// and one of those before (van den Bergen 1999, theorem 2). The distance decreases strictly, or the search gives up: the
/// origin is in the cone, and the shapes overlap, as a rule.
///
/// Neighbours are compared in the scalar of the hulls. Those that rounding leaves in doubt, in a face of many corners, say,
/// are looked at in double, in which all points are.
///
/// Cost: the neighbours of a and b are looked at one to three times, whatever the size of the hulls.
template <class S>
class CornerCone
{
public:
    /// @pre both hulls have neighbours
    CornerCone(const PosedHull<S>& a, const PosedHull<S>& b)
        : m_a(a), m_b(b), m_placement(a, b), m_offset(b.origin() - a.origin())
    {
    }

    /// @param cache has one to three vertex pairs: a corner and the ends of its edges, or some of which the first is taken
    /// @return false if the point is not found; then nothing else is valid
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
                return true;
            if (corners == kMostCorners ||
                !takeCorner(beyond(m_edges.endA, m_vertexA), beyond(m_edges.endB, m_vertexB)))
                return false;
        }
    }

    /// From B to A.
    const Eigen::Vector3d& closest() const { return m_closest; }
    double length2() const { return m_length2; }
    /// Edges that came in.
    std::int32_t steps() const { return m_steps; }
    /// The corner: a support vertex of each hull along closest().
    std::int32_t vertexA() const { return m_vertexA; }
    std::int32_t vertexB() const { return m_vertexB; }

    /// Relative to the origin of A; that of B is this minus closest().
    Eigen::Vector3d pointOfA() const
    {
        Eigen::Vector3d point = m_cornerOfA;
        for (int i = 0; i < m_count; ++i)
        {
            const double weight = m_edges.endA[i] != kNone ? m_weights[i] : 0.0;
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
        // Of two, or the compiler warns.
        for (int i = 0; i < std::min(m_count, 2); ++i)
        {
            cache.verticesA[i + 1] = narrowId<C>(m_edges.endA[i] != kNone ? m_edges.endA[i] : m_vertexA);
            cache.verticesB[i + 1] = narrowId<C>(m_edges.endB[i] != kNone ? m_edges.endB[i] : m_vertexB);
        }
    }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;
    using QuadVector = typename Quad<S>::Vector;
    using Pair = Lanes<double>::Vector;
    using Ends = std::array<std::int32_t, 2>;

    static constexpr int kMostCorners = 8;
    static constexpr std::int32_t kMostSteps = 16;
    /// No vertex, and no block.
    static constexpr std::int32_t kNone = -2;
    /// Of lengths whose direction can be told in the scalar of the hulls, squared.
    static constexpr double kLeast2 = 1e-16, kMost2 = 1e16;
    /// Of the distance of the corner, squared: as GjkSearch has it.
    static constexpr double kTouching2 = 1e-20;
    /// Squared sine of an angle between edges: less leaves too few digits of the weights.
    static constexpr double kThin = 1e-10;

    /// A vertex of each hull, of which one is the corner's.
    struct Edge
    {
        std::int32_t endA, endB;
        Eigen::Vector3d way;
        double length2;
        double fall;  ///< by how much the product with the corner decreases along the way
    };

    /// Up to two of them, side by side.
    struct Edges
    {
        Pair x = {}, y = {}, z = {}, length2 = {}, fall = {};
        Ends endA = {kNone, kNone}, endB = {kNone, kNone};  ///< kNone where it is the corner's

        void set(int i, const Edge& e, std::int32_t cornerA, std::int32_t cornerB)
        {
            // Both lanes, since the other would be read from memory first.
            const auto put = [i](Pair& lanes, double value) {
                lanes = Pair{i == 0 ? value : lanes[0], value};
            };
            put(x, e.way[0]);
            put(y, e.way[1]);
            put(z, e.way[2]);
            put(length2, e.length2);
            put(fall, e.fall);
            endA[i] = e.endA == cornerA ? kNone : e.endA;
            endB[i] = e.endB == cornerB ? kNone : e.endB;
        }
        /// The second is the first, too.
        void moveDown()
        {
            x[0] = x[1];
            y[0] = y[1];
            z[0] = z[1];
            length2[0] = length2[1];
            fall[0] = fall[1];
            endA[0] = endA[1];
            endB[0] = endB[1];
        }
    };

    /// The closest points in the planes of an edge and each of two: weights of both, times `scale`.
    struct Wedges
    {
        Pair weight, newWeight, scale, gain;
        unsigned inner;  ///< bit i: the point lies between the edge and the i-th
    };

    [[gnu::always_inline]] static Wedges wedgesOf(const Edges& edges, const Edge& e)
    {
        const Pair between = edges.x * e.way[0] + edges.y * e.way[1] + edges.z * e.way[2];
        const Pair product = edges.length2 * e.length2;
        Wedges w;
        w.scale = product - between * between;
        w.weight = edges.fall * e.length2 - e.fall * between;
        w.newWeight = e.fall * edges.length2 - edges.fall * between;
        w.gain = w.weight * edges.fall + w.newWeight * e.fall;
        w.inner = laneBits((w.weight > Pair{}) & (w.newWeight > Pair{}) & (w.scale > kThin * product));
        return w;
    }

    /// Whether a remembered vertex pair has a vertex in common with each of the others.
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
        if (!takeCorner(cache.verticesA[corner], cache.verticesB[corner]))
            return false;
        if (!hasEdges || cache.count == 1)
            return true;
        const int first = corner == 0 ? 1 : 0, second = cache.count == 3 ? 3 - corner - first : first;
        if (areVertices(cache.verticesA[first], cache.verticesB[first]) &&
            areVertices(cache.verticesA[second], cache.verticesB[second]))
            recall(edgeTo(cache.verticesA[first], cache.verticesB[first]), cache.verticesA[second],
                   cache.verticesB[second], second != first);
        return isApart();
    }

    /// Remembered edges come in if that brings the point closer.
    [[gnu::always_inline]] void recall(const Edge& edge, std::int32_t a, std::int32_t b, bool isAnother)
    {
        if (!isAnother)
        {
            if (edge.fall > 0.0)
                takeEdge(edge);
            return;
        }
        const Edge other = edgeTo(a, b);
        m_edges.set(0, edge, m_vertexA, m_vertexB);
        const Wedges w = wedgesOf(m_edges, other);
        if ((w.inner & 1u) != 0)
            return takeWedge(w, 0, other);
        const Edge& better = edge.fall > other.fall ? edge : other;
        if (better.fall > 0.0)
            takeEdge(better);
        else
            m_edges.endA[0] = m_edges.endB[0] = kNone;
    }

    bool areVertices(std::int32_t a, std::int32_t b) const
    {
        return a < m_a.hull().blockCount() && b < m_b.hull().blockCount();
    }

    bool takeCorner(std::int32_t a, std::int32_t b)
    {
        if (!areVertices(a, b))
            return false;
        Eigen::Vector3d ofB;
        m_placement.place(a, b, m_cornerOfA, ofB);
        m_corner = m_cornerOfA - ofB - m_offset;
        m_vertexA = a;
        m_vertexB = b;
        m_edges.endA = m_edges.endB = {kNone, kNone};
        m_count = 0;
        m_closest = m_corner;
        m_length2 = m_corner.squaredNorm();
        m_least2 = std::max(kLeast2, kTouching2 * m_length2);
        return isApart();
    }

    /// The closest point is neither the origin, as far as that can be told, nor too far away; nor is it NaN.
    bool isApart() const { return m_length2 > m_least2 && m_length2 < kMost2; }

    [[gnu::always_inline]] Edge edgeTo(std::int32_t a, std::int32_t b) const
    {
        Edge e = {a, b, m_placement.way(m_vertexA, m_vertexB, a, b), 0.0, 0.0};
        e.length2 = e.way.squaredNorm();
        e.fall = -m_corner.dot(e.way);
        return e;
    }

    [[gnu::always_inline]] void takeEdge(const Edge& e)
    {
        m_weights[0] = e.fall / e.length2;
        m_closest = m_corner + m_weights[0] * e.way;
        m_length2 = m_closest.squaredNorm();
        m_count = 1;
        m_edges.set(0, e, m_vertexA, m_vertexB);
        m_edges.endA[1] = m_edges.endB[1] = kNone;
    }

    /// @param old which edge stays
    [[gnu::always_inline]] void takeWedge(const Wedges& w, int old, const Edge& e)
    {
        const double inverse = 1.0 / w.scale[old];
        m_weights = {w.weight[old] * inverse, w.newWeight[old] * inverse};
        if (old == 1)
            m_edges.moveDown();
        m_closest = m_corner + m_weights[0] * Eigen::Vector3d(m_edges.x[0], m_edges.y[0], m_edges.z[0]) +
                    m_weights[1] * e.way;
        m_length2 = m_closest.squaredNorm();
        m_count = 2;
        m_edges.set(1, e, m_vertexA, m_vertexB);
    }

    /// @return false if the point does not come closer, or touches the origin
    [[gnu::noinline]] bool enter(std::int32_t a, std::int32_t b)
    {
        const double before = m_length2;
        const Edge e = edgeTo(a, b);
        Wedges w;
        w.inner = 0;
        if (m_count > 0)
            w = wedgesOf(m_edges, e);
        w.inner &= (1u << m_count) - 1u;
        if (w.inner == 0)
            takeEdge(e);
        else
            takeWedge(
                w, w.inner == 1 || (w.inner == 3 && w.gain[0] * w.scale[1] >= w.gain[1] * w.scale[0]) ? 0 : 1,
                e);
        return m_length2 < before && isApart();
    }

    /// @return false if the closest point of the cone is not found
    bool solve()
    {
        for (; m_steps < kMostSteps; ++m_steps)
        {
            std::int32_t a = m_vertexA, b = m_vertexB;
            if (!findRise(a, b))
                return true;
            if (!enter(a, b))
                return false;
        }
        return false;
    }

    bool isOfOneHull() const { return (m_edges.endA[0] == kNone) == (m_edges.endA[1] == kNone); }

    bool isReached() const
    {
        const double first = m_count > 0 ? m_weights[0] : 0.0, second = m_count > 1 ? m_weights[1] : 0.0;
        return m_count == 2 && isOfOneHull() ? first + second <= 1.0 : first <= 1.0 && second <= 1.0;
    }

    /// The vertex of a hull at the end of an edge that the closest point lies beyond, or of the corner.
    std::int32_t beyond(const Ends& ends, std::int32_t corner) const
    {
        const int far = m_count == 2 && m_weights[1] > m_weights[0] ? 1 : 0;
        for (const int i : {far, 1 - far})
        {
            const bool isBeyond = m_weights[i] > 1.0 || (i == far && m_count == 2 && isOfOneHull());
            if (i < m_count && ends[i] != kNone && isBeyond)
                return ends[i];
        }
        return corner;
    }

    /// By how much the neighbours of a vertex are higher along a direction; but for two of them.
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
            Vector best = rises[0];
            for (int k = 1; k < kVectors; ++k)
                best = best > rises[k] ? best : rises[k];
            const S highest = largestLane(best);
            unsigned bits = 0x80u;  // a NaN equals nothing
            for (int k = 0; k < kVectors; ++k)
                bits |= (laneBits(rises[k] == L::fill(highest)) & ~(k == 0 ? 1u : 0u)) << (k * L::kWidth);
            const std::int32_t neighbour = block.id[__builtin_ctz(bits)];
            const bool isHigher = highest - own > rise.height;
            rise.height = isHigher ? highest - own : rise.height;
            rise.neighbour = isHigher ? neighbour : rise.neighbour;
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

    /// What rounding of the direction and of two products can make of a rise.
    static S doubtOf(const PosedHull<S>& shape, S length)
    {
        return S(1.5) * shape.hull().tieBand() * shape.norm() * length;
    }

    /// The neighbour of the corner against which the closest point leads most.
    ///
    /// @param a, b [in, out] the corner; then the edge's end
    /// @return false if there is none
    [[gnu::noinline]] bool findRise(std::int32_t& a, std::int32_t& b) const
    {
        const S x = static_cast<S>(m_closest[0]), y = static_cast<S>(m_closest[1]),
                z = static_cast<S>(m_closest[2]);
        const QuadVector localA = -(m_a.row(0) * x + m_a.row(1) * y + m_a.row(2) * z);
        const QuadVector localB = m_b.row(0) * x + m_b.row(1) * y + m_b.row(2) * z;
        const Rise ofA = riseAround(m_a.hull(), a, LaneDirection<S>(localA), m_edges.endA);
        const Rise ofB = riseAround(m_b.hull(), b, LaneDirection<S>(localB), m_edges.endB);
        const S length = std::abs(x) + std::abs(y) + std::abs(z);
        const S doubtA = doubtOf(m_a, length), doubtB = doubtOf(m_b, length);
        // Of integers, since && would branch once more.
        if ((static_cast<int>(ofA.height < -doubtA) & static_cast<int>(ofB.height < -doubtB)) != 0)
            return false;
        const bool isOfA = ofA.height > ofB.height;
        if (!(isOfA ? ofA.height > doubtA : ofB.height > doubtB))
            return findLevelRise(a, b);
        a = isOfA ? ofA.neighbour : a;
        b = isOfA ? b : ofB.neighbour;
        return true;
    }

    /// The same in double.
    [[gnu::noinline]] bool findLevelRise(std::int32_t& a, std::int32_t& b) const
    {
        // Relative; some hundred roundings.
        constexpr double kLevel2 = 1e-26;
        double best = 0.0;
        const auto look = [&](std::int32_t endA, std::int32_t endB)
        {
            for (int i = 0; i < m_count; ++i)
            {
                if (endA == m_edges.endA[i] || endB == m_edges.endB[i])
                    return;
            }
            const Edge e = edgeTo(endA, endB);
            const double rise = -m_closest.dot(e.way);
            if (!(rise > best && rise * rise > kLevel2 * m_length2 * e.length2))
                return;
            best = rise;
            a = endA;
            b = endB;
        };
        for (const std::int32_t neighbour : m_a.hull().neighbours(m_vertexA))
            look(neighbour, m_vertexB);
        for (const std::int32_t neighbour : m_b.hull().neighbours(m_vertexB))
            look(m_vertexA, neighbour);
        return best > 0.0;
    }

    const PosedHull<S>& m_a;
    const PosedHull<S>& m_b;
    Placement<PosedHull<S>, PosedHull<S>> m_placement;
    Eigen::Vector3d m_offset;
    std::int32_t m_vertexA = 0, m_vertexB = 0;
    Eigen::Vector3d m_corner, m_cornerOfA;
    Edges m_edges;
    std::array<double, 2> m_weights = {};
    int m_count = 0;  ///< edges
    std::int32_t m_steps = 0;
    Eigen::Vector3d m_closest;
    double m_length2 = 0.0;
    double m_least2 = 0.0;
};
}  // namespace cullet
