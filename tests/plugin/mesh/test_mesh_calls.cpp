// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/mesh_algorithm.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <stdexcept>
#include <vector>

namespace cullet::test
{
namespace
{
struct AddedPoint
{
    int shapeType, part, index;
};
std::vector<AddedPoint> addedPoints;
bool throwsWhenAdded = false;

bool recordPoint(btManifoldPoint&, const btCollisionObjectWrapper* a, int partA, int indexA,
                 const btCollisionObjectWrapper* b, int partB, int indexB)
{
    if (throwsWhenAdded)
        throw std::runtime_error("from the application");
    const bool isMeshFirst = a->getCollisionShape()->getShapeType() == TRIANGLE_SHAPE_PROXYTYPE;
    addedPoints.push_back(isMeshFirst ? AddedPoint{a->getCollisionShape()->getShapeType(), partA, indexA}
                                      : AddedPoint{b->getCollisionShape()->getShapeType(), partB, indexB});
    return false;
}

/// A box on two triangles, the second of which has index 1.
struct MeshCalls : testing::Test
{
    MeshCalls()
    {
        soup.corners = {vec(-3, 0, -3), vec(3, 0, -3), vec(-3, 0, 3),
                        vec(3, 0, -3),  vec(3, 0, 3),  vec(-3, 0, 3)};
    }
    ~MeshCalls() override
    {
        gContactAddedCallback = nullptr;
        throwsWhenAdded = false;
        addedPoints.clear();
    }

