// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A Bullet program opens the library of the C interface at run time, like a program compiled long before; a second
// world uses cullet as a C++ library, and both must agree bit by bit.
#include "cullet/plugin/isa_gjk.h"
#include "cullet/tests/abi/opened_library.h"
#include "cullet/tests/plugin/falling_heap.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <typeinfo>

namespace cullet::test
{
namespace
{
struct HeapResult
{
    std::uint64_t hash;
    int pairs;
};

/// Boxes and hulls that fall onto a plane.
HeapResult dropHeap(btBroadphaseInterface& broadphase, btCollisionDispatcher& dispatcher,
                    btCollisionConfiguration& configuration)
{
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(vec(0, -10, 0));
    btConvexHullShape hull;
    for (int corner = 0; corner < 8; ++corner)
        hull.addPoint(vec(corner & 1, (corner >> 1) & 1, corner >> 2) * btScalar(0.8));
    Heap heap(world);
    for (int i = 0; i < 20; ++i)
        heap.add(&hull, 1, vec(i % 4, 6 + i / 4, i % 3));
    heap.step(120);
    return {heap.hash(), world.getPairCache()->getNumOverlappingPairs()};
}

HeapResult dropHeapLinked()
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    registerIsaGjk(dispatcher);
    Broadphase broadphase;
    return dropHeap(broadphase, dispatcher, configuration);
}

TEST(CInterface, StepsSameWorldFromOpenedLibraryAsLinkedCppLibrary)
{
    const Library library;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    cullet_isa_gjk* isaGjk = nullptr;
    ASSERT_EQ(LOADED(library, cullet_isa_gjk_register)(sizeof(btScalar), &dispatcher, nullptr, &isaGjk), 0);
    cullet_broadphase* handle = nullptr;
    ASSERT_EQ(LOADED(library, cullet_broadphase_create)(sizeof(btScalar), nullptr, &handle), CULLET_OK);
    auto* broadphase =
        static_cast<btBroadphaseInterface*>(LOADED(library, cullet_broadphase_interface)(handle));
    const HeapResult opened = dropHeap(*broadphase, dispatcher, configuration);
    const HeapResult linked = dropHeapLinked();
    EXPECT_EQ(opened.hash, linked.hash);
    EXPECT_EQ(opened.pairs, linked.pairs);
    EXPECT_GT(opened.pairs, 100);

    auto stats = sized<cullet_broadphase_stats>();
    ASSERT_EQ(LOADED(library, cullet_broadphase_get_stats)(handle, &stats), CULLET_OK);
    EXPECT_EQ(stats.updates, 120u);
    EXPECT_EQ(stats.bodies, 0u) << "the world is gone";
    EXPECT_STREQ(stats.backend, "grid");
    auto queries = sized<cullet_isa_gjk_stats>();
    ASSERT_EQ(LOADED(library, cullet_isa_gjk_get_stats)(isaGjk, &queries), CULLET_OK);
    EXPECT_GT(queries.touching, 1000u);
    LOADED(library, cullet_broadphase_destroy)(handle);
}

TEST(CInterface, PassesOptionsToBroadPhase)
{
    const Library library;
    const auto create = LOADED(library, cullet_broadphase_create);
    auto options = sized<cullet_broadphase_options>();
    options.backend = CULLET_BACKEND_BRUTE;
    options.margin = 2;
    cullet_broadphase* handle = nullptr;
    ASSERT_EQ(create(sizeof(btScalar), &options, &handle), CULLET_OK);
    auto& broadphase =
        *static_cast<btBroadphaseInterface*>(LOADED(library, cullet_broadphase_interface)(handle));
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* cube = addCube(broadphase, vec(1, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, cube, vec(4.9, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u) << "3.9 apart, twice the margin is 4";
    moveCube(broadphase, cube, vec(5.1, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    auto stats = sized<cullet_broadphase_stats>();
    EXPECT_EQ(LOADED(library, cullet_broadphase_get_stats)(handle, &stats), CULLET_OK);
    EXPECT_STREQ(stats.backend, "brute");
    EXPECT_EQ(stats.bodies, 2u);
    LOADED(library, cullet_broadphase_destroy)(handle);
}

TEST(CInterface, ReturnsErrorForWrongCallsOfBulletFunctions)
{
    const Library library;
    const auto create = LOADED(library, cullet_broadphase_create);
    const auto getStats = LOADED(library, cullet_broadphase_get_stats);
    cullet_broadphase* handle = nullptr;
    auto options = sized<cullet_broadphase_options>();
    options.size -= 1;
    EXPECT_EQ(create(sizeof(btScalar), &options, &handle), CULLET_ERROR_SIZE);
    options = sized<cullet_broadphase_options>();
    options.backend = -5;
    EXPECT_EQ(create(sizeof(btScalar), &options, &handle), CULLET_ERROR_ARGUMENT);
    options.backend = CULLET_BACKEND_GRID;
    options.margin = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(create(sizeof(btScalar), &options, &handle), CULLET_ERROR_ARGUMENT);
    options.margin = 1e39;
    EXPECT_EQ(create(sizeof(btScalar), &options, &handle), CULLET_ERROR_ARGUMENT) << "no float";
    EXPECT_EQ(create(sizeof(btScalar), nullptr, nullptr), CULLET_ERROR_NULL);
    EXPECT_EQ(handle, nullptr);

    cullet_broadphase_stats stats = {};
    EXPECT_EQ(getStats(nullptr, &stats), CULLET_ERROR_NULL);
    ASSERT_EQ(create(sizeof(btScalar), nullptr, &handle), CULLET_OK);
    EXPECT_EQ(getStats(handle, &stats), CULLET_ERROR_SIZE);
    EXPECT_EQ(getStats(handle, nullptr), CULLET_ERROR_NULL);
    LOADED(library, cullet_broadphase_destroy)(handle);

    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    EXPECT_EQ(enlist(sizeof(btScalar), nullptr, nullptr, nullptr), CULLET_ERROR_NULL);
    EXPECT_EQ(enlist(12 - sizeof(btScalar), &dispatcher, nullptr, nullptr), CULLET_ERROR_PRECISION);
    EXPECT_EQ(LOADED(library, cullet_isa_gjk_get_stats)(nullptr, nullptr), CULLET_ERROR_NULL);
    auto isaGjk = sized<cullet_isa_gjk_options>();
    for (const int wrong : {-1, 3})
    {
        isaGjk.box_box = wrong;
        EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &isaGjk, nullptr), CULLET_ERROR_ARGUMENT);
    }
}

/// The class that finds the contacts of two boxes.
std::string algorithmOfBoxes(btCollisionDispatcher& dispatcher)
{
    btBoxShape box(btVector3(1, 1, 1));
    btCollisionObject bodies[2];
    for (btCollisionObject& body : bodies)
        body.setCollisionShape(&box);
    const btCollisionObjectWrapper a(nullptr, &box, &bodies[0], bodies[0].getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper b(nullptr, &box, &bodies[1], bodies[1].getWorldTransform(), -1, -1);
    btCollisionAlgorithm* const algorithm =
        dispatcher.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    const btCollisionAlgorithm& known = *algorithm;
    const std::string name = typeid(known).name();
    algorithm->~btCollisionAlgorithm();
    dispatcher.freeCollisionAlgorithm(algorithm);
    return name;
}

TEST(CInterface, ChoosesTheAlgorithmOfTwoBoxes)
{
    const Library library;
    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    auto options = sized<cullet_isa_gjk_options>();
    const char* const classes[] = {"15BoxBoxAlgorithm", "15IsaGjkAlgorithm", "btBoxBoxCollisionAlgorithm"};
    for (const int choice : {0, 1, 2, 0})
    {
        options.box_box = choice;
        ASSERT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_OK);
        EXPECT_NE(algorithmOfBoxes(dispatcher).find(classes[choice]), std::string::npos)
            << choice << ": " << algorithmOfBoxes(dispatcher);
    }
}
}  // namespace
}  // namespace cullet::test
