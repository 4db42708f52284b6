// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/meshes/mesh_quality.h"

#include <gtest/gtest.h>

#include <string>

// What meshes do to bodies with cullet, beside stock Bullet: not worse.
namespace cullet
{
namespace
{
constexpr std::uint64_t kSeed = 1;

/// A body's way over ghost collisions is chaotic, so that means of 24 bodies differ by some hundredths.
constexpr double kNoise = 1.1;

struct Compared
{
    MeshQuality stock, cullet;
};

Compared compare(const MeshTrial& trial)
{
    return {runTrial(trial, "bullet", kSeed), runTrial(trial, "isa-gjk", kSeed)};
}

std::string nameOf(const MeshTrial& trial)
{
    return std::string(trialName(trial.kind)) + " " + trial.shape + " on " + trial.mesh + " at " +
           std::to_string(static_cast<int>(trial.speed)) + " m/s";
}

TEST(MeshQuality, JumpsAndSlowsDownNoMoreThanStockWhenBodiesSlide)
{
    int jumped = 0;
    for (const MeshTrial& trial : meshTrials())
    {
        if (trial.kind != TrialKind::Slide || trial.mesh != "flat")
            continue;
        const Compared found = compare(trial);
        jumped += found.stock.jumped;
        EXPECT_EQ(found.cullet.fallen, 0) << nameOf(trial);
        EXPECT_LE(found.cullet.jump.mean, kNoise * found.stock.jump.mean) << nameOf(trial);
        EXPECT_LE(found.cullet.slowdown.mean, kNoise * found.stock.slowdown.mean) << nameOf(trial);
    }
    EXPECT_GT(jumped, 200) << "the trials find ghost collisions";
}

TEST(MeshQuality, DoesNotJumpOrSlowDownWithActiveEdgesWhenBodiesSlide)
{
    int trials = 0;
    for (const MeshTrial& trial : meshTrials())
    {
        if (trial.kind != TrialKind::Slide)
            continue;
        ++trials;
        const MeshQuality found = runTrial(trial, "active-edges", kSeed);
        EXPECT_LT(found.jump.largest, 0.1) << nameOf(trial);
        EXPECT_LT(found.slowdown.largest, 0.01) << nameOf(trial);
        EXPECT_EQ(found.fallen, 0) << nameOf(trial);
    }
    EXPECT_EQ(trials, 13);
}

TEST(MeshQuality, LetsNoMoreBodiesThroughThanStockWhenTheyAreShot)
{
    int stockFallen = 0;
    for (const MeshTrial& trial : meshTrials())
    {
        if (trial.kind != TrialKind::Shot)
            continue;
        const Compared found = compare(trial);
        stockFallen += found.stock.fallen;
        EXPECT_LE(found.cullet.fallen, found.stock.fallen) << nameOf(trial);
        if (trial.mesh == "needles")
        {
            EXPECT_EQ(found.cullet.fallen, 0) << nameOf(trial);
        }
    }
    EXPECT_GT(stockFallen, 20) << "the trials find tunnelling";
}

TEST(MeshQuality, SpinsLongBodiesNoMoreThanStock)
{
    for (const MeshTrial& trial : meshTrials())
    {
        if (trial.shape != "long-box" || trial.kind != TrialKind::Slide)
            continue;
        const Compared found = compare(trial);
        EXPECT_LE(found.cullet.spin.mean, kNoise * found.stock.spin.mean) << nameOf(trial);
        EXPECT_EQ(found.cullet.fallen, 0) << nameOf(trial);
    }
}
}  // namespace
}  // namespace cullet
