// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The cases of `cullet bench losses` that are about the narrow phase, by counts of queries and triangles. A loss that comes
// back fails here without a clock.
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
/// What steps of a world asked the narrow phase.
struct Asked
{
    std::uint64_t pairs = 0;  ///< overlapping pairs of boxes, summed over the steps
    IsaGjkStats queries;
};

std::uint64_t queriesOf(const IsaGjkStats& stats)
{
    return stats.separatedTotal + stats.touchingTotal + stats.delegatedTotal + stats.notConvergedTotal;
}

Asked askedIn(ConvexWorld& world, int steps)
{
    Asked asked;
    for (int step = 0; step < steps; ++step)
    {
        world.step();
        asked.pairs += static_cast<std::uint64_t>(
            world.world.getBroadphase()->getOverlappingPairCache()->getNumOverlappingPairs());
    }
    asked.queries = world.stats();
    return asked;
}

/// A static mesh of triangles with edges of half a metre, a little rough, of 16 m by 16.
class RoughMesh
{
public:
    RoughMesh()
    {
        cullet::test::Random random(40);
        constexpr int kReach = 16, kSide = 2 * kReach + 1;
        std::vector<btVector3> corners;
        for (int i = 0; i < kSide * kSide; ++i)
            corners.push_back(vec(0.5 * (i % kSide - kReach), double(random.point(-0.02f, 0.02f)[0]),
                                  0.5 * (i / kSide - kReach)));
        for (int i = 0; i + kSide < kSide * kSide; ++i)
        {
            if (i % kSide == kSide - 1)
                continue;
            const auto at = static_cast<std::size_t>(i);
            m_triangles.addTriangle(corners[at], corners[at + kSide], corners[at + 1]);
            m_triangles.addTriangle(corners[at + 1], corners[at + kSide], corners[at + kSide + 1]);
        }
        m_shape = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
    }
    btCollisionShape* shape() { return m_shape.get(); }

private:
    btTriangleMesh m_triangles;
    std::unique_ptr<btBvhTriangleMeshShape> m_shape;
};
}  // namespace

TEST(DispatcherLosses, AskOnceForEachPairOfPyramidInEachStep)
{
    btBoxShape ground(vec(40, 1, 40)), box(vec(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    world.add(&ground, 0, vec(0, -1, 0));
    constexpr int kRows = 10;
    for (int row = 0; row < kRows; ++row)
    {
        for (int i = 0; i < kRows - row; ++i)
            world.add(&box, 1, vec(1.02 * i + 0.51 * row, 0.5 + row, 0))
                .setActivationState(DISABLE_DEACTIVATION);
    }
    const Asked asked = askedIn(world, 60);
    EXPECT_GT(asked.pairs, 60u * 100);
    EXPECT_GT(asked.queries.touchingTotal, asked.pairs / 4);
    // The pairs of a step are those before it.
    EXPECT_LE(queriesOf(asked.queries), asked.pairs + asked.pairs / 10);
    EXPECT_EQ(asked.queries.notConvergedTotal, 0u);
}

TEST(DispatcherLosses, DropSomeTrianglesInBoxesOfBodiesThatLieOnMesh)
{
    RoughMesh mesh;
    btCylinderShape cylinder(vec(0.5, 0.5, 0.5));
    btBoxShape part(vec(0.1, 0.1, 0.1));
    btCompoundShape compound;
    for (int i = 0; i < 25; ++i)
        compound.addChildShape(
            btTransform(btQuaternion::getIdentity(), vec(0.25 * (i % 5 - 2), 0, 0.25 * (i / 5 - 2))), &part);
    for (btCollisionShape* shape :
         {static_cast<btCollisionShape*>(&cylinder), static_cast<btCollisionShape*>(&compound)})
    {
        ConvexWorld world(Narrow::Dispatcher);
        world.add(mesh.shape(), 0, vec(0, 0, 0));
        for (int i = 0; i < 16; ++i)
            world.add(shape, 1, vec(3 * (i % 4) - 5, shape == &cylinder ? 0.55 : 0.15, 3 * (i / 4) - 5));
        const IsaGjkStats stats = askedIn(world, 60).queries;
        EXPECT_GT(stats.trianglesAskedTotal, 1000u) << shape->getName();
        EXPECT_LE(100 * stats.trianglesAskedTotal, 92 * stats.trianglesTotal) << shape->getName();
    }
}
}  // namespace cullet::test
