// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/step_scene.h"

namespace cullet::test
{
namespace
{
/// A heap in which all bodies touch: one island.
class BoxPile : public StepScene
{
public:
    explicit BoxPile(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        for (int i = 0; i < 100; ++i)
            addBody(box, 1, vec(1.04 * (i % 4) + 0.07 * (i / 16), 0.6 + 1.1 * (i / 16), 1.04 * (i / 4 % 4)));
    }
    int events() const override { return world().getDispatcher()->getNumManifolds(); }
};

class HullPile : public StepScene
{
public:
    explicit HullPile(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        Random random(11);
        btConvexHullShape& hull = makeShape<btConvexHullShape>();
        for (int i = 0; i < 20; ++i)
            hull.addPoint(vec(random.point(-1, 1)).normalized() * btScalar(0.6));
        for (int i = 0; i < 80; ++i)
            addBody(
                hull, 1,
                vec(1.1 * (i % 4), 0.8 + 1.2 * (i / 16), 1.1 * (i / 4 % 4)) + vec(random.point(-0.1f, 0.1f)));
    }
    int events() const override { return world().getDispatcher()->getNumManifolds(); }
};

/// Islands of many sizes, from one ball to a few boxes, which come to rest and sleep.
class ManyPiles : public StepScene
{
public:
    explicit ManyPiles(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        btSphereShape& ball = makeShape<btSphereShape>(btScalar(0.4));
        for (int i = 0; i < 400; ++i)
        {
            const int pile = i % 100, storey = i / 100;
            if (storey > pile % 7)
                continue;
            btCollisionShape& shape = pile % 5 == 0 ? static_cast<btCollisionShape&>(ball) : box;
            const btVector3 at = vec(4 * (pile % 10) - 20, 0.55 + 1.1 * storey, 4 * (pile / 10) - 20);
            btRigidBody& body = addBody(shape, 1 + 0.1 * (i % 3), at);
            body.setAngularVelocity(vec(0.3 * (pile % 3), 0, 0.1 * (pile % 4)));
            body.setRollingFriction(btScalar(pile % 2 * 0.1));
            body.setRestitution(btScalar(0.1) * btScalar(pile % 6));
        }
    }
    void step(int number) override
    {
        StepScene::step(number);
        m_slept += countAwake(false) > 0 && countAwake(true) > 0;
    }
    int events() const override { return m_slept; }

private:
    int m_slept = 0;
};

/// The same with groups of single islands, two directions of friction, and no split impulse.
class ManyPilesOtherwise : public ManyPiles
{
public:
    explicit ManyPilesOtherwise(btDiscreteDynamicsWorld& world) : ManyPiles(world)
    {
        btContactSolverInfo& info = world.getSolverInfo();
        info.m_minimumSolverBatchSize = 1;
        info.m_splitImpulse = 0;
        info.m_solverMode |=
            SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS;
        info.m_leastSquaresResidualThreshold = btScalar(1e-4);
    }
};

/// The order that Bullet offers for reproducible steps.
class ManyPilesByIds : public ManyPiles
{
public:
    explicit ManyPilesByIds(btDiscreteDynamicsWorld& world) : ManyPiles(world)
    {
        world.getDispatchInfo().m_deterministicOverlappingPairs = true;
        world.getSolverInfo().m_minimumSolverBatchSize = 20;
    }
};

class Pyramids : public StepScene
{
public:
    explicit Pyramids(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        for (int pyramid = 0; pyramid < 6; ++pyramid)
            for (int row = 0; row < 6; ++row)
                for (int i = 0; i < 6 - row; ++i)
                    addBody(box, 1, vec(1.02 * i + 0.51 * row, 0.5 + row, 5.0 * pyramid));
    }
    int events() const override { return world().getDispatcher()->getNumManifolds(); }
};

/// Many static and sleeping bodies and few that move, some of which the application moves and wakes.
class FewMovers : public StepScene
{
public:
    explicit FewMovers(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        for (int i = 0; i < 600; ++i)
            addBody(box, 0, vec(3 * (i % 25) - 37, 0.5, 3 * (i / 25) - 37));
        for (int i = 0; i < 40; ++i)
            m_movers.push_back(&addBody(box, 1, vec(6 * (i % 8) - 20, 3 + i % 3, 6 * (i / 8) - 20)));
        for (std::size_t i = 0; i < m_movers.size(); i += 2)
            m_movers[i]->forceActivationState(ISLAND_SLEEPING);
    }
    void step(int number) override
    {
        btRigidBody& mover = *m_movers[std::size_t(number / 10 * 2) % m_movers.size()];
        btRigidBody& obstacle = *bodies()[std::size_t(number) % 600 + 1];
        if (number % 10 == 3)
            mover.activate();
        if (number % 10 == 5)
            obstacle.getWorldTransform().getOrigin() += vec(0, 0.01, 0);
        if (number % 10 == 7)
            mover.setCollisionShape(&makeShape<btSphereShape>(btScalar(0.3)));
        world().setForceUpdateAllAabbs(number / 100 % 2 == 0);
        StepScene::step(number);
        m_events += countAwake(false) > 0 && countAwake(true) > 0;
    }
    int events() const override { return m_events; }

private:
    std::vector<btRigidBody*> m_movers;
    int m_events = 0;
};

/// Piles on kinematic plates, of which one carries several islands.
class SharedPlates : public StepScene
{
public:
    explicit SharedPlates(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        btBoxShape& plate = makeShape<btBoxShape>(vec(6, 0.25, 6));
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        makeGroupsSmall();
        for (int i = 0; i < 6; ++i)
        {
            const btVector3 at = vec(20 * (i % 3), 3, 20 * (i / 3));
            // The older body is the first one of a manifold.
            if (i % 2 == 0)
                addPlate(plate, at);
            for (int j = 0; j < 12; ++j)
                addBody(box, 1, at + vec(4 * (j % 3) - 4, 0.8 + 1.05 * (j / 9), 4 * (j / 3 % 3) - 4));
            if (i % 2 == 1)
                addPlate(plate, at);
        }
    }
    void step(int number) override
    {
        for (std::size_t i = 0; i < m_plates.size(); ++i)
        {
            btTransform& transform = m_plates[i]->getWorldTransform();
            const double speed = number < 300 ? 0 : 0.01;
            transform.getOrigin() += vec(number % 120 < 60 ? speed : -speed, 0, 0.2 * speed * double(i % 2));
        }
        StepScene::step(number);
    }
    int events() const override { return countAwake(true); }

private:
    void addPlate(btCollisionShape& shape, const btVector3& at)
    {
        m_plates.push_back(&addBody(shape, 0, at));
        m_plates.back()->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        m_plates.back()->setActivationState(DISABLE_DEACTIVATION);
    }

    std::vector<btRigidBody*> m_plates;
};
}  // namespace

std::vector<NamedScene> structureScenes()
{
    return {
        {"BoxPile", makeScene<BoxPile>, false},        {"HullPile", makeScene<HullPile>, false},
        {"ManyPiles", makeScene<ManyPiles>},           {"ManyPilesOtherwise", makeScene<ManyPilesOtherwise>},
        {"ManyPilesByIds", makeScene<ManyPilesByIds>}, {"Pyramids", makeScene<Pyramids>},
        {"FewMovers", makeScene<FewMovers>, false},    {"SharedPlates", makeScene<SharedPlates>}};
}
}  // namespace cullet::test
