// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What the algorithm of a child is.
enum class ChildKind : std::uint8_t
{
    Bullets,  ///< its manifolds are refreshed before all children are processed, as in Bullet
    Plane,    ///< Bullet's for a plane, without contacts unless the child is near
    Mesh,  ///< of cullet, for a convex child over a mesh: as Own, without contacts unless there are triangles
    Own    ///< of cullet: refreshes its manifold when it is processed, as that of a pair of bodies does
};

/// Whether an algorithm refreshes its manifold when it is processed.
inline bool refreshesItself(ChildKind kind)
{
    return kind >= ChildKind::Mesh;
}

/// What is known of the algorithm of a child, or of a pair of children.
struct ChildState
{
    btScalar breakingThreshold = 0;     ///< of a Plane's manifold
    std::uint8_t typeA = 0, typeB = 0;  ///< of the shapes for which the algorithm was made
    ChildKind kind = ChildKind::Bullets;
    bool mayTouch = true;      ///< false: the manifold of a Plane or Mesh has no contacts
    bool isProcessed = false;  ///< in this call
};

/// The state of a new algorithm.
///
/// @param isShared it uses the manifold of another algorithm
ChildState stateOf(const btCollisionAlgorithm& algorithm, const btCollisionShape& a,
                   const btCollisionShape& b, bool isShared);

/// Whether an algorithm was made for shapes of these types; those of children may be exchanged in place.
inline bool fits(const ChildState& state, const btCollisionShape& a, const btCollisionShape& b)
{
    return state.typeA == a.getShapeType() && state.typeB == b.getShapeType();
}

/// A child in world space.
struct PlacedChild
{
    int index = -1;
    const btCollisionShape* shape = nullptr;
    btTransform at;
    btVector3 low, high;  ///< its box

    void place(const btCollisionObjectWrapper& compound, int child)
    {
        const auto& whole = static_cast<const btCompoundShape&>(*compound.getCollisionShape());
        index = child;
        shape = whole.getChildShape(child);
        at = compound.getWorldTransform() * whole.getChildTransform(child);
        shape->getAabb(at, low, high);
    }
    bool overlaps(const btVector3& otherLow, const btVector3& otherHigh) const
    {
        return TestAabbAgainstAabb2(low, high, otherLow, otherHigh);
    }
};

/// Refreshes the manifolds of algorithms that have contacts.
class ManifoldRefresh
{
public:
    explicit ManifoldRefresh(btManifoldResult& result) : m_result(result)
    {
        m_manifolds.initializeFromBuffer(m_room, 0, 4);
    }
    ManifoldRefresh(const ManifoldRefresh&) = delete;
    ManifoldRefresh& operator=(const ManifoldRefresh&) = delete;

    void operator()(btCollisionAlgorithm& algorithm);

private:
    btManifoldResult& m_result;
    btPersistentManifold* m_room[4];
    btManifoldArray m_manifolds;
};

/// Whether the application sees when contacts end, in whose order all manifolds are refreshed first, as in Bullet.
bool seesEndsOfContacts();

void destroy(btCollisionAlgorithm& algorithm, btDispatcher& dispatcher);
}  // namespace CULLET_PRECISION
}  // namespace cullet