    TriangleSoup soup;
    btBoxShape box{vec(0.5, 0.5, 0.5)};
    const btTransform pose{btQuaternion::getIdentity(), vec(0, 0.49, 0)};
    const btTransform ground = btTransform::getIdentity();
};

TEST_F(MeshCalls, ShowCallbacksTheTriangleInBothOrders)
{
    for (const bool isMeshFirst : {false, true})
    {
        MeshBench pair(Loop::Ours, box, soup, isMeshFirst);
        pair.mesh().setCollisionFlags(pair.mesh().getCollisionFlags() |
                                      btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        addedPoints.clear();
        gContactAddedCallback = recordPoint;
        const btPersistentManifold& manifold = pair.step(pose, ground);
        EXPECT_EQ(manifold.getBody0(), &pair.convex());
        EXPECT_EQ(manifold.getNumContacts(), 4);
        bool sawFirst = false, sawSecond = false;
        for (const AddedPoint& point : addedPoints)
        {
            EXPECT_EQ(point.shapeType, int(TRIANGLE_SHAPE_PROXYTYPE));
            EXPECT_EQ(point.part, 0);
            sawFirst = sawFirst || point.index == 0;
            sawSecond = sawSecond || point.index == 1;
        }
        EXPECT_TRUE(sawFirst && sawSecond);
    }
}

TEST_F(MeshCalls, PassOnWhatACallbackThrowsAndGoOn)
{
    MeshBench pair(Loop::Ours, box, soup);
    pair.mesh().setCollisionFlags(pair.mesh().getCollisionFlags() |
                                  btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    gContactAddedCallback = recordPoint;
    throwsWhenAdded = true;
    EXPECT_THROW(pair.step(pose, ground), std::runtime_error);
    throwsWhenAdded = false;
    EXPECT_EQ(pair.step(pose, ground).getNumContacts(), 4);
}

TEST_F(MeshCalls, MakeOneManifoldAndRefreshItOnceAStep)
{
    MeshBench pair(Loop::Ours, box, soup);
    EXPECT_EQ(pair.dispatcher().getNumManifolds(), 1);
    for (int i = 1; i <= 5; ++i)
    {
        const btPersistentManifold& manifold = pair.step(pose, ground);
        ASSERT_EQ(manifold.getNumContacts(), 4);
        EXPECT_EQ(manifold.getContactPoint(0).getLifeTime(), i);
    }
    EXPECT_EQ(pair.dispatcher().getNumManifolds(), 1);
    const btTransform away(btQuaternion::getIdentity(), vec(0, 5, 0));
    EXPECT_EQ(pair.step(away, ground).getNumContacts(), 0);
    EXPECT_EQ(pair.dispatcher().getNumManifolds(), 1);
}

TEST_F(MeshCalls, AreBulletsOwnWhenMeshesAreSwitchedOff)
{
    MeshBench ours(Loop::Ours, box, soup);
    EXPECT_TRUE(isExactly<MeshAlgorithm>(ours.algorithm()));
    IsaGjkOptions options;
    options.meshes = false;
    MeshBench bullets(Loop::Ours, box, soup, false, options);
    EXPECT_TRUE(isExactly<btConvexConcaveCollisionAlgorithm>(bullets.algorithm()));

    registerIsaGjk(ours.dispatcher(), options);
    const btCollisionObjectWrapper wrapA(nullptr, &box, &ours.convex(), pose, -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, &soup, &ours.mesh(), ground, -1, -1);
    btCollisionAlgorithm* const again =
        ours.dispatcher().findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    EXPECT_TRUE(isExactly<btConvexConcaveCollisionAlgorithm>(*again));
    again->~btCollisionAlgorithm();
    ours.dispatcher().freeCollisionAlgorithm(again);
}

/// Counts the algorithms that it makes for triangles.
struct CountingCreateFunc : btConvexConvexAlgorithm::CreateFunc
{
    explicit CountingCreateFunc(btConvexPenetrationDepthSolver* solver) : CreateFunc(solver) {}
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override
    {
        ++count;
        return CreateFunc::CreateCollisionAlgorithm(info, a, b);
    }
    int count = 0;
};

TEST_F(MeshCalls, UseTheAlgorithmForTrianglesThatTheApplicationRegisters)
{
    btGjkEpaPenetrationDepthSolver solver;
    CountingCreateFunc own(&solver);
    MeshBench pair(Loop::Ours, box, soup);
    pair.dispatcher().registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE, &own);
    EXPECT_GT(pair.step(pose, ground).getNumContacts(), 0);
    EXPECT_GT(own.count, 0);
}

/// Collects what a query reports.
struct Reports : btManifoldResult
{
    Reports(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b) : btManifoldResult(a, b) {}
    void addContactPoint(const btVector3&, const btVector3&, btScalar) override { ++count; }
    int count = 0;
};

TEST_F(MeshCalls, ReportEveryTriangleToQueries)
{
    MeshBench pair(Loop::Ours, box, soup);
    pair.step(pose, ground);
    const btCollisionObjectWrapper wrapA(nullptr, &box, &pair.convex(), pose, -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, &soup, &pair.mesh(), ground, -1, -1);
    Reports reports(&wrapA, &wrapB);
    btDispatcherInfo info;
    pair.algorithm().processCollision(&wrapA, &wrapB, info, &reports);
    EXPECT_GE(reports.count, 2);
}

/// Which triangles are reported.
struct TriangleReports : btManifoldResult
{
    TriangleReports(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b)
        : btManifoldResult(a, b)
    {
    }
    void setShapeIdentifiersB(int, int index) override { triangle = index; }
    void addContactPoint(const btVector3&, const btVector3&, btScalar) override
    {
        triangles.insert(triangle);
    }
    int triangle = -1;
    std::set<int> triangles;
};

/// Contacts are reduced to a few for the solver; a query is shown all of them.
TEST_F(MeshCalls, ReportEachOfManyTrianglesToQueries)
{
    TriangleSoup tiles;
    constexpr int kTiles = 6;
    for (int i = 0; i < kTiles * kTiles; ++i)
    {
        const btVector3 at = vec(0.2 * (i % kTiles) - 0.6, 0, 0.2 * (i / kTiles) - 0.6);
        const btVector3 x = vec(0.2, 0, 0), z = vec(0, 0, 0.2);
        for (const btVector3& corner : {at, at + x, at + z, at + x, at + x + z, at + z})
            tiles.corners.push_back(corner);
    }
    MeshBench pair(Loop::Ours, box, tiles);
    EXPECT_EQ(pair.step(pose, ground).getNumContacts(), 4);
    const btCollisionObjectWrapper wrapA(nullptr, &box, &pair.convex(), pose, -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, &tiles, &pair.mesh(), ground, -1, -1);
    TriangleReports reports(&wrapA, &wrapB);
    btDispatcherInfo info;
    pair.algorithm().processCollision(&wrapA, &wrapB, info, &reports);
    EXPECT_EQ(reports.triangles.size(), std::size_t(2 * kTiles * kTiles));
}
}  // namespace
}  // namespace cullet::test
