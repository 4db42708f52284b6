// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <LinearMath/btPoolAllocator.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <malloc.h>
#include <random>
#include <typeinfo>
#include <utility>

namespace cullet::test
{
namespace
{
bool isOurs(const btCollisionAlgorithm& algorithm)
{
    return typeid(algorithm) == typeid(IsaGjkAlgorithm);
}

/// A shape class of the application: an ellipsoid.
class EggShape : public btConvexInternalShape
{
public:
    EggShape() { m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE; }

    btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override
    {
        const btVector3 half(btScalar(0.4), btScalar(0.46), btScalar(0.3));
        const btVector3 scaled = direction * half;
        return scaled.fuzzyZero() ? btVector3(0, 0, 0) : half * scaled.normalized();
    }
    void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* supports,
                                                           int count) const override
    {
        for (int i = 0; i < count; ++i)
            supports[i] = localGetSupportingVertexWithoutMargin(directions[i]);
    }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "Egg"; }
};

/// One shape of each of Bullet's types.
struct Shapes
{
    Shapes()
    {
        for (int i = 0; i < 4; ++i)
            mesh.addTriangle(corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]);
        all = {hull.get(), &box,         &sphere,   &capsule,    &cylinder, &cone,         &multiSphere,
               &triangle,  &tetrahedron, &meshHull, &pointCloud, &scaled,   &minkowskiSum, &egg};
    }
    std::unique_ptr<btConvexHullShape> hull = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btBoxShape box{vec(0.5, 0.5, 0.5)};
    btSphereShape sphere{btScalar(0.5)};
    btCapsuleShape capsule{btScalar(0.3), btScalar(0.6)};
    btCylinderShape cylinder{vec(0.5, 0.5, 0.5)};
    btConeShape cone{btScalar(0.5), btScalar(1)};
    btVector3 centres[2] = {vec(-0.2, 0, 0), vec(0.2, 0, 0)};
    btScalar radii[2] = {btScalar(0.3), btScalar(0.4)};
    btMultiSphereShape multiSphere{centres, radii, 2};
    btTriangleShape triangle{vec(-0.5, 0, -0.5), vec(0.5, 0, -0.5), vec(0, 0, 0.5)};
    btVector3 corners[4] = {vec(0, 0.5, 0), vec(0.5, -0.5, 0.3), vec(-0.5, -0.5, 0.3), vec(0, -0.5, -0.6)};
    btBU_Simplex1to4 tetrahedron{corners[0], corners[1], corners[2], corners[3]};
    btTriangleMesh mesh;
    btConvexTriangleMeshShape meshHull{&mesh};
    btConvexPointCloudShape pointCloud{corners, 4, vec(1, 1, 1)};
    btUniformScalingShape scaled{&cone, btScalar(0.9)};
    btMinkowskiSumShape minkowskiSum{&triangle, &sphere};
    EggShape egg;
    std::vector<btConvexShape*> all;
};
}  // namespace

TEST(IsaGjkAlgorithm, FitsIntoBulletsPoolAndTakesNoHeap)
{
    EXPECT_LE(sizeof(IsaGjkAlgorithm), 192u);
    Shapes shapes;
    ConvexBench bench;
    const std::size_t before = mallinfo2().uordblks;
    ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box);
    EXPECT_EQ(mallinfo2().uordblks, before);
    EXPECT_TRUE(isOurs(*probe.algorithm));
    EXPECT_TRUE(bench.configuration.getCollisionAlgorithmPool()->validPtr(probe.algorithm));
}

TEST(IsaGjkAlgorithm, ReleasesItsOwnManifoldAndNoOther)
{
    Shapes shapes;
    ConvexBench bench;
    {
        ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box);
        probe.place(vec(0, 1.05, 0), vec(0, 0, 0));
        EXPECT_EQ(bench.dispatcher.getNumManifolds(), 0);
        probe.step();
        EXPECT_EQ(bench.dispatcher.getNumManifolds(), 1);
        btManifoldArray manifolds;
        probe.algorithm->getAllContactManifolds(manifolds);
        EXPECT_EQ(manifolds.size(), 1);
    }
    EXPECT_EQ(bench.dispatcher.getNumManifolds(), 0);

    btCollisionObject a, b;
    a.setCollisionShape(shapes.hull.get());
    b.setCollisionShape(&shapes.box);
    btPersistentManifold* shared = bench.dispatcher.getNewManifold(&a, &b);
    {
        ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box, BT_CONTACT_POINT_ALGORITHMS,
                              shared);
        probe.step();
        btManifoldArray manifolds;
        probe.algorithm->getAllContactManifolds(manifolds);
        EXPECT_EQ(manifolds.size(), 0);
    }
    EXPECT_EQ(bench.dispatcher.getNumManifolds(), 1);
    bench.dispatcher.releaseManifold(shared);
}

