// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kCells = 24;

/// A square of 12 m with bumps, as triangles and as heights.
struct Ground
{
    explicit Ground(std::mt19937& engine) : heights((kCells + 1) * (kCells + 1))
    {
        std::uniform_real_distribution<double> bump(0, 0.15);
        for (btScalar& height : heights)
            height = btScalar(bump(engine));
        for (int i = 0; i < kCells; ++i)
        {
            for (int j = 0; j < kCells; ++j)
            {
                triangles.addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
                triangles.addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
            }
        }
    }
    btVector3 corner(int i, int j) const
    {
        return vec(0.5 * i - 6, double(heights[static_cast<std::size_t>(i * (kCells + 1) + j)]), 0.5 * j - 6);
    }

    std::vector<btScalar> heights;
    btTriangleMesh triangles;
};

/// Huge, thin, doubled and flat triangles.
void addStrangeTriangles(TriangleSoup& soup, std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-1, 1);
    const auto add = [&](const btVector3& a, const btVector3& b, const btVector3& c)
    {
        for (const btVector3& corner : {a, b, c})
            soup.corners.push_back(corner);
    };
    add(vec(-900, 0, -900), vec(900, 0, -900), vec(0, 0, 900));
    for (int i = 0; i < 40; ++i)
    {
        const btVector3 a = drawVec(place, engine) * btScalar(2), b = drawVec(place, engine) * btScalar(2);
        add(a, b, a + drawVec(place, engine) * btScalar(1e-4));
        add(a, a, b);
        add(b, b, b);
        const btVector3 c = drawVec(place, engine) * btScalar(2);
        add(a, b, c);
        add(a, b, c);
    }
}

enum class MeshKind
{
    Bvh,
    BvhUnquantized,
    Scaled,
    Materials,
    Terrain,
    Soup
};

struct Mesh
{
    Mesh(MeshKind kind, std::mt19937& engine) : ground(engine)
    {
        switch (kind)
        {
            case MeshKind::Bvh:
                shape = std::make_unique<btBvhTriangleMeshShape>(&ground.triangles, true);
                break;
            case MeshKind::BvhUnquantized:
                shape = std::make_unique<btBvhTriangleMeshShape>(&ground.triangles, false);
                break;
            case MeshKind::Scaled:
                child = std::make_unique<btBvhTriangleMeshShape>(&ground.triangles, true);
                shape = std::make_unique<btScaledBvhTriangleMeshShape>(child.get(), vec(1.5, -2, 0.7));
                break;
            case MeshKind::Materials:
                shape = std::make_unique<btMultimaterialTriangleMeshShape>(&ground.triangles, true);
                break;
            case MeshKind::Terrain:
                shape = std::make_unique<btHeightfieldTerrainShape>(
                    kCells + 1, kCells + 1, ground.heights.data(), btScalar(-1), btScalar(1), 1, false);
                break;
            case MeshKind::Soup:
            {
                auto soup = std::make_unique<TriangleSoup>();
                addStrangeTriangles(*soup, engine);
                shape = std::move(soup);
                break;
            }
        }
    }

    Ground ground;
    std::unique_ptr<btBvhTriangleMeshShape> child;
    std::unique_ptr<btConcaveShape> shape;
};

std::unique_ptr<btConvexHullShape> roundHull(int points, std::mt19937& engine)
{
    auto hull = std::make_unique<btConvexHullShape>();
    std::uniform_real_distribution<double> place(-1, 1);
    for (int i = 0; i < points; ++i)
        hull->addPoint(drawVec(place, engine).normalized() * btScalar(0.6), false);
    hull->recalcLocalAabb();
    return hull;
}

enum class BodyKind
{
    RoundHull,
    SmallHull,
    Box,
    Plate,
    Capsule,
    Sphere,
    Cylinder
};

