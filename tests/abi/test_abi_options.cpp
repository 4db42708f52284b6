// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The solver and the options of contacts from an opened library, compared with the linked C++ library bit by bit.
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/solver.h"
#include "cullet/tests/abi/opened_library.h"
#include "cullet/tests/plugin/falling_heap.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <typeinfo>
#include <utility>

namespace cullet::test
{
namespace
{
std::uint64_t dropHeapWith(btConstraintSolver& solver)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(vec(0, -10, 0));
    // So few contacts that Bullet's world gives them all to the solver at once.
    Heap heap(world, true);
    btBoxShape box(vec(0.4, 0.4, 0.4));
    for (int i = 0; i < 6; ++i)
        heap.add(&box, 1, vec(0.3 * i - 1, 6 + i, 0.1 * i));
    heap.step(60);
    return heap.hash();
}

struct SolverCase
{
    const char* name;
    std::function<void(cullet_solver_options&)> request;
    SolverOptions linked;
};

std::vector<SolverCase> solverCases()
{
    const auto soft = [](auto&& change)
    {
        SolverOptions options;
        options.model = SolverModel::Soft;
        change(options);
        return options;
    };
    return {
        {"default", [](auto&) {}, {}},
        {"soft", [](auto& o) { o.model = CULLET_SOLVER_SOFT; }, soft([](auto&) {})},
        {"substeps", [](auto& o) { o.model = CULLET_SOLVER_SOFT, o.substeps = 2; },
         soft([](auto& o) { o.substeps = 2; })},
        {"frequency", [](auto& o) { o.model = CULLET_SOLVER_SOFT, o.contact_frequency = 12; },
         soft([](auto& o) { o.contactFrequency = 12; })},
        {"damping", [](auto& o) { o.model = CULLET_SOLVER_SOFT, o.contact_damping = 2; },
         soft([](auto& o) { o.contactDamping = 2; })},
        {"push speed", [](auto& o) { o.model = CULLET_SOLVER_SOFT, o.push_speed = 0.25; },
         soft([](auto& o) { o.pushSpeed = btScalar(0.25); })},
    };
}

TEST(CInterface, SolvesAsTheLinkedSolverWithTheSameOptions)
{
    const Library library;
    std::set<std::uint64_t> hashes;
    for (const SolverCase& one : solverCases())
    {
        auto options = sized<cullet_solver_options>();
        one.request(options);
        options.threads = 1;
        cullet_solver* handle = nullptr;
        ASSERT_EQ(LOADED(library, cullet_solver_create)(sizeof(btScalar), &options, &handle), CULLET_OK);
        auto& opened = *static_cast<btConstraintSolver*>(LOADED(library, cullet_solver_interface)(handle));
        Solver linked(one.linked);
        const std::uint64_t hash = dropHeapWith(opened);
        EXPECT_EQ(hash, dropHeapWith(linked)) << one.name;
        EXPECT_TRUE(hashes.insert(hash).second) << one.name << " changes nothing";
        EXPECT_NE(dynamic_cast<btSequentialImpulseConstraintSolver*>(&opened), nullptr);

        auto stats = sized<cullet_solver_stats>();
        ASSERT_EQ(LOADED(library, cullet_solver_get_stats)(handle, &stats), CULLET_OK);
        EXPECT_EQ(stats.groups, linked.stats().groups);
        EXPECT_EQ(stats.contacts, linked.stats().contacts);
        EXPECT_GT(stats.contacts, 5u);
        EXPECT_EQ(stats.refusal, CULLET_REFUSAL_NONE);
        LOADED(library, cullet_solver_destroy)(handle);
    }
}

TEST(CInterface, CountsTheGroupsThatTheSolverLeavesToBullet)
{
    const Library library;
    cullet_solver* handle = nullptr;
    ASSERT_EQ(LOADED(library, cullet_solver_create)(sizeof(btScalar), nullptr, &handle), CULLET_OK);
    auto& solver = *static_cast<btConstraintSolver*>(LOADED(library, cullet_solver_interface)(handle));
    btContactSolverInfo info;
    info.m_solverMode |= SOLVER_RANDMIZE_ORDER;
    solver.solveGroup(nullptr, 0, nullptr, 0, nullptr, 0, info, nullptr, nullptr);
    auto stats = sized<cullet_solver_stats>();
    ASSERT_EQ(LOADED(library, cullet_solver_get_stats)(handle, &stats), CULLET_OK);
    EXPECT_EQ(stats.groups, 1u);
    EXPECT_EQ(stats.refused_groups, 1u);
    EXPECT_EQ(stats.refusal, CULLET_REFUSAL_RANDOM_ORDER);
    LOADED(library, cullet_solver_destroy)(handle);
}

TEST(CInterface, ReturnsErrorForWrongCallsOfSolver)
{
    const Library library;
    const auto create = LOADED(library, cullet_solver_create);
    const auto getStats = LOADED(library, cullet_solver_get_stats);
    cullet_solver* handle = nullptr;
    const auto statusOf = [&](const std::function<void(cullet_solver_options&)>& change)
    {
        auto options = sized<cullet_solver_options>();
        change(options);
        return create(sizeof(btScalar), &options, &handle);
    };
    EXPECT_EQ(statusOf([](auto& o) { --o.size; }), CULLET_ERROR_SIZE);
    for (const int wrong : {-1, 2})
        EXPECT_EQ(statusOf([&](auto& o) { o.model = wrong; }), CULLET_ERROR_ARGUMENT) << wrong;
    for (const int wrong : {-1, 65})
        EXPECT_EQ(statusOf([&](auto& o) { o.substeps = wrong; }), CULLET_ERROR_ARGUMENT) << wrong;
    EXPECT_EQ(statusOf([](auto& o) { o.threads = -1; }), CULLET_ERROR_ARGUMENT);
    const double tooLarge =
        sizeof(btScalar) == sizeof(float) ? 1e39 : std::numeric_limits<double>::infinity();
    const double tooSmall = sizeof(btScalar) == sizeof(float) ? 1e-60 : -1e-300;
    for (const double wrong : {-1.0, std::numeric_limits<double>::quiet_NaN(), tooLarge, tooSmall})
    {
        EXPECT_EQ(statusOf([&](auto& o) { o.contact_frequency = wrong; }), CULLET_ERROR_ARGUMENT) << wrong;
        EXPECT_EQ(statusOf([&](auto& o) { o.contact_damping = wrong; }), CULLET_ERROR_ARGUMENT) << wrong;
        EXPECT_EQ(statusOf([&](auto& o) { o.push_speed = wrong; }), CULLET_ERROR_ARGUMENT) << wrong;
    }
    EXPECT_EQ(create(12 - sizeof(btScalar), nullptr, &handle), CULLET_ERROR_PRECISION);
    EXPECT_EQ(create(3, nullptr, &handle), CULLET_ERROR_ARGUMENT);
    EXPECT_EQ(create(sizeof(btScalar), nullptr, nullptr), CULLET_ERROR_NULL);
    EXPECT_EQ(handle, nullptr);

    cullet_solver_stats stats = {};
    EXPECT_EQ(getStats(nullptr, &stats), CULLET_ERROR_NULL);
    ASSERT_EQ(create(sizeof(btScalar), nullptr, &handle), CULLET_OK);
    EXPECT_EQ(getStats(handle, &stats), CULLET_ERROR_SIZE);
    EXPECT_EQ(getStats(handle, nullptr), CULLET_ERROR_NULL);
    EXPECT_EQ(LOADED(library, cullet_solver_interface)(nullptr), nullptr);
    LOADED(library, cullet_solver_destroy)(handle);
    LOADED(library, cullet_solver_destroy)(nullptr);
}

/// Boxes that fall onto a flat mesh of triangles and slide over it.
std::uint64_t slideOverMesh(const std::function<void(btCollisionDispatcher&)>& enlist)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    enlist(dispatcher);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(vec(0, -10, 0));
    btTriangleMesh triangles;
    for (int i = 0; i < 400; ++i)
    {
        const btVector3 corner = vec(i % 20 - 8, 1, i / 20 - 8);
        triangles.addTriangle(corner, corner + vec(0, 0, 1), corner + vec(1, 0, 0));
        triangles.addTriangle(corner + vec(1, 0, 1), corner + vec(1, 0, 0), corner + vec(0, 0, 1));
    }
    btBvhTriangleMeshShape mesh(&triangles, true);
    Heap heap(world, true);
    heap.add(&mesh, 0, vec(0, 0, 0));
    btBoxShape box(vec(0.4, 0.3, 0.4));
    for (int i = 0; i < 8; ++i)
    {
        heap.add(&box, 1, vec(1.5 + i % 3, 1.5 + 0.1 * i, 1.5 + i / 3));
        heap.bodies.back()->setLinearVelocity(vec(2 + 0.1 * i, 0, 1));
    }
    heap.step(60);
    return heap.hash();
}

