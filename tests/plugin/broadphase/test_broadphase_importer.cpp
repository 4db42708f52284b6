// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Saving a world with its contacts and restoring it with Bullet's importer, which finds the pairs of the saved
// manifolds by the unique ids of their proxies.

#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletWorldImporter/btMultiBodyWorldImporter.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Five boxes in a leaning stack on a plane.
class Stack
{
public:
    explicit Stack(std::unique_ptr<btBroadphaseInterface> broadphase)
        : m_broadphase(std::move(broadphase)),
          m_world(&m_dispatcher, m_broadphase.get(), &m_solver, &m_configuration)
    {
        add(0, m_ground, vec(0, -1, 0));
        for (int i = 0; i < 5; ++i)
            add(1, m_box, vec(0.1 * i, 0.5 + i, 0));
    }

    ~Stack()
    {
        for (const auto& body : m_bodies)
            m_world.removeRigidBody(body.get());
    }

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1.0 / 60.0), 0);
    }

    std::vector<char> saved()
    {
        btDefaultSerializer serializer;
        serializer.setSerializationFlags(serializer.getSerializationFlags() | BT_SERIALIZE_CONTACT_MANIFOLDS);
        m_world.serialize(&serializer);
        const auto* data = reinterpret_cast<const char*>(serializer.getBufferPointer());
        return std::vector<char>(data, data + serializer.getCurrentBufferSize());
    }

    bool restore(std::vector<char> file)
    {
        btMultiBodyWorldImporter importer(&m_world);
        importer.setImporterFlags(eRESTORE_EXISTING_OBJECTS);
        return importer.loadFileFromMemory(file.data(), static_cast<int>(file.size()));
    }

    /// Impulses of all contact points, pair by pair: lost if a manifold does not find its pair.
    std::vector<btScalar> impulses()
    {
        std::vector<btScalar> result;
        for (int i = 0; i < m_dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold* manifold = m_dispatcher.getManifoldByIndexInternal(i);
            for (int p = 0; p < manifold->getNumContacts(); ++p)
                result.push_back(manifold->getContactPoint(p).getAppliedImpulse());
        }
        std::sort(result.begin(), result.end());
        return result;
    }

private:
    void add(double mass, btCollisionShape& shape, const btVector3& origin)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(btScalar(mass), inertia);
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, inertia);
        info.m_startWorldTransform.setOrigin(origin);
        m_bodies.push_back(std::make_unique<btRigidBody>(info));
        m_world.addRigidBody(m_bodies.back().get());
    }

    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btMultiBodyConstraintSolver m_solver;
    std::unique_ptr<btBroadphaseInterface> m_broadphase;
    btMultiBodyDynamicsWorld m_world;
    btBoxShape m_ground{vec(20, 1, 20)};
    btBoxShape m_box{vec(0.5, 0.5, 0.5)};
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

std::unique_ptr<btBroadphaseInterface> make(bool stock)
{
    if (stock)
        return std::make_unique<btDbvtBroadphase>();
    return std::make_unique<Broadphase>();
}
}  // namespace

class BroadphaseImporter : public testing::TestWithParam<bool>
{
};

TEST_P(BroadphaseImporter, RestoresImpulsesOfSavedContacts)
{
    Stack original(make(GetParam()));
    original.step(30);
    const std::vector<char> file = original.saved();
    const std::vector<btScalar> impulses = original.impulses();
    ASSERT_GE(impulses.size(), 10u) << "the stack does not touch: nothing to restore";
    ASSERT_GT(impulses.back(), btScalar(0.1));

    Stack copy(make(GetParam()));
    ASSERT_TRUE(copy.restore(file));
    EXPECT_EQ(copy.impulses(), impulses);
}

INSTANTIATE_TEST_SUITE_P(Worlds, BroadphaseImporter, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& world)
                         { return std::string(world.param ? "Dbvt" : "Cullet"); });
}  // namespace cullet::test
