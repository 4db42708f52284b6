// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes and cylinders that are thinner than their margin after setMargin() or setLocalScaling(), and other inside-out
// scalings.
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
std::unique_ptr<btBoxShape> withMargin(const btVector3& half, double margin)
{
    auto box = std::make_unique<btBoxShape>(half);
    box->setMargin(btScalar(margin));
    return box;
}

std::unique_ptr<btBoxShape> scaled(const btVector3& half, const btVector3& scale)
{
    auto box = std::make_unique<btBoxShape>(half);
    box->setLocalScaling(scale);
    return box;
}

/// A die, plates and rods.
std::vector<std::unique_ptr<btBoxShape>> thinBoxes()
{
    std::vector<std::unique_ptr<btBoxShape>> boxes;
    boxes.push_back(scaled(vec(0.5, 0.5, 0.5), vec(0.01, 0.01, 0.01)));
    boxes.push_back(scaled(vec(0.5, 0.5, 0.5), vec(1, 0.05, 1)));
    boxes.push_back(scaled(vec(0.5, 0.5, 0.5), vec(0.06, 0.05, -1)));
    boxes.push_back(withMargin(vec(0.5, 0.02, 0.5), 0.04));
    boxes.push_back(withMargin(vec(0.3, 0.1, 0.2), 0.25));
    for (const auto& box : boxes)
        EXPECT_LT(box->getImplicitShapeDimensions()[box->getImplicitShapeDimensions().minAxis()], 0);
    return boxes;
}

/// The ground of thin boxes, and the height of its top.
struct Ground
{
    Ground()
    {
        hull->setMargin(btScalar(0.01));
        all = {{hull.get(), 0.51}, {&box, 0.5}, {&sphere, 0.5}, {&capsule, 0.8}, {&triangle, 0.04}};
    }
    std::unique_ptr<btConvexHullShape> hull = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btBoxShape box{vec(0.5, 0.5, 0.5)};
    btSphereShape sphere{btScalar(0.5)};
    btCapsuleShape capsule{btScalar(0.3), btScalar(1)};
    btTriangleShape triangle{vec(-3, 0, -3), vec(0, 0, 5), vec(3, 0, -3)};
    struct Shape
    {
        btConvexShape* shape;
        double top;
    };
    std::vector<Shape> all;
};

const IsaGjkOptions kBoxesToo{BoxPairs::IsaGjk, true};
}  // namespace

TEST(ThinBoxes, TouchWithTheirFaces)
{
    Ground ground;
    for (const auto& box : thinBoxes())
    {
        const double half = double(box->getHalfExtentsWithMargin().y());
        for (const Ground::Shape& below : ground.all)
        {
            ConvexBench bench(false, kBoxesToo);
            for (const double gap : {0.3, 0.02, 0.0, -0.01})
            {
                SCOPED_TRACE(testing::Message()
                             << below.shape->getName() << ", half " << half << ", gap " << gap);
                const auto found = bench.closest(
                    *box, btTransform(btQuaternion::getIdentity(), vec(0, below.top + gap + half, 0)),
                    *below.shape, btTransform::getIdentity(), 0.5);
                ASSERT_TRUE(found);
                EXPECT_NEAR(found->distance, gap, 1e-5);
                EXPECT_GT(found->normal.y(), btScalar(0.9999));
            }
        }
    }
}

TEST(ThinBoxes, TouchAsBoxesThatWereMadeSoThin)
{
    Ground ground;
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> shift(-0.7, 0.7);
    int touching = 0, apart = 0;
    for (const auto& box : thinBoxes())
    {
        btBoxShape made(box->getHalfExtentsWithMargin());
        for (int i = 0; i < 300; ++i)
        {
            const Ground::Shape& other = ground.all[std::size_t(i) % ground.all.size()];
            const btVector3 origin = drawVec(shift, engine);
            const btTransform at(randomRotation(engine), origin);
            ConvexBench bench(false, kBoxesToo);
            const auto thin = bench.closest(*box, at, *other.shape, btTransform::getIdentity(), 2);
            const auto same = bench.closest(made, at, *other.shape, btTransform::getIdentity(), 2);
            ASSERT_TRUE(thin && same);
            EXPECT_NEAR(thin->distance, same->distance, 1e-5) << other.shape->getName();
            (thin->distance < 0 ? touching : apart)++;
        }
    }
    EXPECT_GT(touching, 300);
    EXPECT_GT(apart, 300);
}

