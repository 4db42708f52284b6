// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <Eigen/Core>
#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include <array>
#include <cstdint>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The axes of a CoreFrame; those of the core itself make its bounds tight.
enum class FrameAxes
{
    Core,
    World  ///< enough for a point
};

/// The frame of a convex core: a rotation of the world around the core's origin, in double, so that distances are those
/// of the world.
///
/// The basis of a body is a rotation up to rounding only. The frame's is the nearest rotation, and the rest is part of the
/// core.
class CoreFrame
{
public:
    /// @param core  the convex body's transform
    /// @param mesh  the mesh's
    CoreFrame(const btTransform& core, const btTransform& mesh, FrameAxes axes);
    /// A frame along the axes of the core.
    ///
    /// @param turned frame along the axes of a core with the same basis, for a mesh with the same basis
    CoreFrame(const btTransform& core, const btTransform& mesh, const CoreFrame& turned);

    /// Whether the core's basis is nearly a rotation, and no number is infinite or NaN.
    bool isUsable() const { return m_isUsable; }

    const Eigen::Matrix3d& meshBasis() const { return m_meshBasis; }
    const Eigen::Vector3d& meshOrigin() const { return m_meshOrigin; }
    /// The transform of the core in this frame: nearly the identity, with the core's axes.
    btTransform coreBasis() const;

    /// A point of the mesh in this frame, rounded as in a batch.
    Eigen::Vector3d ofMesh(const btVector3& point) const
    {
        const double x = double(point.x()), y = double(point.y()), z = double(point.z());
        const auto row = [&](int i)
        { return m_meshBasis(i, 0) * x + m_meshBasis(i, 1) * y + m_meshBasis(i, 2) * z + m_meshOrigin[i]; };
        return {row(0), row(1), row(2)};
    }

    Eigen::Vector3d ofWorld(const btVector3& point) const;
    Eigen::Vector3d turnedOfWorld(const btVector3& direction) const;

    /// From this frame to the mesh's.
    Eigen::Vector3d toMesh(const Eigen::Vector3d& point) const { return turnedToMesh(point - m_meshOrigin); }
    Eigen::Vector3d turnedToMesh(const Eigen::Vector3d& direction) const
    {
        return m_meshBasis.transpose() * direction;
    }

    btVector3 toWorld(const Eigen::Vector3d& point) const;
    btVector3 turnedToWorld(const Eigen::Vector3d& direction) const;

private:
    Eigen::Matrix3d m_axes;  ///< of the frame, as columns, in the world
    Eigen::Vector3d m_origin;
    Eigen::Matrix3d m_coreBasis, m_meshBasis;
    Eigen::Vector3d m_meshOrigin;
    bool m_isUsable;
};

/// The last frame along the axes of a core: the children of a compound often have the same basis.
class LastFrame
{
public:
    CoreFrame frameOf(const btTransform& core, const btTransform& mesh);

private:
    struct Bases
    {
        Bases(const btTransform& core, const btTransform& mesh);

        btScalar numbers[18];
    };
    std::optional<Bases> m_bases;
    std::optional<CoreFrame> m_frame;
};

/// An axis that may separate a core from triangles, in the core's frame.
struct CoreAxis
{
    Eigen::Vector3d direction;  ///< unit, from the core to the triangles
    double height;              ///< the largest product of a point of the core with the direction
};

/// Bounds of a core in its own frame.
struct CoreBounds
{
    Eigen::Vector3d low, high;
};

/// Some triangles of a mesh in the order in which the mesh names them, and which of them may be near a convex core.
///
/// Proofs are conservative: a triangle that is dropped is farther from the core than the limit in every search.
class TriangleBatch
{
public:
    static constexpr int kCapacity = 32;

    /// As the mesh has it.
    struct Triangle
    {
        btVector3 corners[3];
        int part, index;
    };

    int count() const { return m_count; }
    bool isFull() const { return m_count == kCapacity; }
    void clear() { m_count = 0; }

