// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/mesh_algorithm.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <gtest/gtest.h>

// Manifolds, algorithms and what they are called with.
namespace cullet::test
{
namespace
{
btCollisionObjectWrapper wrapOf(const btCollisionObject& object)
{
    return {nullptr, object.getCollisionShape(), &object, object.getWorldTransform(), -1, -1};
}

btManifoldArray manifoldsOf(btCollisionAlgorithm& algorithm)
{
    btManifoldArray manifolds;
    algorithm.getAllContactManifolds(manifolds);
    return manifolds;
}

/// A box beside two triangles in the plane y = 0, without margins.
struct MeshOwnership : testing::Test
{
    MeshOwnership()
    {
        soup.corners = {vec(-3, 0, -3), vec(3, 0, -3), vec(-3, 0, 3),
                        vec(3, 0, -3),  vec(3, 0, 3),  vec(-3, 0, 3)};
        body.setCollisionShape(&box);
        mesh.setCollisionShape(&soup);
    }

    /// Makes the algorithm of the pair, calls call(algorithm) and frees it.
    template <class Call>
    void withAlgorithm(bool isMeshFirst, btPersistentManifold* shared, const Call& call)
    {
        const btCollisionObjectWrapper wrapBody = wrapOf(body), wrapMesh = wrapOf(mesh);
        btCollisionAlgorithm* const algorithm =
            isMeshFirst ? dispatcher.findAlgorithm(&wrapMesh, &wrapBody, shared, BT_CONTACT_POINT_ALGORITHMS)
                        : dispatcher.findAlgorithm(&wrapBody, &wrapMesh, shared, BT_CONTACT_POINT_ALGORITHMS);
        ASSERT_TRUE(isExactly<MeshAlgorithm>(*algorithm));
        call(*algorithm);
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    IsaGjkRegistration& isaGjk = registerIsaGjk(dispatcher);
    TriangleSoup soup;
    btBoxShape box{vec(0.5, 0.5, 0.5)};
    btCollisionObject body, mesh;
    const btTransform ground = btTransform::getIdentity();

    static btTransform at(double height)
    {
        return btTransform(btQuaternion::getIdentity(), vec(0, height, 0));
    }
};

TEST_F(MeshOwnership, HasOneManifoldOfTheAlgorithmInBothOrders)
{
    for (const bool isMeshFirst : {false, true})
    {
        withAlgorithm(isMeshFirst, nullptr,
                      [&](btCollisionAlgorithm& algorithm)
                      {
                          ASSERT_EQ(dispatcher.getNumManifolds(), 1);
                          const btManifoldArray named = manifoldsOf(algorithm);
                          ASSERT_EQ(named.size(), 1);
                          EXPECT_EQ(named[0], dispatcher.getManifoldByIndexInternal(0));
                          EXPECT_EQ(named[0]->getBody0(), &body);
                          EXPECT_EQ(named[0]->getBody1(), &mesh);
                          EXPECT_EQ(named[0]->getNumContacts(), 0);
                      });
        EXPECT_EQ(dispatcher.getNumManifolds(), 0) << "released with the algorithm";
    }
}

/// Its queries are shown every triangle, by Bullet's loop: the table for closest points keeps that.
TEST_F(MeshOwnership, LeavesTableForClosestPointsToBullet)
{
    const btCollisionObjectWrapper wrapBody = wrapOf(body), wrapMesh = wrapOf(mesh);
    for (const bool isMeshFirst : {false, true})
    {
        btCollisionAlgorithm* const algorithm =
            dispatcher.findAlgorithm(isMeshFirst ? &wrapMesh : &wrapBody, isMeshFirst ? &wrapBody : &wrapMesh,
                                     nullptr, BT_CLOSEST_POINT_ALGORITHMS);
        EXPECT_TRUE(isExactly<btConvexConcaveCollisionAlgorithm>(*algorithm));
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
}

TEST_F(MeshOwnership, IgnoresManifoldThatItIsGiven)
{
    btPersistentManifold* const shared = dispatcher.getNewManifold(&body, &mesh);
    withAlgorithm(false, shared,
                  [&](btCollisionAlgorithm& algorithm)
                  {
                      ASSERT_EQ(manifoldsOf(algorithm).size(), 1);
                      EXPECT_NE(manifoldsOf(algorithm)[0], shared);
                      body.setWorldTransform(at(0.49));
                      const btCollisionObjectWrapper wrapBody = wrapOf(body), wrapMesh = wrapOf(mesh);
                      btManifoldResult result(&wrapBody, &wrapMesh);
                      algorithm.processCollision(&wrapBody, &wrapMesh, btDispatcherInfo(), &result);
                      EXPECT_EQ(manifoldsOf(algorithm)[0]->getNumContacts(), 4);
                  });
    EXPECT_EQ(shared->getNumContacts(), 0);
    ASSERT_EQ(dispatcher.getNumManifolds(), 1);
    dispatcher.releaseManifold(shared);
}

/// A compound calls with its own object; Bullet's algorithm names it anew in every call.
TEST_F(MeshOwnership, NamesManifoldAndBodiesInEveryCall)
{
    btPersistentManifold* const foreign = dispatcher.getNewManifold(&body, &mesh);
    for (const bool isMeshFirst : {false, true})
    {
        withAlgorithm(isMeshFirst, nullptr,
                      [&](btCollisionAlgorithm& algorithm)
                      {
                          btPersistentManifold* const own = manifoldsOf(algorithm)[0];
                          for (const double height : {0.49, 5.0})
                          {
                              btCollisionObject otherBody, otherMesh;
                              otherBody.setCollisionShape(&box);
                              otherMesh.setCollisionShape(&soup);
                              otherBody.setWorldTransform(at(height));
                              const btCollisionObjectWrapper wrapBody = wrapOf(otherBody),
                                                             wrapMesh = wrapOf(otherMesh);
                              const btCollisionObjectWrapper &first = isMeshFirst ? wrapMesh : wrapBody,
                                                             &second = isMeshFirst ? wrapBody : wrapMesh;
                              btManifoldResult result(&first, &second);
                              result.setPersistentManifold(foreign);
                              algorithm.processCollision(&first, &second, btDispatcherInfo(), &result);
                              EXPECT_EQ(result.getPersistentManifold(), own);
                              EXPECT_EQ(own->getBody0(), &otherBody);
                              EXPECT_EQ(own->getBody1(), &otherMesh);
                              EXPECT_EQ(result.getBody0Wrap(), &first) << "restored";
                              EXPECT_EQ(result.getBody1Wrap(), &second) << "restored";
                          }
                      });
    }
    EXPECT_EQ(foreign->getNumContacts(), 0);
    dispatcher.releaseManifold(foreign);
}

TEST_F(MeshOwnership, RefreshesOnceACallAlsoWithoutTriangles)
{
    MeshBench ours(Loop::Ours, box, soup);
    ASSERT_EQ(ours.step(at(0.499), ground).getNumContacts(), 4);
    // No triangle is in the box any more; the points live on up to the breaking threshold.
    for (int life = 2; life <= 4; ++life)
    {
        const btPersistentManifold& manifold = ours.step(at(0.505), ground);
        ASSERT_EQ(manifold.getNumContacts(), 4);
        for (int i = 0; i < 4; ++i)
        {
            EXPECT_EQ(manifold.getContactPoint(i).getLifeTime(), life);
            EXPECT_NEAR(double(manifold.getContactPoint(i).getDistance()), 0.005, 1e-5);
        }
    }
    EXPECT_EQ(ours.isaGjk().stats().trianglesTotal, 2u) << "of the first step";
    EXPECT_EQ(ours.step(at(0.6), ground).getNumContacts(), 0);
}

TEST_F(MeshOwnership, DoesNothingWhileShapesAreNoConvexOnConcaveOne)
{
    btCompoundShape compound;
    MeshBench ours(Loop::Ours, box, soup);
    ASSERT_EQ(ours.step(at(0.49), ground).getNumContacts(), 4);
    const auto expectUntouched = [&]
    {
        const btPersistentManifold& manifold = ours.step(at(0.49), ground);
        EXPECT_EQ(manifold.getNumContacts(), 4);
        EXPECT_EQ(manifold.getContactPoint(0).getLifeTime(), 1) << "not refreshed, as in Bullet";
    };
    ours.convex().setCollisionShape(&compound);
    expectUntouched();
    ours.convex().setCollisionShape(&soup);
    expectUntouched();
    ours.convex().setCollisionShape(&box);
    ours.mesh().setCollisionShape(&box);
    expectUntouched();
    ours.mesh().setCollisionShape(&soup);
    EXPECT_EQ(ours.step(at(0.49), ground).getContactPoint(0).getLifeTime(), 2);
}

/// Bullet's extension keeps its rows of the tables.
TEST_F(MeshOwnership, LeavesShapesOfGImpactToBulletWheneverItIsRegistered)
{
    btTriangleMesh triangles;
    triangles.addTriangle(vec(-1, 0, -1), vec(1, 0, -1), vec(0, 0, 1));
    btGImpactMeshShape gimpact(&triangles);
    gimpact.updateBound();
    btBvhTriangleMeshShape bvh(&triangles, true);
    btCollisionObject other;
    other.setCollisionShape(&gimpact);
    for (const bool isFirst : {false, true})
    {
        btDefaultCollisionConfiguration ownConfiguration;
        btCollisionDispatcher ownDispatcher(&ownConfiguration);
        if (isFirst)
            btGImpactCollisionAlgorithm::registerAlgorithm(&ownDispatcher);
        registerIsaGjk(ownDispatcher);
        if (!isFirst)
            btGImpactCollisionAlgorithm::registerAlgorithm(&ownDispatcher);
        for (btCollisionShape* const shape :
             {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(&bvh),
              static_cast<btCollisionShape*>(&gimpact)})
        {
            body.setCollisionShape(shape);
            const btCollisionObjectWrapper wrapBody = wrapOf(body), wrapOther = wrapOf(other);
            for (const bool isSwapped : {false, true})
            {
                btCollisionAlgorithm* const algorithm = ownDispatcher.findAlgorithm(
                    isSwapped ? &wrapOther : &wrapBody, isSwapped ? &wrapBody : &wrapOther, nullptr,
                    BT_CONTACT_POINT_ALGORITHMS);
                EXPECT_TRUE(isExactly<btGImpactCollisionAlgorithm>(*algorithm));
                algorithm->~btCollisionAlgorithm();
                ownDispatcher.freeCollisionAlgorithm(algorithm);
            }
        }
    }
    body.setCollisionShape(&box);
}

TEST_F(MeshOwnership, SweepsSphereOfFastBodyAsBullet)
{
    MeshBench ours(Loop::Ours, box, soup), bullet(Loop::Ours, box, soup, false, bulletsLoop());
    const auto fractionOf = [&](MeshBench& bench, double motion)
    {
        btCollisionObject& convex = bench.convex();
        convex.setWorldTransform(at(2));
        convex.setInterpolationWorldTransform(at(2 - motion));
        convex.setCcdSweptSphereRadius(btScalar(0.2));
        convex.setCcdMotionThreshold(btScalar(0.5));
        convex.setHitFraction(1);
        btManifoldResult result;
        const btScalar fraction =
            bench.algorithm().calculateTimeOfImpact(&convex, &bench.mesh(), btDispatcherInfo(), &result);
        EXPECT_EQ(convex.getHitFraction(), fraction);
        return fraction;
    };
    for (const double motion : {0.4, 1.0, 3.0, 6.0})
        EXPECT_EQ(fractionOf(ours, motion), fractionOf(bullet, motion)) << motion;
    EXPECT_EQ(fractionOf(ours, 0.4), btScalar(1)) << "below the threshold";
    EXPECT_NEAR(double(fractionOf(ours, 3)), 0.6, 0.02);
}

TEST_F(MeshOwnership, LeavesSeparatingAxesToBulletWhereTheyAreEnabled)
{
    box.initializePolyhedralFeatures();
    MeshBench ours(Loop::Ours, box, soup), bullet(Loop::Ours, box, soup, false, bulletsLoop());
    const btTransform tilted(btQuaternion(vec(1, 0, 0), btScalar(0.1)), vec(0.2, 0.5, 0.1));
    ours.info().m_enableSatConvex = bullet.info().m_enableSatConvex = true;
    const btPersistentManifold& found = ours.step(tilted, ground);
    EXPECT_TRUE(arePointsEqual(found, bullet.step(tilted, ground)));
    EXPECT_GT(found.getNumContacts(), 0);
    EXPECT_EQ(ours.isaGjk().stats().trianglesTotal, 0u) << "left to Bullet's loop";
    ours.info().m_enableSatConvex = false;
    ours.step(tilted, ground);
    EXPECT_GT(ours.isaGjk().stats().trianglesTotal, 0u);
}
}  // namespace
}  // namespace cullet::test
