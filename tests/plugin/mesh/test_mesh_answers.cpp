// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"
#include "cullet/tests/plugin/mesh/triangle_oracle.h"

#include <LinearMath/btAabbUtil2.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

// Which triangles touch, and where.
namespace cullet::test
{
namespace
{
double deepestOf(const btPersistentManifold& manifold)
{
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < manifold.getNumContacts(); ++i)
        least = std::min(least, double(manifold.getContactPoint(i).getDistance()));
    return least;
}

void addTriangle(TriangleSoup& soup, const btVector3& a, const btVector3& b, const btVector3& c)
{
    for (const btVector3& corner : {a, b, c})
        soup.corners.push_back(corner);
}

btTransform placedAt(const btVector3& place)
{
    return btTransform(btQuaternion::getIdentity(), place);
}

/// A box, a hull of eight points, a capsule and a sphere, with their cores as points.
struct BodyWithCore
{
    std::unique_ptr<btConvexShape> shape;
    std::vector<btVector3> core;
    double radius;  ///< of what is around the core
};

std::vector<BodyWithCore> bodiesWithCores(std::mt19937& engine)
{
    std::vector<BodyWithCore> bodies;
    auto box = std::make_unique<btBoxShape>(vec(0.4, 0.5, 0.3));
    std::vector<btVector3> corners;
    for (int i = 0; i < 8; ++i)
    {
        const btVector3 signs = vec(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        corners.push_back(box->getImplicitShapeDimensions() * signs);
    }
    const double boxMargin = double(box->getMargin());
    bodies.push_back({std::move(box), corners, boxMargin});
    auto hull = std::make_unique<btConvexHullShape>();
    std::uniform_real_distribution<double> place(-0.5, 0.5);
    std::vector<btVector3> points;
    for (int i = 0; i < 8; ++i)
    {
        points.push_back(drawVec(place, engine));
        hull->addPoint(points.back(), i == 7);
    }
    const double hullMargin = double(hull->getMargin());
    bodies.push_back({std::move(hull), points, hullMargin});
    bodies.push_back({std::make_unique<btCapsuleShape>(btScalar(0.25), btScalar(0.8)),
                      {vec(0, 0.4, 0), vec(0, -0.4, 0)},
                      0.25});
    bodies.push_back({std::make_unique<btSphereShape>(btScalar(0.5)), {vec(0, 0, 0)}, 0.5});
    return bodies;
}

/// The least distance of a body from the triangles in Bullet's box, without margins of the mesh; infinity: there is none.
struct OracleAnswer
{
    long double least = std::numeric_limits<long double>::infinity();
    std::vector<long double> ofTriangle;
};

OracleAnswer askOracle(const BodyWithCore& body, const TriangleSoup& soup, const btTransform& pose)
{
    OracleAnswer answer;
    oracle::Points core;
    for (const btVector3& point : body.core)
    {
        // In exact arithmetic, from the numbers that Bullet has.
        oracle::Point moved = oracle::pointOf(pose.getOrigin());
        for (std::size_t row = 0; row < 3; ++row)
            moved[row] += oracle::dot(oracle::pointOf(pose.getBasis()[int(row)]), oracle::pointOf(point));
        core.push_back(moved);
    }
    btVector3 low, high;
    body.shape->getAabb(pose, low, high);
    for (std::size_t i = 0; i + 2 < soup.corners.size(); i += 3)
    {
        const oracle::Point triangle[3] = {oracle::pointOf(soup.corners[i]),
                                           oracle::pointOf(soup.corners[i + 1]),
                                           oracle::pointOf(soup.corners[i + 2])};
        const bool isInBox = TestTriangleAgainstAabb2(&soup.corners[i], low, high);
        answer.ofTriangle.push_back(isInBox ? oracle::distance(core, triangle)
                                            : std::numeric_limits<long double>::infinity());
        answer.least = std::min(answer.least, answer.ofTriangle.back());
    }
    return answer;
}

/// Triangles of all sizes around the origin.
TriangleSoup soupOfManySizes(std::mt19937& engine)
{
    TriangleSoup soup;
    std::uniform_real_distribution<double> place(-1, 1), decade(-3, 1);
    for (int i = 0; i < 30; ++i)
    {
        const btVector3 middle = drawVec(place, engine) * btScalar(1.5);
        const btScalar size = btScalar(std::pow(10.0, decade(engine)));
        const btVector3 a = middle + drawVec(place, engine) * size;
        const btVector3 b = middle + drawVec(place, engine) * size;
        const btVector3 c = middle + drawVec(place, engine) * size;
        addTriangle(soup, a, b, c);
    }
    return soup;
}

TEST(MeshAnswers, TouchClosestTriangleAsExactArithmeticFindsIt)
{
    constexpr unsigned kSeed = 23;
    constexpr double kTolerance = sizeof(btScalar) == sizeof(float) ? 4e-6 : 1e-9;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> place(-1.8, 1.8);
    const TriangleSoup model = soupOfManySizes(engine);
    TriangleSoup soup;
    soup.corners = model.corners;
    for (const BodyWithCore& body : bodiesWithCores(engine))
    {
        MeshBench ours(Loop::Ours, *body.shape, soup);
        int apart = 0, touching = 0;
        for (int i = 0; i < posesToTry(600); ++i)
        {
            SCOPED_TRACE(testing::Message()
                         << "seed " << kSeed << ", " << body.shape->getName() << ", pose " << i);
            const btQuaternion turn = randomRotation(engine);
            const btTransform pose(turn, drawVec(place, engine));
            const OracleAnswer exact = askOracle(body, soup, pose);
            const btPersistentManifold& found = ours.stepFromNothing(pose, btTransform::getIdentity());
            const double limit = body.radius + double(found.getContactBreakingThreshold());
            if (std::abs(double(exact.least) - limit) < kTolerance)
                continue;
            ASSERT_EQ(found.getNumContacts() > 0, double(exact.least) <= limit);
            (found.getNumContacts() > 0 ? touching : apart) += 1;
            // Where cores overlap a depth is measured, which is not the oracle's.
            if (found.getNumContacts() == 0 || double(exact.least) < 1e-3)
                continue;
            const double gap = double(exact.least) - body.radius;
            // Of two points close by, a manifold keeps the first if the other is hardly deeper.
            EXPECT_GT(deepestOf(found), gap - kTolerance);
            EXPECT_LT(deepestOf(found), gap + 5e-4);
            for (int k = 0; k < found.getNumContacts(); ++k)
            {
                const btManifoldPoint& point = found.getContactPoint(k);
                if (double(point.getDistance()) > gap + kTolerance)
                    continue;
                EXPECT_NEAR(double(exact.ofTriangle[std::size_t(point.m_index1)] - exact.least), 0.0,
                            kTolerance);
            }
        }
        EXPECT_GT(apart, 20) << body.shape->getName();
        EXPECT_GT(touching, 100) << body.shape->getName();
    }
}

/// Bullet asks for the triangles in the body's box and the mesh's margin: without the breaking threshold.
TEST(MeshAnswers, BeginAndEndAtHeightsOfBullet)
{
    for (const double meshMargin : {0.0, 0.04, 0.3})
    {
        btTriangleMesh triangles;
        triangles.addTriangle(vec(-5, 0, -5), vec(0, 0, 5), vec(5, 0, -5));
        btBvhTriangleMeshShape shape(&triangles, true);
        shape.setMargin(btScalar(meshMargin));
        std::vector<std::unique_ptr<btConvexShape>> bodies;
        bodies.push_back(std::make_unique<btBoxShape>(vec(0.5, 0.5, 0.5)));
        bodies.push_back(std::make_unique<btSphereShape>(btScalar(0.5)));
        bodies.push_back(std::make_unique<btCapsuleShapeX>(btScalar(0.5), btScalar(0.5)));
        bodies.push_back(std::make_unique<btCylinderShape>(vec(0.5, 0.5, 0.5)));
        const btVector3 points[] = {vec(0, -0.46, 0), vec(0.4, 0.4, 0), vec(-0.4, 0.4, 0.2),
                                    vec(0, 0.4, -0.4)};
        bodies.push_back(std::make_unique<btConvexHullShape>(&points[0].m_floats[0], 4));
        for (const auto& body : bodies)
        {
            SCOPED_TRACE(testing::Message() << body->getName() << ", margin " << meshMargin);
            // Bullet 3.24 drops triangles within the mesh's margin before it asks for their distance (bullet3 issue 4263).
            MeshBench ours(Loop::Ours, *body, shape), plain(Loop::Plain, *body, shape),
                bullet(Loop::Ours, *body, shape, false, bulletsLoop());
            int touching = 0, apart = 0;
            for (int i = 0; i < 160; ++i)
            {
                const btTransform pose = placedAt(vec(0, 0.3 + 0.0051 * i, 0));
                const btPersistentManifold& found = ours.stepFromNothing(pose, btTransform::getIdentity());
                const btPersistentManifold& wanted = plain.stepFromNothing(pose, btTransform::getIdentity());
                const btPersistentManifold& stock = bullet.stepFromNothing(pose, btTransform::getIdentity());
                ASSERT_EQ(found.getNumContacts() > 0, wanted.getNumContacts() > 0) << pose.getOrigin().y();
                ASSERT_TRUE(found.getNumContacts() > 0 || stock.getNumContacts() == 0)
                    << pose.getOrigin().y();
                (found.getNumContacts() > 0 ? touching : apart) += 1;
                if (found.getNumContacts() == 0)
                    continue;
                EXPECT_NEAR(deepestOf(found), deepestOf(wanted), 2e-4) << pose.getOrigin().y();
            }
            EXPECT_GT(touching, 35);
            EXPECT_GT(apart, 15);
        }
    }
}

/// Counts the calls, and gives every triangle in memory that the next one overwrites.
struct CountingSoup final : btConcaveShape
{
    explicit CountingSoup(const TriangleSoup& named) : soup(named)
    {
        m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE;
    }
    void processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                             const btVector3& high) const override
    {
        struct Copy final : btTriangleCallback
        {
            void processTriangle(btVector3* corners, int part, int index) override
            {
                std::copy(corners, corners + 3, scratch);
                callback->processTriangle(scratch, part, index);
                const btScalar none = std::numeric_limits<btScalar>::quiet_NaN();
                std::fill(scratch, scratch + 3, btVector3(none, none, none));
            }
            btTriangleCallback* callback;
            btVector3 scratch[3];
        } copy;
        copy.callback = callback;
        ++calls;
        soup.processAllTriangles(&copy, low, high);
    }
    void getAabb(const btTransform& pose, btVector3& low, btVector3& high) const override
    {
        soup.getAabb(pose, low, high);
    }
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return soup.getLocalScaling(); }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "CountingSoup"; }

    const TriangleSoup& soup;
    mutable int calls = 0;
};

