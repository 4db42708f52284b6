// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "plugin/convex_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Faces with more corners are thinned out.
constexpr int kMostCorners = 16;

/// Two tangents of the contact and its normal: the frame in which a patch is made, with its origin in that of A.
struct ContactFrame
{
    explicit ContactFrame(const Eigen::Vector3d& normal) : axes{Eigen::Vector3d(), Eigen::Vector3d(), normal}
    {
        // Duff et al. 2017, "Building an Orthonormal Basis, Revisited": without a root or a branch for special cases.
        const double sign = std::copysign(1.0, normal.z());
        const double a = -1.0 / (sign + normal.z());
        const double b = normal.x() * normal.y() * a;
        axes[0] = {1.0 + sign * normal.x() * normal.x() * a, sign * b, -sign * normal.x()};
        axes[1] = {b, sign + normal.y() * normal.y() * a, -normal.y()};
    }

    Eigen::Vector3d local(const Eigen::Vector3d& v) const
    {
        return {axes[0].dot(v), axes[1].dot(v), axes[2].dot(v)};
    }
    Eigen::Vector3d world(double x, double y, double z) const
    {
        return x * axes[0] + y * axes[1] + z * axes[2];
    }

    std::array<Eigen::Vector3d, 3> axes;
};

/// Corners of a convex polygon, or the ends of a segment, in the frame of the contact. Clipping by a plane adds one corner
/// at most.
struct ContactPolygon
{
    using Coordinates = std::array<double, 2 * kMostCorners>;

    /// More corners than there is room for can only come from rounding, and are next to another.
    void add(double px, double py, double pz)
    {
        if (count == int(x.size()))
            return;
        const auto i = static_cast<std::size_t>(count++);
        x[i] = px;
        y[i] = py;
        z[i] = pz;
    }

    Coordinates x, y, z;
    int count = 0;
};

/// The face of a core that looks along a direction, in the frame of the contact.
struct ContactFeature
{
    ContactPolygon corners;  ///< seen against `normal`, less than three: an edge, or a corner
    double turn = 1.0;  ///< 1: counter-clockwise seen from the tip of the contact's normal; -1: clockwise
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward, of any length; zero without a face
    double alignment = 0.0;                            ///< cosine between the normal and the direction
};

class FeatureFinder
{
public:
    /// @param side   1 to look along the contact's normal, -1 to look against it
    /// @param vertex support vertex along that direction, or -1
    FeatureFinder(const PosedShape& shape, const ContactFrame& frame, const Eigen::Vector3d& shift,
                  double side, std::int32_t vertex, ContactFeature& feature)
        : m_shape(shape),
          m_frame(frame),
          m_shift(frame.local(shift)),
          m_side(side),
          m_vertex(vertex),
          m_feature(feature)
    {
    }

    void find()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const bool isSegment = hull.kind() == HullKind::Segment && hull.vertexCount() == 2;
        if (!isSegment && hull.kind() != HullKind::Polygon && hull.kind() != HullKind::Solid)
            return;
        for (int k = 0; k < 3; ++k)
            m_columns[k] = m_frame.local({m_shape.row(0)[k], m_shape.row(1)[k], m_shape.row(2)[k]});
        if (!isSegment)
            return findFace();
        addCorner(0);
        addCorner(1);
    }

private:
    void addCorner(std::int32_t vertex)
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const double x = hull.x()[vertex], y = hull.y()[vertex], z = hull.z()[vertex];
        const Eigen::Vector3d p = m_columns[0] * x + m_columns[1] * y + m_columns[2] * z + m_shift;
        m_feature.corners.add(p.x(), p.y(), p.z());
    }

    void findFace()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        turnNormals();
        if (m_vertex < 0)
            m_vertex = m_shape.support(m_side * m_frame.axes[2], -1).vertex;
        const Best best = isTurnedOnly() ? bestFace<true>() : bestFace<false>();
        if (best.face < 0)
            return;
        const Eigen::Vector3d& n = hull.faces()[static_cast<std::size_t>(best.face)].normal;
        m_feature.normal = m_normals[0] * n.x() + m_normals[1] * n.y() + m_normals[2] * n.z();
        m_feature.alignment = std::sqrt(best.score);
        const auto corners = hull.faceVertices(best.face);
        const std::int32_t count = std::min<std::int32_t>(corners.size(), kMostCorners);
        for (std::int32_t i = 0; i < count; ++i)
            addCorner(corners[count == corners.size() ? i : i * corners.size() / count]);
    }

    /// Normals turn with the cofactors of the basis, and keep their side under a mirrored one.
    void turnNormals()
    {
        for (int k = 0; k < 3; ++k)
            m_normals[k] = m_columns[(k + 1) % 3].cross(m_columns[(k + 2) % 3]);
        m_feature.turn = m_side;
        if (m_normals[0].dot(m_columns[0]) >= 0.0)
            return;
        m_feature.turn = -m_side;
        for (Eigen::Vector3d& normal : m_normals)
            normal = -normal;
    }

    struct Best
    {
        std::int32_t face = -1;
        double score = 0.0;  ///< square of the cosine
    };

    /// True if all normals keep their length, up to a common factor.
    bool isTurnedOnly() const
    {
        const double lengths[] = {m_normals[0].squaredNorm(), m_normals[1].squaredNorm(),
                                  m_normals[2].squaredNorm()};
        const double least = std::min({lengths[0], lengths[1], lengths[2]});
        const double most = std::max({lengths[0], lengths[1], lengths[2]});
        const double skew =
            std::max({std::abs(m_normals[0].dot(m_normals[1])), std::abs(m_normals[1].dot(m_normals[2])),
                      std::abs(m_normals[2].dot(m_normals[0]))});
        return most - least <= 1e-5 * most && skew <= 1e-5 * most;
    }

    template <bool kIsTurnedOnly>
    Best bestFace() const
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const auto faces = hull.facesOf(m_vertex);
        Best best;
        for (const std::int32_t face : faces)
            consider<kIsTurnedOnly>(face, best);
        // A vertex inside a face is no corner of any.
        for (std::int32_t face = 0; faces.size() == 0 && face < std::int32_t(hull.faces().size()); ++face)
            consider<kIsTurnedOnly>(face, best);
        if constexpr (kIsTurnedOnly)
            best.score /= m_normals[0].squaredNorm();
        return best;
    }

    /// Without a branch, since no processor can guess which face is better.
    template <bool kIsTurnedOnly>
    void consider(std::int32_t face, Best& best) const
    {
        const Eigen::Vector3d& n = m_shape.hull().faces()[static_cast<std::size_t>(face)].normal;
        const double along =
            m_side * (m_normals[0].z() * n.x() + m_normals[1].z() * n.y() + m_normals[2].z() * n.z());
        double score = along * std::abs(along);
        if constexpr (!kIsTurnedOnly)
            score /= (m_normals[0] * n.x() + m_normals[1] * n.y() + m_normals[2] * n.z()).squaredNorm();
        best.face = score > best.score ? face : best.face;
        best.score = std::max(best.score, score);
    }

    const PosedShape& m_shape;
    const ContactFrame& m_frame;
    Eigen::Vector3d m_shift;
    double m_side;
    std::int32_t m_vertex;
    std::array<Eigen::Vector3d, 3> m_columns;  ///< of the basis
    std::array<Eigen::Vector3d, 3> m_normals;  ///< of the matrix that turns normals
    ContactFeature& m_feature;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
