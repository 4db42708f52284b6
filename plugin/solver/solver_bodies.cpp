// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/solver_bodies.h"

#include "cullet/base/threads/parallel_for_each.h"
#include "cullet/plugin/core/prefetch.h"

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
constexpr std::size_t kSolverBodyGrain = 512;

/// Bodies between a prefetch and its use.
constexpr std::size_t kReadAhead = 4;

/// Groups of fewer bodies lie in the nearest cache in any order.
constexpr std::size_t kFewBodies = 256;
constexpr int kCellsOfAxis = 8;
constexpr std::size_t kCells = kCellsOfAxis * kCellsOfAxis * kCellsOfAxis;

constexpr std::uint32_t kNoLocalId = ~std::uint32_t{0};

std::uint32_t idOf(const btRigidBody& body)
{
    const btBroadphaseProxy* const proxy = body.getBroadphaseHandle();
    return proxy != nullptr ? static_cast<std::uint32_t>(proxy->m_uniqueId) : 0;
}

void copy(const btVector3& from, btScalar (&to)[3])
{
    for (int i = 0; i < 3; ++i)
        to[i] = from[i];
}

btVector3 vectorOf(const btScalar* from)
{
    return {from[0], from[1], from[2]};
}
}  // namespace

void SolverBodies::number(btCollisionObject** bodies, int count, ParallelLoops& loops)
{
    const auto size = static_cast<std::size_t>(count);
    m_places.resize(size);
    parallelForEach(loops, size, kSolverBodyGrain,
                    [&](std::uint32_t i) { m_places[i] = placeOf(*bodies[i]); });
    findLocalIds();
    findCells();
    numberByCells();
    m_kinematic.clear();
    for (std::size_t i = 0; i < size; ++i)
    {
        const Place& place = m_places[i];
        if (place.body == nullptr)
            continue;
        set(m_numbers[i], *place.body, place.localId);
        if (place.body->isKinematicObject())
            m_kinematic.push_back(m_numbers[i]);
    }
}

SolverBodies::Place SolverBodies::placeOf(btCollisionObject& object)
{
    Place place{};
    place.island = object.getIslandTag();
    btRigidBody* const body = btRigidBody::upcast(&object);
    if (body == nullptr || (body->getInvMass() == btScalar(0) && !body->isKinematicObject()))
        return place;
    place.body = body;
    place.id = idOf(*body);
    copy(body->getWorldTransform().getOrigin(), place.centre);
    return place;
}

/// Bodies of an island follow each other.
void SolverBodies::findLocalIds()
{
    const std::size_t count = m_places.size();
    for (std::size_t begin = 0, end = 0; begin < count; begin = std::max(end, begin + 1))
    {
        const int island = m_places[begin].island;
        std::uint32_t least = kNoLocalId;
        const auto isOfIsland = [&](const Place& place)
        { return place.body == nullptr || place.island == island; };
        for (end = begin; end < count && isOfIsland(m_places[end]); ++end)
            least = m_places[end].body != nullptr ? std::min(least, m_places[end].id) : least;
        for (std::size_t i = begin; i < end; ++i)
            m_places[i].localId = m_places[i].id - least;
    }
}

/// Cells of a grid over all bodies, in Morton's order.
void SolverBodies::findCells()
{
    m_cells = m_places.size() < kFewBodies ? 1 : kCells;
    if (m_cells == 1)
        return;
    for (int axis = 0; axis < 3; ++axis)
    {
        btScalar low = BT_LARGE_FLOAT, high = -BT_LARGE_FLOAT;
        for (const Place& place : m_places)
        {
            low = std::min(low, place.body != nullptr ? place.centre[axis] : low);
            high = std::max(high, place.body != nullptr ? place.centre[axis] : high);
        }
        const btScalar scale = high > low ? kCellsOfAxis / (high - low) : btScalar(0);
        for (Place& place : m_places)
        {
            const btScalar cell = (place.centre[axis] - low) * scale;
            // NaN counts as 0.
            const unsigned bits = cell >= kCellsOfAxis ? kCellsOfAxis - 1
                                  : cell > 0           ? static_cast<unsigned>(cell)
                                                       : 0;
            place.cell |= ((bits & 1) | (bits & 2) << 2 | (bits & 4) << 4) << axis;
        }
    }
}

/// Gives numbers in the order of cells.
void SolverBodies::numberByCells()
{
    m_firsts.assign(m_cells + 1, 0);
    m_firsts[0] = kFixedBody + 1;
    for (const Place& place : m_places)
        m_firsts[place.cell + 1] += place.body != nullptr ? 1 : 0;
    for (std::size_t cell = 0; cell < m_cells; ++cell)
        m_firsts[cell + 1] += m_firsts[cell];
    resize(m_firsts[m_cells]);
    m_numbers.resize(m_places.size());
    for (std::size_t i = 0; i < m_places.size(); ++i)
        m_numbers[i] = m_places[i].body != nullptr ? m_firsts[m_places[i].cell]++ : kFixedBody;
}

