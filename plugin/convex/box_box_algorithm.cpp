// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/box_box_algorithm.h"

#include "cullet/plugin/contact/manifold_update.h"
#include "cullet/plugin/convex/box_kernels.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/prefetch.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
BoxSource sourceOf(const btCollisionObjectWrapper& body)
{
    const btTransform& transform = body.getWorldTransform();
    const auto& shape = static_cast<const btBoxShape&>(*body.getCollisionShape());
    return {transform.getBasis()[0].m_floats, transform.getOrigin().m_floats,
            shape.getHalfExtentsWithoutMargin().m_floats, shape.getMarginNV()};
}

/// Prefetches the points of a manifold that has some, and its number of points.
[[gnu::always_inline]] inline void prefetchPoints(const btPersistentManifold& manifold)
{
    if (manifold.getNumContacts() > 0)
        prefetchBytes(&manifold, 0, sizeof(btPersistentManifold) / 16 * 16);
}

bool isBox(const btCollisionObjectWrapper& body)
{
    return body.getCollisionShape()->getShapeType() == BOX_SHAPE_PROXYTYPE;
}
}  // namespace

BoxBoxAlgorithm::BoxBoxAlgorithm(IsaGjkRegistration& isaGjk, btPersistentManifold* manifold,
                                 const btCollisionAlgorithmConstructionInfo& info,
                                 const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b)
    : btActivatingCollisionAlgorithm(info, a, b), m_keeper(isaGjk), m_manifold(manifold)
{
    if (m_manifold != nullptr ||
        !m_dispatcher->needsCollision(a->getCollisionObject(), b->getCollisionObject()))
        return;
    m_manifold = m_dispatcher->getNewManifold(a->getCollisionObject(), b->getCollisionObject());
    m_ownsManifold = m_manifold != nullptr;
}

BoxBoxAlgorithm::~BoxBoxAlgorithm()
{
    if (m_ownsManifold)
        m_dispatcher->releaseManifold(m_manifold);
    m_keeper.isaGjk().leave();
}

void BoxBoxAlgorithm::processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                       const btDispatcherInfo& info, btManifoldResult* result)
{
    // Bullet's pool is full, or the dispatcher's filter excludes the pair.
    if (m_manifold == nullptr)
        return;
    result->setPersistentManifold(m_manifold);
    // They are used once the contact is known.
    prefetchPoints(*m_manifold);
    HullUse unused[2];
    const ContactCall call = {m_keeper.isaGjk(), *a, *b, info, *result, *m_manifold, unused};
    if (m_ownsManifold && m_keeper.keep(call))
        return;
    BoxContact<btScalar> contact;
    contact.count = 0;
    if (isBox(*a) && isBox(*b))
        collideBoxes(sourceOf(*a), sourceOf(*b), m_group, contact);
    count(contact.count > 0);
    if (contact.count > 0)
        report(contact, call);
    else if (m_ownsManifold && m_manifold->getNumContacts() > 0)
        result->refreshContactPoints();
}

void BoxBoxAlgorithm::count(bool isTouching)
{
    IsaGjkRegistration::Counters& counters = m_keeper.isaGjk().counters();
    (isTouching ? counters.touching : counters.separated).add(1);
    if (isTouching)
        counters.depths.add(1);
}

void BoxBoxAlgorithm::report(const BoxContact<btScalar>& contact, const ContactCall& call)
{
    btManifoldResult& result = call.result;
    if (m_ownsManifold && isExactly<btManifoldResult>(result) && updateManifold(contact, result, *m_manifold))
        return m_keeper.store(call);
    const btVector3 normal(contact.normal[0], contact.normal[1], contact.normal[2]);
    for (int i = 0; i < contact.count; ++i)
        result.addContactPoint(normal,
                               btVector3(contact.points[0][i], contact.points[1][i], contact.points[2][i]),
                               contact.distances[i]);
    if (!m_ownsManifold)
        return;
    m_keeper.store(call);
    result.refreshContactPoints();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
