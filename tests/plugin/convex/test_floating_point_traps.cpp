// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Applications may trap divisions by zero and invalid operations: cullet raises no such flag that Bullet does not
// raise.

#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/world_crowd.h"
#include "cullet/tests/support/process/floating_point_flags.h"

// Included after the headers of narrow, because of its type Point.
#include "cullet/demos/scenes/bodies/world_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Flags and events of about the first second of a scene.
struct SceneRun
{
    int flags = 0;
    std::uint64_t contacts = 0;
};

SceneRun run(const char* name, const char* narrow, const char* backend)
{
    WorldSceneOptions options;
    options.bodies = 40;
    options.backend = backend;
    options.narrow = narrow;
    options.threads = 1;
    SceneRun result;
    result.flags = flagsOf(
        [&]
        {
            const auto scene = makeWorldScene(name, options);
            for (int step = 0; step < 60; ++step)
            {
                scene->step();
                result.contacts += scene->contactPairCount();
            }
        });
    return result;
}

TEST(FloatingPointTraps, StaySilentInWorldScenesInWhichBulletRaisesNone)
{
    int inContact = 0;
    for (const WorldSceneInfo& info : worldScenes())
    {
        if (info.name == std::string("file"))
            continue;
        SCOPED_TRACE(info.name);
        const int stock = run(info.name, "bullet", "dbvt").flags;
        EXPECT_EQ(stock, 0) << "Bullet" << nameFlags(stock);
        for (const char* narrow : {"isa-gjk", "dispatcher"})
        {
            const SceneRun ours = run(info.name, narrow, "grid");
            EXPECT_EQ(ours.flags, 0) << narrow << nameFlags(ours.flags);
            inContact += ours.contacts > 0 ? 1 : 0;
        }
    }
    EXPECT_GT(inContact, 20);
}

/// A gentle ground of triangles, half of it in one plane with the origin.
std::unique_ptr<btTriangleMesh> makeGround()
{
    auto mesh = std::make_unique<btTriangleMesh>();
    const auto corner = [](int x, int z) { return vec(x, x < 0 ? 0.0 : 0.2 * std::sin(0.7 * x + z), z); };
    for (int z = -8; z < 8; ++z)
    {
        for (int x = -8; x < 8; ++x)
        {
            mesh->addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
            mesh->addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
        }
    }
    return mesh;
}

/// All kinds of shapes fall on a ground and on each other.
int flagsOfPile(Narrow narrow, btCollisionShape& ground)
{
    MixedShapes shapes;
    const auto round = makeHullShape(ballPoints(60, 0.4, 3));
    const auto cube = makeHullShape(boxPoints(0.4, 0.3, 0.4));
    return flagsOf(
        [&]
        {
            ConvexWorld world(narrow);
            world.add(&ground, 0, vec(0, 0, 0));
            for (int i = 0; i < 75; ++i)
            {
                const int kind = i % 15;
                btCollisionShape* shape = kind == 13   ? round.get()
                                          : kind == 14 ? cube.get()
                                                       : shapes.shapes[static_cast<std::size_t>(kind)].get();
                world.add(shape, 1, vec(1.1 * (i % 5) - 2.2, 0.6 + 0.9 * (i / 25), 1.1 * (i / 5 % 5) - 2.2));
            }
            world.step(60);
        });
}

TEST(FloatingPointTraps, StaySilentForEveryKindOfShape)
{
    const auto triangles = makeGround();
    btBvhTriangleMeshShape mesh(triangles.get(), true);
    btBoxShape box(vec(8, 0.5, 8));
    const auto hull = makeHullShape(boxPoints(8, 0.5, 8));
    btCompoundShape tiles;
    for (int i = 0; i < 9; ++i)
        tiles.addChildShape(
            btTransform(btQuaternion::getIdentity(), vec(4 * (i % 3) - 4, 0, 4 * (i / 3) - 4)), &box);
    for (btCollisionShape* ground : std::vector<btCollisionShape*>{&mesh, &box, hull.get(), &tiles})
    {
        SCOPED_TRACE(ground->getName());
        const int stock = flagsOfPile(Narrow::Stock, *ground);
        EXPECT_EQ(stock, 0) << "Bullet" << nameFlags(stock);
        for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
        {
            const int ours = flagsOfPile(narrow, *ground);
            EXPECT_EQ(ours, 0) << static_cast<int>(narrow) << nameFlags(ours);
        }
    }
}
}  // namespace
}  // namespace cullet::test
