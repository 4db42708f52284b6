// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What the application of a RestScene edits.
#include "cullet/tests/plugin/world/rest_scene.h"

#include <cstdint>

namespace cullet::test
{
namespace
{
/// Changes what a body has for the step alone.
///
/// @param which 0: the hit fraction, 1: the island, otherwise the companion
void setMark(btRigidBody& body, std::uint64_t which)
{
    if (which == 0)
        body.setHitFraction(btScalar(0.5));
    else if (which == 1)
        body.setIslandTag(7);
    else
        body.setCompanionId(3);
}
}  // namespace

void RestScene::wakeSome()
{
    for (int i = 0; i < 5; ++i)
    {
        btRigidBody& mover = anyMover();
        mover.activate(true);
        mover.setLinearVelocity(vec(0, 1, 0));
    }
}

void RestScene::editStatic()
{
    ++m_edits;
    btRigidBody& body = anyStatic();
    const btVector3 shift = vec(m_random.point(-0.05f, 0.05f));
    switch (m_random.below(8))
    {
        case 0:
        {
            btTransform moved = body.getWorldTransform();
            moved.setOrigin(moved.getOrigin() + shift);
            body.setWorldTransform(moved);
            break;
        }
        case 1:
            body.getWorldTransform().getOrigin() += shift;
            break;
        case 2:
            editShape(body);
            break;
        case 3:
            editProxy(body);
            break;
        case 4:
        case 5:
            editMarks(body);
            break;
        case 6:
            addAgain(body);
            break;
        default:
            body.forceActivationState(m_random.chance(0.1f) ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
    }
}

void RestScene::editShape(btRigidBody& body)
{
    switch (m_random.below(3))
    {
        case 0:
            body.getCollisionShape()->setLocalScaling(vec(m_random.point(0.8f, 1.1f)));
            break;
        case 1:
            body.getCollisionShape()->setMargin(btScalar(m_random.between(0.02f, 0.06f)));
            break;
        default:
            body.setCollisionShape(m_sharedShapes[m_random.below(2)]);
    }
}

void RestScene::editProxy(btRigidBody& body)
{
    btBroadphaseProxy& proxy = *body.getBroadphaseProxy();
    switch (m_random.below(4))
    {
        case 0:
            proxy.m_collisionFilterMask ^= 1 << m_random.below(3);
            break;
        case 1:
            world().getBroadphase()->setAabb(&proxy, vec(-1, -1, -1), vec(1, 1, 1), world().getDispatcher());
            break;
        case 2:
            world().refreshBroadphaseProxy(&body);
            break;
        default:
            world().updateSingleAabb(&body);
    }
}

/// Flags and marks of a static body: of few for a while, so that the world stays one of static bodies.
void RestScene::editMarks(btRigidBody& body)
{
    constexpr int kStatic = btCollisionObject::CF_STATIC_OBJECT;
    const auto mark = m_random.below(6);
    switch (mark)
    {
        case 0:
        case 1:
        case 2:
            setMark(body, mark);
            break;
        case 3:
            body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
            break;
        case 4:
            body.setCollisionFlags(body.getCollisionFlags() & ~kStatic);
            break;
        default:
            for (int i = 1; i < kStatics; ++i)
                bodies()[std::size_t(i)]->setCollisionFlags(kStatic);
    }
}

void RestScene::editMover()
{
    ++m_edits;
    btRigidBody& body = anyMover();
    switch (m_random.below(7))
    {
        case 0:
            body.activate(true);
            break;
        case 1:
            body.setLinearVelocity(vec(m_random.point(-1, 1)));
            break;
        case 2:
            body.applyCentralForce(vec(m_random.point(-9, 9)));
            break;
        case 3:
            body.getWorldTransform().getOrigin() += vec(m_random.point(0, 0.1f));
            break;
        case 4:
            body.setCcdMotionThreshold(m_random.chance(0.2f) ? btScalar(0.05) : btScalar(0));
            body.setCcdSweptSphereRadius(btScalar(0.2));
            break;
        case 5:
            body.setHitFraction(btScalar(0.25));
            break;
        default:
            addAgain(body);
    }
}

/// Edits a mover, which sleeps mostly, in ways that do not wake it.
void RestScene::editSleeper()
{
    ++m_edits;
    btRigidBody& body = anyMover();
    btTransform shifted = body.getWorldTransform();
    shifted.getOrigin() += vec(m_random.point(0, 0.05f));
    switch (m_random.below(16))
    {
        case 0:
            body.setLinearVelocity(vec(m_random.point(-1, 1)));
            break;
        case 1:
            body.setAngularVelocity(vec(m_random.point(-1, 1)));
            break;
        case 2:
            body.setLinearVelocity(-btVector3(0, 0, 0));
            break;
        case 3:
            body.applyForce(vec(m_random.point(-9, 9)), vec(m_random.point(-1, 1)));
            break;
        case 4:
            body.getWorldTransform() = shifted;
            break;
        case 5:
            body.setCenterOfMassTransform(shifted);
            break;
        case 6:
            body.setInterpolationWorldTransform(shifted);
            break;
        case 7:
            body.setGravity(vec(m_random.point(-9, 9)));
            break;
        case 8:
            body.setDamping(btScalar(m_random.between(0, 1)), btScalar(m_random.between(0, 1)));
            break;
        case 9:
            body.setMassProps(btScalar(m_random.between(1, 2)), vec(1, 1, 1));
            break;
        case 10:
            editShape(body);
            break;
        case 11:
            editProxy(body);
            break;
        case 12:
            m_random.chance(0.2f) ? editMover() : editStateOfSleeper(body);
            break;
        default:
            editStateOfSleeper(body);
    }
}

void RestScene::editStateOfSleeper(btRigidBody& body)
{
    constexpr int kFlags[] = {btCollisionObject::CF_NO_CONTACT_RESPONSE,
                              btCollisionObject::CF_KINEMATIC_OBJECT, btCollisionObject::CF_STATIC_OBJECT};
    constexpr int kStates[] = {ACTIVE_TAG, WANTS_DEACTIVATION, DISABLE_DEACTIVATION, DISABLE_SIMULATION};
    const auto mark = m_random.below(8);
    switch (mark)
    {
        case 0:
        case 1:
        case 2:
            setMark(body, mark);
            break;
        case 3:
            body.setDeactivationTime(btScalar(0.1));
            break;
        case 4:
            body.setCcdMotionThreshold(btScalar(m_random.chance(0.5f) ? 0.05 : 0));
            break;
        case 5:
            body.setCollisionFlags(body.getCollisionFlags() ^ kFlags[m_random.below(3)]);
            break;
        case 6:
            body.forceActivationState(m_random.chance(0.1f) ? kStates[m_random.below(4)] : ISLAND_SLEEPING);
            break;
        default:
            letAllSleep();
    }
}

/// Undoes what keeps bodies awake, and edits of flags.
void RestScene::letAllSleep()
{
    for (std::size_t i = 1; i < bodies().size(); ++i)
    {
        bodies()[i]->setCollisionFlags(i < kStatics ? btCollisionObject::CF_STATIC_OBJECT
                                                    : btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        bodies()[i]->forceActivationState(ISLAND_SLEEPING);
    }
}

void RestScene::addAgain(btRigidBody& body)
{
    world().removeRigidBody(&body);
    world().addRigidBody(&body);
}
}  // namespace cullet::test
