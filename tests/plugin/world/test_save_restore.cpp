// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world restored to an earlier moment repeats its evolution bit by bit, as with Bullet's narrow phase, which rollback
// networking and replay rely on.

#include "cullet/tests/plugin/world/saved_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kRounds = 6, kStepsBetween = 10, kStepsAfter = 8;
constexpr unsigned kSeed = 35;

/// Gives every second body a velocity.
void push(SavedWorld& saved, std::mt19937& engine)
{
    std::normal_distribution<double> speed(0, 3);
    for (std::size_t i = 1; i < saved.bodies.size(); i += 2)
    {
        const double x = speed(engine), y = speed(engine), z = speed(engine);
        saved.bodies[i]->activate(true);
        saved.bodies[i]->setLinearVelocity(vec(x, y, z));
        saved.bodies[i]->setAngularVelocity(vec(z, x, y));
    }
}

/// Steps the world three times from one moment: directly, restored from its own end, and restored after other events.
void expectTheSameFuture(SavedWorld& saved, std::mt19937& engine)
{
    const Moment moment = saved.now();
    const auto goOn = [&]
    {
        saved.forgetContacts();
        return saved.run(kStepsAfter);
    };
    const Future first = goOn();
    ASSERT_GT(saved.contacts(), 0) << "nothing to remember";
    ASSERT_NE(firstDifference({moment}, {first.back()}), "") << "the world rests";
    saved.restore(moment);
    EXPECT_EQ(firstDifference(first, goOn()), "") << "back from its own end";

    push(saved, engine);
    EXPECT_NE(firstDifference(first, saved.run(kStepsAfter)), "") << "the push did nothing";
    saved.restore(moment);
    EXPECT_EQ(firstDifference(first, goOn()), "") << "back from other events";
}

/// @param fallSteps steps until the first bodies touch
void expectTheSameFutures(SavedWorld& saved, Narrow narrow, int fallSteps)
{
    std::mt19937 engine(kSeed);
    saved.run(fallSteps);
    for (int round = 0; round < kRounds && !testing::Test::HasFailure(); ++round)
    {
        SCOPED_TRACE("round " + std::to_string(round) + ", seed " + std::to_string(kSeed));
        saved.run(kStepsBetween);
        expectTheSameFuture(saved, engine);
    }
    if (narrow != Narrow::Stock)
    {
        EXPECT_GT(saved.touchingTotal(), 200u) << "others made the contacts";
    }
}

btTransform turned(std::mt19937& engine, const btVector3& at)
{
    return btTransform(randomRotation(engine), at);
}

class SaveRestore : public testing::TestWithParam<Narrow>
{
protected:
    btBoxShape m_ground{vec(20, 1, 20)};
    std::vector<std::unique_ptr<btConvexHullShape>> m_hulls;
    btConvexHullShape& hull(const std::vector<btVector3>& points)
    {
        m_hulls.push_back(makeHullShape(points));
        return *m_hulls.back();
    }
    std::mt19937 m_engine{kSeed};
};
}  // namespace

TEST_P(SaveRestore, RepeatsHeapOfHullsBitForBit)
{
    SavedWorld saved(GetParam());
    saved.add(m_ground, 0, vec(0, -1, 0));
    btConvexHullShape* const kinds[] = {&hull(ballPoints(24, 0.5, 1)), &hull(ballPoints(8, 0.5, 2)),
                                        &hull(boxPoints(0.5, 0.3, 0.4))};
    for (int i = 0; i < 27; ++i)
        saved.add(*kinds[i % 3], 1,
                  turned(m_engine, vec(0.9 * (i % 3), 0.8 + 1.0 * (i / 9), 0.9 * (i / 3 % 3))));
    expectTheSameFutures(saved, GetParam(), 40);
}

TEST_P(SaveRestore, RepeatsAlignedStacksOfBoxesAndHullsBitForBit)
{
    SavedWorld saved(GetParam());
    saved.add(m_ground, 0, vec(0, -1, 0));
    btBoxShape box(vec(0.5, 0.5, 0.5));
    btConvexHullShape& cube = hull(boxPoints(0.46, 0.46, 0.46));
    for (int stack = 0; stack < 3; ++stack)
    {
        for (int i = 0; i < 5; ++i)
            saved
                .add((i + stack) % 2 == 0 ? static_cast<btCollisionShape&>(cube) : box, 1,
                     vec(1.5 * stack, 0.51 + 1.01 * i, 0))
                .setActivationState(DISABLE_DEACTIVATION);
    }
    expectTheSameFutures(saved, GetParam(), 30);
}

