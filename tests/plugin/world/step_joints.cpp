// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/step_scene.h"

namespace cullet::test
{
namespace
{
btTransform shifted(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
}

/// Chains of six capsules with joints of all kinds, which fall on the floor.
class Ragdolls : public StepScene
{
public:
    explicit Ragdolls(btDiscreteDynamicsWorld& world, int count = 40) : StepScene(world)
    {
        addFloor();
        m_limb = &makeShape<btCapsuleShape>(btScalar(0.15), btScalar(0.4));
        const int perRow = 20;
        for (int i = 0; i < count; ++i)
            addRagdoll(vec(2.5 * (i % perRow) - 25, 1.2 + 0.3 * (i % 4), 2.5 * (i / perRow) - 20), i);
    }
    void step(int number) override
    {
        StepScene::step(number);
        for (const auto& joint : joints())
            m_events += joint->internalGetAppliedImpulse() != 0;
    }
    int events() const override { return m_events; }

private:
    void addRagdoll(const btVector3& at, int seed)
    {
        btRigidBody* before = nullptr;
        for (int i = 0; i < 6; ++i)
        {
            btRigidBody& limb = addBody(*m_limb, 1 + 0.2 * i, at + vec(0, 0.8 * i, 0));
            limb.setDamping(btScalar(0.05), btScalar(0.85));
            limb.setAngularVelocity(vec(0.2 * (seed % 5), 0, 0.3 * (seed % 3)));
            if (before != nullptr)
                addLink(*before, limb, (seed + i) % 6);
            before = &limb;
        }
    }
    void addLink(btRigidBody& a, btRigidBody& b, int kind)
    {
        const btTransform top = shifted(0, 0.4, 0), bottom = shifted(0, -0.4, 0);
        if (kind == 0)
            addJoint<btHingeConstraint>(a, b, top, bottom).setLimit(btScalar(-0.5), btScalar(0.7));
        else if (kind == 1)
            addJoint<btConeTwistConstraint>(a, b, top, bottom)
                .setLimit(btScalar(0.6), btScalar(0.6), btScalar(0.3));
        else if (kind == 2)
            addJoint<btGeneric6DofConstraint>(a, b, top, bottom, true)
                .setAngularLowerLimit(vec(-0.3, -0.2, -0.4));
        else if (kind == 3)
            addJoint<btGeneric6DofSpring2Constraint>(a, b, top, bottom).enableSpring(0, true);
        else if (kind == 4)
            addJoint<btPoint2PointConstraint>(a, b, top.getOrigin(), bottom.getOrigin());
        else
            addJoint<btSliderConstraint>(a, b, top, bottom, true).setUpperLinLimit(btScalar(0.1));
    }

    btCollisionShape* m_limb = nullptr;
    int m_events = 0;
};

/// Joints that break, that are switched off between islands, that hold to kinematic and static bodies, that share their
/// feedback, and that have iterations of their own.
class OddJoints : public StepScene
{
public:
    explicit OddJoints(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        world.getSolverInfo().m_minimumSolverBatchSize = 1;
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        btRigidBody& carrier = addBody(box, 0, vec(0, 8, 30));
        carrier.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        carrier.setActivationState(DISABLE_DEACTIVATION);
        for (int i = 0; i < 40; ++i)
        {
            const btVector3 at = vec(4 * (i % 10) - 20, 1 + i % 3, 6 * (i / 10));
            btRigidBody& a = addBody(box, 1, at);
            btRigidBody& b = addBody(box, 1, at + vec(1.2, 0.5, 0));
            addPair(a, b, carrier, i);
            m_before = &b;
        }
    }
    void step(int number) override
    {
        StepScene::step(number);
        if (number == 60)
            joints().front()->setEnabled(false);
    }
    int events() const override
    {
        int broken = 0;
        for (const auto& joint : joints())
            broken += joint->getBreakingImpulseThreshold() < 1 && !joint->isEnabled();
        return broken;
    }

private:
    void addPair(btRigidBody& a, btRigidBody& b, btRigidBody& carrier, int i)
    {
        auto& pivot = addJoint<btPoint2PointConstraint>(a, b, vec(0.6, 0, 0), vec(-0.6, 0, 0));
        pivot.setJointFeedback(&m_feedback[i % 2 == 0 ? 0 : 1 + i]);
        if (i % 3 == 0)
            pivot.setBreakingImpulseThreshold(btScalar(0.2));
        if (i % 4 == 0)
            pivot.setOverrideNumSolverIterations(25);
        if (i % 5 == 0)
            addJoint<btPoint2PointConstraint>(a, carrier, vec(0, 3, 0), vec(0.1 * i, 0, 0));
        if (i % 7 == 0)
            addJoint<btHingeConstraint>(b, vec(0.5, 0.5, 0), vec(0, 0, 1));
        if (i % 6 == 5)
            addJoint<btHingeConstraint>(a, *m_before, shifted(2, 0, 0), shifted(-2, 0, 0)).setEnabled(false);
    }

    btRigidBody* m_before = nullptr;
    btJointFeedback m_feedback[41] = {};
};

class ManyRagdolls : public Ragdolls
{
public:
    explicit ManyRagdolls(btDiscreteDynamicsWorld& world) : Ragdolls(world, 300) {}
};
}  // namespace

std::vector<NamedScene> jointScenes()
{
    return {{"Ragdolls", makeScene<Ragdolls>},
            {"OddJoints", makeScene<OddJoints>},
            {"ManyRagdolls", makeScene<ManyRagdolls>}};
}
}  // namespace cullet::test
