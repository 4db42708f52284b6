// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/compound/compound_scene.h"

#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <utility>

// Pairs with a compound that have not moved and have no contacts are left out of a dispatch.
namespace cullet::test
{
namespace
{
/// A compound of all kinds of children above another shape, their boxes overlapping, without contacts.
struct RestingScene
{
    RestingScene()
    {
        for (int i = 0; i < 8; ++i)
            hull.addPoint(vec(i & 1 ? 0.3 : -0.3, i & 2 ? 0.3 : -0.3, i & 4 ? 0.3 : -0.3), false);
        hull.recalcLocalAabb();
        floor.addChildShape(at(0, -1, 0), &ground);
        floor.addChildShape(at(9, 3, 9), &pillar);
        fillCompound(compound);
        fillCompound(inner);
        nested.addChildShape(at(0, 0, 0), &inner);
    }
    void fillCompound(btCompoundShape& shape)
    {
        btCollisionShape* const children[] = {&box, &ball, &hull, &capsule, &cylinder, &cone};
        for (int i = 0; i < 6; ++i)
            shape.addChildShape(at(i - 2.5, 0, 0), children[i]);
    }
    /// @return pairs that the step has left out
    std::uint64_t idlePairsOfStep()
    {
        scene.step();
        return scene.dispatcher().idlePairs();
    }
    void letRest()
    {
        for (int i = 0; i < 3; ++i)
            scene.step();
        EXPECT_EQ(scene.dispatcher().idlePairs(), 1u);
        EXPECT_TRUE(scene.contacts().empty());
    }
    std::size_t contactsOfStep()
    {
        scene.step();
        return scene.contacts().size();
    }
    /// Of all points, in steps.
    std::vector<int> ages()
    {
        std::vector<int> all;
        for (int i = 0; i < scene.manifoldCount(); ++i)
        {
            const btPersistentManifold& manifold = *scene.dispatcher().getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
                all.push_back(manifold.getContactPoint(k).getLifeTime());
        }
        return all;
    }
    void placeOverPlane()
    {
        other = &scene.add(plane, at(0, 0, 0), true);
        body = &scene.add(compound, at(0, 1, 0));
    }
    void lowerPoint() { const_cast<btVector3*>(hull.getUnscaledPoints())[0].setY(btScalar(-1.1)); }
    void lowerHull()
    {
        lowerPoint();
        hull.recalcLocalAabb();
    }