std::unique_ptr<btConvexShape> makeBody(BodyKind kind, std::mt19937& engine)
{
    switch (kind)
    {
        case BodyKind::RoundHull:
            return roundHull(64, engine);
        case BodyKind::SmallHull:
            return roundHull(8, engine);
        case BodyKind::Box:
            return std::make_unique<btBoxShape>(vec(0.4, 0.5, 0.3));
        case BodyKind::Plate:
            return std::make_unique<btBoxShape>(vec(2, 0.05, 2));
        case BodyKind::Capsule:
            return std::make_unique<btCapsuleShape>(btScalar(0.3), btScalar(0.8));
        case BodyKind::Sphere:
            return std::make_unique<btSphereShape>(btScalar(0.5));
        default:
            return std::make_unique<btCylinderShape>(vec(0.4, 0.5, 0.4));
    }
}

btTransform randomPose(std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-1, 1);
    return btTransform(randomRotation(engine),
                       vec(3 * place(engine), 0.5 * place(engine), 3 * place(engine)));
}

btTransform movedALittle(const btTransform& pose, std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-1, 1);
    const btQuaternion turn(vec(0, 1, 0), btScalar(0.02 * place(engine)));
    return btTransform(turn * pose.getRotation(), pose.getOrigin() + drawVec(place, engine) * btScalar(0.02));
}

struct MeshContacts : testing::TestWithParam<std::tuple<MeshKind, BodyKind>>
{
};

std::string nameOf(const testing::TestParamInfo<std::tuple<MeshKind, BodyKind>>& info)
{
    static const char* const meshes[] = {"Bvh", "BvhUnquantized", "Scaled", "Materials", "Terrain", "Soup"};
    static const char* const bodies[] = {"RoundHull", "SmallHull", "Box",     "Plate",
                                         "Capsule",   "Sphere",    "Cylinder"};
    return std::string(bodies[static_cast<std::size_t>(std::get<1>(info.param))]) + "On" +
           meshes[static_cast<std::size_t>(std::get<0>(info.param))];
}

/// Collects the points that a manifold gets.
class PointRecorder
{
public:
    PointRecorder()
    {
        points().clear();
        gContactAddedCallback = record;
    }
    ~PointRecorder() { gContactAddedCallback = nullptr; }
    PointRecorder(const PointRecorder&) = delete;
    PointRecorder& operator=(const PointRecorder&) = delete;

    static std::vector<btManifoldPoint>& points()
    {
        static std::vector<btManifoldPoint> added;
        return added;
    }

private:
    static bool record(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                       const btCollisionObjectWrapper*, int, int)
    {
        points().push_back(point);
        return false;
    }
};

