// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/hull_view.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/turn.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet::convex
{
/// Units of rounding of a scalar.
template <class T>
inline constexpr T kRounding = std::numeric_limits<T>::epsilon() / T(2);

/// Vertices of the two hulls of a pair, a point of A - B.
struct VertexIds
{
    std::int32_t a, b;
};

inline constexpr std::uint32_t kNoVertices = 0xffffffffu;

/// Two ids in 16 bits each; those from 65,535 on become unknown.
CULLET_HOST_DEVICE inline std::uint32_t packed(VertexIds ids)
{
    const auto narrow = [](std::int32_t id)
    {
        const auto number = static_cast<std::uint32_t>(id);
        return number < 0xffffu ? number : 0xffffu;
    };
    return narrow(ids.a) | narrow(ids.b) << 16;
}

/// Unknown ids become -1.
CULLET_HOST_DEVICE inline VertexIds unpacked(std::uint32_t ids)
{
    const auto wide = [](std::uint32_t id) { return id == 0xffffu ? -1 : static_cast<std::int32_t>(id); };
    return {wide(ids & 0xffffu), wide(ids >> 16)};
}

/// Whether the quaternion has a length between 1/2 and 2 and the position is finite.
CULLET_HOST_DEVICE inline bool isUsable(const BodyPose& pose)
{
    const float* const q = pose.rotation;
    const float length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    constexpr float kLargest = 3.4e38f;
    // A NaN makes each comparison false.
    return length2 >= 0.25f && length2 <= 4.0f && fabsf(pose.position[0]) <= kLargest &&
           fabsf(pose.position[1]) <= kLargest && fabsf(pose.position[2]) <= kLargest;
}

/// What an axis test asks of one of two hulls: its support along a direction of its own axes.
template <class T>
struct HullSide
{
    HullView hull;
    Vec<T> direction;
    std::int32_t start;  ///< a vertex likely near it; any number

    CULLET_HOST_DEVICE Support<T> support() const { return hull.support(direction, start); }
};

/// The support of A - B against an axis v.
template <class T>
struct AxisTest
{
    T along;  ///< v.w for the support point w: for a unit v no more than the distance
    VertexIds ids;
};

/// Joins the supports of both sides.
///
/// @param shift v.(origin of B - origin of A)
template <class T>
CULLET_HOST_DEVICE inline AxisTest<T> testOf(const Support<T>& a, const Support<T>& b, T shift)
{
    return {-(a.height + b.height) - shift, {a.vertex, b.vertex}};
}

/// Two hulls with poses, A and B, as a query in T sees them. World axes, relative to the origin of A.
template <class T>
class PosedPair
{
public:
    /// @pre both poses are usable, and the hulls have points
    CULLET_HOST_DEVICE PosedPair(const HullView& hullA, const HullView& hullB, const BodyPose& a,
                                 const BodyPose& b)
        : m_hullA(hullA),
          m_hullB(hullB),
          m_turnA(turnOf(T(a.rotation[0]), T(a.rotation[1]), T(a.rotation[2]), T(a.rotation[3]))),
          m_turnB(turnOf(T(b.rotation[0]), T(b.rotation[1]), T(b.rotation[2]), T(b.rotation[3]))),
          m_offset{T(b.position[0]) - T(a.position[0]), T(b.position[1]) - T(a.position[1]),
                   T(b.position[2]) - T(a.position[2])},
          m_error(errorOf(T(m_hullA.reach()) + T(m_hullB.reach()), sumOfMagnitudes(m_offset)))
    {
    }

    /// From the origin of A to that of B.
    CULLET_HOST_DEVICE const Vec<T>& offset() const { return m_offset; }

    /// Bounds the error of AxisTest::along for an axis of at most unit length, and that of a point(). Infinite in
    /// float where sizes are so small or large that products underflow or overflow.
    CULLET_HOST_DEVICE T error() const { return m_error; }

    /// The unit of relative tolerances: both reaches and the distance of the origins.
    CULLET_HOST_DEVICE T size() const
    {
        return T(m_hullA.reach()) + T(m_hullB.reach()) + rootOf(dot(m_offset, m_offset));
    }

    /// The pair with A elsewhere; see error() for that distance.
    CULLET_HOST_DEVICE PosedPair moved(const Vec<T>& by) const
    {
        PosedPair result = *this;
        result.m_offset = m_offset - by;
        result.m_error = errorOf(T(m_hullA.reach()) + T(m_hullB.reach()), sumOfMagnitudes(result.m_offset));
        return result;
    }

    CULLET_HOST_DEVICE const HullView& hullA() const { return m_hullA; }
    CULLET_HOST_DEVICE const HullView& hullB() const { return m_hullB; }
    CULLET_HOST_DEVICE const Turn<T>& turnA() const { return m_turnA; }
    CULLET_HOST_DEVICE const Turn<T>& turnB() const { return m_turnB; }

    CULLET_HOST_DEVICE bool areVertices(VertexIds ids) const
    {
        return m_hullA.isVertex(ids.a) && m_hullB.isVertex(ids.b);
    }

    /// @pre areVertices(ids)
    CULLET_HOST_DEVICE Vec<T> point(VertexIds ids) const
    {
        return pointA(ids.a) - m_turnB.forward(m_hullB.template vertex<T>(ids.b)) - m_offset;
    }
    CULLET_HOST_DEVICE Vec<T> pointA(std::int32_t vertex) const
    {
        return m_turnA.forward(m_hullA.template vertex<T>(vertex));
    }

    /// @param start vertices likely near the supports; any numbers
    CULLET_HOST_DEVICE AxisTest<T> test(const Vec<T>& axis, VertexIds start) const
    {
        const Support<T> a = sideA(axis, start.a).support();
        return testOf(a, sideB(axis, start.b).support(), dot(axis, m_offset));
    }
    CULLET_HOST_DEVICE HullSide<T> sideA(const Vec<T>& axis, std::int32_t start) const
    {
        return {m_hullA, m_turnA.back(-axis), start};
    }
    CULLET_HOST_DEVICE HullSide<T> sideB(const Vec<T>& axis, std::int32_t start) const
    {
        return {m_hullB, m_turnB.back(axis), start};
    }

private:
    /// With r the unit of rounding: a turned direction is off by 37 r, a height by 3 r more of the reach, the product
    /// with the offset by 5 r of it; the sum adds 2 r of all. A point is turned likewise.
    CULLET_HOST_DEVICE static T errorOf(T reach, T distance)
    {
        const T size = reach + distance;
        if (sizeof(T) == sizeof(float) && !(size > T(1e-6) && size < T(1e6)))
            return T(INFINITY);
        return kRounding<T> * (T(56) * reach + T(10) * distance);
    }

    HullView m_hullA, m_hullB;
    Turn<T> m_turnA, m_turnB;
    Vec<T> m_offset;
    T m_error;
};
}  // namespace cullet::convex
