// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/turn.h"

#include <cstdint>

/// The point of a simplex of up to four points that is closest to the origin.
namespace cullet::convex
{
/// The least relative size of an area or a volume, squared, that is not taken as zero.
template <class T>
struct Flatness;
template <>
struct Flatness<float>
{
    static constexpr float kArea2 = 1e-12f, kVolume2 = 1e-11f, kFar2 = 1e37f;
};
template <>
struct Flatness<double>
{
    static constexpr double kArea2 = 1e-28, kVolume2 = 1e-28, kFar2 = 1e300;
};

/// Finds the closest point by the closest of the features that face the origin.
template <class T>
class ClosestPoint
{
public:
    /// @param points [4], of which the first `count`, at least one, are used
    CULLET_HOST_DEVICE ClosestPoint(const Vec<T> (&points)[4], int count)
    {
        if (count == 1)
            offer(points[0], 1u);
        else if (count == 2)
            offerSegment(points[0], points[1], 1u, 2u);
        else if (count == 3)
            offerTriangle(points[0], points[1], points[2]);
        else
            offerTetrahedron(points);
    }

    CULLET_HOST_DEVICE const Vec<T>& closest() const { return m_closest; }
    CULLET_HOST_DEVICE T length2() const { return m_length2; }
    /// Bit i: point i is a corner of the closest feature.
    CULLET_HOST_DEVICE unsigned members() const { return m_members; }
    /// The origin is inside of four points.
    CULLET_HOST_DEVICE bool isInside() const { return m_isInside; }

private:
    CULLET_HOST_DEVICE void offer(const Vec<T>& point, unsigned members)
    {
        const T length2 = dot(point, point);
        if (!(length2 < m_length2))
            return;
        m_closest = point;
        m_length2 = length2;
        m_members = members;
    }

    CULLET_HOST_DEVICE void offerSegment(const Vec<T>& a, const Vec<T>& b, unsigned bitA, unsigned bitB)
    {
        const Vec<T> edge = b - a;
        const T along = -dot(a, edge), length2 = dot(edge, edge);
        if (!(along > T(0)))
            offer(a, bitA);
        else if (along >= length2)
            offer(b, bitB);
        else
            offer(mulAdd(edge, along / length2, a), bitA | bitB);
    }

    /// Offers the point of a triangle's plane if it is inside of the triangle.
    ///
    /// @return false if it is not, so that the closest point is on an edge
    CULLET_HOST_DEVICE bool offerFace(const Vec<T>& a, const Vec<T>& b, const Vec<T>& c, unsigned members)
    {
        const Vec<T> ab = b - a, ac = c - a, normal = cross(ab, ac);
        const T area2 = dot(normal, normal);
        if (!(area2 > Flatness<T>::kArea2 * dot(ab, ab) * dot(ac, ac)))
            return false;
        const Vec<T> across = cross(normal, a);
        const T weightB = -dot(ac, across), weightC = dot(ab, across);
        if (!(area2 - weightB - weightC > T(0) && weightB > T(0) && weightC > T(0)))
            return false;
        offer(normal * (dot(a, normal) / area2), members);
        return true;
    }

    CULLET_HOST_DEVICE void offerTriangle(const Vec<T>& a, const Vec<T>& b, const Vec<T>& c)
    {
        if (offerFace(a, b, c, 7u))
            return;
        offerSegment(a, b, 1u, 2u);
        offerSegment(b, c, 2u, 4u);
        offerSegment(c, a, 4u, 1u);
    }

    CULLET_HOST_DEVICE void offerTetrahedron(const Vec<T> (&p)[4])
    {
        const Vec<T> a = p[0] - p[3], b = p[1] - p[3], c = p[2] - p[3];
        const Vec<T> opposite0 = cross(b, c), opposite1 = cross(c, a), opposite2 = cross(a, b);
        const Vec<T> opposite3 = cross(p[1] - p[0], p[2] - p[0]);
        const T volume = dot(a, opposite0), sign = volume < T(0) ? T(-1) : T(1);
        const bool isFlat = !(volume * volume > Flatness<T>::kVolume2 * dot(a, a) * dot(b, b) * dot(c, c));
        const bool isBeyond0 = isFlat || sign * dot(p[3], opposite0) > T(0);
        const bool isBeyond1 = isFlat || sign * dot(p[3], opposite1) > T(0);
        const bool isBeyond2 = isFlat || sign * dot(p[3], opposite2) > T(0);
        const bool isBeyond3 = isFlat || sign * dot(p[0], opposite3) < T(0);
        m_isInside = !(isBeyond0 || isBeyond1 || isBeyond2 || isBeyond3);
        // An edge of two faces is offered once.
        constexpr unsigned k01 = 1, k02 = 2, k03 = 4, k12 = 8, k13 = 16, k23 = 32;
        unsigned edges = 0;
        if (isBeyond0 && !offerFace(p[1], p[2], p[3], 14u))
            edges |= k12 | k13 | k23;
        if (isBeyond1 && !offerFace(p[0], p[2], p[3], 13u))
            edges |= k02 | k03 | k23;
        if (isBeyond2 && !offerFace(p[0], p[1], p[3], 11u))
            edges |= k01 | k03 | k13;
        if (isBeyond3 && !offerFace(p[0], p[1], p[2], 7u))
            edges |= k01 | k02 | k12;
        if ((edges & k01) != 0)
            offerSegment(p[0], p[1], 1u, 2u);
        if ((edges & k02) != 0)
            offerSegment(p[0], p[2], 1u, 4u);
        if ((edges & k03) != 0)
            offerSegment(p[0], p[3], 1u, 8u);
        if ((edges & k12) != 0)
            offerSegment(p[1], p[2], 2u, 4u);
        if ((edges & k13) != 0)
            offerSegment(p[1], p[3], 2u, 8u);
        if ((edges & k23) != 0)
            offerSegment(p[2], p[3], 4u, 8u);
    }

    Vec<T> m_closest = {T(0), T(0), T(0)};
    T m_length2 = Flatness<T>::kFar2;
    unsigned m_members = 1u;
    bool m_isInside = false;
};

/// Whether the origin is inside of a tetrahedron for all points that are within `error` of its corners.
///
/// The weight of a corner for the origin is a determinant of the other three. With m the largest length of a corner and
/// r the unit of rounding, points that are off by e change it by at most 3 e (m + e)^2, and it is rounded by 6 r m^3.
CULLET_HOST_DEVICE inline bool isSurelyInside(const Vec<float> (&p)[4], float error)
{
    float largest2 = 0.0f;
    CULLET_UNROLL
    for (int i = 0; i < 4; ++i)
        largest2 = fmaxf(largest2, dot(p[i], p[i]));
    const float m = sqrtf(largest2) * 1.0001f, wide = m + error;
    const float band = 4.0f * error * wide * wide + 1e-6f * m * m * m;
    const Vec<float> c01 = cross(p[0], p[1]), c23 = cross(p[2], p[3]);
    const float w0 = dot(p[1], c23), w1 = -dot(p[0], c23), w2 = dot(p[3], c01), w3 = -dot(p[2], c01);
    return (w0 > band && w1 > band && w2 > band && w3 > band) ||
           (w0 < -band && w1 < -band && w2 < -band && w3 < -band);
}
}  // namespace cullet::convex
