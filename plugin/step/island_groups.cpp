// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/island_groups.h"

#include "cullet/plugin/step/prefetch_step.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool isAwake(const btCollisionObject& object)
{
    return object.getActivationState() != ISLAND_SLEEPING;
}

/// Whether the solver makes a body of its own of an object, which it writes back even if the object is kinematic.
bool isMovedBySolver(const btCollisionObject& object)
{
    const btRigidBody* body = btRigidBody::upcast(&object);
    return body != nullptr && (body->getInvMass() != btScalar(0) || body->isKinematicObject());
}

/// A kinematic body wakes what it touches.
void wakeByKinematic(const btCollisionObject& waker, const btCollisionObject& other)
{
    if (waker.isKinematicObject() && isAwake(waker) && waker.hasContactResponse())
        other.activate();
}

/// Sorts like btAlignedObjectArray<Key>::quickSort(), with Bullet's own function.
template <class Key, class IsLess>
void sortAsBullet(std::vector<Key>& keys, const IsLess& isLess)
{
    const int count = static_cast<int>(keys.size());
    btAlignedObjectArray<Key> view;
    view.initializeFromBuffer(keys.data(), count, count);
    view.quickSort(isLess);
}
}  // namespace

void IslandGroups::reserve(btCollisionWorld& world, btSimulationIslandManager& manager, std::size_t joints)
{
    const auto elements = static_cast<std::size_t>(manager.getUnionFind().getNumElements());
    const auto manifolds = static_cast<std::size_t>(world.getDispatcher()->getNumManifolds());
    m_manifoldKeys.clear();
    m_manifoldKeys.reserve(manifolds);
    m_jointKeys.resize(joints);
    m_firstJointKey.assign(elements, kNoGroup);
    m_groupOfIsland.assign(elements, kNoGroup);
    m_sharedThings.clear();
    m_sharedThings.reserve(2 * manifolds + 3 * joints);
    m_bodies.clear();
    m_bodies.reserve(elements);
    m_manifolds.clear();
    m_manifolds.reserve(manifolds);
    m_joints.clear();
    m_joints.reserve(joints);
}

void IslandGroups::build(btCollisionWorld& world, btSimulationIslandManager& manager, Joints& joints,
                         int minimumBatch)
{
    m_manager = &manager;
    m_objects = &world.getCollisionObjectArray();
    m_minimumBatch = minimumBatch;
    sortJoints(joints);
    {
        BT_PROFILE("islandUnionFindAndQuickSort");
        manager.getUnionFind().sortIslands();
        updateSleep(world);
        collectManifolds(world);
    }
    if (world.getDispatchInfo().m_deterministicOverlappingPairs)
        sortManifoldsByIds();
    else
        sortAsBullet(m_manifoldKeys,
                     [](const ManifoldKey& a, const ManifoldKey& b) { return a.island < b.island; });
    m_element = 0;
    m_manifoldKey = 0;
    m_group = {};
    m_groups = 0;
    m_isFinished = false;
}

void IslandGroups::sortJoints(Joints& joints)
{
    for (std::size_t i = 0; i < m_jointKeys.size(); ++i)
    {
        btTypedConstraint& joint = *joints[static_cast<int>(i)];
        const btRigidBody& a = joint.getRigidBodyA();
        const btRigidBody& b = joint.getRigidBodyB();
        const int island = islandOf(a, b);
        m_jointKeys[i] = {island, &joint};
        noteShared(a, island);
        noteShared(b, island);
        if (joint.getJointFeedback() != nullptr)
            m_sharedThings.push_back({joint.getJointFeedback(), island});
    }
    sortAsBullet(m_jointKeys, [](const JointKey& a, const JointKey& b) { return a.island < b.island; });
    for (std::size_t i = m_jointKeys.size(); i-- > 0;)
    {
        joints[static_cast<int>(i)] = m_jointKeys[i].joint;
        const auto island = static_cast<std::size_t>(m_jointKeys[i].island);
        if (island < m_firstJointKey.size())
            m_firstJointKey[island] = static_cast<std::uint32_t>(i);
    }
}

/// Lets an island sleep if no body of it is active, or wakes all of its bodies.
void IslandGroups::updateSleep(btCollisionWorld& world)
{
    const int count = m_manager->getUnionFind().getNumElements();
    if (count == 0)
        return;
    const btElement* const elements = &m_manager->getUnionFind().getElement(0);
    btCollisionObject* const* const objects = &world.getCollisionObjectArray()[0];
    const auto objectAt = [=](int element) { return objects[elements[element].m_sz]; };
    for (int begin = 0, end = 0; begin < count; begin = end)
    {
        const int island = elements[begin].m_id;
        bool isSleeping = true;
        for (end = begin; end < count && elements[end].m_id == island; ++end)
        {
            if (end + kPrefetchDistance < count)
                prefetchState(objectAt(end + kPrefetchDistance));
            const btCollisionObject& object = *objectAt(end);
            const int state = object.getActivationState();
            if (object.getIslandTag() == island && (state == ACTIVE_TAG || state == DISABLE_DEACTIVATION))
                isSleeping = false;
        }
        for (int i = begin; i < end; ++i)
        {
            btCollisionObject& object = *objectAt(i);
            if (object.getIslandTag() != island)
                continue;
            if (isSleeping)
            {
                object.setActivationState(ISLAND_SLEEPING);
            }
            else if (!isAwake(object))
            {
                object.setActivationState(WANTS_DEACTIVATION);
                object.setDeactivationTime(0);
            }
        }
    }
}

