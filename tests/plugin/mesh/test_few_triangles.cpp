// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>

namespace cullet::test
{
namespace
{
constexpr int kHugeTriangles = 2;

/// Two triangles that are much larger than any body, over a bent edge.
void addHugeTriangles(TriangleSoup& soup)
{
    const btVector3 a = vec(-2.5, 0.1, -2.5), b = vec(-2.5, 0, 2.5), c = vec(2.5, 0, -2.5),
                    d = vec(2.5, 0.2, 2.5);
    for (const btVector3& corner : {a, b, c, c, b, d})
        soup.corners.push_back(corner);
}

/// Adds small triangles where the body's box is and the body, unless it is a box of the same axes, is not.
void addTrianglesInCornerOfBox(TriangleSoup& soup, const btConvexShape& body, const btTransform& at)
{
    btVector3 low, high;
    body.getAabb(at, low, high);
    for (int i = 0; i < 6; ++i)
    {
        const btVector3 corner = high - vec(0.01 * i, 0, 0);
        for (const btVector3& way : {vec(0, 0, 0), vec(0.005, 0, 0), vec(0, 0, 0.005)})
            soup.corners.push_back(corner + way);
    }
}

std::unique_ptr<btConvexShape> makeSmallBody(const std::string& name, std::mt19937& engine)
{
    if (name == "Box")
        return std::make_unique<btBoxShape>(vec(0.4, 0.5, 0.3));
    if (name == "Capsule")
        return std::make_unique<btCapsuleShape>(btScalar(0.2), btScalar(0.6));
    if (name == "Sphere")
        return std::make_unique<btSphereShape>(btScalar(0.4));
    if (name == "Cylinder")
        return std::make_unique<btCylinderShape>(vec(0.4, 0.5, 0.4));
    auto hull = std::make_unique<btConvexHullShape>();
    std::uniform_real_distribution<double> place(-1, 1);
    for (int i = 0; i < (name == "Hull64" ? 64 : 12); ++i)
        hull->addPoint(drawVec(place, engine).normalized() * btScalar(0.5), false);
    hull->recalcLocalAabb();
    return hull;
}

btTransform poseOverHugeTriangles(std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-1, 1);
    return btTransform(randomRotation(engine),
                       vec(2.9 * place(engine), 0.4 + 0.4 * place(engine), 2.9 * place(engine)));
}

struct FewTriangles : testing::TestWithParam<const char*>
{
    std::mt19937 engine{4105};
    std::unique_ptr<btConvexShape> body = makeSmallBody(GetParam(), engine);
};

TEST_P(FewTriangles, GiveBitsOfThoseThatHaveMoreBesideThem)
{
    SCOPED_TRACE("seed 4105");
    TriangleSoup few, many;
    addHugeTriangles(few);
    MeshBench ofFew(Loop::Ours, *body, few), ofMany(Loop::Ours, *body, many);
    int touching = 0, onOne = 0, apart = 0;
    for (int i = 0; i < posesToTry(600); ++i)
    {
        const btTransform at = poseOverHugeTriangles(engine);
        many.corners = few.corners;
        addTrianglesInCornerOfBox(many, *body, at);
        const btPersistentManifold& found = ofFew.stepFromNothing(at, btTransform::getIdentity());
        const btPersistentManifold& expected = ofMany.stepFromNothing(at, btTransform::getIdentity());
        bool isInCorner = false, isOnFirst = false, isOnSecond = false;
        for (int p = 0; p < expected.getNumContacts(); ++p)
        {
            const int index = expected.getContactPoint(p).m_index1;
            isInCorner |= index >= kHugeTriangles;
            isOnFirst |= index == 0;
            isOnSecond |= index == 1;
        }
        if (isInCorner)
            continue;
        ASSERT_TRUE(arePointsEqual(found, expected)) << "pose " << i;
        ++(found.getNumContacts() > 0 ? touching : apart);
        onOne += isOnFirst != isOnSecond;
    }
    EXPECT_GT(touching, 150);
    EXPECT_GT(apart, 100);
    EXPECT_GT(onOne, 100);
}

TEST_P(FewTriangles, AreLeftOutOnlyWhereALoopOverAllFindsNothing)
{
    SCOPED_TRACE("seed 4105");
    TriangleSoup soup;
    addHugeTriangles(soup);
    MeshBench ours(Loop::Ours, *body, soup), plain(Loop::Plain, *body, soup);
    int touching = 0;
    for (int i = 0; i < posesToTry(600); ++i)
    {
        const btTransform at = poseOverHugeTriangles(engine);
        const int expected = plain.stepFromNothing(at, btTransform::getIdentity()).getNumContacts();
        const int found = ours.stepFromNothing(at, btTransform::getIdentity()).getNumContacts();
        ASSERT_EQ(found > 0, expected > 0) << "pose " << i;
        touching += expected > 0;
    }
    EXPECT_GT(touching, 150);
}

INSTANTIATE_TEST_SUITE_P(All, FewTriangles,
                         testing::Values("Box", "Capsule", "Sphere", "Cylinder", "Hull12", "Hull64"),
                         [](const testing::TestParamInfo<const char*>& info) { return info.param; });

TEST(FewTrianglesOfCylinder, GiveBitsOfBulletsLoop)
{
    std::mt19937 engine(4106);
    SCOPED_TRACE("seed 4106");
    const std::unique_ptr<btConvexShape> body = makeSmallBody("Cylinder", engine);
    TriangleSoup soup;
    addHugeTriangles(soup);
    MeshBench ours(Loop::Ours, *body, soup), plain(Loop::Plain, *body, soup);
    int touching = 0;
    for (int i = 0; i < posesToTry(600); ++i)
    {
        const btTransform at = poseOverHugeTriangles(engine);
        const btPersistentManifold& found = ours.stepFromNothing(at, btTransform::getIdentity());
        ASSERT_TRUE(arePointsEqual(found, plain.stepFromNothing(at, btTransform::getIdentity())))
            << "pose " << i;
        touching += found.getNumContacts() > 0;
    }
    EXPECT_GT(touching, 150);
}
}  // namespace
}  // namespace cullet::test
