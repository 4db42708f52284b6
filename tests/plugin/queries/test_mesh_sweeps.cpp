// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/prepared_mesh.h"
#include "cullet/plugin/world_queries.h"
#include "cullet/tests/plugin/queries/query_mesh.h"

#include <gtest/gtest.h>

#include <tuple>

namespace cullet::test
{
namespace
{
/// Part, triangle, fraction, normal and point.
using SweptHit = std::tuple<int, int, btScalar, btScalar, btScalar, btScalar, btScalar, btScalar, btScalar>;
using SweptHits = std::vector<SweptHit>;

struct SweepRecorder : btCollisionWorld::ConvexResultCallback
{
    explicit SweepRecorder(bool wantsCloser) : isCloser(wantsCloser) {}

    btScalar addSingleResult(btCollisionWorld::LocalConvexResult& result, bool isNormalInWorld) override
    {
        EXPECT_TRUE(isNormalInWorld);
        const btVector3 &normal = result.m_hitNormalLocal, &point = result.m_hitPointLocal;
        const btCollisionWorld::LocalShapeInfo& info = *result.m_localShapeInfo;
        hits.emplace_back(info.m_shapePart, info.m_triangleIndex, result.m_hitFraction, normal.x(),
                          normal.y(), normal.z(), point.x(), point.y(), point.z());
        if (isCloser)
            m_closestHitFraction = result.m_hitFraction;
        return result.m_hitFraction;
    }

    bool isCloser;
    SweptHits hits;
};

class MeshSweeps : public testing::TestWithParam<MeshCase>
{
protected:
    static constexpr std::uint32_t kSeed = 4164;
    static constexpr int kSweeps = 400;

    MeshSweeps()
        : random(kSeed),
          scene(makeMeshData(GetParam().kind, kSeed), GetParam().isQuantized, GetParam().scaling),
          prepared(prepare(scene.shape)),
          box(btVector3(btScalar(0.4), btScalar(0.2), btScalar(0.3))),
          sphere(btScalar(0.4)),
          capsule(btScalar(0.3), btScalar(0.8))
    {
        for (int i = 0; i < 16; ++i)
            hull.addPoint(randomVector(random, 0.5f));
    }

    void SetUp() override { ASSERT_TRUE(prepared.isPrepared()); }

    /// A sweep through the mesh; of three, one turns and one slides along.
    void drawSweep(int i)
    {
        if (i % 40 == 20)
            scene.place(randomPose(random, 20.0f));
        else if (i % 40 == 0)
            scene.place(btTransform::getIdentity());
        const btTransform& pose = scene.object.getWorldTransform();
        const btVector3& scaling = scene.object.getCollisionShape()->getLocalScaling();
        const btVector3 target = randomVector(random, 9.0f) * scaling;
        const btVector3 start = randomVector(random, 12.0f) * scaling;
        btVector3 end = target + (target - start) * btScalar(random.unit());
        if (i % 3 == 1)
            end.setY(start.y());
        from = pose * btTransform(randomPose(random, 0.0f).getBasis(), start);
        to = btTransform(i % 3 == 2 ? randomPose(random, 0.0f).getBasis() : from.getBasis(), pose * end);
        const btConvexShape* const shapes[] = {&box, &sphere, &capsule, &hull};
        shape = shapes[random.below(4)];
        penetration = random.chance(0.2f) ? btScalar(0.05) : btScalar(0);
    }

    Random random;
    QueryWorld scene;
    PreparedMesh prepared;
    btBoxShape box;
    btSphereShape sphere;
    btCapsuleShape capsule;
    btConvexHullShape hull;
    const btConvexShape* shape = nullptr;
    btTransform from, to;
    btScalar penetration = 0;
};

TEST_P(MeshSweeps, ReportHitsOfBulletInItsOrder)
{
    int withHits = 0;
    for (int i = 0; i < kSweeps; ++i)
    {
        drawSweep(i);
        SweepRecorder ours(i % 2 == 0), bullets(i % 2 == 0);
        convexSweepTest(scene.world, *shape, from, to, ours, penetration);
        scene.world.convexSweepTest(shape, from, to, bullets, penetration);
        ASSERT_EQ(ours.hits, bullets.hits) << "seed " << kSeed << ", sweep " << i;
        withHits += bullets.hits.empty() ? 0 : 1;
    }
    EXPECT_GT(withHits, kSweeps / 5);
}

TEST_P(MeshSweeps, FindClosestHitOfBullet)
{
    int hits = 0;
    for (int i = 0; i < kSweeps; ++i)
    {
        drawSweep(i);
        btCollisionWorld::ClosestConvexResultCallback ours(from.getOrigin(), to.getOrigin());
        btCollisionWorld::ClosestConvexResultCallback bullets(from.getOrigin(), to.getOrigin());
        if (i % 7 == 0)
            ours.m_closestHitFraction = bullets.m_closestHitFraction = btScalar(random.unit());
        convexSweepTest(scene.world, *shape, from, to, ours, penetration);
        scene.world.convexSweepTest(shape, from, to, bullets, penetration);
        ASSERT_EQ(ours.m_hitCollisionObject, bullets.m_hitCollisionObject)
            << "seed " << kSeed << ", sweep " << i;
        ASSERT_EQ(ours.m_closestHitFraction, bullets.m_closestHitFraction)
            << "seed " << kSeed << ", sweep " << i;
        if (bullets.m_hitCollisionObject == nullptr)
            continue;
        ++hits;
        ASSERT_EQ(ours.m_hitNormalWorld, bullets.m_hitNormalWorld);
        ASSERT_EQ(ours.m_hitPointWorld, bullets.m_hitPointWorld);
    }
    EXPECT_GT(hits, kSweeps / 5);
}

INSTANTIATE_TEST_SUITE_P(All, MeshSweeps, testing::ValuesIn(meshCases()),
                         [](const auto& tested) { return tested.param.name(); });
}  // namespace
}  // namespace cullet::test
