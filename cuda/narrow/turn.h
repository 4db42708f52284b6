// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"

#include <cmath>

/// Vectors and rotations that the CPU and the GPU compute with the same bits. Products and sums are fused, which halves
/// the instructions of a GPU; a CPU without that instruction imitates it.
namespace cullet::convex
{
template <class T>
struct Vec
{
    T x, y, z;
};

template <class T>
CULLET_HOST_DEVICE inline Vec<T> operator+(const Vec<T>& a, const Vec<T>& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class T>
CULLET_HOST_DEVICE inline Vec<T> operator-(const Vec<T>& a, const Vec<T>& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class T>
CULLET_HOST_DEVICE inline Vec<T> operator-(const Vec<T>& a)
{
    return {-a.x, -a.y, -a.z};
}

template <class T>
CULLET_HOST_DEVICE inline Vec<T> operator*(const Vec<T>& a, T by)
{
    return {a.x * by, a.y * by, a.z * by};
}

/// a b + c, rounded once.
CULLET_HOST_DEVICE inline float mulAdd(float a, float b, float c)
{
    return fmaf(a, b, c);
}

CULLET_HOST_DEVICE inline double mulAdd(double a, double b, double c)
{
    return fma(a, b, c);
}

/// a s + b
template <class T>
CULLET_HOST_DEVICE inline Vec<T> mulAdd(const Vec<T>& a, T s, const Vec<T>& b)
{
    return {mulAdd(a.x, s, b.x), mulAdd(a.y, s, b.y), mulAdd(a.z, s, b.z)};
}

template <class T>
CULLET_HOST_DEVICE inline T dot(const Vec<T>& a, const Vec<T>& b)
{
    return mulAdd(a.z, b.z, mulAdd(a.y, b.y, a.x * b.x));
}

template <class T>
CULLET_HOST_DEVICE inline Vec<T> cross(const Vec<T>& a, const Vec<T>& b)
{
    return {mulAdd(a.y, b.z, -(a.z * b.y)), mulAdd(a.z, b.x, -(a.x * b.z)), mulAdd(a.x, b.y, -(a.y * b.x))};
}

/// a x b + c
template <class T>
CULLET_HOST_DEVICE inline Vec<T> crossAdd(const Vec<T>& a, const Vec<T>& b, const Vec<T>& c)
{
    return {mulAdd(a.y, b.z, mulAdd(-a.z, b.y, c.x)), mulAdd(a.z, b.x, mulAdd(-a.x, b.z, c.y)),
            mulAdd(a.x, b.y, mulAdd(-a.y, b.x, c.z))};
}

CULLET_HOST_DEVICE inline float magnitude(float value)
{
    return fabsf(value);
}

CULLET_HOST_DEVICE inline double magnitude(double value)
{
    return fabs(value);
}

CULLET_HOST_DEVICE inline float rootOf(float value)
{
    return sqrtf(value);
}

CULLET_HOST_DEVICE inline double rootOf(double value)
{
    return sqrt(value);
}

/// |x| + |y| + |z|, not less than the length.
template <class T>
CULLET_HOST_DEVICE inline T sumOfMagnitudes(const Vec<T>& a)
{
    return magnitude(a.x) + magnitude(a.y) + magnitude(a.z);
}

/// The rotation of a quaternion (u, w) of any length but zero.
///
/// With r the unit of rounding, a turned vector v is off by at most 37 r |v|: 3 r |u| |v| by a cross product, 5 r by
/// `twice`, and these are doubled in the second cross product.
template <class T>
struct Turn
{
    Vec<T> u;
    T w;
    T twice;  ///< 2 / (|u|^2 + w^2)

    CULLET_HOST_DEVICE Vec<T> forward(const Vec<T>& v) const
    {
        const Vec<T> t = cross(u, v) * twice;
        return crossAdd(u, t, mulAdd(t, w, v));
    }
    CULLET_HOST_DEVICE Vec<T> back(const Vec<T>& v) const
    {
        const Vec<T> t = cross(u, v) * twice;
        return crossAdd(u, t, mulAdd(t, -w, v));
    }
};

template <class T>
CULLET_HOST_DEVICE inline Turn<T> turnOf(T x, T y, T z, T w)
{
    return {{x, y, z}, w, T(2) / mulAdd(w, w, dot(Vec<T>{x, y, z}, Vec<T>{x, y, z}))};
}
}  // namespace cullet::convex
