// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/posed_hull.h"

#include <Eigen/Core>

#include <cstdint>
#include <type_traits>

namespace cullet
{
/// Whether two shapes can look for their support vertices among given ones: hulls.
template <class A, class B>
struct HasVertexAmong : std::false_type
{
};

template <class S>
struct HasVertexAmong<PosedHull<S>, PosedHull<S>> : std::true_type
{
};

/// Points of a shape by vertex, in world axes relative to its origin.
template <class A>
class Placement
{
public:
    explicit Placement(const A& shape) : m_shape(shape) {}
    Eigen::Vector3d point(std::int32_t vertex) const { return m_shape.point(vertex); }

private:
    const A& m_shape;
};

/// With the basis widened once: for each point anew it would cost as much as the product.
template <class S>
class Placement<PosedHull<S>>
{
public:
    explicit Placement(const PosedHull<S>& shape) : m_basis(shape.basis()), m_hull(shape.hull()) {}
    Eigen::Vector3d point(std::int32_t vertex) const
    {
        return m_basis * m_hull.vertex(vertex).template cast<double>();
    }

private:
    Eigen::Matrix3d m_basis;
    const Hull<S>& m_hull;
};
}  // namespace cullet