/// Keeps nothing but the fixed body.
void SolverBodies::resize(std::size_t size)
{
    m_bodies.resize(size);
    m_split.clear();
    m_isMoved.resize(size);
    m_isAnisotropic.assign(size, 0);
    m_isBound.assign(size, 0);
    m_localIds.resize(size);
    m_bodies[kFixedBody] = nullptr;
    m_isMoved[kFixedBody] = 0;
    m_localIds[kFixedBody] = kNoLocalId;
}

std::uint32_t SolverBodies::find(const btCollisionObject& object) const
{
    const auto number = static_cast<std::uint32_t>(object.getCompanionId());
    if (number < size() && m_bodies[number] == &object)
        return number;
    const btRigidBody* const body = btRigidBody::upcast(&object);
    if (body == nullptr)
        return kFixedBody;
    if (body->isKinematicObject())
        return findKinematic(*body);
    return body->getInvMass() == btScalar(0) ? kFixedBody : kUnknown;
}

std::uint32_t SolverBodies::findKinematic(const btRigidBody& body) const
{
    const auto known = std::find_if(m_kinematic.begin(), m_kinematic.end(),
                                    [&](std::uint32_t number) { return m_bodies[number] == &body; });
    return known != m_kinematic.end() ? *known : kUnknown;
}

std::uint32_t SolverBodies::add(btCollisionObject& object)
{
    const std::uint32_t known = find(object);
    if (known != kUnknown)
        return known;
    const std::uint32_t number = size();
    auto& body = static_cast<btRigidBody&>(object);
    m_bodies.push_back(nullptr);
    m_isMoved.push_back(0);
    m_isAnisotropic.push_back(0);
    m_isBound.push_back(0);
    m_localIds.push_back(kNoLocalId);
    if (body.isKinematicObject())
        m_kinematic.push_back(number);
    set(number, body, kNoLocalId);
    return number;
}

void SolverBodies::set(std::uint32_t number, btRigidBody& body, std::uint32_t localId)
{
    const bool isMoved = body.getInvMass() != btScalar(0);
    m_bodies[number] = &body;
    m_isMoved[number] = isMoved ? 1 : 0;
    m_isAnisotropic[number] = body.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION) ? 1 : 0;
    m_localIds[number] = isMoved ? localId : kNoLocalId;
    // Other groups may contain the same kinematic body, so that nothing is written to it.
    if (!body.isKinematicObject())
        body.setCompanionId(static_cast<int>(number));
}

btScalar SolverBodies::inverseMass(std::uint32_t number) const
{
    return isMoved(number) ? m_bodies[number]->getInvMass() : btScalar(0);
}

void SolverBodies::readStates(const btContactSolverInfo& info, ParallelLoops& loops)
{
    const std::size_t withParts = size() + m_split.size() * kBlock;
    m_states.resize(withParts);
    m_motions.resize(withParts);
    m_pushes.resize(withParts);
    m_missing.resize(size());
    m_states[kFixedBody] = {};
    m_motions[kFixedBody] = m_pushes[kFixedBody] = {};
    parallelForEach(loops, size() - 1, kSolverBodyGrain,
                    [&](std::uint32_t i)
                    {
                        if (i + 1 + kReadAhead < size())
                            prefetchBytes(m_bodies[i + 1 + kReadAhead], 0, sizeof(btRigidBody) / 16 * 16);
                        m_motions[i + 1] = m_pushes[i + 1] = {};
                        readState(info, *m_bodies[i + 1], m_states[i + 1]);
                    });
    for (std::size_t i = 0; i < m_split.size(); ++i)
        std::fill_n(m_states.begin() + std::ptrdiff_t(size() + i * kBlock), kBlock,
                    partOf(m_states[m_split[i]]));
}

std::uint32_t SolverBodies::split(std::uint32_t number)
{
    const auto known = std::find(m_split.begin(), m_split.end(), number);
    const auto place = static_cast<std::uint32_t>(known - m_split.begin());
    if (known == m_split.end())
        m_split.push_back(number);
    return size() + place * kBlock;
}

SolverBodyState SolverBodies::partOf(SolverBodyState state)
{
    for (btScalar* const inverse :
         {&state.inverseMassX, &state.inverseMassY, &state.inverseMassZ, &state.inverseMass, &state.inertiaXX,
          &state.inertiaXY, &state.inertiaXZ, &state.inertiaYY, &state.inertiaYZ, &state.inertiaZZ})
        *inverse *= kBlock;
    return state;
}

