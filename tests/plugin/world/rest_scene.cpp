// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/rest_scene.h"

#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <iterator>

namespace cullet::test
{
namespace
{
RestScene* contactScene = nullptr;

bool onContact(btManifoldPoint&, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*,
               int, int)
{
    contactScene->editAt(RestScene::Moment::Contact);
    return false;
}

void onContactEnd(btPersistentManifold* const&)
{
    contactScene->editAt(RestScene::Moment::ContactEnd);
}

void onTick(btDynamicsWorld* world, RestScene::Moment moment)
{
    static_cast<RestScene*>(world->getWorldUserInfo())->editAt(moment);
}
void beforeTick(btDynamicsWorld* world, btScalar)
{
    onTick(world, RestScene::Moment::BeforeTick);
}
void afterTick(btDynamicsWorld* world, btScalar)
{
    onTick(world, RestScene::Moment::AfterTick);
}
}  // namespace

class RestScene::Tide final : public btMotionState
{
public:
    explicit Tide(RestScene& scene) : m_scene(scene) {}
    void getWorldTransform(btTransform& transform) const override
    {
        transform.setIdentity();
        transform.setOrigin(vec(-20, 0.01 * m_scene.m_edits, 0));
        m_scene.editAt(Moment::MotionState);
    }
    void setWorldTransform(const btTransform&) override {}

private:
    RestScene& m_scene;
};

class RestScene::Mirror final : public btMotionState
{
public:
    explicit Mirror(RestScene& scene) : m_scene(scene) {}
    /// Leaves a body where it is when it gets this motion state.
    void getWorldTransform(btTransform&) const override {}
    void setWorldTransform(const btTransform&) override { m_scene.editAt(Moment::Synchronization); }

private:
    RestScene& m_scene;
};

class RestScene::Meddler final : public btActionInterface
{
public:
    explicit Meddler(RestScene& scene) : m_scene(scene) {}
    void updateAction(btCollisionWorld*, btScalar) override { m_scene.editAt(Moment::Action); }
    void debugDraw(btIDebugDraw*) override {}

private:
    RestScene& m_scene;
};

class RestScene::Filter final : public btOverlapFilterCallback
{
public:
    explicit Filter(RestScene& scene) : m_scene(scene) {}
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        m_scene.editAt(Moment::Filter);
        return accepts && (a->m_collisionFilterGroup & b->m_collisionFilterMask) != 0 &&
               (b->m_collisionFilterGroup & a->m_collisionFilterMask) != 0;
    }

    bool accepts = true;  ///< a refused pair does not change the cache

private:
    RestScene& m_scene;
};

/// A body of a class of the application, which is asked before contacts are computed.
class RestScene::Curious final : public btRigidBody
{
public:
    Curious(RestScene& scene, btCollisionShape& shape)
        : btRigidBody(btScalar(1), nullptr, &shape, vec(1, 1, 1)), m_scene(scene)
    {
        setIgnoreCollisionCheck(this, true);
        setActivationState(DISABLE_DEACTIVATION);
        setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(6, 0.9, 12)));
        setInterpolationWorldTransform(getWorldTransform());
    }
    bool checkCollideWithOverride(const btCollisionObject*) const override
    {
        m_scene.editAt(Moment::Check);
        return true;
    }

private:
    RestScene& m_scene;
};

