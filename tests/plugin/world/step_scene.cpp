// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/step_scene.h"

#include <algorithm>
#include <cstring>

namespace cullet::test
{
namespace
{
class Hash
{
public:
    void add(std::uint64_t bits) { m_hash = (m_hash ^ bits) * 1099511628211ull; }
    void add(btScalar value)
    {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(value));
        add(bits);
    }
    void add(int value) { add(static_cast<std::uint64_t>(value)); }
    void add(const btVector3& vector)
    {
        for (int axis = 0; axis < 3; ++axis)
            add(vector[axis]);
    }
    void add(const btTransform& transform)
    {
        add(transform.getOrigin());
        for (int row = 0; row < 3; ++row)
            add(transform.getBasis()[row]);
    }
    void add(const btCollisionObject& object)
    {
        add(object.getWorldTransform());
        add(object.getInterpolationWorldTransform());
        add(object.getInterpolationLinearVelocity());
        add(object.getInterpolationAngularVelocity());
        add(object.getActivationState());
        add(object.getDeactivationTime());
        add(object.getHitFraction());
        add(object.getIslandTag());
        add(object.getCompanionId());
        const btRigidBody* body = btRigidBody::upcast(&object);
        if (body == nullptr)
            return;
        add(body->getLinearVelocity());
        add(body->getAngularVelocity());
        add(body->getTotalForce());
        add(body->getTotalTorque());
        add(body->getInvInertiaTensorWorld()[0]);
    }
    void add(const btPersistentManifold& manifold)
    {
        add(manifold.getBody0()->getWorldArrayIndex());
        add(manifold.getBody1()->getWorldArrayIndex());
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            const btManifoldPoint& point = manifold.getContactPoint(i);
            add(point.getPositionWorldOnB());
            add(point.getDistance());
            add(point.m_appliedImpulse);
            add(point.m_appliedImpulseLateral1);
            add(point.m_appliedImpulseLateral2);
            add(point.m_lateralFrictionDir1);
        }
    }
    void add(btTypedConstraint& joint)
    {
        add(joint.internalGetAppliedImpulse());
        add(int{joint.isEnabled()});
        if (const btJointFeedback* feedback = joint.getJointFeedback())
        {
            add(feedback->m_appliedForceBodyA);
            add(feedback->m_appliedTorqueBodyB);
        }
    }
    std::uint64_t value() const { return m_hash; }

private:
    std::uint64_t m_hash = 14695981039346656037ull;
};
}  // namespace

StepScene::~StepScene()
{
    for (auto& joint : m_joints)
        m_world.removeConstraint(joint.get());
    for (auto& body : m_bodies)
        m_world.removeRigidBody(body.get());
}

void StepScene::step(int)
{
    m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
}

std::uint64_t StepScene::hash() const
{
    Hash hash;
    for (int i = 0; i < m_world.getNumCollisionObjects(); ++i)
        hash.add(*m_world.getCollisionObjectArray()[i]);
    btDispatcher& dispatcher = *m_world.getDispatcher();
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        hash.add(*dispatcher.getManifoldByIndexInternal(i));
    for (int i = 0; i < m_world.getNumConstraints(); ++i)
        hash.add(*m_world.getConstraint(i));
    const auto* solver =
        dynamic_cast<const btSequentialImpulseConstraintSolver*>(m_world.getConstraintSolver());
    if (solver != nullptr)
    {
        hash.add(solver->m_analyticsData.m_numSolverCalls);
        hash.add(solver->m_analyticsData.m_numIterationsUsed);
        hash.add(btScalar(solver->m_analyticsData.m_remainingLeastSquaresResidual));
    }
    return hash.value();
}

btRigidBody& StepScene::addBody(btCollisionShape& shape, double mass, const btVector3& at,
                                btMotionState* motionState)
{
    return addBody(shape, mass, btTransform(btQuaternion::getIdentity(), at), motionState);
}

btRigidBody& StepScene::addBody(btCollisionShape& shape, double mass, const btTransform& at,
                                btMotionState* motionState)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.calculateLocalInertia(btScalar(mass), inertia);
    m_bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), motionState, &shape, inertia));
    btRigidBody& body = *m_bodies.back();
    body.setWorldTransform(at);
    body.setInterpolationWorldTransform(at);
    m_world.addRigidBody(&body);
    return body;
}

btRigidBody& StepScene::addFloor()
{
    return addBody(makeShape<btBoxShape>(vec(100, 1, 100)), 0, vec(0, -1, 0));
}

void StepScene::removeBody(btRigidBody& body)
{
    m_world.removeRigidBody(&body);
    m_bodies.erase(std::find_if(m_bodies.begin(), m_bodies.end(),
                                [&](const auto& owned) { return owned.get() == &body; }));
}

void StepScene::removeJoint(btTypedConstraint& joint)
{
    m_world.removeConstraint(&joint);
    m_joints.erase(std::find_if(m_joints.begin(), m_joints.end(),
                                [&](const auto& owned) { return owned.get() == &joint; }));
}

int StepScene::countAwake(bool isAwake) const
{
    return static_cast<int>(std::count_if(m_bodies.begin(), m_bodies.end(),
                                          [&](const auto& body)
                                          { return body->getInvMass() > 0 && body->isActive() == isAwake; }));
}
}  // namespace cullet::test
