// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/solver_bodies.h"

#include "cullet/base/threads/parallel_loops.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btTransformUtil.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Bodies for which a task pays.
constexpr std::size_t kGrain = 512;

constexpr std::uint32_t kNoLocalId = ~std::uint32_t{0};

std::uint32_t idOf(const btRigidBody& body)
{
    const btBroadphaseProxy* const proxy = body.getBroadphaseHandle();
    return proxy != nullptr ? static_cast<std::uint32_t>(proxy->m_uniqueId) : 0;
}

void set(btScalar (&to)[3], const btVector3& from)
{
    for (int i = 0; i < 3; ++i)
        to[i] = from[i];
}

btVector3 vectorOf(const btScalar* from)
{
    return {from[0], from[1], from[2]};
}

template <class Body>
void forEach(std::size_t count, ParallelLoops& loops, const Body& body)
{
    const unsigned tasks = loops.tasksFor(count, kGrain);
    loops.run(tasks,
              [&](unsigned task)
              {
                  const TaskRange range(count, task, tasks);
                  for (std::uint32_t i = range.begin; i < range.end; ++i)
                      body(i);
              });
}
}  // namespace

void SolverBodies::clear(btCollisionObject** bodies, int count)
{
    m_bodies.assign(1, nullptr);
    m_isMoved.assign(1, 0);
    m_isBound.assign(1, 0);
    m_kinematic.clear();
    for (int i = 0; i < count; ++i)
        bodies[i]->setCompanionId(-1);
    for (int i = 0; i < count; ++i)
        add(*bodies[i]);
    findLocalIds();
}

/// Bodies of an island follow each other.
void SolverBodies::findLocalIds()
{
    m_localIds.assign(1, kNoLocalId);
    for (std::uint32_t begin = 1, end = 1; begin < size(); begin = end)
    {
        const int island = m_bodies[begin]->getIslandTag();
        std::uint32_t least = kNoLocalId;
        for (end = begin; end < size() && m_bodies[end]->getIslandTag() == island; ++end)
            least = std::min(least, idOf(*m_bodies[end]));
        for (std::uint32_t i = begin; i < end; ++i)
            m_localIds.push_back(isMoved(i) ? idOf(*m_bodies[i]) - least : kNoLocalId);
    }
}

std::uint32_t SolverBodies::add(btCollisionObject& object)
{
    btRigidBody* const body = btRigidBody::upcast(&object);
    if (body == nullptr)
        return kFixedBody;
    if (body->isKinematicObject())
    {
        // Other groups may contain the same body, so that nothing is written to it.
        const auto known = std::find_if(m_kinematic.begin(), m_kinematic.end(),
                                        [&](std::uint32_t number) { return m_bodies[number] == body; });
        if (known != m_kinematic.end())
            return *known;
        m_kinematic.push_back(size());
        append(body);
        return m_kinematic.back();
    }
    if (body->getInvMass() == btScalar(0))
        return kFixedBody;
    const auto number = static_cast<std::uint32_t>(body->getCompanionId());
    if (number < size() && m_bodies[number] == body)
        return number;
    body->setCompanionId(static_cast<int>(size()));
    append(body);
    return size() - 1;
}

void SolverBodies::append(btRigidBody* body)
{
    m_localIds.push_back(kNoLocalId);
    m_bodies.push_back(body);
    m_isMoved.push_back(body->getInvMass() != btScalar(0) ? 1 : 0);
    m_isBound.push_back(0);
}

void SolverBodies::readStates(const btContactSolverInfo& info, ParallelLoops& loops)
{
    m_states.resize(size());
    m_motions.resize(size());
    m_pushes.resize(size());
    m_missing.resize(size());
    m_states[kFixedBody] = {};
    m_motions[kFixedBody] = m_pushes[kFixedBody] = {};
    forEach(size() - 1, loops,
            [&](std::uint32_t i)
            {
                m_motions[i + 1] = m_pushes[i + 1] = {};
                readState(info, *m_bodies[i + 1], m_states[i + 1]);
            });
}

void SolverBodies::readState(const btContactSolverInfo& info, btRigidBody& body, SolverBodyState& state)
{
    const btScalar time = info.m_timeStep, inverseMass = body.getInvMass();
    const btMatrix3x3& inertia = body.getInvInertiaTensorWorld();
    const btVector3 force = body.getTotalForce() * inverseMass * time;
    btVector3 torque = body.getTotalTorque() * inertia * time;
    if (inverseMass != btScalar(0))
    {
        const int flags = body.getFlags();
        if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) != 0)
            torque -= body.computeGyroscopicForceExplicit(info.m_maxGyroscopicForce) * inertia * time;
        if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) != 0)
            torque += body.computeGyroscopicImpulseImplicit_World(time);
        if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY) != 0)
            torque += body.computeGyroscopicImpulseImplicit_Body(time);
    }
    const btVector3 factor = body.getLinearFactor() * body.getLinearFactor() * inverseMass;
    const btVector3& turn = body.getAngularFactor();
    set(state.linear, body.getLinearVelocity() + force);
    set(state.angular, body.getAngularVelocity() + torque);
    set(state.force, force);
    set(state.torque, torque);
    set(state.centre, body.getWorldTransform().getOrigin());
    state.inverseMassX = factor.x();
    state.inverseMassY = factor.y();
    state.inverseMassZ = factor.z();
    state.inverseMass = inverseMass;
    state.factorX = turn.x();
    state.factorY = turn.y();
    state.factorZ = turn.z();
    state.inertiaXX = inertia[0][0];
    state.inertiaXY = inertia[0][1];
    state.inertiaXZ = inertia[0][2];
    state.inertiaYY = inertia[1][1];
    state.inertiaYZ = inertia[1][2];
    state.inertiaZZ = inertia[2][2];
}