    /// @param corners in the mesh's frame
    void add(const btVector3* corners, int part, int index)
    {
        const auto place = static_cast<std::size_t>(m_count++);
        for (int c = 0; c < 3; ++c)
        {
            for (int row = 0; row < 3; ++row)
                m_inMesh[c][row][place] = corners[c][row];
        }
        m_ids[place] = {part, index};
    }

    /// Moves the corners to the core's frame. Afterwards all triangles are near. Nothing may be dropped by an axis.
    void placeAll(const CoreFrame& frame);

    /// Moves the corners likewise, and removes what lies outside of the core's bounds by more than the limit.
    ///
    /// @param limit the distance of the cores at which there may be a contact
    /// @param size  of the core and the limit together, for a bound of rounding errors
    void place(const CoreFrame& frame, const CoreBounds& bounds, double limit, double size);

    /// Drops what an axis separates from the core.
    ///
    /// @param first of the triangles to test
    /// @return the number of dropped triangles
    int dropBeyond(const CoreAxis& axis, int first);

    /// Drops the triangles after one that touch the core at the same point and nowhere else: it is a corner of both or on
    /// an edge of both, and the rest of the other triangle leads down from it steeply; see isSteep().
    ///
    /// @param normal of the touch, unit, from the triangle to the core
    /// @param point  of the triangle
    void dropRepeats(int i, const Eigen::Vector3d& normal, const Eigen::Vector3d& point);

    /// The point within the core's bounds that is closest to the middle of a triangle.
    Eigen::Vector3d middleWithin(int i, const CoreBounds& bounds) const;

    /// In the core's frame.
    Eigen::Vector3d corner(int i, int c) const
    {
        const auto place = static_cast<std::size_t>(i);
        return {m_corners[c][0][place], m_corners[c][1][place], m_corners[c][2][place]};
    }

    bool isNear(int i) const { return m_isNear[static_cast<std::size_t>(i)] != 0; }

    Triangle triangle(int i) const
    {
        const Id& id = m_ids[static_cast<std::size_t>(i)];
        return {{inMesh(i, 0), inMesh(i, 1), inMesh(i, 2)}, id.part, id.index};
    }

private:
    using Lanes = std::array<double, kCapacity>;

    struct Id
    {
        int part, index;
    };

    btVector3 inMesh(int i, int c) const
    {
        const auto place = static_cast<std::size_t>(i);
        return btVector3(m_inMesh[c][0][place], m_inMesh[c][1][place], m_inMesh[c][2][place]);
    }
    void placeFew(const CoreFrame& frame);
    void keepWithin(const Lanes& gaps);
    bool hasNearAfter(int i) const;
    int findCorner(int i, const btVector3& corner) const;
    bool repeatsCorner(int i, const btVector3& shared, const Eigen::Vector3d& normal,
                       const Eigen::Vector3d& point) const;
    bool repeatsEdge(int i, const btVector3& sharedA, const btVector3& sharedB,
                     const Eigen::Vector3d& normal) const;

    std::array<btScalar, kCapacity> m_inMesh[3][3];  ///< [corner][coordinate]
    Lanes m_corners[3][3];                           ///< in the core's frame
    Lanes m_reach;                                   ///< the limit and a bound of rounding errors
    std::array<std::uint8_t, kCapacity> m_isNear;
    std::array<Id, kCapacity> m_ids;
    int m_count = 0;
};

/// Whether two triangles of a mesh are one; shapes of the application may name all of them alike.
inline bool areSame(const TriangleBatch::Triangle& a, const TriangleBatch::Triangle& b)
{
    const auto areAt = [&](int c)
    {
        const btVector3 &p = a.corners[c], &q = b.corners[c];
        return p.x() == q.x() && p.y() == q.y() && p.z() == q.z();
    };
    return a.index == b.index && a.part == b.part && areAt(0) && areAt(1) && areAt(2);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