TEST(MeshAnswers, AskShapesOfTheApplicationInEveryStepForTrianglesInScratch)
{
    std::mt19937 engine(14);
    TriangleSoup soup = soupOfManySizes(engine);
    CountingSoup counting(soup);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    for (const bool isCorrected : {false, true})
    {
        IsaGjkOptions options;
        options.activeEdges = isCorrected;
        MeshBench ours(Loop::Ours, box, counting, false, options),
            direct(Loop::Ours, box, soup, false, options);
        counting.calls = 0;
        for (int step = 1; step <= 5; ++step)
        {
            const btPersistentManifold& found = ours.step(placedAt(vec(0, 0, 0)), btTransform::getIdentity());
            EXPECT_TRUE(
                arePointsEqual(found, direct.step(placedAt(vec(0, 0, 0)), btTransform::getIdentity())));
            EXPECT_GT(found.getNumContacts(), 0);
            EXPECT_EQ(counting.calls, step);
        }
    }
}

TEST(MeshAnswers, AreThoseOfBothSidesWhateverTheWinding)
{
    const btVector3 a = vec(-5, 0, -5), b = vec(0, 0, 5), c = vec(5, 0, -5);
    TriangleSoup oneWay, otherWay;
    addTriangle(oneWay, a, b, c);
    addTriangle(otherWay, a, c, b);
    std::vector<std::unique_ptr<btConvexShape>> bodies;
    bodies.push_back(std::make_unique<btBoxShape>(vec(0.5, 0.5, 0.5)));
    bodies.push_back(std::make_unique<btSphereShape>(btScalar(0.5)));
    bodies.push_back(std::make_unique<btCapsuleShape>(btScalar(0.25), btScalar(0.5)));
    bodies.push_back(std::make_unique<btCylinderShape>(vec(0.5, 0.5, 0.5)));
    for (const auto& body : bodies)
    {
        MeshBench one(Loop::Ours, *body, oneWay), other(Loop::Ours, *body, otherWay);
        for (const double side : {1.0, -1.0})
        {
            const btTransform pose = placedAt(vec(0.1, 0.49 * side, 0.2));
            const btPersistentManifold& found = one.stepFromNothing(pose, btTransform::getIdentity());
            const btPersistentManifold& wound = other.stepFromNothing(pose, btTransform::getIdentity());
            ASSERT_GT(found.getNumContacts(), 0) << body->getName();
            ASSERT_GT(wound.getNumContacts(), 0) << body->getName();
            EXPECT_NEAR(deepestOf(found), -0.01, 1e-4) << body->getName();
            EXPECT_NEAR(deepestOf(wound), -0.01, 1e-4) << body->getName();
            for (const btPersistentManifold* const manifold : {&found, &wound})
            {
                for (int i = 0; i < manifold->getNumContacts(); ++i)
                    EXPECT_NEAR(double(manifold->getContactPoint(i).m_normalWorldOnB.y()), side, 1e-4)
                        << body->getName();
            }
        }
    }
}

