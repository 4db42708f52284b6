// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Updates with neighbour lists, with margins, filter words, and creation and destruction of proxies, against the
// oracle.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// The cases that use neighbour lists for so few boxes.
std::vector<BackendCase> nearCases()
{
    std::vector<BackendCase> cases;
    for (const BackendCase& backend : backendCases())
    {
        if (backend.name.find("Near") != std::string::npos)
            cases.push_back(backend);
    }
    return cases;
}

/// Boxes with constant velocities in a walled block; of three groups, two of which do not pair with each other.
class SteadyWorld
{
public:
    SteadyWorld(std::unique_ptr<Backend> backend, std::uint32_t seed)
        : session(std::move(backend)), m_random(seed)
    {
        for (std::uint32_t body = 0; body < kBodies; ++body)
            m_bodies.push_back(newBody());
    }

    /// @param every one of `every` bodies moves
    void move(std::uint32_t every = 1)
    {
        ++m_moves;
        for (std::uint32_t i = m_moves % every; i < kBodies; i += every)
        {
            Body& body = m_bodies[i];
            for (int axis = 0; axis < 3; ++axis)
            {
                if (std::fabs(body.centre[axis] + body.way[axis]) > kReach)
                    body.way[axis] = -body.way[axis];
                body.centre[axis] += body.way[axis];
            }
            session.table.setBox(body.row, boxOf(body));
        }
    }
    bool step()
    {
        const bool isRight = session.step();
        const std::string path = session.backend().stats().path;
        ++paths[path];
        countPairs(path);
        return isRight;
    }
    void jump(std::uint32_t i)
    {
        for (float& x : m_bodies[i].centre)
            x = m_random.between(-kReach, kReach);
    }
    void replace(std::uint32_t i)
    {
        session.table.destroy(m_bodies[i].row);
        m_bodies[i] = newBody();
    }
    void refilter(std::uint32_t i) { session.table.setFilter(m_bodies[i].row, anyFilter()); }
    std::uint32_t anyBody() { return static_cast<std::uint32_t>(m_random.between(0, kBodies - 1)); }

    static constexpr std::uint32_t kBodies = 700;

    BackendSession session;
    std::map<std::string, int> paths;
    // While a neighbour list is used: held pairs that are separated, and held pairs that the filter would refuse now.
    std::uint64_t apart = 0, unwanted = 0;

private:
    static constexpr float kReach = 6;

    struct Body
    {
        ProxyId row;
        float centre[3];
        float way[3];
    };

    static Aabb boxOf(const Body& body) { return boxAt(body.centre[0], body.centre[1], body.centre[2]); }

    Filter anyFilter()
    {
        const int group = 1 << static_cast<int>(m_random.between(0, 2.99f));
        return {group, group == 4 ? 7 : 7 - group};
    }
    Body newBody()
    {
        Body body = {};
        for (int axis = 0; axis < 3; ++axis)
        {
            body.centre[axis] = m_random.between(-kReach, kReach);
            body.way[axis] = m_random.between(-0.03f, 0.03f);
        }
        body.row = session.add(boxOf(body), anyFilter());
        m_rowOfId.resize(session.table.uniqueId(body.row) + 1);
        m_rowOfId.back() = body.row;
        return body;
    }
    void countPairs(const std::string& path)
    {
        if (path != "near pairs")
            return;
        for (const Pair pair : session.pairs())
        {
            const ProxyId a = m_rowOfId[pair.first], b = m_rowOfId[pair.second];
            apart += overlaps(session.table.box(a), session.table.box(b)) ? 0 : 1;
            unwanted += passesFilter(session.table.filter(a), session.table.filter(b)) ? 0 : 1;
        }
    }

    Random m_random;
    std::vector<Body> m_bodies;
    std::vector<ProxyId> m_rowOfId;
    std::uint32_t m_moves = 0;
};

class PsapNeighbourListUpdates : public BackendTest
{
};

