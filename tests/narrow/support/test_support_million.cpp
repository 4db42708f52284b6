// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/support/support_check.h"

#include <gtest/gtest.h>

#include <random>

namespace cullet::test
{
namespace
{
/// Points of a small lattice: most faces of their hulls contain several, often inside the face or an edge.
Points latticePoints(std::mt19937& engine)
{
    std::uniform_int_distribution<int> place(-2, 2);
    Points points;
    for (int i = 0; i < 40; ++i)
    {
        const Eigen::Vector3d p = drawVector(place, engine);
        if (p.cwiseAbs().sum() <= 4.0)
            points.push_back(p);
    }
    return points;
}

TEST(SupportMillion, FindsNoWrongSupportOnTenThousandHullsWithCoplanarFans)
{
    int fanCount = 0, stuckCount = 0, wrongCount = 0;
    for (unsigned seed = 0; seed < 10000 && wrongCount < 5; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        Comparison<float> comparison(latticePoints(engine));
        const Hull<float>& hull = comparison.hull;
        if (!hull.hasNeighbours())
            continue;
        for (const auto& face : hull.faces())
        {
            const Eigen::Vector3f d = face.normal.cast<float>();
            const auto start =
                static_cast<std::int32_t>(engine() % static_cast<unsigned>(hull.vertexCount()));
            comparison.check(d, start);
            comparison.check(-d, start);
            // Where the plain climb of the thesis's Figure 9 would end.
            bool isStuck = supportProduct(hull, start, d) < 0.5f * static_cast<float>(face.offset);
            for (const std::int32_t u : hull.naturalNeighbours(start))
                isStuck = isStuck && supportProduct(hull, u, d) <= supportProduct(hull, start, d);
            stuckCount += isStuck;
        }
        for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
            fanCount += hull.facesOf(v).size() == 0;
        wrongCount += comparison.wrongCount;
    }
    EXPECT_EQ(wrongCount, 0);
    EXPECT_GT(fanCount, 10000);
    EXPECT_GT(stuckCount, 100);
}

TEST(SupportMillion, FindsVertexOfScanInTenMillionDirectionsInFloat)
{
    compareOnAllShapes<float>(600000, 10000, 10000000);
}

TEST(SupportMillion, FindsVertexOfScanInTenMillionDirectionsInDouble)
{
    compareOnAllShapes<double>(600000, 10000, 10000000);
}
}  // namespace
}  // namespace cullet::test