/// A triangle that is a segment, a point, a needle, or there twice, and nothing else.
TEST(MeshAnswers, TouchALoneTriangleWithoutArea)
{
    struct Case
    {
        const char* name;
        std::vector<btVector3> corners;
    };
    const btVector3 left = vec(-1, 0, 0), right = vec(1, 0, 0), middle = vec(0, 0, 0);
    const Case cases[] = {
        {"segment", {left, right, middle}},
        {"segment with two equal corners", {left, right, right}},
        {"point", {middle, middle, middle}},
        {"needle", {left, right, vec(0, 0, 1e-6)}},
        {"twice",
         {vec(-2, 0, -2), vec(0, 0, 2), vec(2, 0, -2), vec(-2, 0, -2), vec(0, 0, 2), vec(2, 0, -2)}}};
    std::vector<std::unique_ptr<btConvexShape>> bodies;
    bodies.push_back(std::make_unique<btBoxShape>(vec(0.5, 0.5, 0.5)));
    bodies.push_back(std::make_unique<btCapsuleShape>(btScalar(0.25), btScalar(0.5)));
    bodies.push_back(std::make_unique<btSphereShape>(btScalar(0.5)));
    bodies.push_back(std::make_unique<btCylinderShape>(vec(0.5, 0.5, 0.5)));
    for (const Case& tested : cases)
    {
        TriangleSoup soup;
        soup.corners = tested.corners;
        for (const auto& body : bodies)
        {
            SCOPED_TRACE(testing::Message() << body->getName() << " on a " << tested.name);
            MeshBench ours(Loop::Ours, *body, soup), bullet(Loop::Ours, *body, soup, false, bulletsLoop());
            for (const double height : {0.5, 0.48, 0.2})
            {
                const btTransform pose = placedAt(vec(0, height, 0));
                const btPersistentManifold& found = ours.stepFromNothing(pose, btTransform::getIdentity());
                const btPersistentManifold& wanted = bullet.stepFromNothing(pose, btTransform::getIdentity());
                EXPECT_TRUE(found.getNumContacts() > 0 || wanted.getNumContacts() == 0) << height;
                EXPECT_GT(found.getNumContacts(), 0) << height;
                for (int i = 0; i < found.getNumContacts(); ++i)
                {
                    const btManifoldPoint& point = found.getContactPoint(i);
                    EXPECT_NEAR(double(point.m_normalWorldOnB.length()), 1.0, 1e-5);
                    EXPECT_TRUE(std::isfinite(point.getDistance()));
                    EXPECT_TRUE(std::isfinite(point.m_localPointA.length()));
                    EXPECT_LE(double(point.getDistance()), 0.021);
                }
                if (tested.corners.size() == 6)
                {
                    EXPECT_LE(found.getNumContacts(), 4);
                    EXPECT_NEAR(deepestOf(found), height - 0.5, 1e-3);
                }
            }
        }
    }
}

