// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/hull.h"
#include "narrow/support.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>

namespace cullet
{
/// A support point in world axes, relative to the origin() of its shape.
struct SupportPoint
{
    Eigen::Vector3d point;
    std::int32_t
        vertex;  ///< id that point() turns into the same point later, or -1 if the shape has no vertices
};

/// A hull at a place in the world, and the interface that the queries expect of any convex shape:
///
///  * `Vector3d origin()`, in world space, exact: all else is relative to it, so that nothing is lost far from the
///    world's origin (the difference of two origins is taken in double).
///  * `SupportPoint support(const Vector3d& direction, int32_t start)`: farthest point along a world direction of any
///    length; `start` is a vertex that is likely near the answer, or -1.
///  * `Vector3d point(int32_t vertex)`: for 0 <= vertex < vertexCount(); a shape without vertices returns 0 there.
///  * `Vector3d centre()`: any inner point, as a first guess.
///
/// The world position of a vertex is basis * vertex + origin, evaluated in double. The basis is a rotation, or any
/// linear map that can be inverted, mirrored and unequal scales included: a linear map keeps the graph of a hull.
template <class S>
class PosedHull
{
public:
    using Scalar = S;
    using Vector = Eigen::Matrix<S, 3, 1>;
    using Matrix = Eigen::Matrix<S, 3, 3>;

    /// @pre the hull has a vertex and outlives this object
    PosedHull(const Hull<S>& hull, const Matrix& basis, const Vector& origin,
              SupportMethod method = SupportMethod::Automatic)
        : m_hull(&hull),
          m_directionBasis(basis.transpose()),
          m_basis(basis.template cast<double>()),
          m_origin(origin.template cast<double>()),
          m_method(method)
    {
    }

    const Hull<S>& hull() const { return *m_hull; }
    const Eigen::Matrix3d& basis() const { return m_basis; }
    const Eigen::Vector3d& origin() const { return m_origin; }
    Eigen::Vector3d centre() const { return m_basis * m_hull->centre(); }
    std::int32_t vertexCount() const { return m_hull->vertexCount(); }
    Eigen::Vector3d point(std::int32_t v) const
    {
        return m_basis * m_hull->vertex(v).template cast<double>();
    }

    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t start) const
    {
        const double largest = direction.cwiseAbs().maxCoeff();
        Vector local;
        // The searches in support.h need a direction whose products neither underflow nor overflow.
        if (largest > 1e-8 && largest < 1e8)
            local = m_directionBasis * direction.template cast<S>();
        else
            local = m_directionBasis * Eigen::Vector3d(direction / largest).template cast<S>();
        const std::int32_t v = supportVertex(*m_hull, local, start, m_method);
        return {point(v), v};
    }

private:
    const Hull<S>* m_hull;
    Matrix m_directionBasis;
    Eigen::Matrix3d m_basis;
    Eigen::Vector3d m_origin;
    SupportMethod m_method;
};
}  // namespace cullet