TEST(CInterface, MakesContactsOfMeshesAsLinkedWithTheSameOptions)
{
    const struct
    {
        const char* name;
        int stockMeshes, activeEdges, patchPoints;
    } cases[] = {{"default", 0, 0, 0}, {"stock", 1, 0, 0}, {"edges", 0, 1, 0}, {"points", 0, 0, 1}};
    const Library library;
    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    std::set<std::uint64_t> hashes;
    for (const auto& one : cases)
    {
        auto options = sized<cullet_isa_gjk_options>();
        options.stock_meshes = one.stockMeshes;
        options.active_edges = one.activeEdges;
        options.patch_points = one.patchPoints;
        IsaGjkOptions linked;
        linked.meshes = one.stockMeshes == 0;
        linked.activeEdges = one.activeEdges != 0;
        linked.patchPoints = one.patchPoints == 0 ? 4 : one.patchPoints;
        const std::uint64_t hash = slideOverMesh(
            [&](auto& dispatcher)
            { EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_OK); });
        EXPECT_EQ(hash, slideOverMesh([&](auto& dispatcher) { registerIsaGjk(dispatcher, linked); }))
            << one.name;
        EXPECT_TRUE(hashes.insert(hash).second) << one.name << " changes nothing";
    }
}

TEST(CInterface, LeavesCompoundsToBulletsLoopWhenAsked)
{
    const Library library;
    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    for (const int isStock : {0, 1})
    {
        btDefaultCollisionConfiguration configuration;
        btCollisionDispatcher dispatcher(&configuration);
        auto options = sized<cullet_isa_gjk_options>();
        options.stock_compounds = isStock;
        ASSERT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_OK);
        btBoxShape box(vec(1, 1, 1));
        btCompoundShape compound;
        compound.addChildShape(btTransform::getIdentity(), &box);
        btCollisionObject bodies[2];
        bodies[0].setCollisionShape(&compound);
        bodies[1].setCollisionShape(&box);
        const auto wrap = [](const btCollisionObject& body)
        {
            return btCollisionObjectWrapper(nullptr, body.getCollisionShape(), &body,
                                            body.getWorldTransform(), -1, -1);
        };
        const btCollisionObjectWrapper a = wrap(bodies[0]), b = wrap(bodies[1]);
        btCollisionAlgorithm* const algorithm =
            dispatcher.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        EXPECT_EQ(typeid(*algorithm) == typeid(btCompoundCollisionAlgorithm), isStock != 0);
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
}

