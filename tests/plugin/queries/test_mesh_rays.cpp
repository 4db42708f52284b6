// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/prepared_mesh.h"
#include "cullet/plugin/world.h"
#include "cullet/plugin/world_queries.h"
#include "cullet/tests/plugin/queries/query_mesh.h"

#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

namespace cullet::test
{
namespace
{
/// Part, triangle, fraction and normal.
using Hit = std::tuple<int, int, btScalar, btScalar, btScalar, btScalar>;
using Hits = std::vector<Hit>;

Hit hitOf(int part, int triangle, btScalar fraction, const btVector3& normal)
{
    return {part, triangle, fraction, normal.x(), normal.y(), normal.z()};
}

/// Records what it is called with. It asks for all hits, or for closer and closer ones.
struct Recorder : btCollisionWorld::RayResultCallback
{
    Recorder(bool wantsCloser, unsigned flags) : isCloser(wantsCloser) { m_flags = flags; }

    btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool isNormalInWorld) override
    {
        EXPECT_TRUE(isNormalInWorld);
        const btCollisionWorld::LocalShapeInfo& info = *result.m_localShapeInfo;
        hits.push_back(
            hitOf(info.m_shapePart, info.m_triangleIndex, result.m_hitFraction, result.m_hitNormalLocal));
        m_collisionObject = result.m_collisionObject;
        if (isCloser)
            m_closestHitFraction = result.m_hitFraction;
        return m_closestHitFraction;
    }

    bool isCloser;
    Hits hits;
};

/// Bullet's test of every triangle, in the order of Bullet's tree.
struct PlainLoop : btTriangleRaycastCallback
{
    PlainLoop(QueryWorld& world, const btVector3& from, const btVector3& to, bool wantsCloser, unsigned flags)
        : btTriangleRaycastCallback(from, to, flags), isCloser(wantsCloser), scene(world)
    {
        const btTransform toMesh = world.object.getWorldTransform().inverse();
        const btVector3 scaling = world.object.getCollisionShape()->getLocalScaling();
        const bool isScaled = world.object.getCollisionShape() != &world.shape;
        m_from = isScaled ? (toMesh * from) / scaling : toMesh * from;
        m_to = isScaled ? (toMesh * to) / scaling : toMesh * to;
        const btScalar far = btScalar(1e10);
        world.shape.processAllTriangles(this, btVector3(-far, -far, -far), btVector3(far, far, far));
    }

    btScalar reportHit(const btVector3& normal, btScalar fraction, int part, int index) override
    {
        hits.push_back(hitOf(part, index, fraction, scene.object.getWorldTransform().getBasis() * normal));
        return isCloser ? fraction : m_hitFraction;
    }

    bool isCloser;
    QueryWorld& scene;
    Hits hits;
};

struct TestedRay
{
    btVector3 from, to;
};

/// Through the mesh from all sides, some along an axis, and some through a vertex or an edge.
TestedRay randomRay(Random& random, const QueryWorld& world)
{
    const btTransform& pose = world.object.getWorldTransform();
    const btVector3& scaling = world.object.getCollisionShape()->getLocalScaling();
    btVector3 target = randomVector(random, 9.0f);
    if (random.chance(0.3f))
    {
        const MeshData& data = world.data();
        const std::uint32_t corner = random.below(static_cast<std::uint32_t>(data.indices.size() / 3)) * 3;
        const auto vertex = [&](std::uint32_t i)
        {
            const btScalar* at = data.vertices.data() + 3 * data.indices[corner + i];
            return btVector3(at[0], at[1], at[2]);
        };
        const btScalar share = random.chance(0.5f) ? btScalar(0) : btScalar(random.unit());
        target = vertex(0) * (1 - share) + vertex(1) * share;
    }
    btVector3 from = randomVector(random, 20.0f);
    if (random.chance(0.3f))
        from = target + btVector3(0, 10, 0);
    const btVector3 to = target + (target - from) * btScalar(random.unit());
    return {pose * (from * scaling), pose * (to * scaling)};
}

class MeshRays : public testing::TestWithParam<MeshCase>
{
protected:
    static constexpr std::uint32_t kSeed = 4161;
    static constexpr int kRays = 2000;

