// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/scenes/bodies/mt_world.h"
#include "cullet/demos/scenes/bodies/world_quality.h"
#include "cullet/tests/demos/scene_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

// The scenes on which `cullet bench world` compares whole steps.
namespace cullet
{
namespace
{
int countTriangles(WorldScene& scene)
{
    struct Counter : btTriangleCallback
    {
        void processTriangle(btVector3*, int, int) override { ++count; }
        int count = 0;
    } counter;
    for (int i = 0; i < scene.world().getNumCollisionObjects(); ++i)
    {
        const btCollisionShape& shape = *object(scene, i).getCollisionShape();
        const btVector3 far(1000, 1000, 1000);
        if (shape.isConcave() && shape.getShapeType() != STATIC_PLANE_PROXYTYPE)
            static_cast<const btConcaveShape&>(shape).processAllTriangles(&counter, -far, far);
    }
    return counter.count;
}

TEST(WholeStepScenes, HaveTheirPublishedSizes)
{
    EXPECT_EQ(countObjects(*make("convex-mesh", 0), moves), 1764);
    EXPECT_EQ(countTriangles(*make("convex-mesh", 4)), 20000);
    EXPECT_EQ(countObjects(*make("pyramid", 0), moves), 990);
    EXPECT_EQ(countObjects(*make("ragdolls", 0), moves), 3300);
    EXPECT_EQ(make("ragdolls", 0)->world().getNumConstraints(), 3000);
    EXPECT_EQ(countTriangles(*make("terrain", 4000)), 224 * 224 * 2);
    const auto statics = make("statics", 0);
    EXPECT_EQ(countObjects(*statics, moves), 1000);
    EXPECT_EQ(statics->world().getNumCollisionObjects(), 65536 + 1000);
}

TEST(WholeStepScenes, KeepPyramidStanding)
{
    const auto pyramid = make("pyramid", 55);
    stepMany(*pyramid, 120);
    double highest = 0;
    for (int i = 1; i <= 55; ++i)
        highest = std::max(highest, double(origin(*pyramid, i).y()));
    EXPECT_NEAR(highest, 9.5, 0.05) << "ten rows";
    // Each of 45 cubes on two others, ten on the floor.
    EXPECT_EQ(pyramid->contactPairCount(), 100u);
}

TEST(WholeStepScenes, SpinFreeHullsThatHardlyTouch)
{
    const auto hulls = make("free-hulls", 64);
    const std::uint64_t pairs = hulls->pairCount();
    std::vector<btVector3> before;
    for (int i = 0; i < 64; ++i)
        before.push_back(origin(*hulls, i));
    stepMany(*hulls, 60);
    EXPECT_GT(hulls->pairCount(), 200u) << "boxes of neighbours overlap; at the start " << pairs;
    for (int i = 0; i < 64; ++i)
    {
        EXPECT_LT((origin(*hulls, i) - before[static_cast<std::size_t>(i)]).length(), btScalar(0.05)) << i;
        EXPECT_GT(btRigidBody::upcast(&object(*hulls, i))->getAngularVelocity().length(), btScalar(0.3)) << i;
    }
}

TEST(WholeStepScenes, HoldLimbsOfRagdollsTogether)
{
    const auto dolls = make("ragdolls", 44);
    EXPECT_EQ(dolls->options().bodies, 44u);
    stepMany(*dolls, 200);
    EXPECT_GT(dolls->lowestHeight(), btScalar(0.02)) << "above the floor";
    double highest = 0;
    for (int i = 1; i <= 44; ++i)
        highest = std::max(highest, double(origin(*dolls, i).y()));
    EXPECT_LT(highest, 1.2) << "fallen";
    for (int i = 0; i < dolls->world().getNumConstraints(); ++i)
    {
        btTypedConstraint& joint = *dolls->world().getConstraint(i);
        const btVector3 a = joint.getRigidBodyA().getWorldTransform().getOrigin();
        const btVector3 b = joint.getRigidBodyB().getWorldTransform().getOrigin();
        EXPECT_LT((a - b).length(), btScalar(0.7)) << i << ": no limb is longer";
    }
}

TEST(WholeStepScenes, RestCubesOnStaticFloorAndHullsOnTerrain)
{
    for (const std::string name : {"statics", "terrain", "convex-mesh"})
    {
        const auto scene = make(name, 36);
        stepMany(*scene, 240);
        EXPECT_GT(scene->lowestHeight(), btScalar(-1)) << name << ": nothing falls through or over the rim";
        EXPECT_GT(scene->contactPairCount(), 30u) << name;
    }
}

TEST(WorldScene, TellsItsThreads)
{
    WorldSceneOptions options = makeOptions(10, "dbvt");
    options.threads = 3;
    EXPECT_EQ(makeWorldScene("boxes", options)->threads(), 1) << "nothing of it uses threads";
    options.narrow = "dispatcher";
    EXPECT_EQ(makeWorldScene("boxes", options)->threads(), 3);
    options.narrow = "bullet";
    options.update = "parallel";
    EXPECT_EQ(makeWorldScene("boxes", options)->threads(), 3);
    options.update = "bullet";
    options.backend = "grid";
    options.threads = 0;
    EXPECT_EQ(makeWorldScene("boxes", options)->threads(), int(std::thread::hardware_concurrency()));
}

TEST(WorldScene, MakesBulletsMultithreadedWorldOrSaysWhyNot)
{
    WorldSceneOptions options = makeOptions(30, "dbvt");
    options.threads = 2;
    const auto serial = makeWorldScene("boxes", options);
    options.isMt = true;
    if (isBulletThreadSafe())
    {
        const auto parallel = makeWorldScene("boxes", options);
        EXPECT_EQ(parallel->threads(), 2);
        stepMany(*serial, 60);
        stepMany(*parallel, 60);
        EXPECT_NEAR(parallel->lowestHeight(), serial->lowestHeight(), 0.05);
        EXPECT_GT(parallel->contactPairCount(), 20u);
        options.bodies = 4;
        EXPECT_THROW(makeWorldScene("soft", options), ProgramError);
        return;
    }
    try
    {
        makeWorldScene("boxes", options);
        FAIL() << "no exception";
    }
    catch (const ProgramError& error)
    {
        EXPECT_EQ(error.code(), kExitUnavailable);
        EXPECT_NE(std::string(error.what()).find("CULLET_THREADSAFE_BULLET"), std::string::npos)
            << error.what();
    }
}

TEST(WorldQuality, MeasuresDepthEnergyAndSleepers)
{
    const auto box = make("boxes", 1);
    EXPECT_EQ(qualityOf(box->world()).points.max, 0);
    EXPECT_EQ(qualityOf(box->world()).energy, 0);
    stepMany(*box, 10);
    // Free fall with mass 1: v is 10 steps of 10 / 60.
    EXPECT_NEAR(qualityOf(box->world()).energy, 0.5 * std::pow(100.0 / 60, 2), 1e-4);
    const auto boxes = make("boxes", 27);
    stepMany(*boxes, 90);
    const WorldQuality landed = qualityOf(boxes->world());
    EXPECT_GT(landed.points.mean, 0);
    EXPECT_LE(landed.points.mean, landed.points.p99);
    EXPECT_LE(landed.points.p99, landed.points.max);
    EXPECT_LT(landed.points.max, 0.3);
    EXPECT_EQ(landed.sleepers, 0u);
    stepMany(*boxes, 600);
    const WorldQuality asleep = qualityOf(boxes->world());
    EXPECT_EQ(asleep.sleepers, 27u);
    EXPECT_EQ(asleep.energy, 0);
}

TEST(WorldQuality, MeasuresJointErrorsAndWays)
{
    const auto dolls = make("ragdolls", 11);
    stepMany(*dolls, 1);
    btRigidBody& limb = const_cast<btRigidBody&>(dolls->world().getConstraint(0)->getRigidBodyB());
    const std::vector<btVector3> before = placesOf(dolls->world());
    const WorldQuality hanging = qualityOf(dolls->world());
    limb.translate(btVector3(0, 0, 1));
    const WorldQuality torn = qualityOf(dolls->world());
    EXPECT_LT(hanging.maxJointError, 0.1);
    EXPECT_NEAR(torn.maxJointError, 1, 0.1);
    EXPECT_GT(torn.meanJointError, hanging.meanJointError);
    EXPECT_LT(torn.meanJointError, torn.maxJointError);
    EXPECT_NEAR(meanWay(before, placesOf(dolls->world())), 1 / double(before.size()), 1e-5);
}

TEST(WorldQuality, CountsSleepers)
{
    EXPECT_FALSE((Sleepers{0, 0}.areAlmostAll()));
    EXPECT_FALSE((Sleepers{100, 98}.areAlmostAll()));
    EXPECT_TRUE((Sleepers{100, 99}.areAlmostAll()));
}

TEST(WorldQuality, MeasuresTheSpinOfABody)
{
    const auto hulls = make("free-hulls", 1);
    const btRigidBody& body = *btRigidBody::upcast(&object(*hulls, 0));
    const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
    const btVector3 inertia = body.getLocalInertia();
    const double expected =
        0.5 * double(spin.x() * spin.x() * inertia.x() + spin.y() * spin.y() * inertia.y() +
                     spin.z() * spin.z() * inertia.z());
    EXPECT_GT(expected, 0);
    EXPECT_NEAR(qualityOf(hulls->world()).energy, expected, 1e-6);
}
}  // namespace
}  // namespace cullet
