// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/tests/plugin/mesh/triangle_oracle.h"
#include "cullet/tests/plugin/queries/query_mesh.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

// contactTest() and contactPairTest() of a world against meshes: every triangle that Bullet reports, as near as Bullet says.
namespace cullet::test
{
namespace
{
/// The least distance at each triangle, by part and index.
using TriangleDistances = std::map<std::pair<int, int>, double>;

struct ContactLog : btCollisionWorld::ContactResultCallback
{
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int partA, int indexA,
                             const btCollisionObjectWrapper*, int partB, int indexB) override
    {
        const bool isMeshFirst = a->getCollisionShape()->getShapeType() == TRIANGLE_SHAPE_PROXYTYPE;
        const auto name = isMeshFirst ? std::make_pair(partA, indexA) : std::make_pair(partB, indexB);
        const auto known = distances.try_emplace(name, double(point.getDistance()));
        known.first->second = std::min(known.first->second, double(point.getDistance()));
        EXPECT_NEAR(double(point.m_normalWorldOnB.length()), 1.0, 1e-4);
        return 0;
    }
    TriangleDistances distances;
};

/// A level mesh with edges of half a metre, of every kind.
struct ContactGround
{
    ContactGround()
        : data(makeMeshData("terrain", 7)),
          interface(data.triangleCount(), data.indices.data(), 3 * sizeof(int),
                    static_cast<int>(data.vertices.size() / 3), data.vertices.data(), 3 * sizeof(btScalar)),
          heights(21 * 21)
    {
        Random random(8);
        for (btScalar& height : heights)
            height = btScalar(random.between(-0.5f, 0.5f));
        compound.addChildShape(btTransform::getIdentity(), &mesh);
        shapes = {{"mesh", &mesh},
                  {"scaled", &scaled},
                  {"materials", &materials},
                  {"field", &field},
                  {"compound", &compound}};
    }

    MeshData data;
    btTriangleIndexVertexArray interface;
    std::vector<btScalar> heights;
    btBvhTriangleMeshShape mesh{&interface, true};
    btScaledBvhTriangleMeshShape scaled{&mesh, btVector3(btScalar(1.5), 1, btScalar(0.8))};
    btMultimaterialTriangleMeshShape materials{&interface, true};
    btHeightfieldTerrainShape field{21, 21, heights.data(), btScalar(-1), btScalar(1), 1, false};
    btCompoundShape compound;
    std::vector<std::pair<std::string, btCollisionShape*>> shapes;
};

/// A body and a ground in a world.
class ContactBench
{
public:
    ContactBench(std::unique_ptr<btCollisionDispatcher> dispatcher, btCollisionShape& body,
                 btCollisionShape& ground)
        : m_dispatcher(std::move(dispatcher)), m_world(m_dispatcher.get(), &m_broadphase, &m_configuration)
    {
        m_body.setCollisionShape(&body);
        m_ground.setCollisionShape(&ground);
        m_world.addCollisionObject(&m_body);
        m_world.addCollisionObject(&m_ground);
    }
    ~ContactBench()
    {
        m_world.removeCollisionObject(&m_body);
        m_world.removeCollisionObject(&m_ground);
    }

    TriangleDistances ask(const btTransform& at, btScalar threshold, bool asksForPair)
    {
        m_body.setWorldTransform(at);
        m_world.updateAabbs();
        ContactLog log;
        log.m_closestDistanceThreshold = threshold;
        if (asksForPair)
            m_world.contactPairTest(&m_body, &m_ground, log);
        else
            m_world.contactTest(&m_body, log);
        return log.distances;
    }

