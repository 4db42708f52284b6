// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>

namespace cullet
{
/// A sum of doubles without rounding: components that do not overlap, by ascending magnitude.
///
/// Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", Grow-Expansion.
/// @pre no intermediate overflows or underflows: coordinates between about 1e-90 and 1e90 in magnitude, or 0
class ExactSum
{
public:
    /// Cost: O(components); at most 128 values may be added.
    void add(double value)
    {
        double carry = value;
        int kept = 0;
        for (int i = 0; i < m_count; ++i)
        {
            const double sum = carry + m_parts[i];
            const double shifted = sum - carry;
            const double error = (carry - (sum - shifted)) + (m_parts[i] - shifted);
            carry = sum;
            if (error != 0.0)
                m_parts[kept++] = error;
        }
        if (carry != 0.0)
            m_parts[kept++] = carry;
        m_count = kept;
    }

    /// Adds a * b * c exactly, as four doubles.
    void addProduct(double a, double b, double c)
    {
        const std::array<double, 2> ab = product(a, b);
        for (const double part : ab)
        {
            const std::array<double, 2> abc = product(part, c);
            add(abc[1]);
            add(abc[0]);
        }
    }

    /// Adds a * b exactly.
    void addProduct(double a, double b)
    {
        const std::array<double, 2> ab = product(a, b);
        add(ab[1]);
        add(ab[0]);
    }

    /// The sum, rounded. The largest component alone may be only half of it.
    double value() const
    {
        double sum = 0.0;
        for (int i = 0; i < m_count; ++i)
            sum += m_parts[i];
        return sum;
    }

    /// -1, 0 or 1: the sign of the largest component.
    int sign() const { return m_count == 0 ? 0 : (m_parts[m_count - 1] > 0.0 ? 1 : -1); }

private:
    static std::array<double, 2> split(double value)
    {
        const double scaled = 134217729.0 * value;  // 2^27 + 1
        const double high = scaled - (scaled - value);
        return {high, value - high};
    }

    static std::array<double, 2> product(double a, double b)
    {
        const double rounded = a * b;
        const std::array<double, 2> x = split(a);
        const std::array<double, 2> y = split(b);
        const double error = ((x[0] * y[0] - rounded) + x[0] * y[1] + x[1] * y[0]) + x[1] * y[1];
        return {rounded, error};
    }

    std::array<double, 128> m_parts;
    int m_count = 0;
};

/// Exact sign of the determinant | b - a, c - a, d - a | from 24 triple products.
inline int exactOrientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                            const Eigen::Vector3d& d)
{
    ExactSum sum;
    const auto addDeterminant =
        [&sum](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r, double factor)
    {
        for (int i = 0; i < 3; ++i)
        {
            const int j = (i + 1) % 3;
            const int k = (i + 2) % 3;
            sum.addProduct(factor * p[i], q[j], r[k]);
            sum.addProduct(-factor * p[i], q[k], r[j]);
        }
    };
    addDeterminant(b, c, d, 1.0);
    addDeterminant(a, c, d, -1.0);
    addDeterminant(a, b, d, 1.0);
    addDeterminant(a, b, c, -1.0);
    return sum.sign();
}

/// Exact sign of | b - a, c - a, d - a |: 1 if d lies on the side of the plane abc from which a, b, c turn
/// counter-clockwise, 0 if the four points are coplanar.
///
/// The rounded determinant decides where it exceeds its error bound (Shewchuk 1997, orient3d, bound A), else
/// exactOrientation().
inline int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d)
{
    const Eigen::Vector3d ab = b - a;
    const Eigen::Vector3d ac = c - a;
    const Eigen::Vector3d ad = d - a;
    double determinant = 0.0;
    double permanent = 0.0;
    for (int i = 0; i < 3; ++i)
    {
        const int j = (i + 1) % 3;
        const int k = (i + 2) % 3;
        const double first = ac[j] * ad[k];
        const double second = ac[k] * ad[j];
        determinant += ab[i] * (first - second);
        permanent += std::abs(ab[i]) * (std::abs(first) + std::abs(second));
    }
    const double bound = 1e-15 * permanent;  // (7 + 56 u) u = 7.8e-16 with u = 2^-53
    if (determinant > bound)
        return 1;
    if (determinant < -bound)
        return -1;
    return exactOrientation(a, b, c, d);
}

/// (b - a) x (c - a), each component rounded at the end: a x b + b x c + c x a without rounding in between.
inline Eigen::Vector3d exactCross(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c)
{
    Eigen::Vector3d cross;
    for (int i = 0; i < 3; ++i)
    {
        const int j = (i + 1) % 3;
        const int k = (i + 2) % 3;
        ExactSum sum;
        const auto addMinor = [&sum, j, k](const Eigen::Vector3d& p, const Eigen::Vector3d& q)
        {
            sum.addProduct(p[j], q[k]);
            sum.addProduct(-p[k], q[j]);
        };
        addMinor(a, b);
        addMinor(b, c);
        addMinor(c, a);
        cross[i] = sum.value();
    }
    return cross;
}

/// (b - a) x (c - a), off by at most 64 eps of its length; zero only for collinear points.
///
/// The rounded product is off by at most 4 eps |b - a| |c - a|, which leaves no digit for a triangle thinner than that.
inline Eigen::Vector3d accurateCross(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                     const Eigen::Vector3d& c)
{
    const Eigen::Vector3d ab = b - a;
    const Eigen::Vector3d ac = c - a;
    const Eigen::Vector3d cross = ab.cross(ac);
    const double cross2 = cross.squaredNorm();
    // Nearly all triangles are far from a needle, and their squares need no root.
    if (cross2 > 0.004 * (ab.squaredNorm() * ac.squaredNorm()) && cross2 > 1e-280)
        return cross;
    // Lengths instead of their squares: fourth powers of a difference may underflow where those of coordinates do not.
    return cross.norm() > 0.0625 * (ab.norm() * ac.norm()) ? cross : exactCross(a, b, c);
}

/// Normal of a triangle, towards the side from which its corners are counter-clockwise, twice its area long; off by at
/// most 64 eps of its length, however thin the triangle is.
///
/// The product is computed at the corner opposite to the longest edge, where it least often has to be exact.
inline Eigen::Vector3d scaledNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c)
{
    const double acrossA = (b - c).squaredNorm(), acrossB = (c - a).squaredNorm(),
                 acrossC = (a - b).squaredNorm();
    if (acrossA >= acrossB && acrossA >= acrossC)
        return accurateCross(a, b, c);
    return acrossB >= acrossC ? accurateCross(b, c, a) : accurateCross(c, a, b);
}

/// True if a, b and c lie on one line, exactly: all three projections on the coordinate planes are degenerate.
inline bool isCollinear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        const int i = (axis + 1) % 3;
        const int j = (axis + 2) % 3;
        const auto flat = [i, j](const Eigen::Vector3d& p) { return Eigen::Vector3d(p[i], p[j], 0.0); };
        const Eigen::Vector3d above(a[i], a[j], 1.0);
        if (orientation(flat(a), flat(b), flat(c), above) != 0)
            return false;
    }
    return true;
}
}  // namespace cullet
