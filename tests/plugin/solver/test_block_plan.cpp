// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/block_plan.h"
#include "cullet/plugin/solver/shuffled_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

namespace cullet
{
namespace
{
using Constraint = BlockPlan::Constraint;

bool shareAll(std::uint32_t body, std::uint32_t)
{
    return body != kFixedBody;
}

std::vector<Constraint> randomConstraints(std::mt19937& random, std::uint32_t bodies, std::size_t count)
{
    std::vector<Constraint> constraints;
    for (std::size_t i = 0; i < count; ++i)
    {
        const auto a = static_cast<std::uint32_t>(random() % bodies);
        const auto b = static_cast<std::uint32_t>(random() % bodies);
        const auto kind = static_cast<std::uint32_t>(random() % BlockPlan::kKinds);
        constraints.push_back({a, a == b ? kFixedBody : b, kind});
    }
    return constraints;
}

/// The bodies that the constraints of a block move, each as often as it is moved.
std::vector<std::uint32_t> movedBy(const BlockPlan& plan, const std::vector<Constraint>& constraints,
                                   const BlockPlan::Block& block)
{
    std::vector<std::uint32_t> moved;
    for (std::uint32_t i = 0; i < block.lanes; ++i)
    {
        const Constraint& constraint = constraints[plan.order()[block.first + i]];
        for (const std::uint32_t body : {constraint.a, constraint.b})
        {
            if (body != kFixedBody)
                moved.push_back(body);
        }
    }
    return moved;
}

void expectNoSharedBody(const BlockPlan& plan, const std::vector<Constraint>& constraints)
{
    for (const BlockPlan::Colour& colour : plan.colours())
    {
        std::multiset<std::uint32_t> ofColour;
        for (std::uint32_t i = colour.begin; i < colour.end; ++i)
        {
            const std::vector<std::uint32_t> moved = movedBy(plan, constraints, plan.blocks()[i]);
            if (colour.isSerial)
                EXPECT_EQ(plan.blocks()[i].lanes, 1u);
            else
                ofColour.insert(moved.begin(), moved.end());
        }
        const std::set<std::uint32_t> distinct(ofColour.begin(), ofColour.end());
        EXPECT_EQ(distinct.size(), ofColour.size());
    }
}

TEST(BlockPlan, MovesNoBodyTwiceInColour)
{
    for (unsigned seed = 1; seed <= 50; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const std::vector<Constraint> constraints = randomConstraints(random, 60, 400);
        BlockPlan plan;
        plan.build(constraints, 60);
        expectNoSharedBody(plan, constraints);
    }
}

TEST(BlockPlan, ContainsEachConstraintOnce)
{
    std::mt19937 random(7);
    const std::vector<Constraint> constraints = randomConstraints(random, 30, 1000);
    BlockPlan plan;
    plan.build(constraints, 30, shareAll);
    // Bodies have more contacts than there are colours.
    ASSERT_GT(plan.serialConstraints(), 0u);
    std::vector<std::uint32_t> seen;
    for (const BlockPlan::Colour& colour : plan.colours())
    {
        for (std::uint32_t i = colour.begin; i < colour.end; ++i)
        {
            const BlockPlan::Block& block = plan.blocks()[i];
            for (std::uint32_t lane = 0; lane < block.lanes; ++lane)
                seen.push_back(plan.order()[block.first + lane]);
        }
    }
    std::sort(seen.begin(), seen.end());
    ASSERT_EQ(seen.size(), constraints.size());
    for (std::uint32_t i = 0; i < seen.size(); ++i)
        EXPECT_EQ(seen[i], i);
}

TEST(BlockPlan, SharesBodiesOfManyConstraintsInBlocksThatMoveNoOtherBodyTwice)
{
    constexpr std::uint32_t kCrowded = 2, kBodies = 400;
    std::mt19937 random(5);
    std::vector<Constraint> constraints;
    for (std::uint32_t i = 0; i < 2000; ++i)
    {
        const std::uint32_t crowded = 1 + i % kCrowded,
                            other = 3 + static_cast<std::uint32_t>(random() % (kBodies - 3));
        constraints.push_back(i % 3 == 0 ? Constraint{other, crowded, 0} : Constraint{crowded, other, 0});
    }
    BlockPlan plan;
    plan.build(constraints, kBodies,
               [](std::uint32_t body, std::uint32_t other)
               { return body != kFixedBody && body <= kCrowded && other % 97 != 0; });
    ASSERT_TRUE(plan.colours().back().isSerial);
    EXPECT_GT(plan.serialConstraints(), 1500u);
    std::uint32_t blocks = 0, constraintsOfBlocks = 0;
    for (std::uint32_t i = plan.colours().back().begin; i < plan.colours().back().end; ++i)
    {
        const BlockPlan::Block& block = plan.blocks()[i];
        const std::vector<std::uint32_t> moved = movedBy(plan, constraints, block);
        EXPECT_EQ(block.lanes > 1, block.shared != kFixedBody);
        for (const std::uint32_t body : moved)
        {
            const auto times = static_cast<std::uint32_t>(std::count(moved.begin(), moved.end(), body));
            EXPECT_EQ(times, body == block.shared ? block.lanes : 1u);
        }
        ++blocks;
        constraintsOfBlocks += block.lanes;
    }
    EXPECT_EQ(constraintsOfBlocks, plan.serialConstraints());
    // Some constraints do not allow it, and some blocks end early, since the next constraint moves a body that is there already.
    EXPECT_LT(blocks, constraintsOfBlocks / 5);
}

TEST(BlockPlan, GivesIslandsTheColoursThatTheyHaveAlone)
{
    std::mt19937 random(3);
    const std::vector<Constraint> island = randomConstraints(random, 20, 60);
    std::vector<Constraint> both;
    for (const Constraint& constraint : island)
    {
        const auto other = [](std::uint32_t body) { return body == kFixedBody ? kFixedBody : body + 20; };
        both.push_back({other(constraint.a), other(constraint.b), constraint.kind});
        both.push_back(constraint);
    }
    BlockPlan alone, together;
    alone.build(island, 20);
    together.build(both, 40);
    const auto colourOf = [](const BlockPlan& plan, std::uint32_t constraint)
    {
        const auto place =
            std::find(plan.order().begin(), plan.order().end(), constraint) - plan.order().begin();
        for (std::size_t c = 0; c < plan.colours().size(); ++c)
        {
            const BlockPlan::Block& last = plan.blocks()[plan.colours()[c].end - 1];
            if (place < static_cast<std::ptrdiff_t>(last.first + last.lanes))
                return c;
        }
        return plan.colours().size();
    };
    for (std::uint32_t i = 0; i < island.size(); ++i)
        EXPECT_EQ(colourOf(alone, i), colourOf(together, 2 * i + 1));
}

TEST(BlockPlan, HasNoBlocksWithoutConstraints)
{
    BlockPlan plan;
    plan.build({}, 1, shareAll);
    EXPECT_TRUE(plan.blocks().empty());
    EXPECT_TRUE(plan.colours().empty());
    EXPECT_EQ(plan.serialConstraints(), 0u);
}

TEST(ShuffledOrder, SortsByHashAndKeepsOrderOfEqualOnes)
{
    struct Thing
    {
        std::uint32_t hash, place;
    };
    std::mt19937 random(11);
    for (const std::size_t size : {0, 1, 2, 255, 256, 257, 5000, 20000})
    {
        std::vector<Thing> things(size);
        std::uint32_t place = 0;
        for (Thing& thing : things)
            thing = {random() % 3 == 0 ? 0xffffffffu : static_cast<std::uint32_t>(random()), place++};
        std::vector<Thing> expected = things;
        std::stable_sort(expected.begin(), expected.end(),
                         [](const Thing& a, const Thing& b) { return a.hash < b.hash; });
        for (const int threads : {1, 3, 8})
        {
            SCOPED_TRACE(testing::Message() << size << " things, " << threads << " threads");
            ShuffledOrder<Thing> order;
            ParallelLoops loops(threads);
            std::vector<Thing> sorted;
            order.sort(things, sorted, loops, [](const Thing& thing) { return thing.hash; });
            ASSERT_EQ(sorted.size(), size);
            for (std::size_t i = 0; i < size; ++i)
                ASSERT_EQ(sorted[i].place, expected[i].place);
        }
    }
}
}  // namespace
}  // namespace cullet
