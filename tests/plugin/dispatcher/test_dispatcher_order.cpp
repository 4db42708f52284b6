// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/dispatcher/contact_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace cullet::test
{
namespace
{
/// Bodies whose pairs all have Bullet's own algorithms in the dispatcher's table.
enum class OwnPairs
{
    Boxes,
    Balls,  ///< spheres and capsules on a plane
    Compounds
};

/// Bodies that fall onto a static ground, past a kinematic platform and sleeping bodies.
class OwnPairsWorld
{
public:
    OwnPairsWorld(OwnPairs kind, Narrow narrow, unsigned seed)
        : m_world(narrow, 2, {BoxPairs::Bullet}), m_engine(seed)
    {
        m_pairOfBoxes.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-0.3, 0, 0)), &m_box);
        m_pairOfBoxes.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.3, 0.2, 0)), &m_box);
        if (kind == OwnPairs::Balls)
            m_world.add(&m_plane, 0, vec(0, 0, 0));
        else
            m_world.add(&m_ground, 0, vec(0, -0.5, 0));
        for (int i = 0; i < 60; ++i)
            addBody(shapeOf(kind, i), i);
        m_platform = &m_world.add(shapeOf(kind, 0), 1, vec(-2, 0.8, 0));
        m_platform->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        m_platform->setActivationState(DISABLE_DEACTIVATION);
        for (std::size_t i = 0; i < m_world.bodies.size(); ++i)
            m_world.bodies[i]->setUserIndex(int(i));
    }

    /// @return every manifold and event of each step
    std::vector<std::uint64_t> run(int steps)
    {
        ContactLog log;
        for (int i = 0; i < steps; ++i)
        {
            btTransform at = m_platform->getWorldTransform();
            at.setOrigin(at.getOrigin() + vec(0.05, 0, 0));
            m_platform->setWorldTransform(at);
            m_world.step();
            log.addManifolds(m_world.dispatcher());
            kinematic += contactsOf(*m_platform);
            manifolds += m_world.dispatcher().getNumManifolds();
            for (const auto& body : m_world.bodies)
                asleep += body->getActivationState() == ISLAND_SLEEPING && !body->isStaticObject() ? 1 : 0;
        }
        return log.entries();
    }

    std::uint64_t hash() const { return m_world.hash(); }

    int kinematic = 0, manifolds = 0, asleep = 0;

private:
    btCollisionShape* shapeOf(OwnPairs kind, int i)
    {
        if (kind == OwnPairs::Balls)
            return i % 2 == 0 ? static_cast<btCollisionShape*>(&m_sphere) : &m_capsule;
        return kind == OwnPairs::Compounds && i % 2 == 0 ? static_cast<btCollisionShape*>(&m_pairOfBoxes)
                                                         : &m_box;
    }

    void addBody(btCollisionShape* shape, int i)
    {
        std::uniform_real_distribution<double> jitter(-0.1, 0.1);
        const double x = jitter(m_engine), z = jitter(m_engine);
        const btVector3 at = vec(x + 0.9 * (i % 4), 0.5 + 0.9 * (i / 16), z + 0.9 * (i / 4 % 4));
        btRigidBody& body = m_world.add(shape, 1, btTransform(randomRotation(m_engine), at));
        if (i % 5 == 0)
        {
            body.setCcdMotionThreshold(btScalar(0.05));
            body.setCcdSweptSphereRadius(btScalar(0.2));
            body.setLinearVelocity(vec(0, -20, 0));
        }
        if (i >= 50)
        {
            body.setWorldTransform(
                btTransform(btQuaternion::getIdentity(), vec(3.0 * (i - 50) - 10, 0.45, 8)));
            body.forceActivationState(ISLAND_SLEEPING);
        }
    }

    int contactsOf(const btCollisionObject& body)
    {
        int count = 0;
        for (int i = 0; i < m_world.dispatcher().getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *m_world.dispatcher().getManifoldByIndexInternal(i);
            if (manifold.getBody0() == &body || manifold.getBody1() == &body)
                count += manifold.getNumContacts();
        }
        return count;
    }

    btBoxShape m_ground{vec(20, 0.5, 20)}, m_box{vec(0.4, 0.4, 0.4)};
    btStaticPlaneShape m_plane{vec(0, 1, 0), 0};
    btSphereShape m_sphere{btScalar(0.4)};
    btCapsuleShape m_capsule{btScalar(0.3), btScalar(0.4)};
    btCompoundShape m_pairOfBoxes;
    ConvexWorld m_world;
    std::mt19937 m_engine;
    btRigidBody* m_platform = nullptr;
};
}  // namespace

// Islands and solver take manifolds in the dispatcher's order, so that a different order gives different bits.
TEST(DispatcherOrder, MatchesBulletsWhereEveryPairIsBulletsOwn)
{
    for (const OwnPairs kind : {OwnPairs::Boxes, OwnPairs::Balls, OwnPairs::Compounds})
    {
        for (unsigned seed = 1; seed <= 2; ++seed)
        {
            SCOPED_TRACE("kind " + std::to_string(int(kind)) + ", seed " + std::to_string(seed));
            OwnPairsWorld bullets(kind, Narrow::Stock, seed), own(kind, Narrow::Dispatcher, seed);
            const std::vector<std::uint64_t> expected = bullets.run(90), log = own.run(90);
            EXPECT_TRUE(log == expected)
                << "differs after "
                << std::mismatch(log.begin(), log.end(), expected.begin(), expected.end()).first - log.begin()
                << " entries of " << expected.size();
            EXPECT_EQ(own.hash(), bullets.hash());
            EXPECT_GT(bullets.kinematic, 20);
            EXPECT_GT(bullets.manifolds, 90 * 60);
            EXPECT_GT(bullets.asleep, 90 * 4);
        }
    }
}
}  // namespace cullet::test
