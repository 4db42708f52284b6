// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The scenes of whole steps, small, with loops of any length on several threads: all of cullet has the bits of Bullet's serial
// world with the same broad phase, dispatcher and solver.
#include "cullet/plugin/world_bodies.h"
#include "cullet/tests/demos/scene_support.h"
#include "cullet/tests/support/number_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
constexpr int kSteps = 60, kStepsBetween = 6;

/// Of transforms, velocities and activation, and of the manifolds in their order.
std::uint64_t hashOf(WorldScene& scene)
{
    test::NumberHash hash;
    hash.add(scene.stateHash());
    btDiscreteDynamicsWorld& world = scene.world();
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btCollisionObject& body = object(scene, i);
        hash.add(body.getActivationState());
        if (const btRigidBody* const moving = btRigidBody::upcast(&body))
        {
            hash.addVector(moving->getLinearVelocity());
            hash.addVector(moving->getAngularVelocity());
        }
    }
    for (int i = 0; i < world.getDispatcher()->getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *world.getDispatcher()->getManifoldByIndexInternal(i);
        hash.add(manifold.getBody0()->getWorldArrayIndex());
        hash.add(manifold.getBody1()->getWorldArrayIndex());
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            hash.addVector(manifold.getContactPoint(k).getPositionWorldOnB());
            hash.add(manifold.getContactPoint(k).getAppliedImpulse());
        }
    }
    return hash.value();
}

std::vector<std::uint64_t> historyOf(const std::string& name, const WorldSceneOptions& options)
{
    const auto scene = makeWorldScene(name, options);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < kSteps; step += kStepsBetween)
    {
        stepMany(*scene, kStepsBetween);
        hashes.push_back(hashOf(*scene));
    }
    EXPECT_GT(scene->world().getDispatcher()->getNumManifolds(), 0) << name;
    return hashes;
}

class WholeStepBits : public testing::TestWithParam<const char*>
{
};

TEST_P(WholeStepBits, AreThoseOfSerialWorldOnAnyNumberOfThreads)
{
    WorldBodies::fewBodies = 0;
    for (const std::string name :
         {"boxes", "hulls", "free-hulls", "pyramid", "wall", "ragdolls", "terrain", "statics", "convex-mesh"})
    {
        WorldSceneOptions options = makeOptions(66);
        options.narrow = "dispatcher";
        options.solver = GetParam();
        const std::vector<std::uint64_t> expected = historyOf(name, options);
        EXPECT_NE(expected.front(), expected.back()) << name;
        options.update = "parallel";
        for (const int threads : {1, 2, 3, 8, 16})
        {
            options.threads = threads;
            EXPECT_TRUE(historyOf(name, options) == expected) << name << " on " << threads << " threads";
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Solvers, WholeStepBits, testing::Values("bullet", "cullet", "cullet-soft"),
                         [](const auto& test)
                         {
                             std::string name = test.param;
                             name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
                             return name;
                         });
}  // namespace
}  // namespace cullet
