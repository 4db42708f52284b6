// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"

namespace cullet
{
/// A translated shape, for the queries (see PosedHull). Points stay relative to its origin, which moves with it.
template <class Shape>
class MovedShape
{
public:
    /// @param shape outlives this object
    MovedShape(const Shape& shape, const Eigen::Vector3d& shift)
        : m_shape(shape), m_origin(shape.origin() + shift)
    {
    }

    const Eigen::Vector3d& origin() const { return m_origin; }
    Eigen::Vector3d centre() const { return m_shape.centre(); }
    std::int32_t vertexCount() const { return m_shape.vertexCount(); }
    Eigen::Vector3d point(std::int32_t v) const { return m_shape.point(v); }
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t start) const
    {
        return m_shape.support(direction, start);
    }

private:
    const Shape& m_shape;
    Eigen::Vector3d m_origin;
};
}  // namespace cullet
