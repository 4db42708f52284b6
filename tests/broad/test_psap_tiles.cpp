// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Tiles: when they are used, and what happens where one is full.

#include "broad/host_exec.h"
#include "broad/psap_pipeline.h"
#include "tests/support/boxes.h"
#include "tests/support/pair_lists.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace cullet::test
{
namespace
{
/// HostExec with lanes to spare, which remembers what was searched.
class TileExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    bool hasSpareLanes() const { return true; }

    template <class Step>
    void searchTiles(const Step& step, const psap::PairList& list)
    {
        ++searchesOfTiles;
        lastShape = step.shape;
        HostExec::searchTiles(step, list);
    }

    bool canSearchTiles(const psap::TileShape& shape) const { return shape.tiles <= mostTiles; }

    int searchesOfTiles = 0;
    psap::TileShape lastShape{};
    std::uint32_t mostTiles = psap::TileShape::kMostTiles;
};

/// A search that finds every pair, again and again.
class TileSearches
{
public:
    explicit TileSearches(PsapOrder order = PsapOrder::Automatic,
                          PsapExecutor executor = PsapExecutor::InOrder)
        : m_options(optionsOf(order, executor)), exec(m_options), m_search(m_options)
    {
    }

    /// @return all pairs in order, found by counting where a tile was full
    std::vector<Pair> find(const std::vector<Aabb>& boxes)
    {
        m_search.look();
        m_search.build(exec, {boxes.data(), boxes.size(), &m_count});
        emit();
        m_wasFull = m_count == psap::kSpilled;
        if (m_wasFull)
        {
            m_search.buildByCounting(exec);
            emit();
        }
        EXPECT_LE(m_count, m_found.size());
        return inOrder({m_found.begin(), m_found.begin() + static_cast<std::ptrdiff_t>(m_count)});
    }

    bool wasFull() const { return m_wasFull; }
    int searchesOfTiles() const { return exec.searchesOfTiles; }

private:
    static PsapOptions optionsOf(PsapOrder order, PsapExecutor executor)
    {
        PsapOptions options;
        options.order = order;
        options.executor = executor;
        options.threads = 3;
        return options;
    }

    void emit()
    {
        psap::EntryTest all{};
        all.takeAll = true;
        m_search.emit(exec, all, {m_found.data(), m_found.size(), &m_count});
    }

    PsapOptions m_options;

public:
    TileExec exec;

private:
    psap::Search<TileExec> m_search;
    std::vector<IdPair> m_found = std::vector<IdPair>(1u << 20);
    std::uint64_t m_count = 0;
    bool m_wasFull = false;
};

std::vector<Pair> byCounting(const std::vector<Aabb>& boxes)
{
    return TileSearches(PsapOrder::Counting).find(boxes);
}

/// Unit cubes in a block of space with these sides, relative to each other; one for each `volume`.
std::vector<Aabb> cubesIn(std::uint32_t count, float volume, Random& random, float x = 1, float y = 1,
                          float z = 1)
{
    const float side = std::cbrt(volume * static_cast<float>(count) / (x * y * z));
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
        boxes.push_back(
            boxAt(random.between(0, x * side), random.between(0, y * side), random.between(0, z * side)));
    return boxes;
}

TEST(PsapTiles, LargeWorldsOfOneSizeAreSearchedInTiles)
{
    SCOPED_TRACE("seed 5");
    Random random(5);
    const std::vector<Aabb> boxes = cubesIn((1u << 16) + 1, 4, random);
    const std::vector<Pair> expected = byCounting(boxes);
    ASSERT_GT(expected.size(), 50000u);
    TileSearches search;
    // The first update makes the plan.
    for (int update = 0; update < 4; ++update)
    {
        EXPECT_EQ(search.find(boxes), expected) << update;
        EXPECT_FALSE(search.wasFull()) << update;
        EXPECT_EQ(search.searchesOfTiles(), update);
    }
    EXPECT_GT(search.exec.lastShape.tiles, 200u);
}

TEST(PsapTiles, SmallerDenserAndMixedWorldsAreNot)
{
    SCOPED_TRACE("seed 6");
    Random random(6);
    std::vector<Aabb> mixed = cubesIn(70000, 40, random);
    for (Aabb& box : mixed)
        box = boxAt(box.min[0], box.min[1], box.min[2], random.logUniform(-2, 1));
    for (const std::vector<Aabb>& boxes : {cubesIn(1u << 16, 4, random), cubesIn(70000, 1, random), mixed})
    {
        TileSearches search;
        for (int update = 0; update < 3; ++update)
            search.find(boxes);
        EXPECT_EQ(search.searchesOfTiles(), 0) << boxes.size();
    }
}

TEST(PsapTiles, NeitherAreThoseThatADeviceHasNoMemoryFor)
{
    Random random(7);
    const std::vector<Aabb> boxes = cubesIn(70000, 4, random);
    TileSearches search;
    search.exec.mostTiles = 10;
    for (int update = 0; update < 3; ++update)
        search.find(boxes);
    EXPECT_EQ(search.searchesOfTiles(), 0);
}

// Cells, bins and tiles are where most boxes are: one far away would make the others look like one point.
TEST(PsapTiles, BodiesFlungFarAwayDoNotSpoilThePlan)
{
    SCOPED_TRACE("seed 12");
    Random random(12);
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        std::vector<Aabb> boxes = cubesIn(6000, 4, random);
        TileSearches search(order);
        search.find(boxes);
        search.find(boxes);
        search.exec.takeTestCount();
        search.find(boxes);
        const std::uint64_t tests = search.exec.takeTestCount();
        boxes[3] = boxAt(3e4f, 0, 0);
        boxes[4000] = boxAt(0, -1e9f, 0);
        boxes[4001] = boxAt(0, 0, 1e30f);
        TileSearches another(order);
        const std::vector<Pair> expected = everyPair(boxes);
        for (int update = 0; update < 3; ++update)
            EXPECT_EQ(another.find(boxes), expected);
        another.exec.takeTestCount();
        another.find(boxes);
        EXPECT_LT(another.exec.takeTestCount(), 2 * tests) << static_cast<int>(order);
        EXPECT_FALSE(another.wasFull()) << static_cast<int>(order);
    }
}