TEST_P(SaveRestore, RepeatsCompoundsBitForBit)
{
    SavedWorld saved(GetParam());
    saved.add(m_ground, 0, vec(0, -1, 0));
    saved.world.sortManifolds();
    btBoxShape box(vec(0.3, 0.3, 0.3));
    btConvexHullShape& ball = hull(ballPoints(16, 0.4, 3));
    btCompoundShape compound;
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-0.5, 0, 0)), &box);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.5, 0, 0)), &ball);
    for (int i = 0; i < 12; ++i)
        saved.add(compound, 1, turned(m_engine, vec(1.2 * (i % 2), 1 + 1.2 * (i / 4), 1.2 * (i / 2 % 2))));
    expectTheSameFutures(saved, GetParam(), 40);
}

TEST_P(SaveRestore, RepeatsHullsOnTriangleMeshBitForBit)
{
    btTriangleMesh mesh;
    for (int i = 0; i < 64; ++i)
    {
        const double x = i % 8 - 4.0, z = i / 8 - 4.0;
        const auto corner = [](double atX, double atZ)
        { return vec(atX, 0.1 * std::sin(3 * atX) * std::cos(2 * atZ), atZ); };
        mesh.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
        mesh.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
    }
    btBvhTriangleMeshShape meshShape(&mesh, true);
    SavedWorld saved(GetParam());
    saved.add(meshShape, 0, vec(0, 0, 0));
    btConvexHullShape* const kinds[] = {&hull(ballPoints(20, 0.5, 4)), &hull(boxPoints(0.5, 0.3, 0.4))};
    for (int i = 0; i < 12; ++i)
        saved.add(*kinds[i % 2], 1,
                  turned(m_engine, vec(1.1 * (i % 3) - 1, 0.9 + 1.1 * (i / 6), 1.1 * (i / 3 % 2))));
    expectTheSameFutures(saved, GetParam(), 40);
}

TEST_P(SaveRestore, RepeatsRagdollsBitForBit)
{
    SavedWorld saved(GetParam());
    saved.add(m_ground, 0, vec(0, -1, 0));
    btBoxShape trunk(vec(0.3, 0.4, 0.2));
    btCapsuleShape limb(btScalar(0.12), btScalar(0.5));
    for (int i = 0; i < 4; ++i)
    {
        const btVector3 at = vec(0.5 * i, 1.3 + 0.9 * i, 0.3 * i);
        btRigidBody& chest = saved.add(trunk, 2, at);
        for (int k = 0; k < 4; ++k)
        {
            const double side = k % 2 == 0 ? 0.3 : -0.3, height = k < 2 ? 0.35 : -0.4;
            btRigidBody& each = saved.add(limb, 1, at + vec(1.5 * side, height - 0.37, 0));
            if (k < 2)
                saved.join<btPoint2PointConstraint>(chest, each, vec(1.5 * side, height, 0), vec(0, 0.37, 0));
            else
                saved.join<btHingeConstraint>(chest, each, vec(1.5 * side, height, 0), vec(0, 0.37, 0),
                                              vec(1, 0, 0), vec(1, 0, 0));
        }
    }
    expectTheSameFutures(saved, GetParam(), 40);
}

TEST_P(SaveRestore, RepeatsMultibodiesBitForBit)
{
    SavedWorld saved(GetParam());
    saved.add(m_ground, 0, vec(0, -1, 0));
    btConvexHullShape &brick = hull(boxPoints(0.4, 0.3, 0.3)), &ball = hull(ballPoints(20, 0.4, 5));
    btBoxShape box(vec(0.4, 0.3, 0.3));
    for (int i = 0; i < 5; ++i)
        saved.addChain(
            {&brick, &ball, &box, &brick},
            btTransform(btQuaternion(vec(1, 0, 0), btScalar(0.3 + i)), vec(0.2 * i, 0.8 + 0.9 * i, 0.2 * i)));
    saved.add(ball, 1, vec(1, 5.5, 0));
    expectTheSameFutures(saved, GetParam(), 40);
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, SaveRestore,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace cullet::test