TEST(ThinBoxes, ComeIntoContactInTheStepInWhichTheyAreNear)
{
    Ground ground;
    int touching = 0;
    for (const auto& box : thinBoxes())
    {
        const double half = double(box->getHalfExtentsWithMargin().y());
        btDefaultCollisionConfiguration configuration;
        Dispatcher dispatcher(&configuration);
        btDbvtBroadphase broadphase;
        btCollisionWorld world(&dispatcher, &broadphase, &configuration);
        btCollisionObject below, above;
        below.setCollisionShape(ground.hull.get());
        above.setCollisionShape(box.get());
        // Keeps its pairs from being new in every step.
        btSphereShape large(2);
        btCollisionObject far;
        far.setCollisionShape(&large);
        for (btCollisionObject* body : {&below, &above, &far})
        {
            body->getWorldTransform().setIdentity();
            body->getWorldTransform().setOrigin(vec(0, body == &far ? 30 : 5, 0));
        }
        below.getWorldTransform().setOrigin(vec(0, 0, 0));
        world.addCollisionObject(&below);
        world.addCollisionObject(&above);
        world.addCollisionObject(&far);
        const double threshold = std::min(0.02, double(box->getContactBreakingThreshold(btScalar(0.02))));
        for (double gap = 0.1; gap > -0.004; gap -= 0.0017)
        {
            above.getWorldTransform().setOrigin(vec(0.1, 0.51 + gap + half, 0));
            world.performDiscreteCollisionDetection();
            double deepest = 1;
            for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
            {
                const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
                for (int k = 0; k < manifold.getNumContacts(); ++k)
                    deepest = std::min(deepest, double(manifold.getContactPoint(k).getDistance()));
            }
            if (gap > threshold + 1e-5)
            {
                EXPECT_EQ(deepest, 1) << gap;
            }
            if (gap > threshold - 1e-5)
                continue;
            EXPECT_NEAR(deepest, gap, 1e-5);
            ++touching;
        }
        for (btCollisionObject* body : {&below, &above, &far})
            world.removeCollisionObject(body);
    }
    EXPECT_GT(touching, 15);
}

TEST(ThinBoxes, RestOnAHullAndSleep)
{
    const auto floor = makeHullShape(boxPoints(3, 0.5, 3));
    for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
    {
        const auto boxes = thinBoxes();
        ConvexWorld world(narrow);
        world.add(floor.get(), 0, vec(0, -0.54, 0));
        for (std::size_t i = 0; i < boxes.size(); ++i)
            world.add(boxes[i].get(), 1,
                      vec(1.2 * double(i) - 2.4, double(boxes[i]->getHalfExtentsWithMargin().y()) + 0.01, 0));
        world.step(240);
        for (std::size_t i = 0; i < boxes.size(); ++i)
        {
            const btRigidBody& body = *world.bodies[i + 1];
            EXPECT_NEAR(double(body.getWorldTransform().getOrigin().y()),
                        double(boxes[i]->getHalfExtentsWithMargin().y()), 2e-3)
                << i;
            EXPECT_FALSE(body.isActive()) << i;
        }
    }
}