/// What the manifold is given; Bullet's own points are places in the world, and coarse there.
struct GivenPoint
{
    btScalar distance;
    btVector3 normal;
    int triangle;
};
std::vector<GivenPoint> givenPoints;

bool keepGivenPoint(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                    const btCollisionObjectWrapper*, int, int triangle)
{
    givenPoints.push_back({point.m_distance1, point.m_normalWorldOnB, triangle});
    return false;
}

std::vector<GivenPoint> givenIn(MeshBench& bench, const btTransform& body, const btTransform& mesh)
{
    givenPoints.clear();
    bench.stepFromNothing(body, mesh);
    return givenPoints;
}

/// Positions are multiples of 2^-6, so that nothing is rounded far away.
TEST(MeshAnswers, AreTheSameFarFromTheOriginOfTheWorld)
{
    const double far = sizeof(btScalar) == sizeof(float) ? 65536 : 1048576;
    btTriangleMesh triangles;
    std::mt19937 engine(29);
    std::uniform_int_distribution<int> height(0, 8);
    double heights[9][9];
    for (auto& row : heights)
    {
        for (double& corner : row)
            corner = height(engine) / 64.0;
    }
    const auto corner = [&](int x, int z) { return vec(x - 4, heights[x][z], z - 4); };
    for (int x = 0; x < 8; ++x)
    {
        for (int z = 0; z < 8; ++z)
        {
            triangles.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
            triangles.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
        }
    }
    btBvhTriangleMeshShape shape(&triangles, true);
    const btVector3 shift = vec(far, -far, 0.5 * far);
    std::uniform_int_distribution<int> place(-128, 128);
    gContactAddedCallback = keepGivenPoint;
    for (const BodyWithCore& body : bodiesWithCores(engine))
    {
        MeshBench near(Loop::Ours, *body.shape, shape), away(Loop::Ours, *body.shape, shape);
        for (MeshBench* const bench : {&near, &away})
            bench->mesh().setCollisionFlags(bench->mesh().getCollisionFlags() |
                                            btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        std::size_t points = 0;
        for (int i = 0; i < 100; ++i)
        {
            const int x = place(engine), z = place(engine);
            const btVector3 origin = vec(x / 64.0, 30 / 64.0, z / 64.0);
            const std::vector<GivenPoint> here = givenIn(near, placedAt(origin), placedAt(vec(0, 0, 0)));
            const std::vector<GivenPoint> there = givenIn(away, placedAt(origin + shift), placedAt(shift));
            EXPECT_EQ(here.size(), there.size()) << body.shape->getName() << " " << i;
            for (std::size_t k = 0; k < std::min(here.size(), there.size()); ++k)
            {
                EXPECT_EQ(here[k].triangle, there[k].triangle);
                EXPECT_EQ(here[k].distance, there[k].distance) << body.shape->getName();
                EXPECT_EQ(here[k].normal, there[k].normal);
            }
            points += here.size();
        }
        EXPECT_GT(points, 60u) << body.shape->getName();
    }
    gContactAddedCallback = nullptr;
}

/// The same mesh as an object, in a compound, and in a compound on a compound.
TEST(MeshAnswers, AreTheSameForMeshesInCompounds)
{
    btTriangleMesh triangles;
    const auto corner = [](int x, int z) { return vec(x - 4, 0.05 * ((3 * x + 5 * z) % 4), z - 4); };
    for (int x = 0; x < 8; ++x)
    {
        for (int z = 0; z < 8; ++z)
        {
            triangles.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
            triangles.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
        }
    }
    btBvhTriangleMeshShape shape(&triangles, true);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    const btTransform child(btQuaternion(vec(0, 1, 0), btScalar(0.5)), vec(0.25, 0, -0.5));
    btCompoundShape ground, body;
    ground.addChildShape(child, &shape);
    body.addChildShape(btTransform::getIdentity(), &box);
    for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
    {
        const auto pointsOn = [&](btCollisionShape& groundShape, btCollisionShape& bodyShape,
                                  const btTransform& groundAt, const btVector3& bodyAt)
        {
            ConvexWorld world(narrow);
            world.world.setGravity(vec(0, 0, 0));
            world.add(&groundShape, 0, groundAt);
            world.add(&bodyShape, 1, bodyAt);
            world.world.performDiscreteCollisionDetection();
            std::vector<double> distances;
            for (int m = 0; m < world.dispatcher().getNumManifolds(); ++m)
            {
                const btPersistentManifold& manifold = *world.dispatcher().getManifoldByIndexInternal(m);
                for (int i = 0; i < manifold.getNumContacts(); ++i)
                    distances.push_back(double(manifold.getContactPoint(i).getDistance()));
            }
            std::sort(distances.begin(), distances.end());
            return distances;
        };
        std::mt19937 engine(18);
        std::uniform_real_distribution<double> place(-2, 2);
        std::size_t points = 0;
        for (int i = 0; i < 40; ++i)
        {
            const double x = place(engine), z = place(engine);
            const btVector3 origin = vec(x, 0.58, z);
            const std::vector<double> plain = pointsOn(shape, box, child, origin);
            for (const auto& found : {pointsOn(ground, box, btTransform::getIdentity(), origin),
                                      pointsOn(ground, body, btTransform::getIdentity(), origin)})
            {
                ASSERT_EQ(found.size(), plain.size()) << i;
                for (std::size_t k = 0; k < plain.size(); ++k)
                    EXPECT_NEAR(found[k], plain[k], 1e-5);
            }
            points += plain.size();
        }
        EXPECT_GT(points, 60u);
    }
}

/// A pair has its manifold as long as the boxes overlap, so that a kinematic mesh wakes what sleeps above it.
TEST(MeshAnswers, WakeSleepersAboveKinematicMeshesInBulletsStep)
{
    btTriangleMesh triangles;
    triangles.addTriangle(vec(-5, 0, -5), vec(0, 0, 5), vec(5, 0, -5));
    btBvhTriangleMeshShape shape(&triangles, true);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    const auto wakingStep = [&](Narrow narrow)
    {
        ConvexWorld world(narrow);
        world.world.setGravity(vec(0, 0, 0));
        btRigidBody& ground = world.add(&shape, 0, placedAt(vec(0, -1, 0)));
        ground.setCollisionFlags(ground.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
        ground.setActivationState(DISABLE_DEACTIVATION);
        btRigidBody& sleeper = world.add(&box, 1, placedAt(vec(0, 0.5, 0)));
        sleeper.forceActivationState(ISLAND_SLEEPING);
        for (int step = 0; step < 60; ++step)
        {
            ground.setWorldTransform(placedAt(vec(0, -1 + 0.02 * step, 0)));
            world.step();
            if (sleeper.getActivationState() != ISLAND_SLEEPING)
                return step;
        }
        return -1;
    };
    const int stock = wakingStep(Narrow::Stock);
    EXPECT_GT(stock, 10);
    EXPECT_EQ(wakingStep(Narrow::IsaGjk), stock);
    EXPECT_EQ(wakingStep(Narrow::Dispatcher), stock);
}
}  // namespace
}  // namespace cullet::test
