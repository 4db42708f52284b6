// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/scene_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

// The scenes whose bodies move over meshes.
namespace cullet
{
namespace
{
/// Lengths of the edges of a mesh, of the first object of a scene.
struct Edges
{
    explicit Edges(WorldScene& scene)
    {
        struct Reader : btTriangleCallback
        {
            explicit Reader(Edges& read) : edges(read) {}
            void processTriangle(btVector3* corners, int, int) override
            {
                double lengths[3];
                for (int i = 0; i < 3; ++i)
                    lengths[i] = double((corners[(i + 1) % 3] - corners[i]).length());
                std::sort(lengths, lengths + 3);
                edges.shortest = std::min(edges.shortest, lengths[0]);
                edges.longest = std::max(edges.longest, lengths[2]);
                edges.leastSlender = std::min(edges.leastSlender, lengths[2] / lengths[0]);
                ++edges.triangles;
            }
            Edges& edges;
        } reader(*this);
        const btVector3 far(10000, 10000, 10000);
        static_cast<const btConcaveShape*>(object(scene, 0).getCollisionShape())
            ->processAllTriangles(&reader, -far, far);
    }

    double shortest = 1e9, longest = 0.0, leastSlender = 1e9;
    int triangles = 0;
};

TEST(MeshScenes, HaveSmallAndHugeTrianglesInCity)
{
    const auto city = make("city", 36);
    const Edges edges(*city);
    EXPECT_GT(edges.triangles, 9 * 200);
    EXPECT_LT(edges.shortest, 0.1);
    EXPECT_GT(edges.shortest, 0.01) << "none is degenerate";
    EXPECT_GT(edges.longest, 100.0);
}

TEST(MeshScenes, HaveOnlySlenderTrianglesInNeedles)
{
    const auto needles = make("needles", 36);
    const Edges edges(*needles);
    EXPECT_GT(edges.triangles, 1000);
    EXPECT_GT(edges.leastSlender, 100.0);
}

TEST(MeshScenes, HoldBodiesThatFallOntoCityAndNeedles)
{
    for (const std::string name : {"city", "needles"})
    {
        const auto scene = make(name, 36);
        stepMany(*scene, 240);
        EXPECT_GT(scene->lowestHeight(), btScalar(-1)) << name;
        EXPECT_GT(scene->contactPairCount(), 25u) << name;
    }
}

/// The fastest that a body of scene "slide" rises in a second.
double fastestRise(const std::string& narrow)
{
    WorldSceneOptions options = makeOptions(24);
    options.narrow = narrow;
    const auto slide = makeWorldScene("slide", options);
    double fastest = 0.0;
    for (int i = 0; i < 60; ++i)
    {
        slide->step();
        for (int body = 1; body <= 24; ++body)
            fastest = std::max(
                fastest,
                double(static_cast<const btRigidBody&>(object(*slide, body)).getLinearVelocity().y()));
    }
    return fastest;
}

TEST(MeshScenes, SlideWithoutJumpsWithEachOfOurNarrowPhases)
{
    EXPECT_GT(fastestRise("bullet"), 1.0);
    EXPECT_LT(fastestRise("isa-gjk"), 0.2);
    EXPECT_LT(fastestRise("dispatcher"), 0.2);
}

TEST(MeshScenes, SlideSixShapesAlongTheirLanes)
{
    const auto scene = make("slide", 12);
    std::set<const btCollisionShape*> shapes;
    double slowest = 1e9, fastest = 0;
    for (int i = 1; i <= 12; ++i)
    {
        const auto& body = static_cast<const btRigidBody&>(object(*scene, i));
        shapes.insert(body.getCollisionShape());
        slowest = std::min(slowest, double(body.getLinearVelocity().x()));
        fastest = std::max(fastest, double(body.getLinearVelocity().x()));
    }
    EXPECT_EQ(shapes.size(), 6u);
    EXPECT_DOUBLE_EQ(slowest, 1.0);
    EXPECT_DOUBLE_EQ(fastest, 15.0);
    bool hasBegunAnew = false;
    double before = double(origin(*scene, 12).x());
    for (int step = 0; step < 200; ++step)
    {
        scene->step();
        const double x = double(origin(*scene, 12).x());
        hasBegunAnew |= x < before - 20.0;
        before = x;
    }
    EXPECT_TRUE(hasBegunAnew);
    for (int i = 1; i <= 12; ++i)
        EXPECT_LT(std::abs(double(origin(*scene, i).x())), 20.5) << i;
    EXPECT_GT(scene->lowestHeight(), btScalar(0.2));
}
}  // namespace
}  // namespace cullet
