// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/shape_contents.h"

#include "cullet/plugin/core/sequence_hash.h"
#include "cullet/plugin/shapes/thread_safe_aabb.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Whether all of a shape is read below.
bool isKnown(const btCollisionShape& shape) noexcept
{
    switch (shape.getShapeType())
    {
        case BOX_SHAPE_PROXYTYPE:
        case SPHERE_SHAPE_PROXYTYPE:
        case CONVEX_HULL_SHAPE_PROXYTYPE:
        case CAPSULE_SHAPE_PROXYTYPE:
        case CYLINDER_SHAPE_PROXYTYPE:
        case CONE_SHAPE_PROXYTYPE:
        case STATIC_PLANE_PROXYTYPE:
        case COMPOUND_SHAPE_PROXYTYPE:
            // Exactly of Bullet's class.
            return hasThreadSafeAabb(shape);
        default:
            return false;
    }
}

void addPlane(const btStaticPlaneShape& plane, SequenceHash& hash) noexcept
{
    hash.add(plane.getPlaneNormal());
    hash.add(bitsOf(plane.getPlaneConstant()), bitsOf(plane.getMargin()));
}

void addConvex(const btConvexInternalShape& shape, SequenceHash& hash) noexcept
{
    hash.add(shape.getImplicitShapeDimensions());
    hash.add(shape.getLocalScalingNV());
    // A hull keeps its box, which may be made anew after the points were changed.
    btVector3 low, high;
    shape.getAabb(btTransform::getIdentity(), low, high);
    hash.add(low);
    hash.add(high);
    hash.add(bitsOf(shape.getMarginNV()),
             shape.isPolyhedral()
                 ? bitsOf(static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron())
                 : 0);
    const int type = shape.getShapeType();
    if (type == CAPSULE_SHAPE_PROXYTYPE)
        hash.add(std::uint64_t(static_cast<const btCapsuleShape&>(shape).getUpAxis()), 0);
    if (type == CYLINDER_SHAPE_PROXYTYPE)
        hash.add(std::uint64_t(static_cast<const btCylinderShape&>(shape).getUpAxis()), 0);
    if (type == CONE_SHAPE_PROXYTYPE)
        hash.add(std::uint64_t(static_cast<const btConeShape&>(shape).getConeUpIndex()), 0);
    if (type != CONVEX_HULL_SHAPE_PROXYTYPE)
        return;
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    hash.add(std::uint64_t(hull.getNumPoints()), 0);
    for (int i = 0; i < hull.getNumPoints(); ++i)
        hash.add(hull.getUnscaledPoints()[i]);
}

/// @return whether all children are of known classes
bool addCompound(const btCompoundShape& compound, SequenceHash& hash) noexcept
{
    hash.add(std::uint64_t(compound.getNumChildShapes()), std::uint64_t(compound.getUpdateRevision()));
    hash.add(bitsOf(compound.getMargin()), bitsOf(compound.getDynamicAabbTree()));
    btVector3 low, high;
    compound.getAabb(btTransform::getIdentity(), low, high);
    hash.add(low);
    hash.add(high);
    const btCollisionShape* last = nullptr;
    std::uint64_t ofLast = 0;
    const btCompoundShapeChild* const children = const_cast<btCompoundShape&>(compound).getChildList();
    for (int i = 0; i < compound.getNumChildShapes(); ++i)
    {
        const btCompoundShapeChild& child = children[i];
        // Children often share a shape.
        if (child.m_childShape != last)
            ofLast = hashOfContents(*child.m_childShape);
        if (ofLast == 0)
            return false;
        last = child.m_childShape;
        hash.add(ofLast, bitsOf(child.m_node));
        hash.add(child.m_transform);
        if (child.m_node == nullptr)
            continue;
        hash.add(child.m_node->volume.Mins());
        hash.add(child.m_node->volume.Maxs());
    }
    return true;
}
}  // namespace

std::uint64_t hashOfContents(const btCollisionShape& shape) noexcept
{
    if (!isKnown(shape))
        return 0;
    const int type = shape.getShapeType();
    SequenceHash hash;
    hash.add(bitsOf(&shape), std::uint64_t(type));
    if (type == COMPOUND_SHAPE_PROXYTYPE)
        return addCompound(static_cast<const btCompoundShape&>(shape), hash) ? hash.value() : 0;
    if (type == STATIC_PLANE_PROXYTYPE)
        addPlane(static_cast<const btStaticPlaneShape&>(shape), hash);
    else
        addConvex(static_cast<const btConvexInternalShape&>(shape), hash);
    return hash.value();
}

std::uint64_t ContentsMemo::hashOf(const btCollisionShape& shape) noexcept
{
    Entry& entry = m_entries[bitsOf(&shape) * std::uint64_t(0x9e3779b97f4a7c15) >> 58];
    if (entry.shape != &shape)
        entry = {&shape, hashOfContents(shape)};
    return entry.hash;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