TEST(IsaGjkAlgorithm, IsRegisteredInBothOrdersAndTablesExceptForBulletsSpecialPairs)
{
    Shapes shapes;
    ConvexBench bench, withBoxes(false, {BoxPairs::IsaGjk, true});
    int ours = 0;
    for (const auto table : {BT_CONTACT_POINT_ALGORITHMS, BT_CLOSEST_POINT_ALGORITHMS})
    {
        for (btConvexShape* a : shapes.all)
        {
            for (btConvexShape* b : shapes.all)
            {
                const auto isRound = [&](btConvexShape* s)
                { return s == &shapes.sphere || s == &shapes.capsule; };
                const bool isSphereTriangle = (a == &shapes.sphere && b == &shapes.triangle) ||
                                              (b == &shapes.sphere && a == &shapes.triangle);
                const bool isBoxBox = a == &shapes.box && b == &shapes.box;
                const bool isStock = (isRound(a) && isRound(b)) || isSphereTriangle;
                ConvexPairProbe probe(bench.dispatcher, *a, *b, table);
                EXPECT_EQ(isOurs(*probe.algorithm), !isStock && !isBoxBox) << a->getName() << b->getName();
                ConvexPairProbe boxProbe(withBoxes.dispatcher, *a, *b, table);
                EXPECT_EQ(isOurs(*boxProbe.algorithm), !isStock) << a->getName() << b->getName();
                ours += isOurs(*probe.algorithm);
            }
        }
    }
    // Excluded: two round shapes, a sphere and a triangle, two boxes.
    EXPECT_EQ(ours, 2 * (14 * 14 - 4 - 2 - 1));
    btBox2dShape flat(vec(1, 1, 0));
    ConvexPairProbe probe(bench.dispatcher, flat, *shapes.hull);
    EXPECT_FALSE(isOurs(*probe.algorithm));
}

TEST(IsaGjkAlgorithm, SetsTheManifoldAndRefreshesItAlsoWhenTheShapesAreFarApart)
{
    Shapes shapes;
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box);
    probe.place(vec(0, 1.04, 0), vec(0, 0, 0));
    btPersistentManifold* manifold = probe.step();
    ASSERT_NE(manifold, nullptr);
    EXPECT_EQ(manifold->getNumContacts(), 4);
    EXPECT_EQ(manifold->getContactPoint(0).getLifeTime(), 1);
    probe.step();
    EXPECT_EQ(manifold->getContactPoint(0).getLifeTime(), 2);
    probe.place(vec(0, 5, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step(), manifold);
    EXPECT_EQ(manifold->getNumContacts(), 0);
    EXPECT_EQ(probe.step(), manifold);
    EXPECT_GE(bench.registration->stats().separatedTotal, 2u);
}

TEST(IsaGjkAlgorithm, RefreshesWhatIsAddedToTheManifoldOfShapesThatStayApart)
{
    Shapes shapes;
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box);
    probe.place(vec(0, 3, 0), vec(0, 0, 0));
    probe.step();
    btPersistentManifold* manifold = probe.step();
    EXPECT_EQ(bench.registration->stats().separatedTotal, 2u);
    // At the bodies' centres the distance of the point exceeds the threshold of the manifold.
    manifold->addManifoldPoint(btManifoldPoint(vec(0, 0, 0), vec(0, 0, 0), vec(0, 1, 0), 0));
    probe.step();
    EXPECT_EQ(bench.registration->stats().separatedTotal, 3u);
    EXPECT_EQ(manifold->getNumContacts(), 0);
}

