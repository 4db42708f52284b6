// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Hulls whose points are rewritten: the memory and the graphs that they have.
#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// Whether a hull without a graph has the points of a shape.
bool samePoints(const Hull<btScalar>& hull, const btConvexHullShape& shape)
{
    bool areSame = hull.kind() == HullKind::Cloud && hull.vertexCount() == shape.getNumPoints();
    for (int i = 0; areSame && i < shape.getNumPoints(); ++i)
        areSame = hull.vertex(i) == toEigen(shape.getUnscaledPoints()[i]);
    return areSame;
}
}  // namespace

TEST(HullCache, WritesRewrittenPointsIntoTheMemoryOfThoseBeforeTheLastOnes)
{
    auto shape = makeHullShape(ballPoints(32, 0.5, 78));
    HullUse use;
    std::vector<const Hull<btScalar>*> hulls;
    for (int i = 0; i < 10; ++i)
    {
        shape->getUnscaledPoints()[i].setX(btScalar(0.1 * i));
        hulls.push_back(use.hullOf(*shape, 0));
        ASSERT_TRUE(samePoints(*hulls.back(), *shape));
    }
    // The first points may be another shape's, too, and are kept as long as a thread may compare them.
    EXPECT_NE(hulls[1], hulls[0]);
    for (std::size_t i = 3; i < hulls.size(); ++i)
    {
        EXPECT_NE(hulls[i], hulls[i - 1]);
        EXPECT_EQ(hulls[i], hulls[i - 2]);
    }
}

TEST(HullCache, KeepsPointsOfOneShapeWhileAnEqualOneIsRewritten)
{
    const std::vector<btVector3> points = ballPoints(32, 0.5, 79);
    // Other shapes never had these addresses.
    static btConvexHullShape edited(points.front(), 32), kept(points.front(), 32);
    HullUse ofEdited, ofKept;
    const Hull<btScalar>* const shared = ofKept.hullOf(kept, 0);
    EXPECT_EQ(ofEdited.hullOf(edited, 0), shared);
    for (int i = 0; i < 6; ++i)
    {
        edited.getUnscaledPoints()[i].setX(btScalar(0.1 * i));
        EXPECT_TRUE(samePoints(*ofEdited.hullOf(edited, 0), edited));
        EXPECT_EQ(ofKept.hullOf(kept, 0), shared);
        EXPECT_TRUE(samePoints(*shared, kept));
    }
}

TEST(HullCache, SharesOneGraphAmongEditedShapesWithEqualPoints)
{
    auto first = makeHullShape(ballPoints(40, 0.5, 80)), second = makeHullShape(ballPoints(40, 0.5, 81));
    HullUse ofFirst, ofSecond;
    ASSERT_NE(ofFirst.hullOf(*first, 0), ofSecond.hullOf(*second, 0));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    const auto rewrite = [](btConvexHullShape& shape, HullUse& use, unsigned seed)
    {
        const std::vector<btVector3> points = ballPoints(40, 0.5, seed);
        for (int i = 0; i < 40; ++i)
            shape.getUnscaledPoints()[i] = points[static_cast<std::size_t>(i)];
        return use.hullOf(shape, 0);
    };
    for (const unsigned seed : {82, 83, 84, 85})
    {
        EXPECT_NE(rewrite(*first, ofFirst, seed), rewrite(*second, ofSecond, seed));
        if (seed % 2 == 1)
        {
            EXPECT_EQ(ofFirst.graphOf(*first, 0), ofSecond.graphOf(*second, 0));
        }
    }
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 2);
    // The points of the second shape belong to it alone, the graph does not.
    const Hull<btScalar>* const graph = ofFirst.graphOf(*first, 0);
    const Eigen::Matrix<btScalar, 3, 1> corner = graph->vertex(0);
    for (const unsigned seed : {86, 87, 88})
        EXPECT_TRUE(samePoints(*rewrite(*second, ofSecond, seed), *second));
    EXPECT_EQ(ofFirst.graphOf(*first, 0), graph);
    EXPECT_EQ(graph->vertex(0), corner);
}

TEST(HullContents, HaveAHashThatEveryPointAndItsPlaceChange)
{
    std::set<std::uint64_t> hashes;
    HullContents contents;
    std::size_t sets = 0;
    const auto add = [&](const btConvexHullShape& shape)
    {
        contents.assign(shape);
        hashes.insert(contents.hash());
        // Half of it chooses a bucket of a map.
        EXPECT_NE(contents.hash() >> 32, 0u);
        ++sets;
    };
    for (int count = 1; count < 40; ++count)
    {
        const auto shape = makeHullShape(ballPoints(count, 0.5, 21));
        add(*shape);
        for (int i = 0; i < count; ++i)
        {
            btVector3& point = shape->getUnscaledPoints()[i];
            for (int axis = 0; axis < 3; ++axis)
            {
                point[axis] += btScalar(0.001);
                add(*shape);
            }
        }
        if (count == 1)
            continue;
        std::swap(shape->getUnscaledPoints()[0], shape->getUnscaledPoints()[count - 1]);
        add(*shape);
    }
    EXPECT_GT(sets, 2000u);
    EXPECT_EQ(hashes.size(), sets);
}
}  // namespace cullet::test
