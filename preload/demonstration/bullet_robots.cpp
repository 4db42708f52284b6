// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A plain Bullet program for timing worlds in which every contact point costs solver time: robots on four wheels
// (btMultiBody), tables of five parts, round hulls. Prints processor time of a step, contacts, and the final energy.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <string>

namespace
{
/// Lives until the process ends, like all its parts.
struct World
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btMultiBodyConstraintSolver solver;
    btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    std::mt19937 random{7};

    btScalar draw() { return std::uniform_real_distribution<btScalar>(-1, 1)(random); }
    btTransform turnedAt(const btVector3& place)
    {
        const btScalar x = draw(), y = draw(), z = draw(), w = draw();
        return btTransform(btQuaternion(x, y, z, w).normalized(), place);
    }
    void add(btCollisionShape* shape, btScalar mass, const btTransform& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape->calculateLocalInertia(mass, inertia);
        btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
        info.m_startWorldTransform = at;
        auto* body = new btRigidBody(info);
        body->setActivationState(DISABLE_DEACTIVATION);
        world.addRigidBody(body);
    }
    void addBox(const btVector3& half, const btVector3& at)
    {
        add(new btBoxShape(half), 0, btTransform(btQuaternion::getIdentity(), at));
    }
};

btConvexHullShape* boxHull(btScalar x, btScalar y, btScalar z)
{
    auto* hull = new btConvexHullShape;
    for (int i = 0; i < 8; ++i)
        hull->addPoint(btVector3(i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z));
    return hull;
}

btConvexHullShape* wheelHull(int sides)
{
    auto* hull = new btConvexHullShape;
    for (int i = 0; i < 2 * sides; ++i)
    {
        const btScalar angle = SIMD_2_PI * btScalar(i / 2) / btScalar(sides);
        hull->addPoint(btVector3(btScalar(0.3) * btCos(angle), btScalar(0.3) * btSin(angle),
                                 i & 1 ? btScalar(0.05) : btScalar(-0.05)));
    }
    return hull;
}

void addCollider(World& all, btMultiBody& robot, int link, btCollisionShape& shape)
{
    auto* collider = new btMultiBodyLinkCollider(&robot, link);
    collider->setCollisionShape(&shape);
    collider->setFriction(1);
    all.world.addCollisionObject(collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
    if (link < 0)
        robot.setBaseCollider(collider);
    else
        robot.getLink(link).m_collider = collider;
}

void addRobot(World& all, btCollisionShape& base, btCollisionShape& wheel, const btVector3& place,
              btScalar speed)
{
    btVector3 baseInertia, wheelInertia;
    base.calculateLocalInertia(10, baseInertia);
    wheel.calculateLocalInertia(1, wheelInertia);
    auto* robot = new btMultiBody(4, 10, baseInertia, false, false);
    const btScalar side = btScalar(0.45);
    for (int i = 0; i < 4; ++i)
        robot->setupRevolute(i, 1, wheelInertia, -1, btQuaternion::getIdentity(), btVector3(0, 0, 1),
                             btVector3(i & 1 ? side : -side, btScalar(-0.15), i & 2 ? side : -side),
                             btVector3(0, 0, 0), true);
    robot->finalizeMultiDof();
    robot->setBaseWorldTransform(btTransform(btQuaternion::getIdentity(), place));
    robot->setCanSleep(false);
    robot->setHasSelfCollision(false);
    all.world.addMultiBody(robot);
    addCollider(all, *robot, -1, base);
    for (int i = 0; i < 4; ++i)
    {
        addCollider(all, *robot, i, wheel);
        all.world.addMultiBodyConstraint(new btMultiBodyJointMotor(robot, i, speed, 5));
    }
    btAlignedObjectArray<btQuaternion> turns;
    btAlignedObjectArray<btVector3> places;
    robot->updateCollisionObjectWorldTransforms(turns, places);
}

void addRobots(World& all)
{
    btCollisionShape* wheel = wheelHull(24);
    btCollisionShape* base = boxHull(btScalar(0.6), btScalar(0.15), btScalar(0.35));
    for (int i = 0; i < 25; ++i)
        addRobot(all, *base, *wheel, btVector3(btScalar(2 * (i % 5)), btScalar(0.5), btScalar(2 * (i / 5))),
                 btScalar(-2 - 0.1 * (i % 7)));
}

void addTables(World& all)
{
    auto* table = new btCompoundShape;
    table->addChildShape(btTransform::getIdentity(), boxHull(btScalar(0.5), btScalar(0.06), btScalar(0.5)));
    btCollisionShape* leg = boxHull(btScalar(0.06), btScalar(0.3), btScalar(0.06));
    const btScalar side = btScalar(0.4);
    for (int i = 0; i < 4; ++i)
        table->addChildShape(
            btTransform(btQuaternion::getIdentity(),
                        btVector3(i & 1 ? side : -side, btScalar(-0.36), i & 2 ? side : -side)),
            leg);
    for (int i = 0; i < 216; ++i)
        all.add(table, 1,
                all.turnedAt(btScalar(1.3) *
                             btVector3(btScalar(i % 6), btScalar(i / 36 + 1), btScalar(i / 6 % 6))));
}

void addHulls(World& all)
{
    std::normal_distribution<btScalar> normal;
    btConvexHullShape* hulls[8];
    for (btConvexHullShape*& hull : hulls)
    {
        hull = new btConvexHullShape;
        for (int i = 0; i < 32; ++i)
        {
            const btScalar x = normal(all.random), y = normal(all.random), z = normal(all.random);
            hull->addPoint(btVector3(x, y, z).normalized() / 2);
        }
    }
    for (const btScalar side : {btScalar(-7), btScalar(7)})
    {
        all.addBox(btVector3(1, 12, 8), btVector3(side, 10, 0));
        all.addBox(btVector3(8, 12, 1), btVector3(0, 10, side));
    }
    for (int i = 0; i < 1000; ++i)
        all.add(
            hulls[i % 8], 1,
            all.turnedAt(btScalar(1.1) * btVector3(btScalar(i % 10) - btScalar(4.5), btScalar(i / 100 + 1),
                                                   btScalar(i / 10 % 10) - btScalar(4.5))));
}

struct Contacts
{
    double points = 0, pairs = 0, loaded = 0, deepest = 0;
};

Contacts contactsOf(btDispatcher& dispatcher)
{
    Contacts all;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
        all.pairs += manifold.getNumContacts() > 0;
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            const btManifoldPoint& point = manifold.getContactPoint(k);
            all.points += 1;
            all.loaded += point.getAppliedImpulse() > 0;
            all.deepest = std::max(all.deepest, -double(point.getDistance()));
        }
    }
    return all;
}

