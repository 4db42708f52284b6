// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/shape_maker.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>

namespace cullet::test
{
namespace
{
constexpr int kMostChildren = 8;
constexpr int kFieldSide = 5;

btTransform at(const btVector3& place)
{
    return btTransform(btQuaternion::getIdentity(), place);
}
}  // namespace

ShapeKind kindWithin(ShapeFamily family, ShapeKind kind)
{
    if (family == ShapeFamily::All || kind == ShapeKind::Plane || kind == ShapeKind::Compound)
        return kind;
    if (family == ShapeFamily::Boxes)
        return ShapeKind::Box;
    return kind == ShapeKind::Capsule ? kind : ShapeKind::Sphere;
}

OwnedShape::OwnedShape(const ShapeRecipe& recipe) : m_recipe(recipe)
{
    m_shape = make();
}

/// 0.125 to 1, of three bits of the size.
btScalar OwnedShape::length(int shift) const
{
    return btScalar((m_recipe.size >> shift & 7) + 1) / 8;
}

std::unique_ptr<btCollisionShape> OwnedShape::make()
{
    const btScalar a = length(0), b = length(2), c = length(5);
    switch (kindWithin(m_recipe.family, m_recipe.kind))
    {
        case ShapeKind::Sphere:
            return std::make_unique<btSphereShape>(a);
        case ShapeKind::Capsule:
            return std::make_unique<btCapsuleShape>(a, b);
        case ShapeKind::Hull:
            return makeHull();
        case ShapeKind::Compound:
            return makeCompound();
        case ShapeKind::Mesh:
            return makeMesh();
        case ShapeKind::HeightField:
            return makeHeightField();
        case ShapeKind::Plane:
            return std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), a - 1);
        case ShapeKind::Empty:
            return std::make_unique<btEmptyShape>();
        case ShapeKind::Cylinder:
            return std::make_unique<btCylinderShape>(btVector3(a, b, a));
        case ShapeKind::Cone:
            return std::make_unique<btConeShape>(a, b);
        case ShapeKind::MultiSphere:
        {
            const btVector3 centres[] = {btVector3(-a, 0, 0), btVector3(a, b, 0)};
            const btScalar radii[] = {c, a};
            return std::make_unique<btMultiSphereShape>(centres, radii, 2);
        }
        case ShapeKind::ScaledMesh:
        {
            m_children.push_back(makeMesh());
            return std::make_unique<btScaledBvhTriangleMeshShape>(
                static_cast<btBvhTriangleMeshShape*>(m_children.back().get()), btVector3(a, 1, c));
        }
        case ShapeKind::Tetrahedron:
            return std::make_unique<btBU_Simplex1to4>(btVector3(-a, -a, 0), btVector3(b, 0, 0),
                                                      btVector3(0, c, 0), btVector3(0, 0, a));
        default:
            return std::make_unique<btBoxShape>(btVector3(a, b, c));
    }
}

/// Corners of a box, and points on and around it.
std::unique_ptr<btCollisionShape> OwnedShape::makeHull() const
{
    auto hull = std::make_unique<btConvexHullShape>();
    const int count = 4 + m_recipe.size % 29;
    std::uint32_t noise = m_recipe.size * 2654435761u + 1;
    for (int i = 0; i < count; ++i)
    {
        btVector3 point(0, 0, 0);
        for (int axis = 0; axis < 3; ++axis)
        {
            noise = noise * 1664525u + 1013904223u;
            point[axis] = (btScalar(noise >> 24) / 128 - 1) * length(2 * axis);
        }
        if (i < 8)
            for (int axis = 0; axis < 3; ++axis)
                point[axis] = ((i >> axis & 1) != 0 ? 1 : -1) * length(2 * axis) * btScalar(0.75);
        hull->addPoint(point, i + 1 == count);
    }
    return hull;
}

/// A ground of uneven quads.
std::unique_ptr<btCollisionShape> OwnedShape::makeMesh()
{
    m_triangles = std::make_unique<btTriangleMesh>();
    const int side = 1 + m_recipe.size % 3;
    const btScalar step = 1 + 2 * length(5);
    const auto corner = [&](int x, int z)
    {
        const btScalar height = btScalar((x * 5 + z * 3 + m_recipe.size) % 4) / 4;
        return btVector3(step * btScalar(x - 1), height, step * btScalar(z - 1));
    };
    for (int x = 0; x < side; ++x)
    {
        for (int z = 0; z < side; ++z)
        {
            m_triangles->addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
            m_triangles->addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
        }
    }
    return std::make_unique<btBvhTriangleMeshShape>(m_triangles.get(), true);
}

std::unique_ptr<btCollisionShape> OwnedShape::makeHeightField()
{
    for (int i = 0; i < kFieldSide * kFieldSide; ++i)
        m_heights.push_back(btScalar((i * 7 + m_recipe.size) % 5) / 4);
    return std::make_unique<btHeightfieldTerrainShape>(kFieldSide, kFieldSide, m_heights.data(), btScalar(0),
                                                       btScalar(1), 1, false);
}

std::unique_ptr<btCollisionShape> OwnedShape::makeCompound()
{
    auto compound = std::make_unique<btCompoundShape>((m_recipe.size & 1) == 0);
    m_shape = std::move(compound);
    for (int child = 0; child < m_recipe.size % 4; ++child)
        addChild(static_cast<std::uint8_t>(m_recipe.size + 37 * child),
                 btVector3(btScalar(child) - 1, btScalar(child % 2), 0));
    return std::move(m_shape);
}

btCompoundShape* OwnedShape::compound()
{
    return m_shape->isCompound() ? static_cast<btCompoundShape*>(m_shape.get()) : nullptr;
}

void OwnedShape::addChild(std::uint8_t size, const btVector3& place)
{
    if (compound() == nullptr || compound()->getNumChildShapes() >= kMostChildren)
        return;
    const ShapeKind kinds[] = {ShapeKind::Box, ShapeKind::Hull, ShapeKind::Sphere, ShapeKind::Capsule};
    OwnedShape child({kindWithin(m_recipe.family, kinds[size % 4]), size, ShapeFamily::All});
    m_children.push_back(std::move(child.m_shape));
    compound()->addChildShape(at(place), m_children.back().get());
}

/// The child's memory stays, as algorithms of pairs may refer to it until the next step.
void OwnedShape::removeChild(std::uint8_t index)
{
    if (compound() != nullptr && compound()->getNumChildShapes() > 0)
        compound()->removeChildShapeByIndex(index % compound()->getNumChildShapes());
}

void OwnedShape::moveChild(std::uint8_t index, const btVector3& place)
{
    if (compound() != nullptr && compound()->getNumChildShapes() > 0)
        compound()->updateChildTransform(index % compound()->getNumChildShapes(), at(place));
}
}  // namespace cullet::test