void IslandGroups::collectManifolds(btCollisionWorld& world)
{
    btDispatcher& dispatcher = *world.getDispatcher();
    const bool needsContacts = world.getDispatchInfo().m_deterministicOverlappingPairs;
    btPersistentManifold* const* const manifolds = dispatcher.getInternalManifoldPointer();
    const int count = dispatcher.getNumManifolds();
    for (int i = 0; i < count; ++i)
    {
        if (i + 2 * kPrefetchDistance < count)
            prefetchBodiesOf(manifolds[i + 2 * kPrefetchDistance]);
        if (i + kPrefetchDistance < count)
        {
            prefetchState(manifolds[i + kPrefetchDistance]->getBody0());
            prefetchState(manifolds[i + kPrefetchDistance]->getBody1());
        }
        btPersistentManifold& manifold = *manifolds[i];
        if (needsContacts && manifold.getNumContacts() == 0)
            continue;
        const btCollisionObject& a = *manifold.getBody0();
        const btCollisionObject& b = *manifold.getBody1();
        if (!isAwake(a) && !isAwake(b))
            continue;
        wakeByKinematic(a, b);
        wakeByKinematic(b, a);
        if (dispatcher.needsResponse(&a, &b))
            addManifold(manifold);
    }
}

void IslandGroups::addManifold(btPersistentManifold& manifold)
{
    const btCollisionObject& a = *manifold.getBody0();
    const btCollisionObject& b = *manifold.getBody1();
    const int island = islandOf(a, b);
    m_manifoldKeys.push_back({island, &manifold});
    noteShared(a, island);
    noteShared(b, island);
}

/// Sorts manifolds by island and then by their bodies, if the world asks for that order.
void IslandGroups::sortManifoldsByIds()
{
    const auto idOf = [](const btCollisionObject* object)
    { return object->getBroadphaseHandle()->m_uniqueId; };
    const auto isLess = [&](const ManifoldKey& left, const ManifoldKey& right)
    {
        if (left.island != right.island)
            return left.island < right.island;
        const int leftId = idOf(left.manifold->getBody0()), rightId = idOf(right.manifold->getBody0());
        if (leftId != rightId)
            return leftId < rightId;
        return idOf(left.manifold->getBody1()) < idOf(right.manifold->getBody1());
    };
    sortAsBullet(m_manifoldKeys, isLess);
}

/// Notes an object of a manifold or joint of an island, unless it is the island's own.
void IslandGroups::noteShared(const btCollisionObject& object, int island)
{
    const int ownIsland = object.getIslandTag();
    if (ownIsland == island || (ownIsland < 0 && !isMovedBySolver(object)))
        return;
    m_sharedThings.push_back({&object, island});
    if (ownIsland >= 0)
        m_sharedThings.push_back({&object, ownIsland});
}

bool IslandGroups::next(IslandGroup& group)
{
    btUnionFind& elements = m_manager->getUnionFind();
    while (m_element < elements.getNumElements())
    {
        const int island = elements.getElement(m_element).m_id;
        const bool isActive = addBodies(island);
        addManifolds(island, isActive);
        if (!isActive)
            continue;
        addJoints(island);
        m_groupOfIsland[static_cast<std::size_t>(island)] = m_groups;
        const std::size_t size =
            m_manifolds.size() - m_group.manifolds.begin + m_joints.size() - m_group.joints.begin;
        if (m_minimumBatch <= 1 || size > static_cast<std::size_t>(m_minimumBatch))
        {
            group = takeGroup();
            return true;
        }
    }
    if (m_isFinished)
        return false;
    m_isFinished = true;
    group = takeGroup();
    return true;
}

/// Adds the bodies of the next island to the group, unless none of them is active.
bool IslandGroups::addBodies(int island)
{
    const int count = m_manager->getUnionFind().getNumElements();
    const btElement* const elements = &m_manager->getUnionFind().getElement(0);
    btCollisionObject* const* const objects = &(*m_objects)[0];
    int end = m_element;
    bool isActive = false;
    for (; end < count && elements[end].m_id == island; ++end)
        isActive = isActive || objects[elements[end].m_sz]->isActive();
    if (isActive)
    {
        for (int i = m_element; i < end; ++i)
            m_bodies.push_back(objects[elements[i].m_sz]);
    }
    m_element = end;
    return isActive;
}

/// Passes over the manifolds of an island, whose turn it is in the sorted list if it has any.
void IslandGroups::addManifolds(int island, bool isActive)
{
    for (; m_manifoldKey < m_manifoldKeys.size() && m_manifoldKeys[m_manifoldKey].island == island;
         ++m_manifoldKey)
    {
        if (isActive)
            m_manifolds.push_back(m_manifoldKeys[m_manifoldKey].manifold);
    }
}

void IslandGroups::addJoints(int island)
{
    for (std::size_t i = m_firstJointKey[static_cast<std::size_t>(island)];
         i < m_jointKeys.size() && m_jointKeys[i].island == island; ++i)
        m_joints.push_back(m_jointKeys[i].joint);
}

IslandGroup IslandGroups::takeGroup()
{
    m_group.bodies.end = static_cast<std::uint32_t>(m_bodies.size());
    m_group.manifolds.end = static_cast<std::uint32_t>(m_manifolds.size());
    m_group.joints.end = static_cast<std::uint32_t>(m_joints.size());
    const IslandGroup group = m_group;
    m_group.bodies.begin = group.bodies.end;
    m_group.manifolds.begin = group.manifolds.end;
    m_group.joints.begin = group.joints.end;
    ++m_groups;
    return group;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
