// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/dispatcher/crowd_world.h"

#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace cullet::test
{
namespace
{
constexpr int kBarrierSteps = 60;

/// What an algorithm of the application does before it computes contacts.
using Act = std::function<void(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*)>;

/// An algorithm of the application for two boxes.
class OwnBoxes : public btBoxBoxCollisionAlgorithm
{
public:
    using btBoxBoxCollisionAlgorithm::btBoxBoxCollisionAlgorithm;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override
    {
        act(a, b);
        btBoxBoxCollisionAlgorithm::processCollision(a, b, info, result);
    }

    struct CreateFunc : btCollisionAlgorithmCreateFunc
    {
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override
        {
            void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(OwnBoxes));
            return new (memory) OwnBoxes(nullptr, info, a, b);
        }
    };
    inline static Act act;
};

/// A world of all shapes in which boxes have an algorithm of the application.
struct OwnBoxesWorld
{
    /// @param isUsed whether boxes have that algorithm
    explicit OwnBoxesWorld(int threads, Crowd crowd = Crowd::Mixed, bool isUsed = true)
        : world(makeCrowd(crowd, 8, onThreadCount(threads)))
    {
        if (isUsed)
            world->dispatcher().registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE,
                                                            &create);
    }
    ~OwnBoxesWorld() { OwnBoxes::act = nullptr; }

    std::uint64_t hashOfManifolds()
    {
        ManifoldLog log;
        log.add(world->dispatcher(), *world->world.getPairCache());
        return log.hash();
    }

    OwnBoxes::CreateFunc create;
    std::unique_ptr<CrowdWorld> world;
};

/// A height field of the application that throws.
class FaultyField : public btHeightfieldTerrainShape
{
public:
    explicit FaultyField(const float* heights)
        : btHeightfieldTerrainShape(2, 2, heights, btScalar(-1), btScalar(1), 1, false)
    {
        setLocalScaling(btVector3(20, 1, 20));
    }
    void processAllTriangles(btTriangleCallback* callback, const btVector3& from,
                             const btVector3& to) const override
    {
        if (++m_calls % 97 == 0)
            throw std::runtime_error("height");
        btHeightfieldTerrainShape::processAllTriangles(callback, from, to);
    }

private:
    mutable int m_calls = 0;
};

/// Two triangles of the application, which count calls on other threads than their own.
class OwnTriangles : public btTriangleMesh
{
public:
    OwnTriangles()
    {
        addTriangle(vec(-20, 0, -20), vec(-20, 0, 20), vec(20, 0, -20));
        addTriangle(vec(20, 0, -20), vec(-20, 0, 20), vec(20, 0, 20));
    }
    void getLockedReadOnlyVertexIndexBase(const unsigned char** vertices, int& vertexCount,
                                          PHY_ScalarType& type, int& stride, const unsigned char** indices,
                                          int& indexStride, int& triangles, PHY_ScalarType& indexType,
                                          int part) const override
    {
        ++calls;
        foreignCalls += std::this_thread::get_id() != m_maker;
        btTriangleMesh::getLockedReadOnlyVertexIndexBase(vertices, vertexCount, type, stride, indices,
                                                         indexStride, triangles, indexType, part);
    }
    mutable std::atomic<int> calls{0}, foreignCalls{0};

private:
    std::thread::id m_maker = std::this_thread::get_id();
};

std::vector<std::uint64_t> hashesWithFaults(CrowdWorld& world, int& faults)
{
    std::vector<std::uint64_t> hashes;
    for (int i = 0; i < kBarrierSteps; ++i)
    {
        try
        {
            world.step();
        }
        catch (const std::runtime_error&)
        {
            ++faults;
        }
        ManifoldLog log;
        log.add(world.dispatcher(), *world.world.getPairCache());
        hashes.push_back(log.hash());
    }
    return hashes;
}
}  // namespace

// A hash of all manifolds that such an algorithm sees tells which contacts have been computed before it.
TEST(ContactBarriers, LetUnknownAlgorithmSeeContactsOfEarlierPairsOnly)
{
    std::vector<std::uint64_t> seen[2];
    for (const int threads : {1, 4})
    {
        OwnBoxesWorld own(threads);
        std::vector<std::uint64_t>& list = seen[threads / 4];
        OwnBoxes::act = [&](auto*, auto*) { list.push_back(own.hashOfManifolds()); };
        own.world->run(kBarrierSteps);
        if (threads == 1)
            continue;
        // In the first step there is no job to wait for.
        EXPECT_GT(own.world->stats().barriersTotal, list.size() * 9 / 10);
        EXPECT_GT(list.size(), 200u);
        EXPECT_GT(own.world->stats().jobsTotal, 2000u);
    }
    EXPECT_TRUE(seen[0] == seen[1]);
}