TEST(IsaGjkAlgorithm, LeavesTheRefreshOfASharedManifoldToItsOwner)
{
    Shapes shapes;
    ConvexBench bench;
    btCollisionObject a, b;
    a.setCollisionShape(shapes.hull.get());
    b.setCollisionShape(&shapes.box);
    btPersistentManifold* shared = bench.dispatcher.getNewManifold(&a, &b);
    {
        ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box, BT_CONTACT_POINT_ALGORITHMS,
                              shared);
        shared->setBodies(&probe.bodyA, &probe.bodyB);
        probe.place(vec(0, 1.04, 0), vec(0, 0, 0));
        probe.step();
        EXPECT_EQ(shared->getNumContacts(), 4);
        EXPECT_EQ(shared->getContactPoint(0).getLifeTime(), 0);
        probe.place(vec(0, 5, 0), vec(0, 0, 0));
        probe.step();
        EXPECT_EQ(shared->getNumContacts(), 4);
    }
    bench.dispatcher.releaseManifold(shared);
}

TEST(IsaGjkAlgorithm, HandlesAShapeOfAnyTypeThatABodyIsGivenLater)
{
    Shapes shapes;
    ConvexBench bench, stock(true);
    ConvexPairProbe probe(bench.dispatcher, *shapes.hull, *shapes.hull);
    int touching = 0, apart = 0;
    for (const double height : {0.9, 1.005, 3.0})
    {
        for (btConvexShape* a : shapes.all)
        {
            for (btConvexShape* b : shapes.all)
            {
                // Points of the old shapes would stay, as in Bullet.
                probe.place(vec(0, 9, 0), vec(0, 0, 0));
                probe.step();
                probe.bodyA.setCollisionShape(a);
                probe.bodyB.setCollisionShape(b);
                probe.place(vec(0.05, height, 0), vec(0, 0, 0.03));
                const bool isTouching = probe.step()->getNumContacts() > 0;
                ConvexPairProbe fresh(stock.dispatcher, *shapes.hull, *shapes.hull);
                // Its manifold then has the threshold of the same shapes.
                fresh.place(vec(0, 9, 0), vec(0, 0, 0));
                fresh.step();
                fresh.bodyA.setCollisionShape(a);
                fresh.bodyB.setCollisionShape(b);
                fresh.place(vec(0.05, height, 0), vec(0, 0, 0.03));
                EXPECT_EQ(isTouching, fresh.step()->getNumContacts() > 0)
                    << a->getName() << ' ' << b->getName() << ' ' << height;
                (isTouching ? touching : apart)++;
            }
        }
    }
    EXPECT_GT(touching, 150);
    EXPECT_GT(apart, 250);
    EXPECT_GT(bench.registration->stats().delegatedTotal, 20u);
    btBox2dShape flat(vec(0.5, 0.5, 0));
    probe.bodyA.setCollisionShape(&flat);
    probe.step();
}

TEST(IsaGjkAlgorithm, MatchesBulletsDistancesForShapesOfAllKinds)
{
    Shapes shapes;
    ConvexBench bench, stock(true);
    const btTransform below(btQuaternion(vec(0, 1, 0), btScalar(0.4)), vec(0, 0, 0.03));
    const btTransform above(btQuaternion(vec(1, 0, 0), btScalar(0.3)), vec(0.2, 1.6, 0.1));
    for (btConvexShape* a : shapes.all)
    {
        for (btConvexShape* b : shapes.all)
        {
            const auto ours = bench.closest(*a, above, *b, below, 2);
            const auto bullets = stock.closest(*a, above, *b, below, 2);
            ASSERT_TRUE(ours && bullets) << a->getName() << ' ' << b->getName();
            EXPECT_NEAR(ours->distance, bullets->distance, 2e-3) << a->getName() << ' ' << b->getName();
            EXPECT_GT(ours->normal.dot(bullets->normal), btScalar(0.999))
                << a->getName() << ' ' << b->getName();
        }
    }
    EXPECT_EQ(bench.registration->stats().notConvergedTotal, 0u);
}

TEST(IsaGjkAlgorithm, PointsNormalFromBToAInBothOrders)
{
    Shapes shapes;
    ConvexBench bench;
    for (const bool isSwapped : {false, true})
    {
        btConvexShape& upper = *shapes.hull;
        btConvexShape& lower = shapes.box;
        ConvexPairProbe probe(bench.dispatcher, isSwapped ? lower : upper, isSwapped ? upper : lower);
        const btVector3 high = vec(0, 1.03, 0), low = vec(0, 0, 0);
        probe.place(isSwapped ? low : high, isSwapped ? high : low);
        const std::vector<Reported> points = probe.query();
        ASSERT_EQ(points.size(), 4u);
        for (const Reported& point : points)
        {
            EXPECT_NEAR(double(point.normal.y()), isSwapped ? -1 : 1, 1e-6);
            EXPECT_NEAR(point.distance, 1.03 - 1 - 0.04, 1e-6);
            // On the surface of B, margin included.
            EXPECT_NEAR(double(point.onB.y()), isSwapped ? 0.53 - 0.04 : 0.5, 1e-6);
        }
    }
}