    btBoxShape box{vec(0.3, 0.3, 0.3)}, large{vec(1, 1, 1)};
    btSphereShape ball{btScalar(0.3)};
    btCapsuleShape capsule{btScalar(0.2), btScalar(0.2)};
    btCylinderShape cylinder{vec(0.3, 0.3, 0.3)};
    btConeShape cone{btScalar(0.3), btScalar(0.6)};
    btConvexHullShape hull;
    btBoxShape ground{vec(10, 1, 10)}, pillar{vec(0.2, 3, 0.2)};
    btStaticPlaneShape plane{vec(0, 1, 0), 0}, high{vec(0, 1, 0), btScalar(0.75)};
    btCompoundShape compound, inner, nested, floor;
    CompoundScene scene{CompoundLoop::Own};
    btCollisionObject *other = nullptr, *body = nullptr;
};

struct CompoundAtRest : RestingScene, testing::Test
{
};

// A turned compound is in the box of the other shape, but not near it.
const btTransform kTurned(btQuaternion(btVector3(0, 0, 1), btScalar(0.5)), vec(0, 2.2, 0));

TEST_F(CompoundAtRest, IsLeftOutOverAnyShapeThatCannotChangeUnseen)
{
    for (btCollisionShape* const other :
         {static_cast<btCollisionShape*>(&plane), static_cast<btCollisionShape*>(&floor)})
    {
        for (btCompoundShape* const shape : {&compound, &nested})
        {
            for (const bool isFirst : {false, true})
            {
                CompoundScene own(CompoundLoop::Own);
                if (isFirst)
                    own.add(*shape, kTurned);
                own.add(*other, at(0, 0, 0), true);
                if (!isFirst)
                    own.add(*shape, kTurned);
                own.step();
                EXPECT_EQ(own.dispatcher().idlePairs(), 0u);
                own.step();
                EXPECT_EQ(own.dispatcher().idlePairs(), 0u);
                const int manifolds = own.manifoldCount();
                for (int i = 0; i < 3; ++i)
                {
                    own.step();
                    EXPECT_EQ(own.dispatcher().idlePairs(), 1u);
                    EXPECT_EQ(own.manifoldCount(), manifolds);
                }
                EXPECT_TRUE(own.contacts().empty());
                own.clear();
                EXPECT_EQ(own.manifoldCount(), 0);
                EXPECT_EQ(own.usedAlgorithms(), 0);
            }
        }
    }
}

TEST_F(CompoundAtRest, IsNotLeftOutOverTriangles)
{
    btTriangleMesh triangles;
    triangles.addTriangle(vec(-9, 0, -9), vec(0, 0, 9), vec(9, 0, -9));
    btBvhTriangleMeshShape mesh(&triangles, true);
    scene.add(mesh, at(0, 0, 0), true);
    scene.add(compound, at(0, 0.35, 0));
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(idlePairsOfStep(), 0u);
    scene.clear();
}

// Nothing says when the application's heights change.
TEST_F(CompoundAtRest, SeesTerrainThatRises)
{
    std::vector<btScalar> heights(9, btScalar(0));
    btHeightfieldTerrainShape terrain(3, 3, heights.data(), 1, 0, 4, 1, PHY_FLOAT, false);
    terrain.setLocalScaling(vec(9, 1, 9));
    // PHY_FLOAT means btScalar there. The heights are about the middle of their range.
    scene.add(terrain, at(0, 2, 0), true);
    scene.add(compound, at(0, 1, 0));
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(contactsOfStep(), 0u);
    heights.assign(9, btScalar(0.75));
    EXPECT_GT(contactsOfStep(), 0u);
    scene.clear();
}

TEST_F(CompoundAtRest, IsNotLeftOutWithContacts)
{
    scene.add(plane, at(0, 0, 0), true);
    scene.add(compound, at(0, 0.3, 0));
    for (int i = 0; i < 5; ++i)
        EXPECT_EQ(idlePairsOfStep(), 0u);
    // The age of a point is counted in every step.
    const std::vector<int> all = ages();
    ASSERT_FALSE(all.empty());
    EXPECT_GE(*std::max_element(all.begin(), all.end()), 4);
}

// Algorithms of pairs of children refresh their points themselves, and not once more at the end.
TEST_F(CompoundAtRest, LetsPointsOfPairsOfChildrenAgeByOneInEachStep)
{
    scene.add(floor, at(0, 0, 0), true);
    scene.add(compound, at(0, 0.29, 0));
    for (int i = 0; i < 3; ++i)
        scene.step();
    std::vector<int> all = ages();
    ASSERT_FALSE(all.empty());
    for (int i = 0; i < 3; ++i)
    {
        const int most = *std::max_element(all.begin(), all.end());
        scene.step();
        all = ages();
        EXPECT_EQ(*std::max_element(all.begin(), all.end()), most + 1);
    }
}

TEST_F(CompoundAtRest, IsNotLeftOutWithShapeOfDerivedClass)
{
    struct OwnBall : btSphereShape
    {
        using btSphereShape::btSphereShape;
    } own(btScalar(0.3));
    compound.addChildShape(at(0, 0.5, 0), &own);
    scene.add(plane, at(0, 0, 0), true);
    scene.add(compound, at(0, 2, 0));
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(idlePairsOfStep(), 0u);
    scene.clear();
}

struct Edit
{
    const char* name;
    std::function<void(RestingScene&)> make;
};

/// The compound is a metre above a plane; after each of these a child touches it.
const Edit kEdits[] = {
    {"child's transform in place",
     [](RestingScene& s) { s.compound.getChildTransform(2).setOrigin(vec(0, -0.8, 0)); }},
    {"updateChildTransform()", [](RestingScene& s) { s.compound.updateChildTransform(1, at(0, -0.8, 0)); }},
    {"child's shape",
     [](RestingScene& s)
     {
         s.compound.getChildList()[0].m_childShape = &s.large;
         s.compound.getChildList()[0].m_childShapeType = s.large.getShapeType();
     }},
    {"one more child", [](RestingScene& s) { s.compound.addChildShape(at(0, -0.8, 0), &s.ball); }},
    {"size of a box", [](RestingScene& s) { s.box.setImplicitShapeDimensions(vec(1, 1, 1)); }},
    {"size of a sphere", [](RestingScene& s) { s.ball.setUnscaledRadius(btScalar(1)); }},
    {"points of a hull", [](RestingScene& s) { s.lowerHull(); }},
    {"points of a hull, and its box two steps later",
     [](RestingScene& s)
     {
         s.lowerPoint();
         s.scene.step();
         s.scene.step();
         s.hull.recalcLocalAabb();
     }},
    {"scaling", [](RestingScene& s) { s.compound.setLocalScaling(vec(4, 4, 4)); }},
    {"margin of a hull", [](RestingScene& s) { s.hull.setMargin(btScalar(0.8)); }},
    {"shape of the other body", [](RestingScene& s) { s.other->setCollisionShape(&s.high); }},
    {"pose of the other body", [](RestingScene& s) { s.other->setWorldTransform(at(0, 0.75, 0)); }},
    {"pose of the body", [](RestingScene& s) { s.body->setWorldTransform(at(0, 0.3, 0)); }},
    {"child of a nested compound",
     [](RestingScene& s) { s.inner.getChildTransform(2).setOrigin(vec(0, -0.8, 0)); }},
};

TEST(CompoundRestEdits, AreSeenInTheSameStep)
{
    for (const Edit& edit : kEdits)
    {
        SCOPED_TRACE(edit.name);
        RestingScene own;
        own.compound.addChildShape(at(0, 0, 3), &own.inner);
        own.placeOverPlane();
        own.letRest();
        edit.make(own);
        EXPECT_GT(own.contactsOfStep(), 0u);
    }
}

// Points may be put into the manifolds that getAllContactManifolds() names, as Bullet's importer does.
TEST_F(CompoundAtRest, RefreshesPointsThatWerePutIntoManifolds)
{
    placeOverPlane();
    letRest();
    btPersistentManifold& manifold = *scene.manifoldsOfPair()[0];
    btManifoldPoint far(vec(0, 0, 0), vec(0, 0, 0), vec(0, 1, 0), 0);
    manifold.addManifoldPoint(far);
    EXPECT_EQ(contactsOfStep(), 0u);
    EXPECT_EQ(manifold.getNumContacts(), 0);
    letRest();
}

int askedTotal = 0;

TEST_F(CompoundAtRest, IsProcessedWhileApplicationIsAskedAboutChildren)
{
    placeOverPlane();
    letRest();
    askedTotal = 0;
    gCompoundChildShapePairCallback = [](const btCollisionShape*, const btCollisionShape*)
    {
        ++askedTotal;
        return true;
    };
    EXPECT_EQ(idlePairsOfStep(), 0u);
    EXPECT_EQ(askedTotal, 6);
    gCompoundChildShapePairCallback = nullptr;
    EXPECT_EQ(idlePairsOfStep(), 0u);
    EXPECT_EQ(idlePairsOfStep(), 1u);
}

void handOn(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info)
{
    btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

// A near callback of the application lets every pair be processed.
TEST(CompoundRest, ChangesNoBitOfContactsAndManifolds)
{
    const unsigned seed = 41;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    RestingScene scenes[2];
    scenes[1].scene.dispatcher().setNearCallback(handOn);
    for (RestingScene& own : scenes)
    {
        own.scene.add(own.plane, at(0, 0, 0), true);
        own.scene.add(own.floor, at(0, 0, 0), true);
        own.body = &own.scene.add(own.compound, kTurned);
        own.other = &own.scene.add(own.nested, at(0, 5, 0));
    }
    std::uint64_t idle = 0;
    std::size_t points = 0;
    for (int step = 0; step < 400; ++step)
    {
        const unsigned choice = engine() % 6;
        const double height = double(engine() % 1000) * 0.002, angle = double(engine() % 1000) * 0.001;
        for (RestingScene& own : scenes)
        {
            const btTransform pose(btQuaternion(vec(0.6, 0, 0.8), btScalar(angle)), vec(0, height, 0));
            if (choice == 0)
                own.body->setWorldTransform(pose);
            else if (choice == 1)
                own.other->setWorldTransform(pose);
            own.scene.step();
        }
        ASSERT_EQ(scenes[0].scene.manifoldCount(), scenes[1].scene.manifoldCount()) << "step " << step;
        ASSERT_TRUE(scenes[0].scene.contacts() == scenes[1].scene.contacts()) << "step " << step;
        EXPECT_EQ(scenes[1].scene.dispatcher().idlePairs(), 0u);
        idle += scenes[0].scene.dispatcher().idlePairs();
        points += scenes[0].scene.contacts().size();
    }
    EXPECT_GT(idle, 100u);
    EXPECT_GT(points, 1000u);
}
}  // namespace
}  // namespace cullet::test
