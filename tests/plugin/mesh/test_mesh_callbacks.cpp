// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleInfoMap.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

// What Bullet's global callbacks see of a contact with a mesh.
namespace cullet::test
{
namespace
{
constexpr int kTiles = 10;

/// A level square of 10 m of two parts, side by side, with triangles of a metre.
struct TwoParts
{
    TwoParts()
    {
        for (int part = 0; part < 2; ++part)
        {
            for (int x = 0; x <= kTiles / 2; ++x)
            {
                for (int z = 0; z <= kTiles; ++z)
                {
                    for (const double coordinate : {double(x + part * kTiles / 2 - 5), 0.0, double(z - 5)})
                        vertices[part].push_back(btScalar(coordinate));
                }
            }
            for (int x = 0; x < kTiles / 2; ++x)
            {
                for (int z = 0; z < kTiles; ++z)
                {
                    const int corner = x * (kTiles + 1) + z;
                    for (const int offset : {0, 1, kTiles + 1, kTiles + 1, 1, kTiles + 2})
                        indices[part].push_back(corner + offset);
                }
            }
            btIndexedMesh indexed;
            indexed.m_numTriangles = static_cast<int>(indices[part].size() / 3);
            indexed.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(indices[part].data());
            indexed.m_triangleIndexStride = 3 * int(sizeof(int));
            indexed.m_numVertices = static_cast<int>(vertices[part].size() / 3);
            indexed.m_vertexBase = reinterpret_cast<const unsigned char*>(vertices[part].data());
            indexed.m_vertexStride = 3 * int(sizeof(btScalar));
            mesh.addIndexedMesh(indexed);
        }
    }

    std::vector<btScalar> vertices[2];
    std::vector<int> indices[2];
    btTriangleIndexVertexArray mesh;
};

/// What a callback saw of a point.
struct SeenTriangle
{
    btScalar margin;
    btVector3 corners[3];
    btVector3 origin;
    const btCollisionObjectWrapper* parent;
    const btCollisionObject* object;
    int part, index;
    bool isConvexShown;  ///< the other side is the convex shape
};

struct CallbackLog
{
    CallbackLog()
    {
        seen().clear();
        gContactAddedCallback = record;
    }
    ~CallbackLog() { gContactAddedCallback = nullptr; }
    CallbackLog(const CallbackLog&) = delete;
    CallbackLog& operator=(const CallbackLog&) = delete;

    static std::vector<SeenTriangle>& seen()
    {
        static std::vector<SeenTriangle> all;
        return all;
    }