TEST(IsaGjkAlgorithm, ReportsNoContactOfFlatHullsApartInOnePlaneAfterCrossing)
{
    const auto hull = makeHullShape({vec(0, 0, 0), vec(2, 0, 0), vec(0, 0, 2)});
    const auto other = makeHullShape({vec(0, 0, 0), vec(-2, 0, 0), vec(0, 0, -2)});
    ConvexBench bench;
    std::mt19937 engine(1);
    std::normal_distribution<double> normal;
    int crossed = 0;
    for (int i = 0; i < 500; ++i)
    {
        SCOPED_TRACE(i);
        ConvexPairProbe probe(bench.dispatcher, *hull, *other);
        const btVector3 axis = drawVec(normal, engine).normalized();
        const double z = 1 + 0.5 * normal(engine), y = 0.3 * normal(engine), x = 1 + 0.5 * normal(engine);
        const btVector3 at = vec(x, y, z);
        const btTransform still(btQuaternion::getIdentity(), vec(0, 0, 0));
        probe.place(still, btTransform(btQuaternion(axis, btScalar(normal(engine))), at));
        crossed += probe.step()->getNumContacts() > 0 ? 1 : 0;
        // 0.283 apart, with margins of 0.08.
        probe.place(vec(0, 0, 0), vec(2.2, 0, 2.2));
        for (int frame = 0; frame < 3; ++frame)
            EXPECT_EQ(probe.step()->getNumContacts(), 0);
        EXPECT_TRUE(probe.query().empty());
    }
    EXPECT_GT(crossed, 50);
}

TEST(IsaGjkAlgorithm, PlacesContactAtSphereCentreThatLiesInFlatHull)
{
    const auto hull = makeHullShape({vec(-5, 0, -5), vec(5, 0, -5), vec(5, 0, 5), vec(-5, 0, 5)});
    btSphereShape sphere(btScalar(0.5));
    ConvexBench bench;
    for (const bool isSwapped : {false, true})
    {
        btConvexShape& a = isSwapped ? static_cast<btConvexShape&>(sphere) : *hull;
        btConvexShape& b = isSwapped ? static_cast<btConvexShape&>(*hull) : sphere;
        ConvexPairProbe probe(bench.dispatcher, a, b);
        probe.place(isSwapped ? vec(1, 0, 2) : vec(0, 0, 0), isSwapped ? vec(0, 0, 0) : vec(1, 0, 2));
        const std::vector<Reported> points = probe.query();
        ASSERT_FALSE(points.empty());
        for (const Reported& point : points)
        {
            EXPECT_NEAR(std::abs(double(point.normal.y())), 1.0, 1e-6);
            EXPECT_NEAR(double(point.onB.x()), 1.0, 1e-5);
            EXPECT_NEAR(double(point.onB.z()), 2.0, 1e-5);
        }
    }
}

TEST(IsaGjkAlgorithm, ReportsNoPointForTransformsOrHullsThatAreNotFinite)
{
    Shapes shapes;
    ConvexBench bench;
    const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
    const btScalar infinity = std::numeric_limits<btScalar>::infinity();
    for (btConvexShape* shape : shapes.all)
    {
        ConvexPairProbe probe(bench.dispatcher, *shape, *shapes.hull);
        for (const btScalar bad : {nan, infinity, -infinity})
        {
            btTransform broken(btQuaternion::getIdentity(), btVector3(bad, 0, 0));
            probe.place(broken, btTransform::getIdentity());
            EXPECT_TRUE(probe.query().empty());
            btMatrix3x3 basis = btMatrix3x3::getIdentity();
            basis[1][2] = bad;
            probe.place(btTransform::getIdentity(), btTransform(basis));
            EXPECT_TRUE(probe.query().empty());
        }
        // The algorithm works as before once the transforms are valid again.
        probe.place(vec(0, 0.1, 0), vec(0, 0, 0));
        EXPECT_FALSE(probe.query().empty());
    }
    auto broken = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    broken->getUnscaledPoints()[3].setX(nan);
    btConvexHullShape empty;
    ConvexPairProbe brokenProbe(bench.dispatcher, *broken, shapes.box);
    EXPECT_TRUE(brokenProbe.query().empty());
    ConvexPairProbe emptyProbe(bench.dispatcher, empty, shapes.box);
    EXPECT_TRUE(emptyProbe.query().empty());
}

