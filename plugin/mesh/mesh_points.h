// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/plugin/mesh/triangle_batch.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A point where a convex core and a triangle touch, in the core's frame.
struct MeshPoint
{
    /// On the convex shape, margins included; of a touch whose patch is not made yet: about the middle of the patch.
    Eigen::Vector3d place;
    Eigen::Vector3d normal;  ///< unit, from the triangle to the core
    double distance;         ///< margins included; negative: depth
    TriangleBatch::Triangle triangle;
    Touch touch;  ///< to which the point belongs
};

/// Points of all triangles that a convex body touches, reduced to the few that a manifold holds.
///
/// The first of them is the deepest. Each further one is the farthest from those before it and from the lines between
/// them, in position and depth: a plate keeps its corners, a box in the corner of a room touches floor and walls, and a
/// point between two others, which carries nothing, is left out. A point counts less the larger its distance is. A
/// point that the manifold would merge with an earlier one is left out, too.
///
/// The points may come from any number of triangles: when there is no more room, the set is reduced to kKept of them in
/// the same way. The result depends on the points and their order alone.
class MeshPoints
{
public:
    /// @param breakingThreshold of the manifold: the distance of the shapes, margins included, from which there are no
    ///                          points, and the distance of two points below which it merges them
    explicit MeshPoints(double breakingThreshold) : m_threshold(breakingThreshold) {}

    static constexpr int kKept = 6;

    void add(const MeshPoint& point)
    {
        if (m_count == kRoom)
            reduce(kKept);
        new (&m_points[static_cast<std::size_t>(m_count++)].point) MeshPoint(point);
    }

    void clear() { m_count = 0; }

    /// Moves the points of another set behind those of this one.
    void take(MeshPoints& others)
    {
        for (int i = 0; i < others.m_count; ++i)
            add(others[i]);
        others.clear();
    }

    /// @param most 1 to kKept
    void reduce(int most);

    int count() const { return m_count; }
    const MeshPoint& operator[](int i) const { return m_points[static_cast<std::size_t>(i)].point; }

private:
    static constexpr int kRoom = 32;

    class Selection;

    /// Room for a point that may never be there: to initialise all of it would cost more than the few points of a call.
    union Room
    {
        Room() {}
        MeshPoint point;
    };

    int deepest() const;

    double m_threshold;
    std::array<Room, kRoom> m_points;
    int m_count = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