    MeshRays()
        : random(kSeed),
          scene(makeMeshData(GetParam().kind, kSeed), GetParam().isQuantized, GetParam().scaling),
          prepared(prepare(scene.shape))
    {
    }

    void SetUp() override
    {
        ASSERT_TRUE(prepared.isPrepared());
        scene.place(btTransform::getIdentity());
    }

    /// Some rays with the mesh at the origin, so that some are along its axes, and some in any pose.
    void placeFor(int ray)
    {
        if (ray % 500 == 250)
            scene.place(randomPose(random, 30.0f));
        else if (ray % 500 == 0)
            scene.place(btTransform::getIdentity());
    }

    Random random;
    QueryWorld scene;
    PreparedMesh prepared;
};

TEST_P(MeshRays, ReportHitsOfPlainLoopInOrderOfBullet)
{
    constexpr unsigned kFlags[] = {btTriangleRaycastCallback::kF_None,
                                   btTriangleRaycastCallback::kF_FilterBackfaces,
                                   btTriangleRaycastCallback::kF_KeepUnflippedNormal};
    int rays = 0, missedByBullet = 0;
    for (int i = 0; i < kRays; ++i)
    {
        placeFor(i);
        const TestedRay ray = randomRay(random, scene);
        const bool isCloser = i % 2 == 0;
        const unsigned flags = kFlags[i % 3];
        Recorder ours(isCloser, flags), bullets(isCloser, flags);
        rayTest(scene.world, ray.from, ray.to, ours);
        scene.world.rayTest(ray.from, ray.to, bullets);
        const PlainLoop plain(scene, ray.from, ray.to, isCloser, flags);
        rays += plain.hits.empty() ? 0 : 1;
        ASSERT_EQ(ours.hits, plain.hits) << "seed " << kSeed << ", ray " << i;
        missedByBullet += bullets.hits != ours.hits ? 1 : 0;
        if (!isCloser)
        {
            for (const Hit& hit : bullets.hits)
                ASSERT_NE(std::find(ours.hits.begin(), ours.hits.end(), hit), ours.hits.end());
        }
    }
    RecordProperty("raysWithHitsThatBulletMisses", missedByBullet);
    EXPECT_GT(rays, kRays / 10);
}

TEST_P(MeshRays, FindClosestHitOfPlainLoop)
{
    int hits = 0;
    for (int i = 0; i < kRays; ++i)
    {
        placeFor(i);
        const TestedRay ray = randomRay(random, scene);
        btCollisionWorld::ClosestRayResultCallback ours(ray.from, ray.to);
        if (i % 7 == 0)
            ours.m_closestHitFraction = btScalar(random.unit());
        const btScalar limit = ours.m_closestHitFraction;
        rayTest(scene.world, ray.from, ray.to, ours);
        const PlainLoop plain(scene, ray.from, ray.to, true, 0);
        const bool isHit = !plain.hits.empty() && std::get<2>(plain.hits.back()) < limit;
        ASSERT_EQ(ours.hasHit(), isHit) << "seed " << kSeed << ", ray " << i;
        if (!isHit)
            continue;
        ++hits;
        const btVector3& normal = ours.m_hitNormalWorld;
        ASSERT_EQ(hitOf(0, std::get<1>(plain.hits.back()), ours.m_closestHitFraction, normal),
                  plain.hits.back());
        ASSERT_EQ(ours.m_collisionObject, &scene.object);
    }
    EXPECT_GT(hits, kRays / 10);
}

TEST_P(MeshRays, FindSameHitsInBatchesOnAnyNumberOfThreads)
{
    std::vector<Ray> rays;
    for (int i = 0; i < kRays; ++i)
    {
        const TestedRay ray = randomRay(random, scene);
        rays.push_back({ray.from, ray.to});
    }
    for (const int threads : {1, 3})
    {
        std::vector<RayHit> hits(rays.size());
        RayBatchOptions options;
        options.threads = threads;
        rayTestBatch(scene.world, rays.data(), rays.size(), hits.data(), options);
        for (std::size_t i = 0; i < rays.size(); ++i)
        {
            const PlainLoop plain(scene, rays[i].from, rays[i].to, true, 0);
            ASSERT_EQ(hits[i].object != nullptr, !plain.hits.empty());
            const Hit none = hitOf(0, 0, btScalar(1), btVector3(0, 0, 0));
            const RayHit& hit = hits[i];
            ASSERT_EQ(hit.object == nullptr ? hitOf(0, 0, hit.fraction, btVector3(0, 0, 0))
                                            : hitOf(hit.part, hit.triangle, hit.fraction, hit.normal),
                      plain.hits.empty() ? none : plain.hits.back());
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, MeshRays, testing::ValuesIn(meshCases()),
                         [](const auto& tested) { return tested.param.name(); });

/// Objects of several shapes, in a world of any class.
template <class World>
Hits hitsOfWorld(bool isPrepared)
{
    Random random(4162);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    World world(&dispatcher, &broadphase, &solver, &configuration);
    const MeshData data = makeMeshData("terrain", 4163);
    btTriangleIndexVertexArray interface(data.triangleCount(), const_cast<int*>(data.indices.data()),
                                         3 * sizeof(int), static_cast<int>(data.vertices.size() / 3),
                                         const_cast<btScalar*>(data.vertices.data()), 3 * sizeof(btScalar));
    btBvhTriangleMeshShape mesh(&interface, true);
    const PreparedMesh prepared = isPrepared ? prepare(mesh) : PreparedMesh();
    btBoxShape box(btVector3(1, 1, 1));
    btSphereShape sphere(1);
    btCompoundShape compound;
    compound.addChildShape(btTransform::getIdentity(), &box);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(0, 3, 0)), &sphere);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(0, 6, 0)), &mesh);
    btCollisionShape* const shapes[] = {&mesh, &box, &sphere, &compound};
    std::vector<std::unique_ptr<btCollisionObject>> objects;
    for (int i = 0; i < 40; ++i)
    {
        objects.push_back(std::make_unique<btCollisionObject>());
        objects.back()->setCollisionShape(shapes[i % 4]);
        objects.back()->setWorldTransform(randomPose(random, 15.0f));
        const int mask = i % 5 == 0 ? 0 : -1;
        world.addCollisionObject(objects.back().get(), 1, mask);
    }
    Hits hits;
    for (int i = 0; i < 1000; ++i)
    {
        const btVector3 from = randomVector(random, 25.0f);
        const btVector3 to = randomVector(random, 25.0f);
        struct AnyShape : Recorder
        {
            using Recorder::Recorder;
            btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool isWorld) override
            {
                btCollisionWorld::LocalShapeInfo none = {-7, -7};
                if (result.m_localShapeInfo == nullptr)
                    result.m_localShapeInfo = &none;
                return Recorder::addSingleResult(result, isWorld);
            }
        } recorded(i % 2 == 0, 0);
        world.rayTest(from, to, recorded);
        hits.insert(hits.end(), recorded.hits.begin(), recorded.hits.end());
    }
    for (const auto& object : objects)
        world.removeCollisionObject(object.get());
    return hits;
}

TEST(WorldRays, AreThoseOfBulletWithAndWithoutPreparedMeshes)
{
    const Hits expected = hitsOfWorld<btDiscreteDynamicsWorld>(false);
    EXPECT_GT(expected.size(), 1000u);
    EXPECT_EQ(hitsOfWorld<World<btDiscreteDynamicsWorld>>(false), expected);
    EXPECT_EQ(hitsOfWorld<World<btDiscreteDynamicsWorld>>(true), expected);
}
}  // namespace
}  // namespace cullet::test