/// Every point of every triangle, as the manifold gets them from a loop without memory.
std::vector<btManifoldPoint> pointsOfAllTriangles(MeshBench& bench, const btTransform& at,
                                                  const btTransform& meshAt)
{
    bench.convex().setCollisionFlags(bench.convex().getCollisionFlags() |
                                     btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    const PointRecorder recorder;
    bench.stepFromNothing(at, meshAt);
    return PointRecorder::points();
}

bool isOneOf(const btManifoldPoint& point, const std::vector<btManifoldPoint>& all, double tolerance)
{
    const auto matches = [&](const btManifoldPoint& other)
    {
        return point.m_index0 == other.m_index0 && point.m_index1 == other.m_index1 &&
               double((point.m_localPointA - other.m_localPointA).length()) < tolerance &&
               double((point.m_normalWorldOnB - other.m_normalWorldOnB).length()) < tolerance &&
               std::abs(double(point.m_distance1 - other.m_distance1)) < tolerance;
    };
    return std::any_of(all.begin(), all.end(), matches);
}

double deepest(const btPersistentManifold& manifold)
{
    double least = 1;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
        least = std::min(least, double(manifold.getContactPoint(i).m_distance1));
    return least;
}

double deepest(const std::vector<btManifoldPoint>& points)
{
    double least = 1;
    for (const btManifoldPoint& point : points)
        least = std::min(least, double(point.m_distance1));
    return least;
}

/// Calls call(pose of the body, of the mesh) for poses that change a little five times, then at random.
template <class Call>
void forEachPose(std::mt19937& engine, int count, const Call& call)
{
    const btTransform meshAt(randomRotation(engine), vec(1, 2, 3));
    for (int i = 0; i < count; ++i)
    {
        btTransform pose = randomPose(engine);
        for (int step = 0; step < 6; ++step)
        {
            SCOPED_TRACE("pose " + std::to_string(i) + ", step " + std::to_string(step));
            call(meshAt * pose, meshAt);
            pose = movedALittle(pose, engine);
        }
    }
}

TEST_P(MeshContacts, AreTheSameBitsWithAndWithoutMemory)
{
    constexpr unsigned kSeed = 41;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const Mesh mesh(std::get<0>(GetParam()), engine);
    const auto body = makeBody(std::get<1>(GetParam()), engine);
    int touching = 0, points = 0;
    for (const bool isMeshFirst : {false, true})
    {
        MeshBench ours(Loop::Ours, *body, *mesh.shape, isMeshFirst);
        forEachPose(engine, posesToTry(40),
                    [&](const btTransform& at, const btTransform& meshAt)
                    {
                        const btPersistentManifold& found = ours.stepFromNothing(at, meshAt);
                        MeshBench fresh(Loop::Ours, *body, *mesh.shape, isMeshFirst);
                        ASSERT_TRUE(arePointsEqual(found, fresh.step(at, meshAt)));
                        touching += found.getNumContacts() > 0;
                        points += found.getNumContacts();
                    });
    }
    EXPECT_GT(touching, 80);
    EXPECT_GT(points, touching);
}

/// A length: the triangles of some soups have corners a kilometre away.
constexpr double kLimitNoise = sizeof(btScalar) == sizeof(float) ? 3e-5 : 1e-10;

TEST_P(MeshContacts, AreDeepestAndAmongThoseOfAllTriangles)
{
    constexpr unsigned kSeed = 42;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const Mesh mesh(std::get<0>(GetParam()), engine);
    const auto body = makeBody(std::get<1>(GetParam()), engine);
    MeshBench ours(Loop::Ours, *body, *mesh.shape), plain(Loop::Plain, *body, *mesh.shape);
    const double tolerance = std::get<0>(GetParam()) == MeshKind::Soup ? 1e-3 : 1e-4;
    int touching = 0, odd = 0, points = 0;
    forEachPose(engine, posesToTry(60),
                [&](const btTransform& at, const btTransform& meshAt)
                {
                    const std::vector<btManifoldPoint> all = pointsOfAllTriangles(plain, at, meshAt);
                    const btPersistentManifold& found = ours.stepFromNothing(at, meshAt);
                    const double limit = double(found.getContactBreakingThreshold());
                    if (found.getNumContacts() == 0 || all.empty())
                    {
                        // At the limit, rounding decides whether there is a contact.
                        if (found.getNumContacts() > 0 || !all.empty())
                        {
                            EXPECT_NEAR(std::min(deepest(found), deepest(all)), limit, kLimitNoise);
                        }
                        return;
                    }
                    ++touching;
                    // Bullet's manifold replaces a point by a later one nearby, which may be less deep.
                    const bool isFilledByBullet = std::get<1>(GetParam()) == BodyKind::Cylinder;
                    const double expected = isFilledByBullet ? deepest(plain.manifold()) : deepest(all);
                    // See MeshPoints: of the deepest points, any up to a thousandth.
                    EXPECT_NEAR(deepest(found), expected, std::max(2e-3, 1.2e-3 * (limit - expected)));
                    for (int i = 0; i < found.getNumContacts(); ++i)
                        odd += !isOneOf(found.getContactPoint(i), all, tolerance);
                    points += found.getNumContacts();
                });
    EXPECT_GT(touching, 60);
    // Where two features are equally close, rounding decides which one a search finds. Bullet's test of a sphere and a
    // triangle without area finds nothing.
    const bool hasFlatTriangles = std::get<0>(GetParam()) == MeshKind::Soup;
    EXPECT_LT(odd * (hasFlatTriangles && std::get<1>(GetParam()) == BodyKind::Sphere ? 20 : 50), points);
}

/// Poses in which stock Bullet has a body overlap a mesh, beside what this library has there.
struct StockTally
{
    void compare(MeshBench& stock, MeshBench& ours, const btTransform& at, const btTransform& meshAt)
    {
        const double bullets = deepest(stock.stepFromNothing(at, meshAt));
        if (bullets >= 0)
            return;
        const double found = deepest(ours.stepFromNothing(at, meshAt));
        ++touching;
        missed += found > 0;
        if (bullets > -kShallow)
        {
            ++shallow;
            lessDeep += found > bullets + 2e-3;
        }
    }

    static constexpr double kShallow =
        0.02;  ///< metres; where bodies are deeper, each search may find another way out
    int touching = 0, missed = 0, shallow = 0, lessDeep = 0;
};

TEST_P(MeshContacts, TouchWhereStockBulletTouchesAndAsDeep)
{
    constexpr unsigned kSeed = 47;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const Mesh mesh(std::get<0>(GetParam()), engine);
    const auto body = makeBody(std::get<1>(GetParam()), engine);
    MeshBench ours(Loop::Ours, *body, *mesh.shape), stock(Loop::Stock, *body, *mesh.shape);
    StockTally tally;
    forEachPose(engine, posesToTry(12),
                [&](const btTransform& at, const btTransform& meshAt)
                {
                    tally.compare(stock, ours, at, meshAt);
                    // Lifted until it hardly overlaps.
                    btTransform pose = meshAt.inverse() * at;
                    for (int lifts = 0; lifts < 12; ++lifts)
                    {
                        const double depth = -deepest(stock.stepFromNothing(meshAt * pose, meshAt));
                        pose.getOrigin() += vec(0, std::max(depth - 0.005, 0.0), 0);
                    }
                    tally.compare(stock, ours, meshAt * pose, meshAt);
                });
    EXPECT_GT(tally.touching, 60);
    EXPECT_GT(tally.shallow, 10);
    EXPECT_EQ(tally.missed, 0);
    EXPECT_EQ(tally.lessDeep, 0);
}

INSTANTIATE_TEST_SUITE_P(
    All, MeshContacts,
    testing::Combine(testing::Values(MeshKind::Bvh, MeshKind::BvhUnquantized, MeshKind::Scaled,
                                     MeshKind::Materials, MeshKind::Terrain, MeshKind::Soup),
                     testing::Values(BodyKind::RoundHull, BodyKind::SmallHull, BodyKind::Box, BodyKind::Plate,
                                     BodyKind::Capsule, BodyKind::Sphere, BodyKind::Cylinder)),
    nameOf);

/// A body at rest on a mesh of its own. A pair with memory has the points of a new one after every edit.
struct EditedMesh : testing::Test
{
    void expectSame(const char* after)
    {
        const btPersistentManifold& found = ours.stepFromNothing(pose, btTransform::getIdentity());
        MeshBench fresh(Loop::Ours, *hull, *mesh.shape);
        fresh.convex().setCollisionShape(ours.convex().getCollisionShape());
        fresh.mesh().setCollisionShape(ours.mesh().getCollisionShape());
        EXPECT_TRUE(arePointsEqual(found, fresh.step(pose, btTransform::getIdentity()))) << after;
        contacts = found.getNumContacts();
    }

    std::mt19937 engine{7};
    Mesh mesh{MeshKind::Bvh, engine};
    std::unique_ptr<btConvexHullShape> hull = roundHull(40, engine);
    MeshBench ours{Loop::Ours, *hull, *mesh.shape};
    btTransform pose{btQuaternion::getIdentity(), vec(0.1, 0.62, 0.2)};
    int contacts = 0;
};

TEST_F(EditedMesh, IsSeenInTheSameStepWhenAVertexMoves)
{
    expectSame("at rest");
    expectSame("at rest");
    ASSERT_GT(contacts, 0);
    const btPersistentManifold before = ours.manifold();
    unsigned char* vertices;
    unsigned char* indices;
    int vertexCount, stride, indexStride, faceCount;
    PHY_ScalarType type, indexType;
    mesh.ground.triangles.getLockedVertexIndexBase(&vertices, vertexCount, type, stride, &indices,
                                                   indexStride, faceCount, indexType);
    // Down, so that all vertices stay inside of the tree's boxes of 0.15 m for some, and the body loses its ground.
    for (int i = 0; i < vertexCount; ++i)
        *reinterpret_cast<btScalar*>(vertices + i * stride + sizeof(btScalar)) *= btScalar(0.25);
    expectSame("lowered");
    EXPECT_FALSE(arePointsEqual(before, ours.manifold()));
}

TEST_F(EditedMesh, IsSeenInTheSameStepWhenShapesAreExchanged)
{
    expectSame("a hull");
    btBoxShape box(vec(0.5, 0.6, 0.5));
    btSphereShape sphere(btScalar(0.62));
    TriangleSoup soup;
    soup.corners = {vec(-3, 0.05, -3), vec(3, 0.05, -3), vec(0, 0.05, 3)};
    int touching = 0;
    for (btCollisionShape* body :
         {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(&sphere),
          static_cast<btCollisionShape*>(hull.get())})
    {
        for (btCollisionShape* ground :
             {static_cast<btCollisionShape*>(&soup), static_cast<btCollisionShape*>(mesh.shape.get())})
        {
            ours.convex().setCollisionShape(body);
            ours.mesh().setCollisionShape(ground);
            expectSame("exchanged");
            touching += contacts > 0;
        }
    }
    EXPECT_GE(touching, 5);
}

TEST_F(EditedMesh, IsSeenInTheSameStepWhenTheScaleChanges)
{
    expectSame("at rest");
    const btVector3 scale = vec(1, 1.3, 1);
    mesh.shape->setLocalScaling(scale);
    expectSame("scaled");
    hull->setLocalScaling(vec(1, 0.5, 1));
    expectSame("flatter body");
    hull->setLocalScaling(vec(1, 1.1, 1));
    expectSame("taller body");
    EXPECT_GT(contacts, 0);
}

TEST_F(EditedMesh, AsksForFewTrianglesWhereTheyAreSmall)
{
    btTriangleMesh triangles;
    const auto corner = [](int i, int j) { return vec(0.1 * i - 2, 0, 0.1 * j - 2); };
    for (int i = 0; i < 40; ++i)
    {
        for (int j = 0; j < 40; ++j)
        {
            triangles.addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
            triangles.addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
        }
    }
    btBvhTriangleMeshShape fine(&triangles, true);
    MeshBench bench(Loop::Ours, *hull, fine);
    pose.setOrigin(vec(0, 0.55, 0));
    for (int i = 0; i < 10; ++i)
        EXPECT_GT(bench.step(pose, btTransform::getIdentity()).getNumContacts(), 0);
    const IsaGjkStats stats = bench.isaGjk().stats();
    EXPECT_GT(stats.trianglesTotal, 2000u);
    EXPECT_GT(stats.trianglesAskedTotal, 0u);
    EXPECT_LT(stats.trianglesAskedTotal * 3, stats.trianglesTotal);
}

TEST_F(EditedMesh, IsLeftToBulletForPosesThatAreNoRotations)
{
    const IsaGjkOptions bullets = []
    {
        IsaGjkOptions options;
        options.meshes = false;
        return options;
    }();
    MeshBench bullet(Loop::Ours, *hull, *mesh.shape, false, bullets);
    pose.setBasis(pose.getBasis() * btScalar(1.05));
    expectSame("stretched");
    EXPECT_TRUE(arePointsEqual(ours.step(pose, btTransform::getIdentity()),
                               bullet.step(pose, btTransform::getIdentity())) ||
                ours.isaGjk().stats().trianglesTotal == 0);
    pose.setOrigin(vec(0, std::nan(""), 0));
    EXPECT_EQ(ours.step(pose, btTransform::getIdentity()).getNumContacts(), 0);
}
TEST(PosedTriangle, IsNoLargerThanItsEdgesWhenItIsHuge)
{
    for (const double edge : {1e-3, 1.0, 1e4})
    {
        const btTriangleShape triangle(vec(0, 0, 0), vec(edge, 0, 0), vec(0, 0, edge));
        HullUse unused;
        const auto posed = poseShape(triangle, ConvexKind::Triangle, btTransform::getIdentity(), unused, 0);
        ASSERT_TRUE(posed.has_value());
        EXPECT_LT(double(posed->size()), 2 * edge);
        EXPECT_GE(double(posed->size()), edge);
    }
}
}  // namespace
}  // namespace cullet::test