TEST(ThinBoxes, MatchBulletBesideShapesOfItsContactsWhateverTouchedBefore)
{
    btCylinderShape cylinder(vec(0.9, 1.9, 0.16));
    btConeShape cone(btScalar(0.5), 1);
    std::mt19937 engine(9);
    std::uniform_real_distribution<double> shift(-2.5, 2.5);
    int apart = 0, reported = 0;
    for (const auto& box : thinBoxes())
    {
        for (btConvexShape* other :
             {static_cast<btConvexShape*>(&cylinder), static_cast<btConvexShape*>(&cone)})
        {
            ConvexBench bench(false, kBoxesToo), stock(true);
            ConvexPairProbe used(bench.dispatcher, *box, *other);
            for (int i = 0; i < 200; ++i)
            {
                const btMatrix3x3 turn(randomRotation(engine));
                const btTransform at(turn, drawVec(shift, engine));
                used.place(btTransform::getIdentity(), btTransform::getIdentity());
                ASSERT_GT(used.step()->getNumContacts(), 0);
                ConvexPairProbe fresh(bench.dispatcher, *box, *other), bullet(stock.dispatcher, *box, *other);
                std::vector<Reported> points[3];
                ConvexPairProbe* probes[] = {&used, &fresh, &bullet};
                for (std::size_t k = 0; k < 3; ++k)
                {
                    probes[k]->place(at, btTransform::getIdentity());
                    points[k] = probes[k]->query(0.25);
                }
                for (std::size_t k = 1; k < 3; ++k)
                {
                    ASSERT_EQ(points[k].size(), points[0].size()) << i;
                    for (std::size_t p = 0; p < points[0].size(); ++p)
                    {
                        EXPECT_EQ(points[k][p].distance, points[0][p].distance) << i;
                        EXPECT_EQ(points[k][p].onB, points[0][p].onB) << i;
                    }
                }
                (points[0].empty() ? apart : reported)++;
            }
        }
    }
    EXPECT_GT(apart, 300);
    EXPECT_GT(reported, 300);
}

TEST(InvertedShapes, MatchBulletForThinCylindersAndMirroredCapsules)
{
    Ground ground;
    btCylinderShape die(vec(0.5, 0.5, 0.5)), disc(vec(0.5, 0.02, 0.5)), rod(vec(0.02, 0.5, 0.02));
    btCapsuleShape capsule(btScalar(0.1), btScalar(0.6));
    die.setLocalScaling(vec(0.01, 0.01, 0.01));
    disc.setMargin(btScalar(0.04));
    rod.setMargin(btScalar(0.04));
    capsule.setLocalScaling(vec(-1, -1, -1));
    std::mt19937 engine(6);
    std::uniform_real_distribution<double> shift(-0.7, 0.7);
    int touching = 0, apart = 0;
    for (btConvexShape* shape : std::initializer_list<btConvexShape*>{&die, &disc, &rod, &capsule})
    {
        for (btConvexShape* other : std::initializer_list<btConvexShape*>{ground.hull.get(), &ground.box})
        {
            for (int i = 0; i < 200; ++i)
            {
                ConvexBench bench, stock(true);
                ConvexPairProbe ours(bench.dispatcher, *shape, *other),
                    bullets(stock.dispatcher, *shape, *other);
                const btVector3 origin = drawVec(shift, engine);
                const btTransform at(randomRotation(engine), origin);
                ours.place(at, btTransform::getIdentity());
                bullets.place(at, btTransform::getIdentity());
                const std::vector<Reported> points = ours.query(), expected = bullets.query();
                ASSERT_EQ(points.size(), expected.size());
                for (std::size_t k = 0; k < points.size(); ++k)
                    EXPECT_EQ(points[k].distance, expected[k].distance);
                (points.empty() ? apart : touching)++;
            }
        }
    }
    EXPECT_GT(touching, 300);
    EXPECT_GT(apart, 300);
}

TEST(ThinBoxes, GiveFiniteContactsWhenInvertedOrEmpty)
{
    const auto hull = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::vector<std::unique_ptr<btBoxShape>> boxes;
    boxes.push_back(std::make_unique<btBoxShape>(vec(-0.1, -0.1, -0.1)));
    boxes.push_back(withMargin(vec(0.1, -0.1, 0.1), 0.04));
    boxes.push_back(scaled(vec(0.5, 0.5, 0.5), vec(1, 0, 1)));
    boxes.push_back(scaled(vec(0.5, 0.5, 0.5), vec(0, 0, 0)));
    for (const auto& box : boxes)
    {
        ConvexBench bench;
        ConvexPairProbe probe(bench.dispatcher, *box, *hull);
        for (const double height : {2.0, 0.5, 0.0})
        {
            probe.place(vec(0, height, 0), vec(0, 0, 0));
            for (const Reported& point : probe.query(1))
                EXPECT_TRUE(std::isfinite(point.distance) && std::isfinite(double(point.onB.length2())));
        }
        EXPECT_FALSE(probe.query().empty());
    }
}
}  // namespace cullet::test