// Few large boxes, and some without bounds, are tested against all others.
TEST(PsapTiles, LargeBoxesAmongMany)
{
    SCOPED_TRACE("seed 8");
    Random random(8);
    std::vector<Aabb> boxes = cubesIn(70000, 4, random);
    boxes[17] = {{-10, -10, -10}, {80, 3, 80}};
    boxes[69999] = {{-10, -10, 20}, {80, 80, 24}};
    boxes[40000] = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, 2, kInfinity}};
    boxes[40001] = {{kNan, 0, 0}, {1, 1, 1}};
    boxes[40002] = {{1e30f, 1e30f, 1e30f}, {1e30f, 1e30f, 1e30f}};
    boxes[40003] = {{5, 5, 5}, {4, 4, 4}};
    const std::vector<Pair> expected = byCounting(boxes);
    for (const PsapExecutor executor : {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::Threads})
    {
        TileSearches search(PsapOrder::Automatic, executor);
        EXPECT_EQ(search.find(boxes), expected);
        EXPECT_EQ(search.find(boxes), expected);
        EXPECT_EQ(search.searchesOfTiles(), 1);
        EXPECT_FALSE(search.wasFull());
    }
}

TEST(PsapTiles, WhereOneIsFullCountingFindsThePairs)
{
    SCOPED_TRACE("seed 9");
    Random random(9);
    const std::vector<Aabb> sparse = cubesIn(70000, 4, random);
    std::vector<Aabb> piled = sparse;
    for (std::uint32_t i = 0; i < 1500; ++i)
        piled[40 * i] = boxAt(random.between(30, 40), random.between(30, 40), random.between(30, 40));
    const std::vector<Pair> expected = byCounting(piled);
    TileSearches search;
    for (int update = 0; update < 20; ++update)
        search.find(sparse);
    EXPECT_EQ(search.searchesOfTiles(), 19);
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_TRUE(search.wasFull());
    // By counting, until there is a plan that knows of the pile.
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_EQ(search.searchesOfTiles(), 20);
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_FALSE(search.wasFull());
    EXPECT_EQ(search.searchesOfTiles(), 21);
    // A plan as good as new is not tried again for a while.
    EXPECT_EQ(search.find(sparse), byCounting(sparse));
    std::vector<Aabb> heap = sparse;
    for (std::uint32_t i = 0; i < 20000; ++i)
        heap[3 * i] = boxAt(1 + random.between(0, 14), 1 + random.between(0, 14), 1 + random.between(0, 14));
    EXPECT_EQ(search.find(heap), byCounting(heap));
    EXPECT_TRUE(search.wasFull());
    const int searches = search.searchesOfTiles();
    for (int update = 0; update < 256; ++update)
        search.find(sparse);
    EXPECT_EQ(search.searchesOfTiles(), searches);
    for (int update = 0; update < 3; ++update)
        EXPECT_EQ(search.find(sparse), byCounting(sparse));
    EXPECT_GT(search.searchesOfTiles(), searches);
}

