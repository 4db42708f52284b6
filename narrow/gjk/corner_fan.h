// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/hull_pair.h"
#include "cullet/narrow/math/lanes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Classifies the origin by the edges at one corner w of A - B, without a support search: finds four points that likely
/// enclose it, or an axis that likely separates.
///
/// The edges of A - B at w = a - b are among the edges of A at a and the mirrored edges of B at b. They span the cone
/// in which all of A - B lies. Projected along the line through w and the origin they are points around the centre of a
/// plane, and the line is inside the cone exactly if they surround the centre. `up` and `side` are the axes of that
/// plane; a point on the far side of A - B defines up. The edge on each side with the lowest slope up / side decides:
///
/// * If the two slopes add up to less than zero the line is in the cone. If w is the lowest point along an axis on
///   which the origin is higher, the origin is in the cone, too, and the tetrahedron of the far point, w and the ends
///   of the two edges often contains it.
/// * Else every direction of the plane between the two normals of these edges has w lowest, level with the origin.
///   Tilted towards w the axis separates, until another edge is level with w. If the end of that edge is the edge's
///   point nearest to the origin, the axis is tilted further from there: an axis towards the nearest point of A - B
///   separates for more frames.
///
/// A shift of A - B classifies another point than the origin.
///
/// All values are rounded, and nothing is proved here. Cost: one or two passes over the neighbours of a and b.
template <class S>
class CornerFan
{
public:
    using Point = Eigen::Matrix<S, 3, 1>;

    /// @param a, b support vertices against some axis, of hulls that have graphs
    CornerFan(const HullPair<S>& pair, std::int32_t a, std::int32_t b, S shiftX, S shiftY, S shiftZ)
        : m_shift(shiftX, shiftY, shiftZ),
          m_vertexA{pair.a().hull().opposite(a), a, a, a},
          m_vertexB{pair.b().hull().opposite(b), b, b, b},
          m_corner{a, b}
    {
        const Point w = pair.point(a, b) + m_shift;
        const Point far = pair.point(m_vertexA[0], m_vertexB[0]) + m_shift;
        const Point side = far.cross(w);
        const Point up = w.cross(side);
        Local localUp(pair, up);
        const Local localSide(pair, side);
        collectSlopes(pair.a().hull(), a, localUp.a, localSide.a, 0);
        collectSlopes(pair.b().hull(), b, localUp.b, localSide.b, kOfB);
        const S left = m_left.slope();
        const S right = m_right.slope();
        m_isComplete = left < kNone && right < kNone;
        m_isCone = left + right < S(0);
        if (m_isCone)
        {
            put(m_left.end(m_corner), 2);
            put(m_right.end(m_corner), 3);
        }
        else if (m_isComplete)
        {
            const S middle = S(0.5) * (right - left);
            m_axis = up + middle * side;
            localUp.add(middle, localSide);
            tilt(pair, localUp, w);
        }
    }

    /// False if there is no edge on one side, or a coordinate is not finite; then no other result is valid.
    bool isComplete() const { return m_isComplete; }
    /// The line from w through the origin is in the cone.
    bool isCone() const { return m_isCone; }
    /// If isCone(), the vertex pairs of four points: far, w, and two neighbours of w.
    const std::array<std::int32_t, 4>& verticesA() const { return m_vertexA; }
    const std::array<std::int32_t, 4>& verticesB() const { return m_vertexB; }
    /// If not isCone(), an axis from B to A, and the vertex pair that is likely its support point.
    const Point& axis() const { return m_axis; }
    const VertexPair& corner() const { return m_corner; }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;

    static constexpr S kNone = std::numeric_limits<S>::infinity();
    /// Marks a neighbour of b.
    static constexpr std::int32_t kOfB = std::int32_t(1) << 30;
    /// Corners at which an axis is tilted, after the first. More brought nothing where measured.
    static constexpr int kMaxTilts = 2;

    using QuadVector = typename Quad<S>::Vector;

    /// A direction of A - B in the axes of each hull.
    struct Local
    {
        Local(const HullPair<S>& pair, const Point& world)
            : a(pair.a().row(0) * world[0] + pair.a().row(1) * world[1] + pair.a().row(2) * world[2]),
              b(-(pair.b().row(0) * world[0] + pair.b().row(1) * world[1] + pair.b().row(2) * world[2]))
        {
        }

        void add(S times, const Local& other)
        {
            a += times * other.a;
            b += times * other.b;
        }

        QuadVector a, b;
    };

