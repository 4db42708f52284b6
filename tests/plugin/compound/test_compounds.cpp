// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/compound/compound_pair_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/tests/plugin/compound/compound_scene.h"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <random>
#include <string>

// Contacts of compounds beside those of Bullet's loops over the same children.
namespace cullet::test
{
namespace
{
enum class Others
{
    Plane,
    Box,
    Hull,
    Mesh,
    Compound,
    Tiles,  ///< a wide compound
    Count
};
constexpr const char* kOtherNames[] = {"Plane", "Box", "Hull", "Mesh", "Compound", "Tiles"};

/// Random compounds of all kinds of children, and what lies below them. The same for the same seed.
class RandomCompounds
{
public:
    RandomCompounds(unsigned seed, Others other, bool hasTree)
        : m_engine(seed), m_other(other), m_hasTree(hasTree), m_mesh(makeMesh())
    {
        for (int i = 0; i < 8; ++i)
            m_hull.addPoint(vec(i & 1 ? 0.3 : -0.2, i & 2 ? 0.2 : -0.3, i & 4 ? 0.25 : -0.25), false);
        m_hull.recalcLocalAabb();
        for (int i = 0; i < 16; ++i)
            m_wideHull.addPoint(vec(i & 1 ? 4 : -4, i & 2 ? 0 : -1, i & 4 ? 4 : -4), false);
        m_wideHull.recalcLocalAabb();
    }

    btCompoundShape& makeCompound(int children, double size)
    {
        m_compounds.emplace_back(m_hasTree);
        btCompoundShape& compound = m_compounds.back();
        for (int i = 0; i < children; ++i)
            compound.addChildShape(somewhere(size), childShape(static_cast<int>(m_engine() % 5)));
        return compound;
    }
    btCollisionShape& otherShape()
    {
        switch (m_other)
        {
            case Others::Plane:
                return m_plane;
            case Others::Box:
                return m_box;
            case Others::Hull:
                return m_wideHull;
            case Others::Mesh:
                return m_mesh;
            case Others::Compound:
                return makeCompound(12, 0.8);
            default:
                return makeTiles();
        }
    }
    btTransform somewhere(double distance)
    {
        std::uniform_real_distribution<double> any(-distance, distance);
        const btQuaternion rotation = randomRotation(m_engine);
        return btTransform(rotation, drawVec(any, m_engine));
    }
    std::mt19937& engine() { return m_engine; }

private:
    btCollisionShape* childShape(int kind)
    {
        switch (kind)
        {
            case 0:
                return &m_sphere;
            case 1:
                return &m_smallBox;
            case 2:
                return &m_cylinder;
            case 3:
                return &m_capsule;
            default:
                return &m_hull;
        }
    }
    btCompoundShape& makeTiles()
    {
        m_compounds.emplace_back(m_hasTree);
        for (int i = 0; i < 64; ++i)
            m_compounds.back().addChildShape(at(i % 8 - 3.5, -0.5, i / 8 - 3.5), &m_tile);
        return m_compounds.back();
    }
    btBvhTriangleMeshShape makeMesh()
    {
        for (int x = -4; x < 4; ++x)
        {
            for (int z = -4; z < 4; ++z)
            {
                m_triangles.addTriangle(vec(x, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z));
                m_triangles.addTriangle(vec(x + 1, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z + 1));
            }
        }
        return btBvhTriangleMeshShape(&m_triangles, true);
    }