double energyOf(const btMultiBodyDynamicsWorld& world)
{
    double energy = 0;
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btRigidBody* body = btRigidBody::upcast(world.getCollisionObjectArray()[i]);
        if (body != nullptr && body->getInvMass() > 0)
            energy += double(body->getLinearVelocity().length2()) / 2;
    }
    for (int i = 0; i < world.getNumMultibodies(); ++i)
        energy +=
            double(const_cast<btMultiBodyDynamicsWorld&>(world).getMultiBody(i)->getBaseVel().length2()) / 2;
    return energy;
}
}  // namespace

int main(int count, char** arguments)
{
    const std::string scene = count > 1 ? arguments[1] : "robots";
    const int steps = count > 2 ? std::atoi(arguments[2]) : 240;
    World all;
    all.world.setGravity(btVector3(0, -10, 0));
    all.addBox(btVector3(60, 1, 60), btVector3(0, -1, 0));
    if (scene == "robots")
        addRobots(all);
    else if (scene == "tables")
        addTables(all);
    else
        addHulls(all);
    Contacts sum;
    double energy = 0, clocks = 0;
    for (int i = 0; i < steps; ++i)
    {
        const std::clock_t start = std::clock();
        all.world.stepSimulation(btScalar(1) / 60, 0);
        clocks += double(std::clock() - start);
        const Contacts now = contactsOf(all.dispatcher);
        sum.points += now.points;
        sum.pairs += now.pairs;
        sum.loaded += now.loaded;
        sum.deepest = std::max(sum.deepest, now.deepest);
        energy += i < steps * 2 / 3 ? 0 : energyOf(all.world);
    }
    std::printf("step %.3f ms\n", 1e3 * clocks / CLOCKS_PER_SEC / steps);
    std::printf("points %.1f, %.1f of them loaded, in %.1f pairs; deepest %.2g; energy at the end %.3g\n",
                sum.points / steps, sum.loaded / steps, sum.pairs / steps, sum.deepest,
                energy / (steps - steps * 2 / 3));
}
