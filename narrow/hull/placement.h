// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <cstdint>
#include <type_traits>

namespace cullet
{
/// Whether two shapes can search for their support vertices from given ones: true for hulls.
template <class A, class B>
struct HasVertexAmong : std::false_type
{
};

template <class S>
struct HasVertexAmong<PosedHull<S>, PosedHull<S>> : std::true_type
{
};

/// Points of two shapes by vertex, in world axes, each relative to its shape's origin.
template <class A, class B>
class Placement
{
public:
    Placement(const A& a, const B& b) : m_a(a), m_b(b) {}
    void place(std::int32_t vertexA, std::int32_t vertexB, Eigen::Vector3d& a, Eigen::Vector3d& b) const
    {
        a = m_a.point(vertexA);
        b = m_b.point(vertexB);
    }

private:
    const A& m_a;
    const B& m_b;
};

/// The points of two hulls at once, A's in the first lane. The bases are widened once, since that costs as much as the
/// product for one point.
template <class S>
class Placement<PosedHull<S>, PosedHull<S>>
{
public:
    [[gnu::always_inline]] Placement(const PosedHull<S>& a, const PosedHull<S>& b)
        : m_hullA(a.hull()), m_hullB(b.hull())
    {
        for (int i = 0; i < 3; ++i)
        {
            m_rows[i][0] = widePairOf<0>(a.row(i), b.row(i));
            m_rows[i][1] = widePairOf<1>(a.row(i), b.row(i));
            m_rows[i][2] = widePairOf<2>(a.row(i), b.row(i));
        }
    }

    [[gnu::always_inline]] void place(std::int32_t vertexA, std::int32_t vertexB, Eigen::Vector3d& a,
                                      Eigen::Vector3d& b) const
    {
        const Pair x = widePair(m_hullA.x()[vertexA], m_hullB.x()[vertexB]);
        const Pair y = widePair(m_hullA.y()[vertexA], m_hullB.y()[vertexB]);
        const Pair z = widePair(m_hullA.z()[vertexA], m_hullB.z()[vertexB]);
        // Rounded like PosedHull::point(), which Eigen computes in two lanes.
        const Pair worldX = m_rows[0][0] * x + m_rows[0][1] * y + m_rows[0][2] * z;
        const Pair worldY = m_rows[1][0] * x + m_rows[1][1] * y + m_rows[1][2] * z;
        const Pair worldZ = m_rows[2][0] * x + (m_rows[2][1] * y + m_rows[2][2] * z);
        a = {worldX[0], worldY[0], worldZ[0]};
        b = {worldX[1], worldY[1], worldZ[1]};
    }

    /// The vector from one point of A - B to another.
    [[gnu::always_inline]] Eigen::Vector3d edgeVector(std::int32_t fromA, std::int32_t fromB,
                                                      std::int32_t toA, std::int32_t toB) const
    {
        const Pair x =
            pairOf(m_hullA.x(), toA, m_hullB.x(), toB) - pairOf(m_hullA.x(), fromA, m_hullB.x(), fromB);
        const Pair y =
            pairOf(m_hullA.y(), toA, m_hullB.y(), toB) - pairOf(m_hullA.y(), fromA, m_hullB.y(), fromB);
        const Pair z =
            pairOf(m_hullA.z(), toA, m_hullB.z(), toB) - pairOf(m_hullA.z(), fromA, m_hullB.z(), fromB);
        const Pair worldX = m_rows[0][0] * x + m_rows[0][1] * y + m_rows[0][2] * z;
        const Pair worldY = m_rows[1][0] * x + m_rows[1][1] * y + m_rows[1][2] * z;
        const Pair worldZ = m_rows[2][0] * x + m_rows[2][1] * y + m_rows[2][2] * z;
        return {worldX[0] - worldX[1], worldY[0] - worldY[1], worldZ[0] - worldZ[1]};
    }

private:
    using Pair = Lanes<double>::Vector;

    static Pair pairOf(const S* a, std::int32_t vertexA, const S* b, std::int32_t vertexB)
    {
        return widePair(a[vertexA], b[vertexB]);
    }

    Pair m_rows[3][3];
    const Hull<S>& m_hullA;
    const Hull<S>& m_hullB;
};
}  // namespace cullet