    std::mt19937 m_engine;
    const Others m_other;
    const bool m_hasTree;
    btSphereShape m_sphere{btScalar(0.25)};
    btBoxShape m_smallBox{vec(0.3, 0.2, 0.25)};
    btCylinderShape m_cylinder{vec(0.25, 0.2, 0.25)};
    btCapsuleShape m_capsule{btScalar(0.2), btScalar(0.3)};
    btConvexHullShape m_hull, m_wideHull;
    btStaticPlaneShape m_plane{vec(0, 1, 0), 0};
    btBoxShape m_box{vec(4, 0.1, 4)};
    btBoxShape m_tile{vec(0.5, 0.5, 0.5)};
    btTriangleMesh m_triangles;
    btBvhTriangleMeshShape m_mesh;
    std::deque<btCompoundShape> m_compounds;
};

/// The other shape, how often, and whether compounds have trees.
using CompoundCase = std::tuple<Others, bool>;

class Compounds : public testing::TestWithParam<CompoundCase>
{
};

INSTANTIATE_TEST_SUITE_P(All, Compounds,
                         testing::Combine(testing::Values(Others::Plane, Others::Box, Others::Hull,
                                                          Others::Mesh, Others::Compound, Others::Tiles),
                                          testing::Bool()),
                         [](const testing::TestParamInfo<CompoundCase>& info)
                         {
                             return std::string(kOtherNames[std::size_t(std::get<0>(info.param))]) +
                                    (std::get<1>(info.param) ? "Tree" : "NoTree");
                         });

// Each pose in new scenes, so that no manifold has older points: those are refreshed once less than in Bullet.
TEST_P(Compounds, HaveContactsOfBulletsLoopInItsOrder)
{
    const unsigned seed = 41;
    RandomCompounds shapes(seed, std::get<0>(GetParam()), std::get<1>(GetParam()));
    btCompoundShape& compound = shapes.makeCompound(12, 0.8);
    btCollisionShape& other = shapes.otherShape();
    int touching = 0, manifolds = 0;
    for (int pose = 0; pose < 60; ++pose)
    {
        SCOPED_TRACE("seed " + std::to_string(seed) + " pose " + std::to_string(pose));
        const btTransform place = shapes.somewhere(0.9);
        const bool isSwapped = pose % 2 == 1;
        std::vector<ChildContact> contacts[2];
        int counts[2];
        for (const CompoundLoop loop : {CompoundLoop::Bullets, CompoundLoop::Own})
        {
            CompoundScene scene(loop);
            if (isSwapped)
                scene.add(other, at(0, 0, 0), true);
            scene.add(compound, place);
            if (!isSwapped)
                scene.add(other, at(0, 0, 0), true);
            scene.step();
            contacts[int(loop)] = scene.contacts();
            counts[int(loop)] = scene.manifoldCount();
        }
        EXPECT_TRUE(contacts[0] == contacts[1]) << contacts[0].size() << " and " << contacts[1].size();
        EXPECT_EQ(counts[0], counts[1]);
        touching += contacts[1].empty() ? 0 : 1;
        manifolds += counts[1];
    }
    EXPECT_GT(touching, 20);
    EXPECT_GT(manifolds, 100);
}

/// A callback with which all manifolds are refreshed before children are processed, as in Bullet.
class EndsAreSeen
{
public:
    EndsAreSeen()
    {
        gContactEndedCallback = [](btPersistentManifold* const&) {};
    }
    ~EndsAreSeen() { gContactEndedCallback = nullptr; }
    EndsAreSeen(const EndsAreSeen&) = delete;
    EndsAreSeen& operator=(const EndsAreSeen&) = delete;
};

// A body that moves keeps manifolds, of which some end, and children are added, moved and removed.
TEST_P(Compounds, HaveManifoldsOfBulletsLoopWhileBodiesMoveAndChildrenChange)
{
    const EndsAreSeen scope;
    const unsigned seed = 42;
    std::vector<std::vector<ChildContact>> contacts[2];
    std::vector<int> counts[2];
    int touching = 0, ended = 0;
    for (const CompoundLoop loop : {CompoundLoop::Bullets, CompoundLoop::Own})
    {
        RandomCompounds shapes(seed, std::get<0>(GetParam()), std::get<1>(GetParam()));
        btCompoundShape& compound = shapes.makeCompound(12, 0.8);
        btSphereShape ball(btScalar(0.3));
        CompoundScene scene(loop);
        scene.add(shapes.otherShape(), at(0, 0, 0), true);
        btCollisionObject& body = scene.add(compound, at(0, 0, 0));
        int last = 0;
        for (int step = 0; step < 120; ++step)
        {
            const double angle = 0.05 * step;
            body.setWorldTransform(
                btTransform(btQuaternion(btScalar(angle), btScalar(0.3 * angle), btScalar(0.5 * angle)),
                            vec(0.2 * std::sin(angle), 0.5 + 0.7 * std::sin(3 * angle), 0.3 * angle)));
            if (step % 20 == 10)
                compound.addChildShape(shapes.somewhere(0.8), &ball);
            if (step % 20 == 15)
                compound.removeChildShapeByIndex(int(shapes.engine()() % 3));
            if (step % 7 == 3)
                compound.updateChildTransform(1, shapes.somewhere(0.8));
            scene.step();
            contacts[int(loop)].push_back(scene.contacts());
            counts[int(loop)].push_back(scene.manifoldCount());
            touching += contacts[int(loop)].back().empty() ? 0 : 1;
            ended += scene.manifoldCount() < last ? 1 : 0;
            last = scene.manifoldCount();
        }
        scene.clear();
        EXPECT_EQ(scene.manifoldCount(), 0);
        EXPECT_EQ(scene.usedAlgorithms(), 0);
    }
    EXPECT_GT(touching, 100);
    EXPECT_GT(ended, 10);
    EXPECT_TRUE(counts[0] == counts[1]);
    int different = 0;
    for (std::size_t step = 0; step < contacts[0].size(); ++step)
        different += contacts[0][step] == contacts[1][step] ? 0 : 1;
    EXPECT_EQ(different, 0) << "seed " << seed;
}

bool ignorePoint(btManifoldPoint&, void*, void*)
{
    return true;
}

// While an application's callback for points is set, Bullet's functions add them one by one.
TEST_P(Compounds, UpdateManifoldsAsBulletDoesInBothOrders)
{
    const unsigned seed = 46;
    int points = 0;
    for (const bool isSwapped : {false, true})
    {
        RandomCompounds shapes(seed, std::get<0>(GetParam()), std::get<1>(GetParam()));
        btCompoundShape& compound = shapes.makeCompound(12, 0.8);
        btCollisionShape& other = shapes.otherShape();
        CompoundScene scenes[2] = {CompoundScene(CompoundLoop::Own), CompoundScene(CompoundLoop::Own)};
        btCollisionObject* bodies[2];
        for (int i = 0; i < 2; ++i)
        {
            if (isSwapped)
                scenes[i].add(other, at(0, 0, 0), true);
            bodies[i] = &scenes[i].add(compound, at(0, 0, 0));
            if (!isSwapped)
                scenes[i].add(other, at(0, 0, 0), true);
        }
        for (int step = 0; step < 60; ++step)
        {
            SCOPED_TRACE("seed " + std::to_string(seed) + " step " + std::to_string(step));
            const double angle = 0.002 * step;
            for (btCollisionObject* const body : bodies)
                body->setWorldTransform(btTransform(
                    btQuaternion(btScalar(angle), btScalar(0.7), btScalar(1.1 + angle)), vec(angle, 0.7, 0)));
            scenes[0].step();
            gContactProcessedCallback = ignorePoint;
            scenes[1].step();
            gContactProcessedCallback = nullptr;
            EXPECT_TRUE(scenes[0].contacts() == scenes[1].contacts());
            points += static_cast<int>(scenes[0].contacts().size());
        }
    }
    EXPECT_GT(points, 120);
}

/// A compound of one box beside another shape, and the other way round.
struct CompoundEdits : testing::Test
{
    CompoundEdits()
    {
        compound.addChildShape(at(0, 0, 0), &box);
        floor.addChildShape(at(0, -1, 0), &ground);
    }