    static std::set<std::pair<int, int>> names()
    {
        std::set<std::pair<int, int>> found;
        for (const SeenTriangle& triangle : seen())
            found.insert({triangle.part, triangle.index});
        return found;
    }

private:
    static bool record(btManifoldPoint&, const btCollisionObjectWrapper* a, int partA, int indexA,
                       const btCollisionObjectWrapper* b, int partB, int indexB)
    {
        const bool isFirst = a->getCollisionShape()->getShapeType() == TRIANGLE_SHAPE_PROXYTYPE;
        const btCollisionObjectWrapper &wrap = isFirst ? *a : *b, &other = isFirst ? *b : *a;
        EXPECT_EQ(wrap.getCollisionShape()->getShapeType(), int(TRIANGLE_SHAPE_PROXYTYPE));
        const auto& shape = static_cast<const btTriangleShape&>(*wrap.getCollisionShape());
        EXPECT_EQ(wrap.m_partId, isFirst ? partA : partB);
        EXPECT_EQ(wrap.m_index, isFirst ? indexA : indexB);
        seen().push_back({shape.getMargin(),
                          {shape.m_vertices1[0], shape.m_vertices1[1], shape.m_vertices1[2]},
                          wrap.getWorldTransform().getOrigin(),
                          wrap.m_parent,
                          wrap.getCollisionObject(),
                          wrap.m_partId,
                          wrap.m_index,
                          other.getCollisionShape()->isConvex()});
        return false;
    }
};

void askForEveryPoint(MeshBench& bench)
{
    bench.mesh().setCollisionFlags(bench.mesh().getCollisionFlags() |
                                   btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
}

TEST(MeshCallbacks, SeeTriangleWithItsPartMarginAndPlaceInBothOrders)
{
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    shape.setMargin(btScalar(0.07));
    btBoxShape box(vec(0.8, 0.5, 0.7));
    const btTransform meshAt(btQuaternion(vec(0, 1, 0), btScalar(0.3)), vec(1, 2, 3));
    for (const bool isMeshFirst : {false, true})
    {
        MeshBench ours(Loop::Ours, box, shape, isMeshFirst);
        askForEveryPoint(ours);
        const CallbackLog log;
        ours.step(meshAt * btTransform(btQuaternion::getIdentity(), vec(0.1, 0.56, 0.2)), meshAt);
        std::set<int> parts;
        for (const SeenTriangle& seen : CallbackLog::seen())
        {
            EXPECT_EQ(seen.margin, btScalar(0.07));
            EXPECT_EQ(seen.origin, meshAt.getOrigin());
            EXPECT_EQ(seen.object, &ours.mesh());
            EXPECT_NE(seen.parent, nullptr);
            EXPECT_TRUE(seen.isConvexShown);
            parts.insert(seen.part);
            const int* const named = ground.indices[seen.part].data() + 3 * seen.index;
            for (int corner = 0; corner < 3; ++corner)
            {
                const btScalar* const vertex = ground.vertices[seen.part].data() + 3 * named[corner];
                EXPECT_EQ(seen.corners[corner], btVector3(vertex[0], vertex[1], vertex[2]));
            }
        }
        EXPECT_EQ(parts.size(), 2u);
    }
}

/// With callbacks that change contacts no triangle that Bullet shows is left out, in any step.
TEST(MeshCallbacks, SeeEveryTriangleThatBulletShowsInEveryStep)
{
    constexpr unsigned kSeed = 8;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> place(-3, 3), height(0.45, 0.6), turn(-0.05, 0.05);
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    btBoxShape box(vec(1.2, 0.5, 0.7));
    std::size_t shown = 0, most = 0;
    for (int i = 0; i < 60; ++i)
    {
        MeshBench ours(Loop::Ours, box, shape), bullet(Loop::Ours, box, shape, false, bulletsLoop());
        askForEveryPoint(ours);
        askForEveryPoint(bullet);
        const double x = place(engine), y = height(engine), z = place(engine);
        const double angle = turn(engine);
        const btTransform at(btQuaternion(vec(0, 0, 1), btScalar(angle)), vec(x, y, z));
        for (int step = 0; step < 3; ++step)
        {
            const CallbackLog log;
            ours.step(at, btTransform::getIdentity());
            const std::set<std::pair<int, int>> found = CallbackLog::names();
            CallbackLog::seen().clear();
            bullet.step(at, btTransform::getIdentity());
            const std::set<std::pair<int, int>> wanted = CallbackLog::names();
            EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end()))
                << "seed " << kSeed << ", pose " << i << ", step " << step;
            shown += wanted.size();
            most = std::max(most, wanted.size());
        }
    }
    EXPECT_GT(shown, 500u);
    EXPECT_GT(most, 8u);
}

bool adjustEdges(btManifoldPoint& point, const btCollisionObjectWrapper* a, int partA, int indexA,
                 const btCollisionObjectWrapper* b, int partB, int indexB)
{
    if (b->getCollisionShape()->getShapeType() == TRIANGLE_SHAPE_PROXYTYPE)
        btAdjustInternalEdgeContacts(point, b, a, partB, indexB);
    else
        btAdjustInternalEdgeContacts(point, a, b, partA, indexA);
    return false;
}

/// Points whose normal is not that of the level ground.
int tiltedPointsOn(btConcaveShape& ground, bool isAdjusted, int& points)
{
    constexpr unsigned kSeed = 9;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> place(-3, 3), low(0.47, 0.53), turn(-3, 3);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    btSphereShape sphere(btScalar(0.5));
    gContactAddedCallback = isAdjusted ? adjustEdges : nullptr;
    int tilted = 0;
    for (btConvexShape* const body :
         {static_cast<btConvexShape*>(&box), static_cast<btConvexShape*>(&sphere)})
    {
        for (const bool isMeshFirst : {false, true})
        {
            MeshBench ours(Loop::Ours, *body, ground, isMeshFirst);
            askForEveryPoint(ours);
            for (int i = 0; i < 150; ++i)
            {
                const double x = place(engine), y = low(engine), z = place(engine);
                const double angle = turn(engine);
                const btTransform at(btQuaternion(vec(0, 1, 0), btScalar(angle)), vec(x, y, z));
                const btPersistentManifold& found = ours.stepFromNothing(at, btTransform::getIdentity());
                for (int k = 0; k < found.getNumContacts(); ++k)
                    tilted += btFabs(found.getContactPoint(k).m_normalWorldOnB.y()) < btScalar(0.9999);
                points += found.getNumContacts();
            }
        }
    }
    gContactAddedCallback = nullptr;
    return tilted;
}

/// The utility finds triangles of meshes, scaled meshes and height fields by part and index.
TEST(MeshCallbacks, LetBulletsEdgeUtilityWork)
{
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    btScaledBvhTriangleMeshShape scaled(&shape, vec(1.25, 1, 0.75));
    const std::vector<btScalar> heights((kTiles + 1) * (kTiles + 1), btScalar(0));
    btHeightfieldTerrainShape field(kTiles + 1, kTiles + 1, heights.data(), btScalar(-1), btScalar(1), 1,
                                    false);
    btTriangleInfoMap map, fieldMap;
    for (btConcaveShape* const mesh :
         {static_cast<btConcaveShape*>(&shape), static_cast<btConcaveShape*>(&scaled),
          static_cast<btConcaveShape*>(&field)})
    {
        int points = 0;
        EXPECT_GT(tiltedPointsOn(*mesh, false, points), 20) << mesh->getName();
    }
    btGenerateInternalEdgeInfo(&shape, &map);
    btGenerateInternalEdgeInfo(&field, &fieldMap);
    for (btConcaveShape* const mesh :
         {static_cast<btConcaveShape*>(&shape), static_cast<btConcaveShape*>(&scaled),
          static_cast<btConcaveShape*>(&field)})
    {
        int points = 0;
        EXPECT_EQ(tiltedPointsOn(*mesh, true, points), 0) << mesh->getName();
        EXPECT_GT(points, 300) << mesh->getName();
    }
    shape.setTriangleInfoMap(nullptr);
    field.setTriangleInfoMap(nullptr);
}

btScalar combineToThree(const btCollisionObject*, const btCollisionObject*)
{
    return 3;
}

btScalar combineToSeven(const btCollisionObject*, const btCollisionObject*)
{
    return 7;
}

/// Points go through btManifoldResult, which combines the properties of both bodies.
TEST(MeshCallbacks, CombinePropertiesOfBothBodies)
{
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    const btTransform at(btQuaternion::getIdentity(), vec(0.1, 0.49, 0.2));
    MeshBench ours(Loop::Ours, box, shape);
    ours.convex().setFriction(btScalar(0.5));
    ours.mesh().setFriction(btScalar(0.8));
    ours.convex().setContactStiffnessAndDamping(1000, 10);
    ours.convex().setCollisionFlags(ours.convex().getCollisionFlags() |
                                    btCollisionObject::CF_HAS_FRICTION_ANCHOR);
    const btManifoldPoint& plain = ours.step(at, btTransform::getIdentity()).getContactPoint(0);
    EXPECT_FLOAT_EQ(float(plain.m_combinedFriction), 0.4f);
    EXPECT_NE(plain.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING, 0);
    EXPECT_NE(plain.m_contactPointFlags & BT_CONTACT_FLAG_FRICTION_ANCHOR, 0);

    auto* const friction = gCalculateCombinedFrictionCallback;
    auto* const restitution = gCalculateCombinedRestitutionCallback;
    gCalculateCombinedFrictionCallback = combineToThree;
    gCalculateCombinedRestitutionCallback = combineToSeven;
    const btPersistentManifold& found = ours.stepFromNothing(at, btTransform::getIdentity());
    gCalculateCombinedFrictionCallback = friction;
    gCalculateCombinedRestitutionCallback = restitution;
    ASSERT_EQ(found.getNumContacts(), 4);
    for (int i = 0; i < 4; ++i)
    {
        EXPECT_EQ(found.getContactPoint(i).m_combinedFriction, btScalar(3));
        EXPECT_EQ(found.getContactPoint(i).m_combinedRestitution, btScalar(7));
    }
}

struct LifeCounts
{
    int started = 0, ended = 0, destroyed = 0;
};
LifeCounts lifeCounts;

struct CountLives
{
    CountLives()
    {
        lifeCounts = {};
        gContactStartedCallback = [](btPersistentManifold* const&) { ++lifeCounts.started; };
        gContactEndedCallback = [](btPersistentManifold* const&) { ++lifeCounts.ended; };
        gContactDestroyedCallback = [](void*)
        {
            ++lifeCounts.destroyed;
            return false;
        };
    }
    ~CountLives()
    {
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
        gContactDestroyedCallback = nullptr;
    }
    CountLives(const CountLives&) = delete;
    CountLives& operator=(const CountLives&) = delete;
};

void stepBoxAt(MeshBench& bench, double x, double height)
{
    bench.step(btTransform(btQuaternion::getIdentity(), vec(x, height, 0.2)), btTransform::getIdentity());
}

/// Gives every point an owner, slides a box from triangle to triangle by less than the breaking threshold a step, and counts
/// the points that have lost their owner.
int lostOwners(MeshBench& bench)
{
    static int owner;
    btPersistentManifold& manifold = *bench.dispatcher().getManifoldByIndexInternal(0);
    for (int step = 0; step < 5; ++step)
        stepBoxAt(bench, 0.1, 0.49);
    int lost = 0;
    for (int step = 1; step <= 60; ++step)
    {
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            manifold.getContactPoint(i).m_userPersistentData = &owner;
            manifold.getContactPoint(i).m_appliedImpulse = 1;
        }
        stepBoxAt(bench, 0.1 + 0.01 * step, 0.49);
        EXPECT_EQ(manifold.getNumContacts(), 4);
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            const btManifoldPoint& point = manifold.getContactPoint(i);
            EXPECT_EQ(point.m_userPersistentData != nullptr, point.m_appliedImpulse == btScalar(1));
            lost += point.m_userPersistentData == nullptr ? 1 : 0;
        }
    }
    return lost;
}

