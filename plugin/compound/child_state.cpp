// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/compound/child_state.h"

#include "cullet/plugin/convex/box_box_algorithm.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
ChildKind kindOf(const btCollisionAlgorithm& algorithm)
{
    if (IsaGjkRegistration::isOfMesh(algorithm))
        return ChildKind::Mesh;
    if (isExactly<IsaGjkAlgorithm>(algorithm) || isExactly<BoxBoxAlgorithm>(algorithm) ||
        IsaGjkRegistration::isOfCompound(algorithm))
        return ChildKind::Own;
    return isExactly<btConvexPlaneCollisionAlgorithm>(algorithm) ? ChildKind::Plane : ChildKind::Bullets;
}
}  // namespace

ChildState stateOf(const btCollisionAlgorithm& algorithm, const btCollisionShape& a,
                   const btCollisionShape& b, bool isShared)
{
    ChildState state;
    state.typeA = static_cast<std::uint8_t>(a.getShapeType());
    state.typeB = static_cast<std::uint8_t>(b.getShapeType());
    state.kind = isShared ? ChildKind::Bullets : kindOf(algorithm);
    return state;
}

void ManifoldRefresh::operator()(btCollisionAlgorithm& algorithm)
{
    m_manifolds.resizeNoInitialize(0);
    algorithm.getAllContactManifolds(m_manifolds);
    for (int i = 0; i < m_manifolds.size(); ++i)
    {
        if (m_manifolds[i]->getNumContacts() == 0)
            continue;
        m_result.setPersistentManifold(m_manifolds[i]);
        m_result.refreshContactPoints();
        m_result.setPersistentManifold(nullptr);
    }
}

bool seesEndsOfContacts()
{
    return gContactEndedCallback != nullptr || gContactDestroyedCallback != nullptr;
}

void destroy(btCollisionAlgorithm& algorithm, btDispatcher& dispatcher)
{
    algorithm.~btCollisionAlgorithm();
    dispatcher.freeCollisionAlgorithm(&algorithm);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
