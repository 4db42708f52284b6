// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/small_world_backend.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kStatic = 600, kLinks = 12;

/// Boxes at rest in a room, and links that move among them.
class Room
{
public:
    explicit Room(std::uint32_t seed, float place = 0) : m_random(seed), m_place(place)
    {
        for (std::uint32_t i = 0; i < kStatic + kLinks; ++i)
            rows.push_back(session.add(anywhere()));
    }

    Aabb anywhere() { return boxAt(m_random.point(m_place - 5, m_place + 5), m_random.between(0.1f, 0.5f)); }
    void step(std::uint32_t link, float reach)
    {
        const ProxyId row = rows[kStatic + link];
        session.table.setBox(row, translated(session.table.box(row), m_random.point(-reach, reach)));
    }
    void stepAll(float reach)
    {
        for (std::uint32_t link = 0; link < kLinks; ++link)
            step(link, reach);
    }
    ProxyId& anyRow() { return rows[m_random.below(kStatic + kLinks)]; }
    std::uint64_t tests() { return session.backend().stats().candidates; }

    BackendSession session{std::make_unique<SmallWorldBackend>(false)};
    std::vector<ProxyId> rows;

private:
    Random m_random;
    float m_place;
};

TEST(MovingRows, TestsLinksThatStepAgainstNeighboursAndEachOtherOnly)
{
    Room room(51);
    ASSERT_TRUE(room.session.step());
    std::uint64_t tests = 0, changes = 0;
    for (int update = 0; update < 200; ++update)
    {
        room.stepAll(0.03f);
        ASSERT_TRUE(room.session.step()) << "update " << update;
        tests += room.tests();
        changes += room.session.delta().added.size() + room.session.delta().removed.size();
    }
    EXPECT_GT(changes, 100u);
    // A tenth of all rows, with the making of lists.
    EXPECT_LE(tests, 200u * kLinks * kStatic / 10);
}

TEST(MovingRows, FindsBoxThatComesNearWhileTheListHolds)
{
    Room room(52);
    ASSERT_TRUE(room.session.step());
    for (int update = 0; update < 3; ++update)
    {
        room.step(0, 0.01f);
        ASSERT_TRUE(room.session.step());
    }
    // A row that was at rest, one that is created, and one whose filter words change.
    const Aabb& link = room.session.table.box(room.rows[kStatic]);
    room.session.table.setBox(room.rows[7], link);
    const ProxyId created = room.session.add(link);
    room.step(0, 0.001f);
    ASSERT_TRUE(room.session.step());
    EXPECT_GE(room.session.delta().added.size(), 2u);
    EXPECT_LT(room.tests(), 3u * 704);
    room.session.table.setFilter(created, {2, 2});
    room.step(0, 0.001f);
    ASSERT_TRUE(room.session.step());
    room.session.table.setFilter(created, kEverything);
    room.step(0, 0.001f);
    ASSERT_TRUE(room.session.step());
}

TEST(MovingRows, RemovesPairThatTheMarginHeldBeyondTheSkin)
{
    Room room(55);
    BackendSession& session = room.session;
    session.margin = 0.05f;
    session.add(boxAt(50, 0, 0));
    const ProxyId link = session.add(boxAt(50.5f, 0, 0));
    const std::size_t without = session.step() ? session.pairs().size() : 0;
    session.table.setBox(link, boxAt(51.09f, 0, 0));
    ASSERT_TRUE(session.step());
    ASSERT_EQ(session.pairs().size(), without) << "held by the margin";
    // The second step makes a list with a skin of eight times 2 mm.
    session.table.setBox(link, boxAt(51.092f, 0, 0));
    ASSERT_TRUE(session.step());
    session.table.setBox(link, boxAt(51.105f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_LT(room.tests(), kLinks) << "inside the skin";
    EXPECT_EQ(session.pairs().size(), without - 1);
}

TEST(MovingRows, HasPairsOfOracleWhileFewRowsStepAndTeleport)
{
    constexpr std::uint32_t kSeed = 53;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    constexpr Aabb kEverywhere = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    // Far away a float is coarser than the growth of a skin.
    for (const float place : {0.0f, 20000.0f})
    {
        Room room(kSeed, place);
        Random random(kSeed + 1);
        BackendSession& session = room.session;
        session.margin = 0.05f;
        int updatesWithLists = 0;
        for (int update = 0; update < 600; ++update)
        {
            for (std::uint32_t link = 0; link < kLinks; ++link)
            {
                if (random.chance(0.7f))
                    room.step(link, update % 100 < 50 ? 0.02f : 0.2f);
                else if (random.chance(0.05f))
                    session.table.setBox(room.rows[kStatic + link], room.anywhere());
            }
            if (random.chance(0.1f))
                session.table.setBox(room.anyRow(), random.chance(0.2f) ? kEverywhere : room.anywhere());
            if (random.chance(0.05f))
                session.table.setBox(room.anyRow(), kEmptyAabb);
            if (random.chance(0.05f))
                session.table.setFilter(room.anyRow(), random.chance(0.5f) ? Filter{2, 2} : kEverything);
            if (random.chance(0.05f))
            {
                ProxyId& row = room.anyRow();
                session.table.destroy(row);
                row = session.add(room.anywhere());
            }
            if (update % 150 == 149)
                session.restart(session.pairs());
            if (update % 90 == 50)
                session.useFilter = !session.useFilter;
            if (update % 70 == 30)
                session.margin = session.margin == 0.0f ? 0.05f : 0.0f;
            ASSERT_TRUE(session.step()) << "update " << update << " at " << place;
            updatesWithLists += room.tests() != 0 && room.tests() < 4u * kStatic ? 1 : 0;
        }
        EXPECT_GT(updatesWithLists, 200);
        EXPECT_GT(session.addedTotal(), 5000u);
        EXPECT_GT(session.removedTotal(), 1000u);
    }
}

TEST(MovingRows, ForgetsListsWhereOtherRowsMoveInEachUpdate)
{
    Room room(54);
    ASSERT_TRUE(room.session.step());
    std::uint32_t next = 0;
    for (int update = 0; update < 100; ++update)
    {
        for (int i = 0; i < 20; ++i)
        {
            const ProxyId row = room.rows[next++ % kStatic];
            room.session.table.setBox(row, translated(room.session.table.box(row), 0.02f, 0, 0));
        }
        room.step(0, 0.02f);
        ASSERT_TRUE(room.session.step()) << "update " << update;
        // As without lists.
        EXPECT_LE(room.tests(), 21u * 640);
    }
}
}  // namespace
}  // namespace cullet::test
