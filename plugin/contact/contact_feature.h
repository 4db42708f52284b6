// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
inline void read(const Eigen::Vector3d& v, Components& components)
{
    components = Components{static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()),
                            static_cast<btScalar>(v.z()), 0};
}

/// Maps normals of a hull as its pose turns and stretches it; the same for all faces, and wherever the core is.
class NormalMap
{
public:
    explicit NormalMap(const PosedShape& shape) : m_isSimilarity(findSimilarity(shape))
    {
        if (m_isSimilarity)
            return;
        m_cofactors = cofactorsOf(shape);
        const auto& faces = shape.hull().faces();
        if (faces.size() > m_lengths.size())
            return;
        for (const auto& face : faces)
            m_lengths[static_cast<std::size_t>(m_known++)] = lengthOf(face.normal);
    }

    /// Whether the basis is a rotation times a scale, with or without reflection: it maps normals as it maps points.
    bool isSimilarity() const { return m_isSimilarity; }
    /// Of a similarity.
    double scale() const { return m_scale; }
    /// Of any other map: to multiply by.
    const Eigen::Matrix3d& cofactors() const { return m_cofactors; }
    /// Of a normal that is mapped by any other map.
    double lengthOf(const Eigen::Vector3d& normal) const { return (m_cofactors * normal).norm(); }
    /// The same, for the normal of a face of the hull.
    double lengthOf(std::int32_t face, const Eigen::Vector3d& normal) const
    {
        return face < m_known ? m_lengths[static_cast<std::size_t>(face)] : lengthOf(normal);
    }

    /// Normals transform with the cofactors of the basis; the sign keeps them outward under a reflection.
    static Eigen::Matrix3d cofactorsOf(const PosedShape& shape)
    {
        const Eigen::Matrix3d basis = shape.basis();
        const double side = isMirrored(shape) ? -1.0 : 1.0;
        Eigen::Matrix3d cofactors;
        for (int i = 0; i < 3; ++i)
            cofactors.row(i) = side * basis.row((i + 1) % 3).cross(basis.row((i + 2) % 3));
        return cofactors;
    }

    /// Whether the basis contains a reflection.
    static bool isMirrored(const PosedShape& shape)
    {
        const Components& y = shape.row(1);
        const Components& z = shape.row(2);
        const Components normal = CULLET_SHUFFLE(y, y, 1, 2, 0, 3) * CULLET_SHUFFLE(z, z, 2, 0, 1, 3) -
                                  CULLET_SHUFFLE(y, y, 2, 0, 1, 3) * CULLET_SHUFFLE(z, z, 1, 2, 0, 3);
        const Components products = shape.row(0) * normal;
        return Quad<btScalar>::sumOfThree(products) < 0;
    }

private:
    bool findSimilarity(const PosedShape& shape)
    {
        Components squares = {}, products = {};
        for (int i = 0; i < 3; ++i)
        {
            const Components& row = shape.row(i);
            squares += row * row;
            products += row * CULLET_SHUFFLE(row, row, 1, 2, 0, 3);
        }
        m_scale = double(squareRoot(squares[0]));
        Components skew = squares - squares[0];
        Quad<btScalar>::makePositive(skew);
        Quad<btScalar>::makePositive(products);
        const Components most = skew > products ? skew : products;
        return largestOf(most) <= btScalar(1e-5) * squares[0];
    }

    Eigen::Matrix3d m_cofactors;
    std::array<double, 6> m_lengths;  ///< of the mapped normals of the first m_known faces
    std::int32_t m_known = 0;         ///< none, if the hull has more, or gets its graph later
    double m_scale;
    bool m_isSimilarity;
};

/// The face at the support vertex of a core whose normal is best aligned with a direction.
class ContactFace
{
public:
    /// @param direction unit vector in world space
    /// @param vertex    support vertex along the direction, or -1
    /// @param fan       the faces around the vertex, for a hull without a graph; or null
    /// @param map       of the shape; null: it is found out
    ContactFace(const PosedShape& shape, const Eigen::Vector3d& direction, std::int32_t vertex,
                const VertexFan<btScalar>* fan = nullptr, const NormalMap* map = nullptr)
        : m_shape(shape),
          m_fan(fan),
          m_map(map),
          m_hasSides(shape.hull().kind() == HullKind::Polygon && fan == nullptr)
    {
        const HullKind kind = shape.hull().kind();
        if (kind != HullKind::Polygon && kind != HullKind::Solid && fan == nullptr)
            return;
        if (m_hasSides)
        {
            findSide(direction);
            return;
        }
        if (m_map == nullptr)
            m_map = &m_own.emplace(shape);
        if (m_map->isSimilarity())
            mapToHull(direction);
        else
            m_local = m_map->cofactors().transpose() * direction;
        findFace(vertex >= 0 ? vertex : shape.support(direction, -1).vertex);
    }

    ContactFace(const ContactFace&) = delete;
    ContactFace& operator=(const ContactFace&) = delete;

    /// Cosine between the face's normal and the direction; 0 without a face.
    double alignment() const { return m_alignment; }

