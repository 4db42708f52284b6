// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/hull_pair.h"
#include "narrow/lanes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace cullet
{
/// What the edges at one corner w of A - B tell about the origin, without a support search: four points that likely
/// enclose it, or an axis that likely separates.
///
/// The edges of A - B at w = a - b are among those of A at a and, mirrored, of B at b. They span the cone in which all of
/// A - B lies. Seen along the line through w and the origin they are points around the centre of a plane, and the line
/// is inside the cone exactly if they surround the centre. `up` and `side` are the axes of that plane; a point on the far
/// side of A - B defines up. The edge on each side with the lowest slope up / side decides:
///
/// * If the two slopes add up to less than zero the line is in the cone. If w is the lowest point along an axis on which
///   the origin is higher, so is the origin, and the far point, w and the ends of the two edges often have it inside.
/// * Else every direction of the plane between the two normals of these edges has w lowest, level with the origin.
///   Tilted towards w it separates, as far as it goes until another edge is level with w.
///
/// A shift of A - B asks the same about another point than the origin.
///
/// Everything is rounded, and nothing is proved here. Cost: each neighbour of a and b is looked at once or twice.
template <class S>
class CornerFan
{
public:
    using Point = Eigen::Matrix<S, 3, 1>;

    /// @param a, b support vertices against some axis, of hulls that have neighbours
    CornerFan(const HullPair<S>& pair, std::int32_t a, std::int32_t b, S shiftX, S shiftY, S shiftZ)
        : m_vertexA{pair.a().hull().opposite(a), a, a, a}, m_vertexB{pair.b().hull().opposite(b), b, b, b}
    {
        const Point shift(shiftX, shiftY, shiftZ);
        const Point w = pair.point(a, b) + shift;
        const Point far = pair.point(m_vertexA[0], m_vertexB[0]) + shift;
        const Point side = far.cross(w);
        const Point up = w.cross(side);
        lookAround(pair.a(), a, up, side, 0);
        lookAround(pair.b(), b, -up, -side, kOfB);
        const S left = take(m_left, m_leftId, 2);
        const S right = take(m_right, m_rightId, 3);
        m_isComplete = left < kNone && right < kNone;
        m_isCone = left + right < S(0);
        if (m_isComplete && !m_isCone)
            tilt(pair, up + S(0.5) * (right - left) * side, w);
    }

    /// False if there is no edge on one side, or a coordinate is not finite; then nothing else is valid.
    bool isComplete() const { return m_isComplete; }
    /// The line from w through the origin is in the cone.
    bool isCone() const { return m_isCone; }
    /// If so, the vertex pairs of four points: far, w, and two neighbours of w.
    const std::array<std::int32_t, 4>& verticesA() const { return m_vertexA; }
    const std::array<std::int32_t, 4>& verticesB() const { return m_vertexB; }
    /// If not, an axis from B to A along which w likely is the support point.
    const Point& axis() const { return m_axis; }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;

    static constexpr S kNone = std::numeric_limits<S>::infinity();
    /// Marks a neighbour of b.
    static constexpr std::int32_t kOfB = std::int32_t(1) << 30;

    struct Direction
    {
        Direction(const PosedHull<S>& shape, const Point& world)
        {
            const typename Quad<S>::Vector d =
                shape.row(0) * world[0] + shape.row(1) * world[1] + shape.row(2) * world[2];
            x = L::fill(d[0]);
            y = L::fill(d[1]);
            z = L::fill(d[2]);
        }
        Vector x, y, z;
    };

    /// Calls see(edge . first, edge . second, neighbours) for vectors of edges that begin at the vertex; some have no
    /// length.
    template <class See>
    static void forEdges(const PosedHull<S>& shape, std::int32_t vertex, const Point& worldFirst,
                         const Point& worldSecond, const See& see)
    {
        const Hull<S>& hull = shape.hull();
        const Direction first(shape, worldFirst), second(shape, worldSecond);
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
                see(alongFirst, alongSecond, &block.id[lane]);
            }
        }
    }

    void lookAround(const PosedHull<S>& shape, std::int32_t vertex, const Point& up, const Point& side,
                    std::int32_t mark)
    {
        forEdges(shape, vertex, up, side,
                 [&](const Vector& height, const Vector& along, const std::int32_t* neighbours)
                 {
                     const Vector slope = height / along;
                     const Mask id = L::loadIds(neighbours) | mark;
                     keepLower(along > S(0), slope, id, m_left, m_leftId);
                     keepLower(along < S(0), -slope, id, m_right, m_rightId);
                 });
    }

    static void keepLower(const Mask& isHere, const Vector& slope, const Mask& id, Vector& best, Mask& bestId)
    {
        const Mask isLower = isHere & (slope < best);
        best = isLower ? slope : best;
        bestId = isLower ? id : bestId;
    }

    /// Puts the neighbour with the lowest slope into the vertex pair at a place.
    S take(const Vector& slopes, const Mask& ids, int place)
    {
        const S lowest = -largestLane(-slopes);
        const unsigned lanes = laneBits(slopes == L::fill(lowest)) | 1u << (L::kWidth - 1);
        const std::int32_t id = static_cast<std::int32_t>(ids[__builtin_ctz(lanes)]);
        const bool isOfB = (id & kOfB) != 0;
        m_vertexA[place] = isOfB ? m_vertexA[place] : id;
        m_vertexB[place] = isOfB ? id & ~kOfB : m_vertexB[place];
        return lowest;
    }

    /// Not all the way, since a vertex that is level with w would leave it open which of them is the support.
    void tilt(const HullPair<S>& pair, const Point& level, const Point& w)
    {
        Vector farthest = L::fill(kNone);
        const auto see = [&](const Vector& height, const Vector& along, const std::int32_t*)
        {
            const Vector way = -height / along;
            farthest = (along < S(0)) & (way < farthest) ? way : farthest;
        };
        forEdges(pair.a(), m_vertexA[1], level, w, see);
        forEdges(pair.b(), m_vertexB[1], -level, -w, see);
        // Bounded where no edge leads towards the origin.
        const S bound = S(1e3) * level.cwiseAbs().maxCoeff() / w.cwiseAbs().maxCoeff();
        m_axis = level + S(0.9) * std::min(-largestLane(-farthest), bound) * w;
    }

    std::array<std::int32_t, 4> m_vertexA, m_vertexB;
    Vector m_left = L::fill(kNone), m_right = L::fill(kNone);  ///< lowest slopes so far on each side
    Mask m_leftId = {}, m_rightId = {};
    Point m_axis = Point::Zero();
    bool m_isComplete = false;
    bool m_isCone = false;
};
}  // namespace cullet