TEST(PsapTiles, RoomIsUsedToTheLastPlace)
{
    SCOPED_TRACE("seed 13");
    Random random(13);
    std::vector<Aabb> boxes = cubesIn(1500, 4, random);
    TileSearches search(PsapOrder::Tiles);
    search.find(boxes);
    // One after the other to the same place.
    std::uint32_t piled = 0;
    while (!search.wasFull())
    {
        ASSERT_LT(piled, 1500u);
        boxes[piled++] = boxAt(8.1f, 8.1f, 8.1f, 0.01f);
        ASSERT_EQ(search.find(boxes), everyPair(boxes)) << piled;
    }
    EXPECT_GT(piled, 20u);
}

// Flat, long and sparse worlds, few boxes and many, tiles narrower than boxes; sizes that differ.
TEST(PsapTiles, AnyWorldThatIsForcedIntoThem)
{
    SCOPED_TRACE("seed 10");
    Random random(10);
    int inTiles = 0;
    std::size_t pairs = 0;
    for (const std::uint32_t count : {1u, 2u, 30u, 400u, 3000u})
        for (const float volume : {0.01f, 0.3f, 4.0f, 1000.0f})
            for (const float flat : {0.0f, 0.01f, 1.0f})
            {
                std::vector<Aabb> boxes =
                    cubesIn(count, volume, random, 1, 1 + 8 * flat, flat == 0 ? 1e-6f : flat);
                for (std::uint32_t i = 0; i < count; i += 3)
                    boxes[i] =
                        boxAt(boxes[i].min[0], boxes[i].min[1], boxes[i].min[2], random.between(0, 1.5f));
                const std::vector<Pair> expected = everyPair(boxes);
                TileSearches search(PsapOrder::Tiles);
                for (int update = 0; update < 2; ++update)
                    ASSERT_EQ(search.find(boxes), expected) << count << ", " << volume << ", " << flat;
                if (search.searchesOfTiles() != 0 && !search.wasFull())
                {
                    ++inTiles;
                    pairs += expected.size();
                }
            }
    EXPECT_GT(inTiles, 40) << "of 60";
    EXPECT_GT(pairs, 100000u);
}

// Boxes that come after the plan was made, larger ones and far away ones; coordinates that end on the edges of tiles.
TEST(PsapTiles, APlanOfAnotherFrameFindsThePairs)
{
    SCOPED_TRACE("seed 11");
    Random random(11);
    TileSearches search(PsapOrder::Tiles);
    std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    for (Aabb& box : boxes)
        box = boxAt(std::floor(box.min[0]), std::floor(box.min[1]), std::floor(box.min[2]));
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    for (std::uint32_t i = 0; i < 10; ++i)
        boxes[100 * i] = boxAt(random.between(0, 16), random.between(0, 16), random.between(0, 16), 1.5f);
    for (std::uint32_t i = 0; i < 3; ++i)
        boxes[100 * i + 1] = boxAt(random.between(-1e6f, 1e6f), 0, 0, 40);
    boxes[7] = boxes[8] = boxAt(1e7f, 0, 0);
    boxes[9] = {{-kInfinity, -kInfinity, -1}, {kInfinity, kInfinity, 1}};
    boxes[10] = {{kNan, 0, 0}, {1, 1, 1}};
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_EQ(search.searchesOfTiles(), 2);
    EXPECT_FALSE(search.wasFull());
    // More large ones than the side list takes.
    for (std::uint32_t i = 0; i < 40; ++i)
        boxes[20 * i] = boxAt(random.between(0, 16), random.between(0, 16), random.between(0, 16), 1.5f);
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_TRUE(search.wasFull());
}
}  // namespace
}  // namespace cullet::test
