// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/solver_group.h"

#include "cullet/plugin/step/island_groups.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
int tagOf(const btPersistentManifold& manifold)
{
    return islandOf(*manifold.getBody0(), *manifold.getBody1());
}

int tagOf(const btTypedConstraint& joint)
{
    return islandOf(joint.getRigidBodyA(), joint.getRigidBodyB());
}

/// The number of the first things that belong to an island.
template <class Thing>
int countOf(Thing* const* things, int count, int island)
{
    int own = 0;
    while (own < count && tagOf(*things[own]) == island)
        ++own;
    return own;
}

/// Takes the island of the first body out of a group.
SolverGroup takeIsland(SolverGroup& group)
{
    const int tag = group.bodies[0]->getIslandTag();
    SolverGroup island = group;
    island.bodyCount = 1;
    while (island.bodyCount < group.bodyCount && group.bodies[island.bodyCount]->getIslandTag() == tag)
        ++island.bodyCount;
    island.manifoldCount = countOf(group.manifolds, group.manifoldCount, tag);
    island.jointCount = countOf(group.joints, group.jointCount, tag);
    group.bodies += island.bodyCount;
    group.bodyCount -= island.bodyCount;
    group.manifolds += island.manifoldCount;
    group.manifoldCount -= island.manifoldCount;
    group.joints += island.jointCount;
    group.jointCount -= island.jointCount;
    return island;
}

/// Whether no contact or joint of an island moves a body of another one.
bool isByItself(const SolverGroup& island)
{
    const int tag = island.bodies[0]->getIslandTag();
    const auto isOther = [tag](const btCollisionObject& object)
    { return object.getIslandTag() != tag && !object.isStaticOrKinematicObject(); };
    for (int i = 0; i < island.manifoldCount; ++i)
    {
        if (isOther(*island.manifolds[i]->getBody0()) || isOther(*island.manifolds[i]->getBody1()))
            return false;
    }
    for (int i = 0; i < island.jointCount; ++i)
    {
        // Disabled joints have no rows, and do not put islands together.
        const btTypedConstraint& joint = *island.joints[i];
        if (joint.isEnabled() && (isOther(joint.getRigidBodyA()) || isOther(joint.getRigidBodyB())))
            return false;
    }
    return true;
}

/// Whether a group consists of islands, one after the other.
bool consistsOfIslands(SolverGroup group)
{
    for (int last = -1; group.bodyCount > 0;)
    {
        const int tag = group.bodies[0]->getIslandTag();
        if (tag <= last || !isByItself(takeIsland(group)))
            return false;
        last = tag;
    }
    return group.manifoldCount == 0 && group.jointCount == 0;
}
}  // namespace

GroupIslands::GroupIslands(const SolverGroup& group)
    : m_rest(group), m_isDivided(areMany(group) && consistsOfIslands(group))
{
}

bool GroupIslands::areMany(const SolverGroup& group)
{
    return group.bodyCount > 1 &&
           group.bodies[0]->getIslandTag() != group.bodies[group.bodyCount - 1]->getIslandTag();
}

bool GroupIslands::next(SolverGroup& island)
{
    if (m_rest.bodyCount == 0 && m_rest.manifoldCount == 0 && m_rest.jointCount == 0)
        return false;
    if (m_isDivided)
    {
        island = takeIsland(m_rest);
        return true;
    }
    island = m_rest;
    m_rest.bodyCount = m_rest.manifoldCount = m_rest.jointCount = 0;
    return true;
}

void IslandSelection::clear()
{
    m_bodies.clear();
    m_manifolds.clear();
    m_joints.clear();
}

void IslandSelection::add(const SolverGroup& island)
{
    m_bodies.insert(m_bodies.end(), island.bodies, island.bodies + island.bodyCount);
    m_manifolds.insert(m_manifolds.end(), island.manifolds, island.manifolds + island.manifoldCount);
    m_joints.insert(m_joints.end(), island.joints, island.joints + island.jointCount);
}

SolverGroup IslandSelection::selected()
{
    return {m_bodies.data(),    static_cast<int>(m_bodies.size()),
            m_manifolds.data(), static_cast<int>(m_manifolds.size()),
            m_joints.data(),    static_cast<int>(m_joints.size())};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
