// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Reading points in lanes, and rows of blocks side by side.
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

namespace cullet::test
{
namespace
{
std::vector<const RowKernels*> allKernels()
{
    std::vector<const RowKernels*> kernels = {&rowKernelsBaseline()};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") != 0)
        kernels.push_back(&rowKernelsAvx2());
    if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0)
        kernels.push_back(&rowKernelsAvx512());
#endif
    return kernels;
}

btScalar number(Random& random)
{
    return btScalar(random.below(2001)) / 1000 - 1;
}

btVector3 vector(Random& random)
{
    const btScalar x = number(random), y = number(random), z = number(random);
    return {x, y, z};
}

/// Points of which each number differs, some never solved before.
std::vector<btManifoldPoint> randomPoints(Random& random)
{
    std::vector<btManifoldPoint> points(kBlock);
    for (btManifoldPoint& point : points)
    {
        point.m_positionWorldOnA = vector(random);
        point.m_positionWorldOnB = vector(random);
        point.m_normalWorldOnB = vector(random);
        point.m_lateralFrictionDir1 = vector(random);
        point.m_lateralFrictionDir2 = vector(random);
        for (btScalar* value :
             {&point.m_distance1, &point.m_combinedFriction, &point.m_combinedRollingFriction,
              &point.m_combinedSpinningFriction, &point.m_combinedRestitution, &point.m_appliedImpulse})
            *value = number(random);
        if (random.below(3) == 0)
            continue;
        point.m_appliedImpulseLateral1 = number(random);
        point.m_appliedImpulseLateral2 = number(random);
    }
    return points;
}

btVector3 laneOf(const BlockOfVectors& block, int lane)
{
    return {block.x.lane[lane], block.y.lane[lane], block.z.lane[lane]};
}

void expectPoint(const SolverStep& step, const btManifoldPoint& point, int lane, const PointSource& source)
{
    EXPECT_EQ(source.isLive.lane[lane], 1);
    EXPECT_EQ(laneOf(source.positionA, lane), point.m_positionWorldOnA);
    EXPECT_EQ(laneOf(source.positionB, lane), point.m_positionWorldOnB);
    EXPECT_EQ(laneOf(source.normal, lane), point.m_normalWorldOnB);
    EXPECT_EQ(source.gap.lane[lane], point.m_distance1 + step.slop);
    EXPECT_EQ(source.friction.lane[lane], point.m_combinedFriction);
    EXPECT_EQ(source.restitution.lane[lane], point.m_combinedRestitution);
    EXPECT_EQ(source.impulse.lane[lane], point.m_appliedImpulse);
    EXPECT_EQ(source.softness.lane[lane], step.softness);
    EXPECT_EQ(source.errorReduction.lane[lane], step.errorReduction);
    const btVector3 slide = point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                            point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
    EXPECT_EQ(laneOf(source.slideImpulse, lane), slide);
}

void expectNoPoint(int lane, const PointSource& source)
{
    for (const BlockOf* block :
         {&source.isLive, &source.gap, &source.friction, &source.restitution, &source.impulse})
        EXPECT_EQ(block->lane[lane], 0);
    for (const BlockOfVectors* block :
         {&source.positionA, &source.positionB, &source.normal, &source.slideImpulse})
        EXPECT_EQ(laneOf(*block, lane), btVector3(0, 0, 0));
}

TEST(RowPoints, ReadEachLaneAsItsPointSays)
{
    SolverStep step{};
    step.isSoft = true;
    step.slop = btScalar(0.25);
    step.softness = btScalar(0.5);
    step.errorReduction = btScalar(0.125);
    Random random(7);
    for (const RowKernels* kernels : allKernels())
    {
        for (int round = 0; round < 20; ++round)
        {
            std::vector<btManifoldPoint> points = randomPoints(random);
            PointSource source;
            std::memset(static_cast<void*>(&source), 0xff, sizeof(source));
            for (int lane = 0; lane < kBlock; ++lane)
                source.points[lane] = random.below(4) != 0 ? &points[std::size_t(lane)] : nullptr;
            kernels->readPoints(step, source);
            for (int lane = 0; lane < kBlock; ++lane)
            {
                if (source.points[lane] != nullptr)
                    expectPoint(step, *source.points[lane], lane, source);
                else
                    expectNoPoint(lane, source);
            }
        }
    }
}
}  // namespace
}  // namespace cullet::test