TEST_P(PsapNeighbourListUpdates, MatchOracleInSteadyWorld)
{
    SCOPED_TRACE("seed 21");
    SteadyWorld world(GetParam().make(), 21);
    world.session.margin = 0.05f;
    for (int step = 0; step < 120; ++step)
    {
        SCOPED_TRACE(step);
        if (step % 10 == 7)
            for (int k = 0; k < 20; ++k)
                world.refilter(world.anyBody());
        if (step % 24 == 11)
            world.jump(world.anyBody());
        if (step % 24 == 23)
            world.replace(world.anyBody());
        world.session.margin = step > 60 && step < 75 ? 0.01f * static_cast<float>(step % 7) : 0.05f;
        world.move(step < 80 ? 1 : 5);
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(world.session.addedTotal(), 2000u);
    EXPECT_GT(world.session.removedTotal(), 1500u);
    EXPECT_GT(world.paths["near pairs"], 70);
    EXPECT_GT(world.paths["rebuild"], 12);
    EXPECT_GT(world.apart, 300u);
    EXPECT_GT(world.unwanted, 300u);
}

// Pairs refused by the filter words enter once the words allow them; held pairs stay.
TEST_P(PsapNeighbourListUpdates, MatchOracleWhenFiltersChange)
{
    SCOPED_TRACE("seed 22");
    SteadyWorld world(GetParam().make(), 22);
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE(step);
        for (std::uint32_t body = 0; body < SteadyWorld::kBodies && step % 4 == 1; body += 3)
            world.refilter(body);
        world.move();
        world.session.useFilter = step / 10 % 3 != 2;
        // As the contract requires.
        if (step % 30 == 20 || (step != 0 && step % 30 == 0))
            world.session.restart(world.session.pairs());
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(world.session.addedTotal(), 2000u);
    EXPECT_GT(world.paths["near pairs"], 30);
    EXPECT_GT(world.unwanted, 3000u);
}

// A margin as wide as the boxes needs skins at least as wide.
TEST_P(PsapNeighbourListUpdates, MatchOracleWithMarginAsWideAsBoxes)
{
    SCOPED_TRACE("seed 23");
    SteadyWorld world(GetParam().make(), 23);
    world.session.margin = 0.9f;
    for (int step = 0; step < 40; ++step)
    {
        SCOPED_TRACE(step);
        world.session.margin = step < 20 ? 0.9f : step < 30 ? 1.3f : 0.2f;
        world.move();
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(world.paths["near pairs"], 25);
    EXPECT_GT(world.apart, 10000u);
}

TEST_P(PsapNeighbourListUpdates, FallBackToSearchWhenMarginExceedsEverySkin)
{
    SCOPED_TRACE("seed 24");
    for (const float margin : {1e31f, kInfinity})
    {
        SteadyWorld world(GetParam().make(), 24);
        world.session.margin = margin;
        for (int step = 0; step < 6; ++step)
        {
            world.move();
            ASSERT_TRUE(world.step());
        }
        EXPECT_EQ(world.paths["near pairs"], 0);
    }
}

void setFilters(SteadyWorld& world, Filter filter)
{
    for (ProxyId row = 0; row < world.session.table.size(); ++row)
        world.session.table.setFilter(row, filter);
}

/// Worlds with a sudden event, each in a different update between two lists: the next list may have been begun before
/// the event shows.
///
/// @param prepare called before each update with its number
/// @param happen  called once, before an update that uses a neighbour list, in most worlds
/// @param check   called at the end with each world after further updates
template <class Prepare, class Happen, class Check>
void tryBetweenLists(const BackendCase& backend, std::uint32_t seed, const Prepare& prepare,
                     const Happen& happen, const Check& check)
{
    int followed = 0;
    for (int k = 0; k < 16; ++k)
    {
        const int at = 7 + k / 2;
        const int end = at + (k % 2 == 0 ? 1 : 3);
        SCOPED_TRACE("seed " + std::to_string(seed) + ", at " + std::to_string(at) + " of " +
                     std::to_string(end));
        SteadyWorld world(backend.make(), seed);
        for (int step = 0; step < end; ++step)
        {
            world.move();
            prepare(world, step);
            if (step == at)
                happen(world);
            ASSERT_TRUE(world.step());
            followed += step == at && world.session.backend().stats().path == std::string("near pairs");
        }
        if (end > at + 1)
            check(world);
        // A search begins with the held pairs; a missing one shows when it leaves.
        world.replace(0);
        world.move();
        ASSERT_TRUE(world.step());
        EXPECT_STREQ(world.session.backend().stats().path, "rebuild");
        for (std::uint32_t body = 0; body < SteadyWorld::kBodies; ++body)
            world.jump(body);
        world.move();
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(followed, 8);
}

TEST_P(PsapNeighbourListUpdates, MatchOracleWhenManyPairsEnterAtOnce)
{
    tryBetweenLists(
        GetParam(), 25,
        [](SteadyWorld& world, int step)
        {
            if (step == 0)
                setFilters(world, {1, 0});
        },
        [](SteadyWorld& world) { setFilters(world, kEverything); },
        [](const SteadyWorld& world) { EXPECT_GT(world.session.addedTotal(), 800u); });
}

// First the pairs of some boxes. With half of the boxes the list has no room for all pairs that enter later; with three
// quarters it has, but not after the held pairs.
TEST_P(PsapNeighbourListUpdates, MatchOracleWhenMorePairsEnterThanHeldListHasRoomFor)
{
    for (const ProxyId share : {2u, 4u})
    {
        SCOPED_TRACE(share);
        tryBetweenLists(
            GetParam(), 27,
            [share](SteadyWorld& world, int step)
            {
                if (step == 0)
                    setFilters(world, {1, 0});
                for (ProxyId row = 0; row < SteadyWorld::kBodies && step == 3; ++row)
                    world.session.table.setFilter(row, row % share != 0 ? kEverything : Filter{1, 0});
            },
            [](SteadyWorld& world) { setFilters(world, kEverything); },
            [](const SteadyWorld& world) { EXPECT_GT(world.session.addedTotal(), 800u); });
    }
}

// Other pairs stay held that neither the boxes nor the filter words would give now.
TEST_P(PsapNeighbourListUpdates, MatchOracleWhenManyPairsLeaveAtOnce)
{
    tryBetweenLists(
        GetParam(), 26,
        [](SteadyWorld& world, int step)
        {
            if (step == 0)
            {
                setFilters(world, kEverything);
                world.session.margin = 0.9f;
            }
            for (std::uint32_t body = 0; body < SteadyWorld::kBodies && step == 5; body += 2)
                world.refilter(body);
        },
        [](SteadyWorld& world) { world.session.margin = 0; },
        [](const SteadyWorld& world)
        {
            EXPECT_GT(world.session.removedTotal(), 80u);
            EXPECT_GT(world.unwanted, 100u);
        });
}

// A restart invalidates the held flags of the neighbour list.
TEST_P(PsapNeighbourListUpdates, MatchOracleAfterRestartWithHalfOfPairs)
{
    SCOPED_TRACE("seed 28");
    SteadyWorld world(GetParam().make(), 28);
    for (int step = 0; step < 24; ++step)
    {
        SCOPED_TRACE(step);
        world.move();
        if (step == 9)
        {
            ASSERT_STREQ(world.session.backend().stats().path, "near pairs");
            const Pairs held = world.session.pairs();
            ASSERT_GT(held.size(), 200u);
            world.session.restart(
                {held.begin(), held.begin() + static_cast<std::ptrdiff_t>(held.size() / 2)});
        }
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(world.paths["near pairs"], 12);
}

// Pairs leave whose boxes have not moved, and which were not reported in that update.
TEST_P(PsapNeighbourListUpdates, MatchOracleWhenMarginShrinksWhileMostBoxesRest)
{
    SCOPED_TRACE("seed 29");
    SteadyWorld world(GetParam().make(), 29);
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE(step);
        world.session.margin = step < 20 ? 0.3f : 0.3f - 0.07f * static_cast<float>(step / 5 % 4);
        world.move(step < 20 ? 1 : 20);
        ASSERT_TRUE(world.step());
    }
    EXPECT_GT(world.paths["near pairs"], 40);
    EXPECT_GT(world.session.removedTotal(), 250u);
}

INSTANTIATE_TEST_SUITE_P(Backends, PsapNeighbourListUpdates, testing::ValuesIn(nearCases()), backendCaseName);
}  // namespace
}  // namespace cullet::test