    static btDefaultCollisionConfiguration& configuration()
    {
        static btDefaultCollisionConfiguration shared;
        return shared;
    }

private:
    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btDbvtBroadphase m_broadphase;
    btCollisionWorld m_world;
    btCollisionObject m_body, m_ground;
};

/// The distance of the core of a box from a triangle of the mesh; 0: they overlap.
double exactDistance(const btBoxShape& box, const btTransform& at, const ContactGround& ground, int triangle)
{
    oracle::Points core;
    for (int i = 0; i < 8; ++i)
    {
        const btVector3 signs(btScalar(i & 1 ? 1 : -1), btScalar(i & 2 ? 1 : -1), btScalar(i & 4 ? 1 : -1));
        const oracle::Point corner = oracle::pointOf(box.getImplicitShapeDimensions() * signs);
        oracle::Point moved = oracle::pointOf(at.getOrigin());
        for (std::size_t row = 0; row < 3; ++row)
            moved[row] += oracle::dot(oracle::pointOf(at.getBasis()[int(row)]), corner);
        core.push_back(moved);
    }
    oracle::Point corners[3];
    for (int corner = 0; corner < 3; ++corner)
    {
        const int vertex = ground.data.indices[std::size_t(3 * triangle + corner)];
        for (std::size_t axis = 0; axis < 3; ++axis)
            corners[corner][axis] = ground.data.vertices[std::size_t(3 * vertex) + axis];
    }
    return double(oracle::distance(core, corners));
}

/// Where a distance is less than Bullet's, its search for the closest points has ended early.
TEST(ContactQueries, ReportTrianglesOfBulletAtItsDistances)
{
    constexpr unsigned kSeed = 4172;
    Random random(kSeed);
    ContactGround ground;
    btBoxShape box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
    btSphereShape sphere(btScalar(0.5));
    btConvexHullShape hull;
    for (int i = 0; i < 24; ++i)
        hull.addPoint(randomVector(random, 1.0f).normalized() * btScalar(0.5));
    btCylinderShape cylinder(btVector3(btScalar(0.4), btScalar(0.5), btScalar(0.4)));
    for (const auto& [name, shape] : ground.shapes)
    {
        for (btConvexShape* const body :
             {static_cast<btConvexShape*>(&box), static_cast<btConvexShape*>(&sphere),
              static_cast<btConvexShape*>(&hull), static_cast<btConvexShape*>(&cylinder)})
        {
            SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", " << body->getName() << " on " << name);
            ContactBench stock(std::make_unique<btCollisionDispatcher>(&ContactBench::configuration()), *body,
                               *shape);
            ContactBench ours(std::make_unique<Dispatcher>(&ContactBench::configuration()), *body, *shape);
            std::size_t triangles = 0, apart = 0, nearer = 0, compared = 0;
            for (int i = 0; i < 40; ++i)
            {
                btTransform at = randomPose(random, 4.0f);
                at.getOrigin().setY(btScalar(random.between(0.2f, 1.6f)));
                const bool asksForPair = i % 2 == 0;
                const btScalar threshold = i % 4 < 2 ? btScalar(0) : btScalar(0.5);
                const TriangleDistances wanted = stock.ask(at, threshold, asksForPair);
                const TriangleDistances found = ours.ask(at, threshold, asksForPair);
                for (const auto& [triangle, distance] : wanted)
                {
                    const auto same = found.find(triangle);
                    ASSERT_NE(same, found.end()) << "pose " << i << ", triangle " << triangle.second;
                    // Where shapes overlap deeply, Bullet's depths are estimates.
                    if (distance < -0.03)
                        continue;
                    EXPECT_LT(same->second, distance + 3e-3) << "pose " << i;
                    nearer += same->second < distance - 3e-3 ? 1 : 0;
                    apart += distance > 0.1 ? 1 : 0;
                }
                triangles += wanted.size();
                if (body != &box || shape != &ground.mesh)
                    continue;
                for (const auto& [triangle, distance] : found)
                {
                    const double exact = exactDistance(box, at, ground, triangle.second);
                    if (exact > 0)
                    {
                        EXPECT_NEAR(distance, exact - double(box.getMargin()), 1e-4) << "pose " << i;
                    }
                    compared += exact > 0 ? 1 : 0;
                }
            }
            EXPECT_GT(triangles, 60u);
            EXPECT_GT(apart, 20u) << "of queries with a threshold";
            EXPECT_LT(nearer * 20, triangles) << "Bullet's search ends early in few cases";
            EXPECT_TRUE(body != &box || shape != &ground.mesh || compared > 100u);
        }
    }
}
}  // namespace
}  // namespace cullet::test