TEST(CInterface, KeepsContactsAsLinkedWithTheSameOptions)
{
    const Library library;
    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    std::set<std::uint64_t> hashes;
    for (const double distance : {0.0, 0.002, 0.01})
    {
        for (const double angle : {0.0, 0.001})
        {
            if (distance == 0 && angle != 0)
                continue;
            auto options = sized<cullet_isa_gjk_options>();
            options.reuse_distance = distance;
            options.reuse_angle = angle;
            IsaGjkOptions linked;
            linked.reusePose.distance = btScalar(distance);
            if (angle != 0)
                linked.reusePose.angle = btScalar(angle);
            const std::uint64_t hash = slideOverMesh(
                [&](auto& dispatcher)
                { EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_OK); });
            EXPECT_EQ(hash, slideOverMesh([&](auto& dispatcher) { registerIsaGjk(dispatcher, linked); }));
            EXPECT_TRUE(hashes.insert(hash).second) << distance << ", " << angle << " changes nothing";
        }
    }
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    const double nan = std::nan("");
    for (const auto& wrong : {std::pair(-1.0, 0.0), std::pair(0.01, -0.1), std::pair(0.01, 1.5),
                              std::pair(nan, 0.0), std::pair(0.01, nan), std::pair(1e300, 0.0)})
    {
        auto options = sized<cullet_isa_gjk_options>();
        options.reuse_distance = wrong.first;
        options.reuse_angle = wrong.second;
        const bool isRange = sizeof(btScalar) == 8 && wrong.first == 1e300;
        EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr),
                  isRange ? CULLET_OK : CULLET_ERROR_ARGUMENT);
    }
}

TEST(CInterface, TakesOptionsOfContactsFromProgramsOfTheFirstVersion)
{
    const Library library;
    const auto enlist = LOADED(library, cullet_isa_gjk_register);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    auto options = sized<cullet_isa_gjk_options>();
    for (const int wrong : {-1, 5})
    {
        options.patch_points = wrong;
        EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_ERROR_ARGUMENT);
    }
    // A program of the first version has no such member: what follows the struct is not read.
    options.size = 12;
    EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_OK);
    options.size = 11;
    EXPECT_EQ(enlist(sizeof(btScalar), &dispatcher, &options, nullptr), CULLET_ERROR_SIZE);
}
}  // namespace
}  // namespace cullet::test