    std::size_t contactsOfStep()
    {
        scene.step();
        return scene.contacts().size();
    }

    btBoxShape box{vec(0.5, 0.5, 0.5)};
    btSphereShape ball{btScalar(0.5)};
    btBoxShape ground{vec(10, 1, 10)};
    btCompoundShape compound, floor;
    CompoundScene scene{CompoundLoop::Own};
};

TEST_F(CompoundEdits, AreSeenInTheSameStep)
{
    scene.add(ground, at(0, -1, 0), true);
    btCollisionObject& body = scene.add(compound, at(0, 1.5, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    compound.addChildShape(at(2, -1.1, 0), &ball);
    EXPECT_EQ(contactsOfStep(), 1u);
    EXPECT_EQ(scene.contacts()[0].index1 + scene.contacts()[0].index0, 0);
    compound.updateChildTransform(1, at(2, -0.5, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    compound.updateChildTransform(0, at(0, -1.05, 0));
    EXPECT_EQ(contactsOfStep(), 4u);
    compound.removeChildShapeByIndex(0);
    EXPECT_EQ(contactsOfStep(), 0u);
    EXPECT_EQ(scene.manifoldCount(), 0);
    compound.updateChildTransform(0, at(0, -1.05, 0));
    EXPECT_EQ(contactsOfStep(), 1u);
    body.setWorldTransform(at(0, 9, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    scene.clear();
    EXPECT_EQ(scene.usedAlgorithms(), 0);
}

TEST_F(CompoundEdits, OfBothCompoundsAreSeenInTheSameStep)
{
    scene.add(floor, at(0, 0, 0), true);
    scene.add(compound, at(0, 1.5, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    compound.addChildShape(at(2, -1.1, 0), &ball);
    EXPECT_EQ(contactsOfStep(), 1u);
    floor.addChildShape(at(0, 0.6, 0), &box);
    EXPECT_EQ(contactsOfStep(), 5u);
    floor.updateChildTransform(1, at(0, 0.3, 0));
    EXPECT_EQ(contactsOfStep(), 1u);
    floor.removeChildShapeByIndex(0);
    EXPECT_EQ(contactsOfStep(), 0u);
    scene.clear();
    EXPECT_EQ(scene.usedAlgorithms(), 0);
}

// Bullet keeps the algorithms, and contacts, that the first compound had without a tree.
TEST_F(CompoundEdits, OfTreesLeaveNoStaleContact)
{
    btCompoundShape bare(false);
    bare.addChildShape(at(0, 0, 0), &box);
    scene.add(floor, at(0, 0, 0), true);
    btCollisionObject& body = scene.add(bare, at(0, 0.45, 0));
    EXPECT_EQ(contactsOfStep(), 4u);
    bare.createAabbTreeFromChildren();
    EXPECT_EQ(contactsOfStep(), 4u);
    EXPECT_EQ(scene.manifoldCount(), 1);
    EXPECT_EQ(scene.manifoldsOfPair().size(), 1);
    body.setWorldTransform(at(0, 0.9, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    scene.clear();
    EXPECT_EQ(scene.usedAlgorithms(), 0);
}

// Bullet calls the algorithm of the child that was.
TEST_F(CompoundEdits, ReplaceAlgorithmWhenChildHasAnotherShape)
{
    for (const bool isBoth : {false, true})
    {
        btCompoundShape own;
        own.addChildShape(at(0, 0, 0), &box);
        isBoth ? scene.add(floor, at(0, 0, 0), true) : scene.add(ground, at(0, -1, 0), true);
        scene.add(own, at(0, 0.45, 0));
        EXPECT_EQ(contactsOfStep(), 4u);
        own.getChildList()[0].m_childShape = &ball;
        own.getChildList()[0].m_childShapeType = ball.getShapeType();
        EXPECT_EQ(contactsOfStep(), 1u);
        EXPECT_EQ(scene.manifoldCount(), 1);
        scene.clear();
    }
}

TEST_F(CompoundEdits, EndContactsWhenBodyHasAnotherShape)
{
    scene.add(ground, at(0, -1, 0), true);
    btCollisionObject& body = scene.add(compound, at(0, 0.45, 0));
    EXPECT_EQ(contactsOfStep(), 4u);
    body.setCollisionShape(&ball);
    EXPECT_EQ(contactsOfStep(), 0u);
    body.setCollisionShape(&compound);
    EXPECT_EQ(contactsOfStep(), 4u);
}

TEST_F(CompoundEdits, OfNestedCompoundsAreSeenInTheSameStep)
{
    btCompoundShape outer;
    outer.addChildShape(at(0, 0, 0), &compound);
    scene.add(ground, at(0, -1, 0), true);
    scene.add(outer, at(0, 1.5, 0));
    EXPECT_EQ(contactsOfStep(), 0u);
    compound.updateChildTransform(0, at(0, -1.05, 0));
    outer.updateChildTransform(0, at(0, 0, 0));
    EXPECT_EQ(contactsOfStep(), 4u);
    EXPECT_EQ(scene.manifoldsOfPair().size(), 1);
}

TEST_F(CompoundEdits, NameAllManifoldsOfChildren)
{
    for (const bool isBoth : {false, true})
    {
        btCompoundShape own;
        for (int i = 0; i < 5; ++i)
            own.addChildShape(at(1.2 * i - 2.4, 0, 0),
                              i % 2 == 0 ? static_cast<btCollisionShape*>(&box) : &ball);
        isBoth ? scene.add(floor, at(0, 0, 0), true) : scene.add(ground, at(0, -1, 0), true);
        scene.add(own, at(0, 0.45, 0));
        scene.step();
        const btManifoldArray named = scene.manifoldsOfPair();
        ASSERT_EQ(named.size(), 5);
        ASSERT_EQ(scene.manifoldCount(), 5);
        for (int i = 0; i < 5; ++i)
            EXPECT_NE(named.findLinearSearch(scene.dispatcher().getManifoldByIndexInternal(i)), named.size());
        scene.clear();
        EXPECT_EQ(scene.usedAlgorithms(), 0);
    }
}

/// A row of children over a plane, which Bullet gives a manifold each.
struct CompoundOverPlane : testing::Test
{
    CompoundOverPlane()
    {
        for (int i = 0; i < 6; ++i)
            compound.addChildShape(at(0, 2 * i, 0), &ball);
        scene.add(plane, at(0, 0, 0), true);
        body = &scene.add(compound, at(0, 0.49, 0));
    }

    btSphereShape ball{btScalar(0.5)};
    btStaticPlaneShape plane{vec(0, 1, 0), 0};
    btCompoundShape compound;
    CompoundScene scene{CompoundLoop::Own};
    btCollisionObject* body;
};

TEST_F(CompoundOverPlane, HasContactOfChildThatComesNear)
{
    for (int step = 0; step < 3; ++step)
        scene.step();
    EXPECT_EQ(scene.manifoldCount(), 6);
    ASSERT_EQ(scene.contacts().size(), 1u);
    compound.updateChildTransform(3, at(1, 0, 0));
    scene.step();
    EXPECT_EQ(scene.contacts().size(), 2u);
    // Upside down.
    body->setWorldTransform(btTransform(btQuaternion(vec(0, 0, 1), SIMD_PI), vec(0, 10.49, 0)));
    scene.step();
    ASSERT_EQ(scene.contacts().size(), 1u);
    body->setWorldTransform(at(0, 0.49, 0));
    ball.setUnscaledRadius(btScalar(2.5));
    scene.step();
    EXPECT_EQ(scene.contacts().size(), 3u);
}

// As after a load from a file, which fills the manifolds of a pair by hand.
TEST_F(CompoundOverPlane, RefreshesPointsThatWerePutIntoManifolds)
{
    scene.step();
    scene.step();
    const btManifoldArray manifolds = scene.manifoldsOfPair();
    ASSERT_EQ(manifolds.size(), 6);
    ASSERT_EQ(manifolds[4]->getNumContacts(), 0);
    btManifoldPoint point(vec(5, 0, 0), vec(0, 0, 0), vec(0, 1, 0), -1);
    manifolds[4]->addManifoldPoint(point);
    scene.step();
    EXPECT_EQ(manifolds[4]->getNumContacts(), 0);
}

/// Two layers of children over triangles, of which the lower one touches.
struct CompoundOverMesh : testing::Test
{
    CompoundOverMesh()
    {
        for (int x = -6; x < 6; ++x)
        {
            for (int z = -6; z < 6; ++z)
            {
                triangles.addTriangle(vec(x, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z));
                triangles.addTriangle(vec(x + 1, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z + 1));
            }
        }
        // The box of the mesh reaches high above the children.
        triangles.addTriangle(vec(5, 4, 5), vec(6, 4, 5), vec(5, 4, 6));
        mesh.emplace(&triangles, true);
        for (int i = 0; i < 12; ++i)
            compound.addChildShape(at(i % 3 - 1, i / 3 % 2, i / 6), &box);
        ground = &scene.add(*mesh, at(0, 0, 0), true);
        body = &scene.add(compound, at(0, 0.39, 0));
    }

    /// What a loop without a region finds.
    std::vector<ChildContact> contactsOfBulletsLoop()
    {
        CompoundScene other(CompoundLoop::Bullets);
        other.add(*mesh, ground->getWorldTransform(), true);
        other.add(compound, body->getWorldTransform());
        other.step();
        return other.contacts();
    }

    btBoxShape box{vec(0.4, 0.4, 0.4)};
    btTriangleMesh triangles;
    std::optional<btBvhTriangleMeshShape> mesh;
    btCompoundShape compound;
    CompoundScene scene{CompoundLoop::Own};
    btCollisionObject *ground, *body;
};

TEST_F(CompoundOverMesh, HasContactsOfChildrenThatComeNear)
{
    for (int step = 0; step < 3; ++step)
        scene.step();
    EXPECT_EQ(scene.manifoldCount(), 12) << "boxes of children overlap that of the mesh";
    EXPECT_EQ(scene.contacts().size(), 24u);
    // Upside down: the other layer.
    body->setWorldTransform(btTransform(btQuaternion(vec(0, 0, 1), SIMD_PI), vec(0, 1.39, 0)));
    scene.step();
    EXPECT_EQ(scene.contacts().size(), 24u);
    compound.updateChildTransform(2, at(0, 1.8, 3));
    scene.step();
    EXPECT_TRUE(scene.contacts() == contactsOfBulletsLoop());
    ground->setWorldTransform(btTransform(btQuaternion(vec(1, 0, 0), btScalar(0.1)), vec(0, -0.05, 0)));
    scene.step();
    scene.step();
    EXPECT_EQ(scene.contacts().size(), contactsOfBulletsLoop().size());
}

// The local box of the compound does not contain a child whose shape has grown.
TEST_F(CompoundOverMesh, SeesChildrenThatGrow)
{
    for (int step = 0; step < 2; ++step)
        scene.step();
    body->setWorldTransform(at(0, 0.79, 0));
    scene.step();
    scene.step();
    ASSERT_EQ(scene.contacts().size(), 0u);
    box.setLocalScaling(vec(1, 2, 1));
    scene.step();
    EXPECT_EQ(scene.contacts().size(), 24u);
}

TEST_F(CompoundOverMesh, SeesVerticesThatAreWrittenInPlace)
{
    for (int step = 0; step < 2; ++step)
        scene.step();
    ASSERT_EQ(scene.contacts().size(), 24u);
    unsigned char *vertices, *indices;
    int count, stride, indexStride, faces;
    PHY_ScalarType type, indexType;
    triangles.getLockedVertexIndexBase(&vertices, count, type, stride, &indices, indexStride, faces,
                                       indexType, 0);
    for (int i = 0; i < count; ++i)
        reinterpret_cast<btScalar*>(vertices + i * stride)[1] -= btScalar(0.001);
    mesh->refitTree(vec(-6, -1, -6), vec(6, 4, 6));
    scene.step();
    for (const ChildContact& contact : scene.contacts())
        EXPECT_NEAR(contact.distance, -0.009, 1e-5);
}

// As after a load from a file, which fills the manifolds of a pair by hand.
TEST_F(CompoundOverMesh, RefreshesPointsThatWerePutIntoManifolds)
{
    scene.step();
    scene.step();
    const btManifoldArray manifolds = scene.manifoldsOfPair();
    int empty = 0;
    for (int i = 0; i < manifolds.size(); ++i)
    {
        if (manifolds[i]->getNumContacts() > 0)
            continue;
        ++empty;
        btManifoldPoint point(vec(5, 0, 0), vec(0, 0, 0), vec(0, 1, 0), -1);
        manifolds[i]->addManifoldPoint(point);
    }
    ASSERT_EQ(empty, 6);
    scene.step();
    EXPECT_EQ(scene.contacts().size(), 24u);
}

TEST(CompoundCallbacks, AreAskedForEachChildThatTreesFind)
{
    static int calls;
    int callsOf[2][2];
    for (const bool isBoth : {false, true})
    {
        for (const CompoundLoop loop : {CompoundLoop::Bullets, CompoundLoop::Own})
        {
            RandomCompounds shapes(43, isBoth ? Others::Tiles : Others::Box, true);
            btCompoundShape& compound = shapes.makeCompound(12, 0.8);
            CompoundScene scene(loop);
            scene.add(shapes.otherShape(), at(0, 0, 0), true);
            scene.add(compound, at(0, 0.3, 0));
            calls = 0;
            const btShapePairCallback refuseBalls = [](const btCollisionShape* a, const btCollisionShape* b)
            {
                ++calls;
                return a->getShapeType() != SPHERE_SHAPE_PROXYTYPE &&
                       b->getShapeType() != SPHERE_SHAPE_PROXYTYPE;
            };
            gCompoundChildShapePairCallback = gCompoundCompoundChildShapePairCallback = refuseBalls;
            scene.step();
            const std::size_t withCallback = scene.contacts().size();
            gCompoundChildShapePairCallback = gCompoundCompoundChildShapePairCallback = nullptr;
            callsOf[isBoth][int(loop)] = calls;
            scene.step();
            EXPECT_GT(scene.contacts().size(), withCallback);
        }
        EXPECT_EQ(callsOf[isBoth][0], callsOf[isBoth][1]);
        EXPECT_GT(callsOf[isBoth][0], 3);
    }
}

/// Counts and sums what a contact test reports.
struct CountContacts : btCollisionWorld::ContactResultCallback
{
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override
    {
        ++count;
        sum += point.getDistance();
        return 0;
    }
    int count = 0;
    btScalar sum = 0;
};

TEST(CompoundQueries, ReportContactsOfBulletsLoop)
{
    int all = 0;
    for (const Others other : {Others::Plane, Others::Box, Others::Mesh, Others::Tiles})
    {
        for (const double distance : {0.0, 0.3})
        {
            CountContacts counts[2];
            for (const CompoundLoop loop : {CompoundLoop::Bullets, CompoundLoop::Own})
            {
                RandomCompounds shapes(44, other, true);
                btCompoundShape& compound = shapes.makeCompound(12, 0.8);
                CompoundScene scene(loop);
                scene.add(shapes.otherShape(), at(0, 0, 0), true);
                btCollisionObject& body = scene.add(compound, at(0, 0.7, 0));
                counts[int(loop)].m_closestDistanceThreshold = btScalar(distance);
                scene.world().contactTest(&body, counts[int(loop)]);
                EXPECT_EQ(scene.manifoldCount(), 0);
            }
            EXPECT_EQ(counts[0].count, counts[1].count);
            EXPECT_EQ(counts[0].sum, counts[1].sum);
            all += counts[1].count;
        }
    }
    EXPECT_GT(all, 20);
}

TEST(CompoundRegistration, ReplacesBulletsAlgorithmsOnlyWhenAsked)
{
    RandomCompounds shapes(45, Others::Tiles, true);
    btCompoundShape& compound = shapes.makeCompound(4, 0.5);
    btCollisionShape& tiles = shapes.otherShape();
    btBoxShape box(vec(1, 1, 1));
    for (const CompoundLoop loop : {CompoundLoop::Bullets, CompoundLoop::Own})
    {
        const bool isOwn = loop == CompoundLoop::Own;
        CompoundScene scene(loop);
        scene.add(tiles, at(0, 0, 0), true);
        scene.add(compound, at(0, 0, 0));
        scene.step();
        EXPECT_EQ(isExactly<CompoundPairAlgorithm>(*scene.pair().m_algorithm), isOwn);
        scene.clear();
        scene.add(box, at(0, 0, 0), true);
        scene.add(compound, at(0, 0, 0));
        scene.step();
        EXPECT_EQ(isExactly<CompoundAlgorithm>(*scene.pair().m_algorithm), isOwn);
    }
    // Another registration for the dispatcher gives Bullet's algorithms back.
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    registerIsaGjk(dispatcher);
    IsaGjkOptions without;
    without.compounds = false;
    IsaGjkRegistration& isaGjk = registerIsaGjk(dispatcher, without);
    btCollisionObject a, b;
    a.setCollisionShape(&compound);
    b.setCollisionShape(&box);
    const btCollisionObjectWrapper wrapA(nullptr, &compound, &a, a.getWorldTransform(), -1, -1),
        wrapB(nullptr, &box, &b, b.getWorldTransform(), -1, -1);
    for (const bool isSwapped : {false, true})
    {
        btCollisionAlgorithm* const algorithm = dispatcher.findAlgorithm(
            isSwapped ? &wrapB : &wrapA, isSwapped ? &wrapA : &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        EXPECT_FALSE(isaGjk.isOfCompound(*algorithm));
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
}

// GImpact's rows stay, whichever is registered first.
TEST(CompoundRegistration, LeavesRowsOfGImpact)
{
    for (const bool isGImpactFirst : {false, true})
    {
        btDefaultCollisionConfiguration configuration;
        btCollisionDispatcher dispatcher(&configuration);
        if (isGImpactFirst)
            btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
        registerIsaGjk(dispatcher);
        if (!isGImpactFirst)
            btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
        btTriangleMesh triangles;
        triangles.addTriangle(vec(0, 0, 0), vec(1, 0, 0), vec(0, 0, 1));
        btGImpactMeshShape mesh(&triangles);
        mesh.updateBound();
        btSphereShape ball(1);
        btCompoundShape compound;
        compound.addChildShape(at(0, 0, 0), &ball);
        btCollisionObject a, b;
        const btCollisionObjectWrapper wrapA(nullptr, &compound, &a, a.getWorldTransform(), -1, -1),
            wrapB(nullptr, &mesh, &b, b.getWorldTransform(), -1, -1);
        btCollisionAlgorithm* const algorithm =
            dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        EXPECT_TRUE(isExactly<btGImpactCollisionAlgorithm>(*algorithm));
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
}
}  // namespace
}  // namespace cullet::test