// Children of compounds and triangles may be pairs of such an algorithm.
TEST(ContactBarriers, StandBeforeCompoundsWhoseChildrenMayHaveUnknownAlgorithms)
{
    std::vector<std::uint64_t> seen[2];
    for (const int threads : {1, 4})
    {
        OwnBoxesWorld own(threads, Crowd::Compounds);
        std::vector<std::uint64_t>& list = seen[threads / 4];
        OwnBoxes::act = [&](auto*, auto*) { list.push_back(own.hashOfManifolds()); };
        own.world->run(kBarrierSteps / 3);
        EXPECT_GT(list.size(), 200u);
        EXPECT_EQ(own.world->stats().barriersTotal > list.size(), threads > 1);
    }
    EXPECT_TRUE(seen[0] == seen[1]);
}

// No pair of the world has these types: only a part of a compound might.
TEST(ContactBarriers, StandBeforeCompoundsForAnUnknownAlgorithmOfAnyTypes)
{
    const std::pair<int, int> types[] = {{CONE_SHAPE_PROXYTYPE, COMPOUND_SHAPE_PROXYTYPE},
                                         {COMPOUND_SHAPE_PROXYTYPE, CONE_SHAPE_PROXYTYPE},
                                         {CONE_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE},
                                         {STATIC_PLANE_PROXYTYPE, CONE_SHAPE_PROXYTYPE},
                                         {CONE_SHAPE_PROXYTYPE, CONE_SHAPE_PROXYTYPE},
                                         {COMPOUND_SHAPE_PROXYTYPE, TERRAIN_SHAPE_PROXYTYPE}};
    OwnBoxesWorld known(4, Crowd::Compounds, false);
    known.world->run(3);
    EXPECT_EQ(known.world->stats().barriersTotal, 0u);
    for (const auto& [a, b] : types)
    {
        OwnBoxesWorld own(4, Crowd::Compounds, false);
        own.world->dispatcher().registerCollisionCreateFunc(a, b, &own.create);
        own.world->run(3);
        EXPECT_GT(own.world->stats().barriersTotal, 0u) << a << " and " << b;
    }
}

TEST(ContactBarriers, KeepTrianglesOfTheApplicationOnTheCallingThread)
{
    OwnTriangles triangles;
    btBvhTriangleMeshShape mesh(&triangles, true);
    btScaledBvhTriangleMeshShape scaled(&mesh, vec(1, 1, 1));
    for (btCollisionShape* const shape :
         {static_cast<btCollisionShape*>(&mesh), static_cast<btCollisionShape*>(&scaled)})
    {
        OwnBoxesWorld own(4, Crowd::OnPlane, false);
        own.world->add(shape, 0, vec(0, 0.05, 0));
        triangles.calls = 0;
        own.world->run(kBarrierSteps / 2);
        EXPECT_GT(own.world->stats().dividedTotal, 500u);
        // Once for each body in a step.
        EXPECT_GT(triangles.calls, 100);
        EXPECT_EQ(triangles.foreignCalls, 0) << shape->getName();
    }
}

TEST(ContactBarriers, LetUnknownAlgorithmRemoveBodies)
{
    std::vector<std::uint64_t> hashes[2];
    int removed[2] = {};
    for (const int threads : {1, 4})
    {
        OwnBoxesWorld own(threads);
        CrowdWorld& world = *own.world;
        int& count = removed[threads / 4];
        int calls = 0;
        // One body in every few calls, never of the pair itself.
        OwnBoxes::act = [&](const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b)
        {
            const std::size_t which = world.bodies.size() - 1 - std::size_t(++calls) % 20;
            btRigidBody* const body = world.bodies[which].get();
            if (calls % 9 != 0 || body == a->getCollisionObject() || body == b->getCollisionObject() ||
                !body->isInWorld())
                return;
            world.world.removeRigidBody(body);
            ++count;
        };
        hashes[threads / 4] = world.run(kBarrierSteps);
        OwnBoxes::act = [](auto*, auto*) {};
    }
    EXPECT_GT(removed[0], 15);
    EXPECT_EQ(removed[0], removed[1]);
    EXPECT_TRUE(hashes[0] == hashes[1]);
}

TEST(ContactBarriers, KeepContactsOfEarlierPairsWhenAPairThrows)
{
    const float heights[4] = {};
    for (const bool isUnknown : {false, true})
    {
        SCOPED_TRACE(isUnknown ? "unknown algorithm" : "shape of the application");
        std::vector<std::uint64_t> hashes[2];
        int faults[2] = {};
        for (const int threads : {1, 4})
        {
            FaultyField field(heights);
            OwnBoxesWorld own(threads, Crowd::OnPlane, isUnknown);
            int calls = 0;
            OwnBoxes::act = [&](auto*, auto*)
            {
                if (++calls % 41 == 0)
                    throw std::runtime_error("pair");
            };
            if (!isUnknown)
                own.world->add(&field, 0, vec(0, 0.05, 0));
            hashes[threads / 4] = hashesWithFaults(*own.world, faults[threads / 4]);
            OwnBoxes::act = [](auto*, auto*) {};
            EXPECT_EQ(own.world->stats().jobsTotal > 1000, threads > 1);
            EXPECT_EQ(own.world->stats().barriersTotal > 0, threads > 1 && isUnknown);
        }
        EXPECT_GT(faults[0], 2);
        EXPECT_EQ(faults[0], faults[1]);
        EXPECT_TRUE(hashes[0] == hashes[1]);
    }
}
}  // namespace cullet::test
