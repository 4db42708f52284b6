// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/island_search.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/step/prefetch_step.h"
#include "cullet/plugin/step/static_mark.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
const btCollisionObject* objectOf(const btBroadphaseProxy* proxy)
{
    return static_cast<const btCollisionObject*>(proxy->m_clientObject);
}

bool merges(const btCollisionObject* object)
{
    return object != nullptr && object->mergesSimulationIslands();
}

/// Unites the islands of all pairs.
void uniteByPairs(btCollisionWorld& world, btUnionFind& elements)
{
    btOverlappingPairCache& cache = *world.getPairCache();
    const int count = cache.getNumOverlappingPairs();
    const btBroadphasePair* const pairs = count > 0 ? cache.getOverlappingPairArrayPtr() : nullptr;
    for (int i = 0; i < count; ++i)
    {
        if (i + 2 * kPrefetchDistance < count)
        {
            __builtin_prefetch(pairs[i + 2 * kPrefetchDistance].m_pProxy0);
            __builtin_prefetch(pairs[i + 2 * kPrefetchDistance].m_pProxy1);
        }
        if (i + kPrefetchDistance < count)
        {
            prefetchState(objectOf(pairs[i + kPrefetchDistance].m_pProxy0));
            prefetchState(objectOf(pairs[i + kPrefetchDistance].m_pProxy1));
        }
        const btCollisionObject* const a = objectOf(pairs[i].m_pProxy0);
        const btCollisionObject* const b = objectOf(pairs[i].m_pProxy1);
        if (merges(a) && merges(b))
            elements.unite(a->getIslandTag(), b->getIslandTag());
    }
}

void uniteMovers(btUnionFind& elements, const btCollisionObject* a, const btCollisionObject* b)
{
    if (a != nullptr && !a->isStaticOrKinematicObject() && b != nullptr && !b->isStaticOrKinematicObject())
        elements.unite(a->getIslandTag(), b->getIslandTag());
}
void uniteByManifoldsAndJoints(const IslandSearch::Step& step, btUnionFind& elements)
{
    for (int i = 0; i < step.predictive.size(); ++i)
        uniteMovers(elements, step.predictive[i]->getBody0(), step.predictive[i]->getBody1());
    for (int i = 0; i < step.joints.size(); ++i)
    {
        if (step.joints[i]->isEnabled())
            uniteMovers(elements, &step.joints[i]->getRigidBodyA(), &step.joints[i]->getRigidBodyB());
    }
}
}  // namespace

void IslandSearch::reserve(std::size_t objects)
{
    m_movers.clear();
    m_movers.reserve(objects);
}

void IslandSearch::run(const Step& step)
{
    btUnionFind& elements = step.manager.getUnionFind();
    if (!isExactly<btSimulationIslandManager>(step.manager))
    {
        BT_PROFILE("calculateSimulationIslands");
        step.manager.updateActivationState(&step.world, step.world.getDispatcher());
        uniteByManifoldsAndJoints(step, elements);
        step.manager.storeIslandActivationState(&step.world);
        return;
    }
    BT_PROFILE("calculateSimulationIslands");
    numberObjects(step);
    step.manager.initUnionFind(static_cast<int>(m_movers.size()));
    uniteByPairs(step.world, elements);
    uniteByManifoldsAndJoints(step, elements);
    storeIslands(step.world, step.manager);
}

/// As btSimulationIslandManager::updateActivationState(), and for static objects as storeIslandActivationState(): nothing
/// reads theirs in between.
void IslandSearch::numberObjects(const Step& step)
{
    const btCollisionObjectArray& objects = step.world.getCollisionObjectArray();
    const auto number = [&](int count, const auto& indexOf)
    {
        for (int i = 0; i < count; ++i)
        {
            if (i + kPrefetchDistance < count)
                prefetchResting(objects[indexOf(i + kPrefetchDistance)], false);
            numberObject(*objects[indexOf(i)], indexOf(i));
        }
    };
    if (step.restless == nullptr)
        number(objects.size(), [](int i) { return i; });
    else
        number(static_cast<int>(step.restless->size()),
               [&](int i) { return (*step.restless)[static_cast<std::size_t>(i)]; });
}

void IslandSearch::numberObject(btCollisionObject& object, int index)
{
    if (object.isStaticOrKinematicObject())
    {
        markAsStatic(object);
        return;
    }
    object.setIslandTag(static_cast<int>(m_movers.size()));
    object.setCompanionId(-1);
    object.setHitFraction(1);
    m_movers.push_back(index);
}

/// As btSimulationIslandManager::storeIslandActivationState(), for objects that have an island.
void IslandSearch::storeIslands(const btCollisionWorld& world, btSimulationIslandManager& manager) const
{
    btUnionFind& elements = manager.getUnionFind();
    for (std::size_t i = 0; i < m_movers.size(); ++i)
    {
        if (i + kPrefetchDistance < m_movers.size())
            prefetchState(world.getCollisionObjectArray()[m_movers[i + kPrefetchDistance]]);
        const auto element = static_cast<int>(i);
        world.getCollisionObjectArray()[m_movers[i]]->setIslandTag(elements.find(element));
        elements.getElement(element).m_sz = m_movers[i];
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