    /// Corners, counter-clockwise seen from outside of the untransformed hull; both ends of a segment.
    Hull<btScalar>::Span corners() const
    {
        static constexpr std::int32_t kEnds[] = {0, 1};
        if (m_fan != nullptr && m_face >= 0)
        {
            const std::array<std::int32_t, 3>& corners = m_fan->begin()[m_face].corners;
            return {corners.data(), corners.data() + 3};
        }
        const Hull<btScalar>& hull = m_shape.hull();
        if (m_face >= 0)
            return hull.faceVertices(m_face);
        const bool isSegment = hull.kind() == HullKind::Segment && hull.vertexCount() == 2;
        return {kEnds, kEnds + (isSegment ? 2 : 0)};
    }

    /// The face's outward unit normal in world space.
    Eigen::Vector3d normal() const
    {
        if (m_hasSides)
            return (m_face == 0 ? m_ofFirstSide : Eigen::Vector3d(-m_ofFirstSide)).normalized();
        const Eigen::Vector3d& n = faceNormal(m_face);
        if (!m_map->isSimilarity())
            return (m_map->cofactors() * n).normalized();
        Components local;
        read(n, local);
        Eigen::Vector3d turned;
        for (int i = 0; i < 3; ++i)
        {
            const Components products = m_shape.row(i) * local;
            turned[i] = double(Quad<btScalar>::sumOfThree(products));
        }
        return turned * (1.0 / m_map->scale());
    }

    /// Whether the basis contains a reflection.
    bool isMirrored() const { return NormalMap::isMirrored(m_shape); }

private:
    const Eigen::Vector3d& faceNormal(std::int32_t face) const
    {
        if (m_fan != nullptr)
            return m_fan->begin()[face].normal;
        return m_shape.hull().faces()[static_cast<std::size_t>(face)].normal;
    }

    void mapToHull(const Eigen::Vector3d& direction)
    {
        Components d;
        read(direction, d);
        const Components local = m_shape.row(0) * d[0] + m_shape.row(1) * d[1] + m_shape.row(2) * d[2];
        m_local = Eigen::Vector3d(local[0], local[1], local[2]) * (1.0 / m_map->scale());
    }

    /// Chooses one of the two faces of a polygon, which are back to back.
    void findSide(const Eigen::Vector3d& direction)
    {
        const Eigen::Vector3d& n = faceNormal(0);
        if (n.x() == 0.0 && n.y() == 0.0)
        {
            // Of the map for normals, a triangle needs one column.
            const Eigen::Matrix3d basis = m_shape.basis();
            m_ofFirstSide = basis.col(0).cross(basis.col(1)) * (isMirrored() ? -n.z() : n.z());
        }
        else
            m_ofFirstSide = NormalMap::cofactorsOf(m_shape) * n;
        const double along = m_ofFirstSide.dot(direction);
        // A NaN makes the comparison false.
        if (!(std::abs(along) > 0.0))
            return;
        m_face = along > 0.0 ? 0 : 1;
        m_alignment = std::abs(along) / m_ofFirstSide.norm();
    }

    struct Best
    {
        std::int32_t face = -1;
        double cosine = 0.0;
    };

    void findFace(std::int32_t vertex)
    {
        Best best;
        if (m_fan != nullptr)
            considerFirst(static_cast<std::int32_t>(m_fan->end() - m_fan->begin()), best);
        else if (const auto faces = m_shape.hull().facesOf(vertex); faces.size() > 0)
            considerAll(faces, best);
        else  // a vertex inside a face has no faces
            considerFirst(static_cast<std::int32_t>(m_shape.hull().faces().size()), best);
        m_face = best.face;
        m_alignment = best.cosine;
    }

    void considerAll(const Hull<btScalar>::Span& faces, Best& best) const
    {
        if (m_map->isSimilarity())
        {
            for (const std::int32_t face : faces)
                consider(face, m_local.dot(faceNormal(face)), best);
        }
        else
        {
            for (const std::int32_t face : faces)
                consider(face, cosineOf(face), best);
        }
    }

    void considerFirst(std::int32_t count, Best& best) const
    {
        for (std::int32_t face = 0; face < count; ++face)
            consider(face, m_map->isSimilarity() ? m_local.dot(faceNormal(face)) : cosineOf(face), best);
    }

    double cosineOf(std::int32_t face) const
    {
        const Eigen::Vector3d& n = faceNormal(face);
        return m_local.dot(n) / (m_fan != nullptr ? m_map->lengthOf(n) : m_map->lengthOf(face, n));
    }

    /// Branch-free, since the branch would be unpredictable.
    static void consider(std::int32_t face, double cosine, Best& best)
    {
        best.face = cosine > best.cosine ? face : best.face;
        best.cosine = std::max(best.cosine, cosine);
    }

    const PosedShape& m_shape;
    const VertexFan<btScalar>* m_fan;
    const NormalMap* m_map;          ///< unless m_hasSides
    std::optional<NormalMap> m_own;  ///< if the caller had none
    /// The direction in the hull's frame. Its product with a hull normal is the cosine if the map is a similarity, otherwise
    /// the cosine times the length of the mapped normal.
    Eigen::Vector3d m_local;
    Eigen::Vector3d m_ofFirstSide;  ///< world space, of any length: normal of the first face, if m_hasSides
    const bool m_hasSides;          ///< a polygon
    std::int32_t m_face = -1;
    double m_alignment = 0.0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