    /// Calls visit(edge . first, edge . second, neighbours) for vectors of edges that begin at the vertex; some edges
    /// are zero.
    template <class Visit>
    static void forEachEdge(const Hull<S>& hull, std::int32_t vertex, const QuadVector& localFirst,
                            const QuadVector& localSecond, const Visit& visit)
    {
        const LaneDirection<S> first(localFirst), second(localSecond);
        for (std::int32_t index = vertex; index >= 0; index = hull.block(index).id[0])
        {
            const NeighbourBlock<S>& block = hull.block(index);
            const Vector x0 = L::fill(block.x[0]), y0 = L::fill(block.y[0]), z0 = L::fill(block.z[0]);
            for (int lane = 0; lane < 8; lane += L::kWidth)
            {
                const Vector x = L::load(&block.x[lane]) - x0;
                const Vector y = L::load(&block.y[lane]) - y0;
                const Vector z = L::load(&block.z[lane]) - z0;
                const Vector alongFirst = x * first.x + y * first.y + z * first.z;
                const Vector alongSecond = x * second.x + y * second.y + z * second.z;
                visit(alongFirst, alongSecond, &block.id[lane]);
            }
        }
    }

    /// The lowest of many slopes and its neighbour, by lane.
    class Lowest
    {
    public:
        void keep(const Mask& isHere, const Vector& slope, const Mask& id)
        {
            const Mask isLower = isHere & (slope < m_slope);
            m_slope = isLower ? slope : m_slope;
            m_id = isLower ? id : m_id;
        }

        S slope() const { return -largestLane(-m_slope); }

        /// The corner with a vertex replaced by the neighbour with the lowest slope; not valid without an edge.
        VertexPair end(const VertexPair& corner) const
        {
            const unsigned lanes = laneBits(m_slope == L::fill(slope())) | 1u << (L::kWidth - 1);
            const std::int32_t id = static_cast<std::int32_t>(m_id[__builtin_ctz(lanes)]);
            const bool isOfB = (id & kOfB) != 0;
            return {isOfB ? corner.a : id, isOfB ? id & ~kOfB : corner.b};
        }

    private:
        Vector m_slope = L::fill(kNone);
        Mask m_id = {};
    };

    void collectSlopes(const Hull<S>& hull, std::int32_t vertex, const QuadVector& up, const QuadVector& side,
                       std::int32_t mark)
    {
        forEachEdge(hull, vertex, up, side,
                    [&](const Vector& height, const Vector& along, const std::int32_t* neighbours)
                    {
                        const Vector slope = height / L::withoutZeros(along);
                        const Mask id = L::loadIds(neighbours) | mark;
                        m_left.keep(along > S(0), slope, id);
                        m_right.keep(along < S(0), -slope, id);
                    });
    }

    void put(const VertexPair& pair, int place)
    {
        m_vertexA[place] = pair.a;
        m_vertexB[place] = pair.b;
    }

    /// Finds how far an axis can be tilted towards a point until an edge at the corner is level.
    Lowest tiltUntilLevel(const HullPair<S>& pair, const Local& axis, const Local& towards) const
    {
        Lowest lowest;
        std::int32_t mark = 0;
        const auto visit = [&](const Vector& height, const Vector& along, const std::int32_t* neighbours)
        { lowest.keep(along < S(0), -height / L::withoutZeros(along), L::loadIds(neighbours) | mark); };
        forEachEdge(pair.a().hull(), m_corner.a, axis.a, towards.a, visit);
        mark = kOfB;
        forEachEdge(pair.b().hull(), m_corner.b, axis.b, towards.b, visit);
        return lowest;
    }

    /// Tilts the axis towards its support points. The last tilt is not complete, since with a vertex level with the
    /// corner the support would be ambiguous.
    ///
    /// @param axis [in, out] the axis so far
    void tilt(const HullPair<S>& pair, Local& axis, const Point& w)
    {
        Point towards = w;
        for (int tilts = 0;; ++tilts)
        {
            const Local localTowards(pair, towards);
            const Lowest lowest = tiltUntilLevel(pair, axis, localTowards);
            // Negative after a complete tilt.
            const S farthest = std::max(lowest.slope(), S(0));
            // The bound applies where no edge leads towards the origin.
            const S bound = S(1e3) * m_axis.cwiseAbs().maxCoeff() / towards.cwiseAbs().maxCoeff();
            if (tilts < kMaxTilts && farthest < bound)
            {
                const VertexPair end = lowest.end(m_corner);
                const Point next = pair.point(end.a, end.b) + m_shift;
                // Where the shapes touch, the next point may be the origin, which is no direction.
                if (next.dot(next - towards) <= S(0) && !next.isZero(S(0)))
                {
                    m_axis += farthest * towards;
                    axis.add(farthest, localTowards);
                    towards = next;
                    m_corner = end;
                    continue;
                }
            }
            m_axis += S(0.9) * std::min(farthest, bound) * towards;
            return;
        }
    }

    Point m_shift;
    std::array<std::int32_t, 4> m_vertexA, m_vertexB;
    Lowest m_left, m_right;  ///< lowest slope on each side
    VertexPair m_corner;
    Point m_axis = Point::Zero();
    bool m_isComplete = false;
    bool m_isCone = false;
};
}  // namespace cullet