TEST(IsaGjkAlgorithm, ReportsNoContactOfTriangleWithCornerThatIsNotFinite)
{
    Shapes shapes;
    ConvexBench bench;
    const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
    const btScalar infinity = std::numeric_limits<btScalar>::infinity();
    for (btConvexShape* partner : shapes.all)
    {
        // Pairs handled by Bullet.
        if (partner == &shapes.sphere)
            continue;
        for (int i = 0; i < 9; ++i)
        {
            for (const btScalar bad : {nan, infinity, -infinity})
            {
                btTriangleShape triangle = shapes.triangle;
                btScalar& coordinate = triangle.m_vertices1[i / 3][i % 3];
                ConvexPairProbe probe(bench.dispatcher, triangle, *partner);
                const btScalar good = std::exchange(coordinate, bad);
                EXPECT_TRUE(probe.query().empty()) << partner->getName() << ' ' << i << ' ' << bad;
                EXPECT_EQ(probe.step()->getNumContacts(), 0);
                coordinate = good;
                EXPECT_FALSE(probe.query().empty()) << partner->getName();
            }
        }
    }
}

TEST(IsaGjkAlgorithm, LeavesTheUsersPointersAndIndicesAlone)
{
    Shapes shapes;
    ConvexBench bench;
    int mine = 0;
    shapes.hull->setUserPointer(&mine);
    shapes.hull->setUserIndex(11);
    shapes.hull->setUserIndex2(12);
    prepare(*shapes.hull);
    ConvexPairProbe probe(bench.dispatcher, *shapes.hull, shapes.box);
    probe.step();
    invalidate(*shapes.hull);
    EXPECT_EQ(shapes.hull->getUserPointer(), &mine);
    EXPECT_EQ(shapes.hull->getUserIndex(), 11);
    EXPECT_EQ(shapes.hull->getUserIndex2(), 12);
}

TEST(IsaGjkAlgorithm, MatchesBulletsTimeOfImpact)
{
    Shapes shapes;
    ConvexBench bench, stock(true);
    std::vector<btScalar> fractions;
    for (ConvexBench* side : {&stock, &bench})
    {
        ConvexPairProbe probe(side->dispatcher, *shapes.hull, *shapes.hull);
        probe.place(vec(0, 5, 0), vec(0, 0, 0));
        probe.bodyA.setInterpolationWorldTransform(btTransform(btQuaternion::getIdentity(), vec(0, -5, 0)));
        probe.bodyB.setInterpolationWorldTransform(probe.bodyB.getWorldTransform());
        probe.bodyA.setCcdMotionThreshold(btScalar(0.1));
        probe.bodyA.setCcdSweptSphereRadius(btScalar(0.2));
        probe.bodyB.setCcdSweptSphereRadius(btScalar(0.2));
        fractions.push_back(probe.algorithm->calculateTimeOfImpact(&probe.bodyA, &probe.bodyB, {}, nullptr));
    }
    EXPECT_LT(fractions[0], btScalar(0.9));
    EXPECT_EQ(fractions[0], fractions[1]);
}

TEST(IsaGjkAlgorithm, AppliesMultipointSettingsOfConfigurationAtOnce)
{
    ConvexBench bench;
    auto ball = makeHullShape(ballPoints(40, 0.5, 3));
    btBoxShape box(vec(0.5, 0.5, 0.5));
    ConvexPairProbe probe(bench.dispatcher, *ball, box);
    probe.place(vec(0, 1.0, 0), vec(0, 0, 0));
    const std::size_t before = probe.query().size();
    ASSERT_GE(before, 1u);
    bench.configuration.setConvexConvexMultipointIterations(6, 4);
    EXPECT_GE(probe.query().size(), before + 6);
    bench.configuration.setConvexConvexMultipointIterations(0, 4);
    EXPECT_EQ(probe.query().size(), before);
}
}  // namespace cullet::test
