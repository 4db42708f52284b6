// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/vertex_pairs.h"
#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cullet
{
/// Guesses the closest features of two hulls of which one lies on the other: a face of each, seen along a direction, overlap
/// in a polygon, and the hulls are closest at one of its corners. That is a corner of one face over the other, or a place
/// where an edge of one crosses an edge of the other.
///
/// It is a guess, since other faces may be closer; FeaturePair::solve() proves it. After a body has slid on, it is often
/// right where the features of the last pose are not, and costs less than a search.
///
/// Cost: O(p q) for faces of p and q corners.
template <class S>
class FacingFaces
{
public:
    /// Of faces with more corners nothing is found.
    static constexpr std::int32_t kMostCorners = 16;

    /// @param vertexA, vertexB on the faces
    /// @param about of any length, approximately from B to A
    FacingFaces(const PosedHull<S>& a, const PosedHull<S>& b, std::int32_t vertexA, std::int32_t vertexB,
                const Eigen::Vector3d& about)
    {
        const double length = about.norm();
        if (!(length > 0.0))
            return;
        const Matrix axes = axesAlong(about / length);
        const Face ofA(a, vertexA, axes, -1.0, Vector::Zero()),
            ofB(b, vertexB, axes, 1.0, b.origin() - a.origin());
        if (!ofA.isUsable() || !ofB.isUsable())
            return;
        const Sides aOverB(ofA, ofB), bOverA(ofB, ofA);
        considerCorners(aOverB, ofA, ofB, false);
        considerCorners(bOverA, ofB, ofA, true);
        considerCrossings(aOverB, bOverA, ofA, ofB);
    }

    bool isFound() const { return m_pairs.count > 0; }
    /// Three vertices of a face and one over it, or two of each of two edges.
    const VertexPairs& pairs() const { return m_pairs; }

private:
    static std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

    using Vector = Eigen::Vector3d;
    using Matrix = Eigen::Matrix3d;
    using Numbers = std::array<double, kMostCorners>;
    using Lane = Lanes<double>::Vector;

    static constexpr std::int32_t kLanes = Lanes<double>::kWidth;
    static_assert(kMostCorners % kLanes == 0, "the last lanes are within the arrays");

    static Lane load(const Numbers& numbers, std::int32_t from)
    {
        Lane lanes;
        std::memcpy(&lanes, &numbers[at(from)], sizeof(lanes));
        return lanes;
    }

    /// Two tangents of a unit vector and the vector itself, as rows (Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited").
    static Matrix axesAlong(const Vector& up)
    {
        const double sign = std::copysign(1.0, up[2]), a = -1.0 / (sign + up[2]), b = up[0] * up[1] * a;
        Matrix axes;
        axes << 1.0 + sign * up[0] * up[0] * a, sign * b, -sign * up[0],  //
            b, sign + up[1] * up[1] * a, -up[1],                          //
            up[0], up[1], up[2];
        return axes;
    }

    /// The face at a vertex whose normal is nearest to a direction; its corners in the coordinates of the axes.
    struct Face
    {
        /// @param side 1 or -1: the direction is the third axis, or against it
        Face(const PosedHull<S>& shape, std::int32_t vertex, const Matrix& axes, double side,
             const Vector& offset)
        {
            const Hull<S>& hull = shape.hull();
            if (vertex < 0 || vertex >= hull.vertexCount() ||
                (hull.kind() != HullKind::Solid && hull.kind() != HullKind::Polygon))
                return;
            const Matrix map = axes * shape.basis();
            const Vector local = map.row(2) * side, from = axes * offset;
            double best = 0.0;
            std::int32_t face = -1;
            for (const std::int32_t other : hull.facesOf(vertex))
            {
                const double along = local.dot(hull.faces()[at(other)].normal);
                face = along > best ? other : face;
                best = along > best ? along : best;
            }
            if (face < 0 || hull.faceVertices(face).size() > kMostCorners)
                return;
            for (const std::int32_t corner : hull.faceVertices(face))
            {
                const S* const v = hull.lanes(corner);
                const Vector point =
                    map.col(0) * double(v[0]) + map.col(1) * double(v[1]) + map.col(2) * double(v[2]) + from;
                ids[at(count)] = corner;
                x[at(count)] = point[0];
                y[at(count)] = point[1];
                z[at(count++)] = point[2];
            }
            // Lanes beyond the last corner repeat the first.
            for (std::int32_t i = count; i % kLanes != 0; ++i)
            {
                x[at(i)] = x[0];
                y[at(i)] = y[0];
                z[at(i)] = z[0];
            }
            findPlane();
        }

        bool isUsable() const { return turn != 0.0; }
        std::int32_t next(std::int32_t i) const { return i + 1 < count ? i + 1 : 0; }
        double heightAt(double px, double py) const
        {
            return z[0] + slopeX * (px - x[0]) + slopeY * (py - y[0]);
        }

        std::int32_t count = 0;
        std::array<std::int32_t, kMostCorners> ids;
        Numbers x, y, z;
        double slopeX = 0.0, slopeY = 0.0;  ///< of its plane
        double turn = 0.0;  ///< 1: counter-clockwise seen from the tip of the third axis; -1: clockwise

    private:
        void findPlane()
        {
            if (count < 3)
                return;
            const Vector first = corner(0),
                         across = (corner(count / 3) - first).cross(corner(2 * count / 3) - first);
            if (!(std::abs(across[2]) > 0.5 * across.norm()))
                return;
            slopeX = -across[0] / across[2];
            slopeY = -across[1] / across[2];
            turn = across[2] < 0.0 ? -1.0 : 1.0;
        }
        Vector corner(std::int32_t i) const { return {x[at(i)], y[at(i)], z[at(i)]}; }
    };

    /// Where the corners of a face are in relation to the prism over another face.
    struct Sides
    {
        Sides(const Face& face, const Face& base)
        {
            for (std::int32_t k = 0; k < base.count; ++k)
            {
                const double x = base.x[at(k)], y = base.y[at(k)],
                             alongX = base.turn * (y - base.y[at(base.next(k))]),
                             alongY = base.turn * (base.x[at(base.next(k))] - x);
                std::uint32_t corners = 0;
                for (std::int32_t i = 0; i < face.count; i += kLanes)
                {
                    const Lane values = alongX * (load(face.x, i) - x) + alongY * (load(face.y, i) - y);
                    std::memcpy(&inside[at(k)][at(i)], &values, sizeof(values));
                    corners |= laneBits(values > Lane{}) << i;
                }
                corners &= (std::uint32_t(1) << face.count) - 1;
                isInside[at(k)] = corners;
                all &= corners;
            }
            for (std::int32_t i = 0; i < face.count; ++i)
                heights[at(i)] = face.z[at(i)] - base.heightAt(face.x[at(i)], face.y[at(i)]);
        }

        /// The edges of the face that cross a side, a bit for each first corner.
        std::uint32_t crossed(std::int32_t side, std::int32_t corners) const
        {
            const std::uint32_t here = isInside[at(side)], first = here & 1u;
            return here ^ (here >> 1 | first << (corners - 1));
        }

        Numbers heights;                                   ///< over the base
        std::array<Numbers, kMostCorners> inside;          ///< [side of the base][corner]
        std::array<std::uint32_t, kMostCorners> isInside;  ///< [side of the base], a bit for each corner
        std::uint32_t all = ~std::uint32_t(0);             ///< inside of all sides
    };

    /// @param isBelow the corners are B's: their heights over A are minus distances
    void considerCorners(const Sides& sides, const Face& face, const Face& base, bool isBelow)
    {
        for (std::int32_t i = 0; i < face.count; ++i)
        {
            const double gap = isBelow ? -sides.heights[at(i)] : sides.heights[at(i)];
            if ((sides.all >> i & 1u) == 0 || !(gap < m_least))
                continue;
            m_least = gap;
            const std::array<std::int32_t, 3> one = {face.ids[at(i)], face.ids[at(i)], face.ids[at(i)]},
                                              three = {base.ids[0], base.ids[1], base.ids[2]};
            m_pairs = isBelow ? VertexPairs{three, one, 3} : VertexPairs{one, three, 3};
        }
    }

    void considerCrossings(const Sides& aOverB, const Sides& bOverA, const Face& ofA, const Face& ofB)
    {
        std::array<std::uint32_t, kMostCorners> crossedByB;
        for (std::int32_t i = 0; i < ofA.count; ++i)
            crossedByB[at(i)] = bOverA.crossed(i, ofB.count);
        for (std::int32_t k = 0; k < ofB.count; ++k)
        {
            for (std::uint32_t edges = aOverB.crossed(k, ofA.count); edges != 0; edges &= edges - 1)
            {
                const std::int32_t i = __builtin_ctz(edges), next = ofA.next(i);
                if ((crossedByB[at(i)] >> k & 1u) == 0)
                    continue;
                const double from = aOverB.inside[at(k)][at(i)], to = aOverB.inside[at(k)][at(next)],
                             part = from / (from - to), low = aOverB.heights[at(i)],
                             gap = low + part * (aOverB.heights[at(next)] - low);
                if (!(gap < m_least))
                    continue;
                m_least = gap;
                m_pairs = {{ofA.ids[at(i)], ofA.ids[at(next)], -1},
                           {ofB.ids[at(k)], ofB.ids[at(ofB.next(k))], -1},
                           2};
            }
        }
    }

    VertexPairs m_pairs;
    double m_least = std::numeric_limits<double>::infinity();
};
}  // namespace cullet
