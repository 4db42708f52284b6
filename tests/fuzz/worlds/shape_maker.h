// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <btBulletCollisionCommon.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
enum class ShapeKind : std::uint8_t
{
    Box,
    Sphere,
    Capsule,
    Hull,
    Compound,
    Mesh,
    HeightField,
    Plane,
    Empty,
    Cylinder,
    Cone,
    MultiSphere,
    ScaledMesh,
    Tetrahedron,
    kCount
};

/// Which shapes a world has. Bullet's own algorithms answer for pairs within Boxes and within Spheres.
enum class ShapeFamily : std::uint8_t
{
    All,
    Boxes,   ///< boxes, planes, compounds of boxes
    Spheres  ///< spheres, capsules, planes, compounds of spheres
};

struct ShapeRecipe
{
    ShapeKind kind = ShapeKind::Box;
    std::uint8_t size = 0;
    ShapeFamily family = ShapeFamily::All;
};

/// The kind that stands for a kind in a family.
ShapeKind kindWithin(ShapeFamily family, ShapeKind kind);

/// A shape with what it refers to. The same recipe gives equal shapes.
class OwnedShape
{
public:
    explicit OwnedShape(const ShapeRecipe& recipe);
    OwnedShape(const OwnedShape&) = delete;
    OwnedShape& operator=(const OwnedShape&) = delete;

    btCollisionShape& shape() { return *m_shape; }
    const ShapeRecipe& recipe() const { return m_recipe; }
    /// Null for shapes of other kinds.
    btCompoundShape* compound();
    /// Bodies with such a shape do not move by forces.
    bool isConcave() const { return m_shape->isConcave() || m_shape->isInfinite(); }

    /// Compounds of fewer than eight children get one more; others stay.
    void addChild(std::uint8_t size, const btVector3& place);
    void removeChild(std::uint8_t index);
    void moveChild(std::uint8_t index, const btVector3& place);

private:
    std::unique_ptr<btCollisionShape> make();
    std::unique_ptr<btCollisionShape> makeHull() const;
    std::unique_ptr<btCollisionShape> makeMesh();
    std::unique_ptr<btCollisionShape> makeHeightField();
    std::unique_ptr<btCollisionShape> makeCompound();
    btScalar length(int shift) const;

    ShapeRecipe m_recipe;
    // In the order in which they refer to each other.
    std::unique_ptr<btTriangleMesh> m_triangles;
    std::vector<btScalar> m_heights;
    std::vector<std::unique_ptr<btCollisionShape>> m_children;
    std::unique_ptr<btCollisionShape> m_shape;
};
}  // namespace cullet::test
