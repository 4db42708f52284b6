// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <Eigen/Core>
#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include <array>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A linear map into the frame of a convex core, in double: distances there are those of the world up to a relative
/// error.
struct CoreFrame
{
    /// @param core  the convex body's transform
    /// @param mesh  the mesh's
    CoreFrame(const btTransform& core, const btTransform& mesh);

    /// Whether the core's basis is a rotation up to rounding, and no number is infinite or NaN.
    bool isUsable() const;

    Eigen::Matrix3d basis;   ///< of the mesh
    Eigen::Vector3d origin;  ///< of the mesh
    Eigen::Matrix3d turn;    ///< from the world's axes
    double distortion;       ///< bound of the relative error of distances
};

/// An axis that may separate a core from triangles, in the core's frame.
struct CoreAxis
{
    Eigen::Vector3d direction;  ///< unit, from the core to the triangles
    double height;              ///< the largest product of a point of the core with the direction
};

/// Some triangles of a mesh in the order in which the mesh names them, and which of them may be near a convex core.
///
/// Proofs are conservative: a triangle that is dropped is farther from the core than the limit in every search.
class TriangleBatch
{
public:
    static constexpr int kCapacity = 32;

    int count() const { return m_count; }
    bool isFull() const { return m_count == kCapacity; }
    void clear() { m_count = 0; }

    /// @param corners in the mesh's frame
    void add(const btVector3* corners, int part, int index)
    {
        Triangle& triangle = m_triangles[static_cast<std::size_t>(m_count++)];
        for (int i = 0; i < 3; ++i)
            triangle.corners[i] = corners[i];
        triangle.part = part;
        triangle.index = index;
    }

    /// Moves the corners to the core's frame. Afterwards all triangles are near.
    ///
    /// @param limit the distance of the cores at which there may be a contact
    /// @param size  of the core and the limit together, for a bound of rounding errors
    void place(const CoreFrame& frame, double limit, double size);

    /// Drops what lies outside of the core's bounds by more than the limit.
    void dropOutside(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

    /// Drops what an axis separates from the core.
    ///
    /// @param first of the triangles to test
    /// @return the number of dropped triangles
    int dropBeyond(const CoreAxis& axis, int first);

    bool isNear(int i) const { return m_isNear[static_cast<std::size_t>(i)] != 0; }

    struct Triangle
    {
        btVector3 corners[3];
        int part, index;
    };
    const Triangle& triangle(int i) const { return m_triangles[static_cast<std::size_t>(i)]; }

private:
    using Lanes = std::array<double, kCapacity>;

    Lanes m_corners[3][3];  ///< [corner][coordinate]
    Lanes m_reach;          ///< the limit and a bound of rounding errors
    std::array<std::uint8_t, kCapacity> m_isNear;
    std::array<Triangle, kCapacity> m_triangles;
    int m_count = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