TEST(MeshCallbacks, KeepWhatPointsHoldAtLeastAsOftenAsBullet)
{
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    MeshBench ours(Loop::Ours, box, shape), bullet(Loop::Ours, box, shape, false, bulletsLoop());
    const CountLives counting;
    const int lost = lostOwners(ours);
    EXPECT_EQ(lifeCounts.started, 1);
    EXPECT_EQ(lifeCounts.ended, 0);
    EXPECT_EQ(lifeCounts.destroyed, lost);
    const int lostByBullet = lostOwners(bullet);
    EXPECT_LE(lost, lostByBullet);
    EXPECT_LT(lost, 24) << "of 240";
}

TEST(MeshCallbacks, TellWhenContactsBeginAndEnd)
{
    TwoParts ground;
    btBvhTriangleMeshShape shape(&ground.mesh, true);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    MeshBench ours(Loop::Ours, box, shape);
    const CountLives counting;
    for (int round = 1; round <= 3; ++round)
    {
        stepBoxAt(ours, 0.1, 0.49);
        stepBoxAt(ours, 0.105, 0.49);
        EXPECT_EQ(lifeCounts.started, round);
        EXPECT_EQ(lifeCounts.ended, round - 1);
        stepBoxAt(ours, 0.1, 2);
        EXPECT_EQ(ours.manifold().getNumContacts(), 0);
        EXPECT_EQ(lifeCounts.ended, round);
    }
}
}  // namespace
}  // namespace cullet::test