RestScene::RestScene(btDiscreteDynamicsWorld& world, std::uint32_t seed, const RestOptions& options)
    : StepScene(world),
      m_options(options),
      m_random(seed),
      m_tide(std::make_unique<Tide>(*this)),
      m_mirror(std::make_unique<Mirror>(*this)),
      m_meddler(std::make_unique<Meddler>(*this)),
      m_filter(std::make_unique<Filter>(*this))
{
    m_sharedShapes = {&makeShape<btBoxShape>(vec(0.6, 0.5, 0.6)), &makeShape<btSphereShape>(btScalar(0.6))};
    for (int i = 0; i < kStatics; ++i)
        addBody(makeStaticShape(i), 0, vec(1.2 * (i % 26), 0, 1.2 * (i / 26)));
    auto& ball = makeShape<btSphereShape>(btScalar(0.3));
    auto& brick = makeShape<btBoxShape>(vec(0.3, 0.2, 0.3));
    m_curious = std::make_unique<Curious>(*this, brick);
    const int columns = options.columns;
    for (int i = 0; i < options.movers; ++i)
    {
        btCollisionShape& shape = i % 4 == 0 ? static_cast<btCollisionShape&>(ball) : brick;
        addBody(shape, 1, vec(2.4 * (i / 3 % columns), 1.2 + 0.7 * (i % 3), 2.4 * (i / (3 * columns))));
        bodies().back()->setDamping(btScalar(0.3), btScalar(0.6));
        bodies().back()->setCollisionFlags(btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    }
    world.setInternalTickCallback(nullptr, this);
    contactScene = this;
}

RestScene::~RestScene()
{
    chooseMoment(0);
    contactScene = nullptr;
}

btCollisionShape& RestScene::makeStaticShape(int number)
{
    switch (number % 8)
    {
        case 0:
        case 1:
            return *m_sharedShapes[std::size_t(number % 8)];
        case 2:
        {
            auto& hull = makeShape<btConvexHullShape>();
            for (int corner = 0; corner < 8; ++corner)
                hull.addPoint(vec(corner & 1, (corner >> 1) & 1, corner >> 2) - vec(0.5, 0.5, 0.5));
            return hull;
        }
        case 3:
        {
            auto& compound = makeShape<btCompoundShape>();
            compound.addChildShape(btTransform::getIdentity(), m_sharedShapes[0]);
            return compound;
        }
        case 4:
            return makeShape<btCapsuleShape>(btScalar(0.4), btScalar(0.5));
        case 5:
            return makeShape<btCylinderShape>(vec(0.5, 0.5, 0.5));
        default:
            return makeShape<btBoxShape>(vec(0.55, 0.5, 0.5));
    }
}

void RestScene::editAt(Moment moment)
{
    if (m_random.chance(0.7f) || (moment == Moment::Filter && !m_options.editsInFilters))
        return;
    ++m_editsAt[std::size_t(moment)];
    // Few movers are edited, so that the piles sleep for most of the time. Callbacks of pairs edit only marks and flags.
    if (moment == Moment::Contact || moment == Moment::ContactEnd || moment == Moment::Filter ||
        moment == Moment::Check)
        editMarks(anyStatic());
    else if (m_random.chance(m_options.moverEdits))
        m_options.editsSleepers ? editSleeper() : editMover();
    else
        editStatic();
}

void RestScene::step(int number)
{
    constexpr int kPhase = 30;
    if (number % kPhase == 0)
        chooseMoment(number / kPhase);
    if (m_options.editsSleepers && m_moment == Moment::Nothing && number % 8 == 0)
        letAllSleep();
    if (number % 3 == 0)
        editAt(Moment::Nothing);
    m_filter->accepts = number % 4 < 2;
    if (m_moment == Moment::BeforeTick && number % 3 == 0)
        wakeSome();
    // Pairs of sleeping bodies end and begin.
    if (m_moment == Moment::ContactEnd || m_moment == Moment::Filter)
    {
        for (std::size_t i = 1; i < 60; ++i)
        {
            bodies()[i]->getWorldTransform().getOrigin() += vec(0, number % 2 == 0 ? -2 : 2, 0);
            if (!world().getForceUpdateAllAabbs())
                world().updateSingleAabb(bodies()[i].get());
        }
    }
    takeStep();
}

/// In one of the ways to take a step, mostly the usual one.
void RestScene::takeStep()
{
    constexpr btScalar kUsual = btScalar(1) / 60;
    const bool isUnusual = m_options.editsSleepers && m_random.chance(0.1f);
    switch (isUnusual ? m_random.below(6) : 6)
    {
        case 0:
            world().stepSimulation(2 * kUsual, 3, kUsual);
            break;
        case 1:
            world().stepSimulation(kUsual / 2, 0, kUsual);
            break;
        case 2:
            world().stepSimulation(0, 0, kUsual);
            break;
        case 3:
            world().stepSimulation(btScalar(0.9) * kUsual, 1, kUsual);
            break;
        case 4:
            world().setSynchronizeAllMotionStates(!world().getSynchronizeAllMotionStates());
            break;
        case 5:
            // Wakes all.
            gDisableDeactivation = m_random.chance(0.2f);
            break;
        default:
            world().stepSimulation(kUsual, 0, kUsual);
    }
    if (isUnusual && gDisableDeactivation)
    {
        world().stepSimulation(kUsual, 0, kUsual);
        gDisableDeactivation = false;
    }
}

/// Installs the callback of one moment and removes all others; for half of the time there is none.
void RestScene::chooseMoment(int number)
{
    constexpr Moment kTurns[] = {Moment::Check,       Moment::BeforeTick, Moment::AfterTick,
                                 Moment::MotionState, Moment::Action,     Moment::Contact,
                                 Moment::ContactEnd,  Moment::Filter,     Moment::Synchronization};
    if (m_moment == Moment::Action)
        world().removeAction(m_meddler.get());
    if (m_moment == Moment::Check)
        world().removeRigidBody(m_curious.get());
    m_moment = number % 2 == 0 ? Moment::Nothing : kTurns[std::size_t(number / 2) % std::size(kTurns)];
    const auto callbackAt = [this](Moment moment, auto* callback)
    { return m_moment == moment ? callback : nullptr; };
    world().setInternalTickCallback(callbackAt(Moment::BeforeTick, beforeTick), this, true);
    world().setInternalTickCallback(callbackAt(Moment::AfterTick, afterTick), this, false);
    gContactAddedCallback = callbackAt(Moment::Contact, onContact);
    gContactEndedCallback = callbackAt(Moment::ContactEnd, onContactEnd);
    world().getPairCache()->setOverlapFilterCallback(callbackAt(Moment::Filter, m_filter.get()));
    if (m_moment == Moment::Action)
        world().addAction(m_meddler.get());
    if (m_moment == Moment::Check)
        world().addRigidBody(m_curious.get());
    if (m_moment == Moment::Contact || m_moment == Moment::Synchronization)
        wakeSome();
    // Sleeping pairs that begin get no contacts, so that none would end.
    for (std::size_t i = kStatics; m_moment == Moment::ContactEnd && i < bodies().size(); ++i)
        bodies()[i]->activate();
    for (std::size_t i = kStatics; i < bodies().size(); i += 7)
        bodies()[i]->setMotionState(m_moment == Moment::Synchronization ? m_mirror.get() : nullptr);
    btRigidBody& body = *bodies().front();
    const bool isKinematic = m_moment == Moment::MotionState;
    body.setMotionState(isKinematic ? m_tide.get() : nullptr);
    body.setCollisionFlags(isKinematic ? btCollisionObject::CF_KINEMATIC_OBJECT
                                       : btCollisionObject::CF_STATIC_OBJECT);
    body.forceActivationState(isKinematic ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
}
}  // namespace cullet::test