void SolverBodies::spread(std::uint32_t number, std::uint32_t firstPart, SolverMotion* motions)
{
    std::fill_n(motions + firstPart, kBlock, motions[number]);
}

void SolverBodies::merge(std::uint32_t number, std::uint32_t firstPart, SolverMotion* motions)
{
    // Sums of two, so that the mean of equal numbers is the same number.
    const auto meanOf = [&](const auto& component)
    {
        btScalar sums[kBlock];
        for (int part = 0; part < kBlock; ++part)
            sums[part] = component(motions[firstPart + unsigned(part)]);
        for (int half = kBlock / 2; half > 0; half /= 2)
        {
            for (int i = 0; i < half; ++i)
                sums[i] += sums[i + half];
        }
        return sums[0] / kBlock;
    };
    for (int k = 0; k < 3; ++k)
    {
        motions[number].linear[k] = meanOf([k](const SolverMotion& motion) { return motion.linear[k]; });
        motions[number].angular[k] = meanOf([k](const SolverMotion& motion) { return motion.angular[k]; });
    }
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
    copy(body.getLinearVelocity() + force, state.linear);
    copy(body.getAngularVelocity() + torque, state.angular);
    copy(force, state.force);
    copy(torque, state.torque);
    copy(body.getWorldTransform().getOrigin(), state.centre);
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

void SolverBodies::beginSubsteps(ParallelLoops& loops)
{
    parallelForEach(loops, size(), kSolverBodyGrain,
                    [&](std::uint32_t i)
                    {
                        for (int k = 0; k < 3; ++k)
                        {
                            m_motions[i].linear[k] = m_states[i].linear[k] - m_states[i].force[k];
                            m_motions[i].angular[k] = m_states[i].angular[k] - m_states[i].torque[k];
                        }
                    });
}

void SolverBodies::addForces(int substep, btScalar share, ParallelLoops& loops)
{
    parallelForEach(
        loops, size(), kSolverBodyGrain,
        [&](std::uint32_t i)
        {
            if (substep == 0)
                m_missing[i] = {MissingPart(m_motions[i].linear), MissingPart(m_motions[i].angular)};
            const btScalar part = m_isBound[i] != 0 ? share : btScalar(substep == 0 ? 1 : 0);
            for (int k = 0; k < 3; ++k)
            {
                m_motions[i].linear[k] += m_states[i].force[k] * part;
                m_motions[i].angular[k] += m_states[i].torque[k] * part;
            }
        });
}

void SolverBodies::move(btScalar time, ParallelLoops& loops)
{
    parallelForEach(loops, size(), kSolverBodyGrain,
                    [&](std::uint32_t i)
                    {
                        for (int k = 0; k < 3; ++k)
                        {
                            m_pushes[i].linear[k] += m_motions[i].linear[k] * time;
                            m_pushes[i].angular[k] += m_motions[i].angular[k] * time;
                        }
                    });
}

void SolverBodies::endSubstep(int substep, btScalar share, btScalar time, ParallelLoops& loops)
{
    parallelForEach(loops, size(), kSolverBodyGrain,
                    [&](std::uint32_t i)
                    {
                        const SolverBodyState& state = m_states[i];
                        m_missing[i].linear.add(m_motions[i].linear, vectorOf(state.force) * share,
                                                btScalar(substep) * time);
                        m_missing[i].angular.add(m_motions[i].angular, vectorOf(state.torque) * share,
                                                 btScalar(substep) * time);
                    });
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
    parallelForEach(loops, size() - 1, kSolverBodyGrain,
                    [&](std::uint32_t i) { writeBackMoved(info, i + 1); });
}

void SolverBodies::writeBackMoved(const btContactSolverInfo& info, std::uint32_t number) const
{
    btRigidBody& body = *m_bodies[number];
    body.setCompanionId(-1);
    if (!isMoved(number))
        return;
    const btVector3 linear = vectorOf(m_motions[number].linear);
    btVector3 angular = vectorOf(m_motions[number].angular);
    // A pose turns by no more in a step. Points of contact of a body that is to turn faster would leave what they touch
    // by their velocity alone, in every step, while the body sinks.
    const btScalar most = ANGULAR_MOTION_THRESHOLD / info.m_timeStep;
    if (m_isBound[number] != 0 && angular.length2() > most * most)
        angular *= most / angular.length();
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
    parallelForEach(loops, size() - 1, kSolverBodyGrain, [&](std::uint32_t i) { writeBack(info, i + 1); });
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
