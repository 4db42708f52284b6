// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Stacks of boxes stand as well as with Bullet's own algorithm for two boxes.

#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
struct Stack
{
    const char* name;
    std::vector<btVector3> places;
    btVector3 half;
};

/// The solver makes towers lean, more or less by how their boxes happen to lie.
Stack makeTower(unsigned seed)
{
    Stack stack{"tower", {}, vec(0.5, 0.5, 0.5)};
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> shift(-0.02, 0.02);
    for (int i = 0; i < 10; ++i)
    {
        const double x = shift(engine), z = shift(engine);
        stack.places.push_back(vec(x, 0.5 + i, z));
    }
    return stack;
}

/// Half a brick ends every other row.
Stack makeWall(unsigned seed)
{
    Stack stack{"wall", {}, vec(0.5, 0.25, 0.25)};
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> shift(-0.004, 0.004);
    for (int row = 0; row < 8; ++row)
    {
        for (int i = row % 2; i < 8; ++i)
            stack.places.push_back(vec(1.01 * i - 0.505 * (row % 2) + shift(engine), 0.25 + 0.5 * row, 0));
    }
    return stack;
}

Stack makePyramid(unsigned)
{
    Stack stack{"pyramid", {}, vec(0.5, 0.5, 0.5)};
    for (int row = 0; row < 10; ++row)
    {
        for (int i = 0; i < 10 - row; ++i)
            stack.places.push_back(vec(1.1 * i + 0.55 * row, 0.5 + row, 0));
    }
    return stack;
}

/// After 600 steps.
struct Outcome
{
    double drift = 0;   ///< of any body, from its place
    double energy = 0;  ///< kinetic, of all bodies, in the last second
    int asleep = 0;
    std::uint64_t hash = 0;
};

Outcome standFor600Steps(const Stack& stack, Narrow narrow, BoxPairs boxPairs, bool canSleep)
{
    IsaGjkOptions options;
    options.boxPairs = boxPairs;
    ConvexWorld world(narrow, 1, options);
    btBoxShape floor(vec(50, 1, 50)), box(stack.half);
    world.add(&floor, 0, vec(0, -1, 0));
    for (const btVector3& place : stack.places)
    {
        btRigidBody& body = world.add(&box, 1, place);
        if (!canSleep)
            body.setActivationState(DISABLE_DEACTIVATION);
    }
    Outcome outcome;
    for (int step = 0; step < 600; ++step)
    {
        world.step();
        for (std::size_t i = 1; step >= 540 && i < world.bodies.size(); ++i)
            outcome.energy += double(world.bodies[i]->getLinearVelocity().length2() +
                                     world.bodies[i]->getAngularVelocity().length2()) /
                              120;
    }
    for (std::size_t i = 1; i < world.bodies.size(); ++i)
    {
        const btVector3 moved = world.bodies[i]->getWorldTransform().getOrigin() - stack.places[i - 1];
        outcome.drift = std::max(outcome.drift, double(moved.length()));
        outcome.asleep += world.bodies[i]->isActive() ? 0 : 1;
    }
    outcome.hash = world.hash();
    return outcome;
}

struct StackKind
{
    const char* name;
    Stack (*make)(unsigned seed);
    unsigned count;  ///< of stacks with other seeds
};

void PrintTo(const StackKind& kind, std::ostream* out)
{
    *out << kind.name;
}

class BoxStacks : public ::testing::TestWithParam<StackKind>
{
protected:
    /// The means of all seeds.
    Outcome mean(Narrow narrow, BoxPairs boxPairs, bool canSleep, const std::string& label)
    {
        Outcome sum;
        for (unsigned seed = 1; seed <= GetParam().count; ++seed)
        {
            const Outcome one = standFor600Steps(GetParam().make(seed), narrow, boxPairs, canSleep);
            sum.drift += one.drift / GetParam().count;
            sum.energy += one.energy / GetParam().count;
            sum.asleep += one.asleep;
        }
        const std::string prefix = label + (canSleep ? "Sleeping" : "");
        RecordProperty(prefix + "DriftMicrometres", static_cast<int>(sum.drift * 1e6));
        RecordProperty(prefix + "EnergyMicrojoules", static_cast<int>(sum.energy * 1e6));
        RecordProperty(prefix + "Asleep", sum.asleep);
        return sum;
    }
};
}  // namespace

TEST_P(BoxStacks, StandAsWithBullet)
{
    for (const bool canSleep : {false, true})
    {
        const Outcome stock = mean(Narrow::Stock, BoxPairs::Bullet, canSleep, "stock");
        const Outcome ours = mean(Narrow::IsaGjk, BoxPairs::SeparatingAxes, canSleep, "ours");
        EXPECT_LT(ours.drift, 1.2 * stock.drift);
        EXPECT_LT(ours.energy, std::max(1.5 * stock.energy, 1e-4));
        EXPECT_GE(ours.asleep, stock.asleep);
    }
}

TEST_P(BoxStacks, HaveTheSameBitsWithBothDispatchers)
{
    const Stack stack = GetParam().make(1);
    const Outcome stock = standFor600Steps(stack, Narrow::Stock, BoxPairs::Bullet, true);
    for (const BoxPairs boxPairs : {BoxPairs::SeparatingAxes, BoxPairs::Bullet})
    {
        const Outcome registered = standFor600Steps(stack, Narrow::IsaGjk, boxPairs, true);
        const Outcome own = standFor600Steps(stack, Narrow::Dispatcher, boxPairs, true);
        EXPECT_EQ(registered.hash, own.hash);
        EXPECT_EQ(registered.hash == stock.hash, boxPairs == BoxPairs::Bullet);
    }
}

INSTANTIATE_TEST_SUITE_P(All, BoxStacks,
                         testing::Values(StackKind{"tower", makeTower, 8}, StackKind{"wall", makeWall, 3},
                                         StackKind{"pyramid", makePyramid, 1}),
                         [](const testing::TestParamInfo<StackKind>& kind)
                         { return std::string(kind.param.name); });
}  // namespace cullet::test
