// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btVector3.h>

#include <unordered_map>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
inline Eigen::Vector3f toEigen(const btVector3& v)
{
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// The surface of the convex hull of points, face by face; empty if they have no volume and no area.
DrawMesh makeHullMesh(const std::vector<btVector3>& points);

/// The surface of a shape in its own frame.
///
/// Polyhedra are grown by their collision margin about their centre, since they touch at the margin. Other convex
/// shapes without a special case are the hull of some hundred support points; triangle meshes are shown as they are, an
/// infinite plane as a square of `planeSize`. Empty for shapes without a surface.
DrawMesh makeShapeMesh(const btCollisionShape& shape, btScalar planeSize);

/// The meshes of the shapes of a film, each made once. Shapes must outlive this object unchanged.
class ShapeMeshes
{
public:
    struct Look
    {
        std::uint32_t mesh;
        Eigen::Vector3f scale;
    };

    explicit ShapeMeshes(Film& film) : m_film(film) {}

    /// @param planeSize edge of the square for an infinite plane
    Look look(const btCollisionShape& shape, btScalar planeSize);

private:
    Film& m_film;
    std::unordered_map<const btCollisionShape*, Look> m_looks;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