void SolverBodies::beginSubsteps()
{
    for (std::size_t i = 0; i < m_states.size(); ++i)
    {
        for (int k = 0; k < 3; ++k)
        {
            m_motions[i].linear[k] = m_states[i].linear[k] - m_states[i].force[k];
            m_motions[i].angular[k] = m_states[i].angular[k] - m_states[i].torque[k];
        }
    }
    for (std::size_t i = 0; i < m_motions.size(); ++i)
        m_missing[i] = {MissingPart(m_motions[i].linear), MissingPart(m_motions[i].angular)};
}

void SolverBodies::addForces(int substep, btScalar share)
{
    for (std::size_t i = 0; i < m_states.size(); ++i)
    {
        const btScalar part = m_isBound[i] != 0 ? share : btScalar(substep == 0 ? 1 : 0);
        for (int k = 0; k < 3; ++k)
        {
            m_motions[i].linear[k] += m_states[i].force[k] * part;
            m_motions[i].angular[k] += m_states[i].torque[k] * part;
        }
    }
}

void SolverBodies::move(btScalar time)
{
    for (std::size_t i = 0; i < m_motions.size(); ++i)
    {
        for (int k = 0; k < 3; ++k)
        {
            m_pushes[i].linear[k] += m_motions[i].linear[k] * time;
            m_pushes[i].angular[k] += m_motions[i].angular[k] * time;
        }
    }
}

void SolverBodies::endSubstep(int substep, btScalar share, btScalar time)
{
    for (std::size_t i = 0; i < m_motions.size(); ++i)
    {
        const SolverBodyState& state = m_states[i];
        m_missing[i].linear.add(m_motions[i].linear, vectorOf(state.force) * share, btScalar(substep) * time);
        m_missing[i].angular.add(m_motions[i].angular, vectorOf(state.torque) * share,
                                 btScalar(substep) * time);
    }
}

void SolverBodies::MissingPart::add(const btScalar* velocity, const btVector3& added, btScalar time)
{
    constexpr btScalar kMostGrowth = btScalar(1.5 * 1.5);
    const btVector3 now = vectorOf(velocity), change = now - last;
    last = now;
    if (time == 0)
        first = change.length2();
    isSteady = isSteady && change.length2() <= kMostGrowth * btMax(first, added.length2());
    way += change * time;
}

void SolverBodies::writeBackMoved(const btContactSolverInfo& info, ParallelLoops& loops)
{
    forEach(size() - 1, loops, [&](std::uint32_t i) { writeBackMoved(info, i + 1); });
}

void SolverBodies::writeBackMoved(const btContactSolverInfo& info, std::uint32_t number) const
{
    btRigidBody& body = *m_bodies[number];
    body.setCompanionId(-1);
    if (!isMoved(number))
        return;
    const btVector3 linear = vectorOf(m_motions[number].linear),
                    angular = vectorOf(m_motions[number].angular);
    body.setLinearVelocity(linear);
    body.setAngularVelocity(angular);
    if (m_isBound[number] == 0)
        return;
    // Bullet's integration follows, by the velocity at the end for the whole step.
    btTransform now, before;
    const SolverMotion& way = m_pushes[number];
    const MissingWay& missing = m_missing[number];
    btTransformUtil::integrateTransform(body.getWorldTransform(),
                                        vectorOf(way.linear) + missing.linear.total(),
                                        vectorOf(way.angular) + missing.angular.total(), 1, now);
    btTransformUtil::integrateTransform(now, -linear, -angular, info.m_timeStep, before);
    body.setWorldTransform(before);
}

void SolverBodies::writeBack(const btContactSolverInfo& info, ParallelLoops& loops)
{
    forEach(size() - 1, loops, [&](std::uint32_t i) { writeBack(info, i + 1); });
}

void SolverBodies::writeBack(const btContactSolverInfo& info, std::uint32_t number) const
{
    btRigidBody& body = *m_bodies[number];
    const SolverBodyState& state = m_states[number];
    const SolverMotion& motion = m_motions[number];
    body.setLinearVelocity(vectorOf(state.linear) + vectorOf(motion.linear));
    body.setAngularVelocity(vectorOf(state.angular) + vectorOf(motion.angular));
    body.setCompanionId(-1);
    if (!info.m_splitImpulse)
        return;
    const btVector3 push = vectorOf(m_pushes[number].linear), turn = vectorOf(m_pushes[number].angular);
    if (push.isZero() && turn.isZero())
        return;
    btTransform moved;
    btTransformUtil::integrateTransform(body.getWorldTransform(), push, turn * info.m_splitImpulseTurnErp,
                                        info.m_timeStep, moved);
    body.setWorldTransform(moved);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
