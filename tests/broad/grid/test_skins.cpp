// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes that rest in their skins: kernels of every instruction set against the definition, and updates in which nearly
// all boxes rest.

#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/verlet/verlet_pairs.h"
#include "cullet/tests/broad/grid/column_kernels_here.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
Aabb randomBox(Random& random, float side)
{
    return boxAt(random.point(0, side));
}

Aabb jittered(const Aabb& box, Random& random, float stride)
{
    return translated(box, random.point(-stride, stride));
}

TEST(RestingMode, FindsBoxesOutsideTheirSkinsWithEveryKernelSet)
{
    constexpr std::uint32_t kCount = 2003;
    constexpr float kSlack = 0.25f;
    Random random(51);
    std::vector<Aabb> reference;
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < kCount; ++i)
    {
        reference.push_back(randomBox(random, 9));
        if (random.chance(0.05f))
            reference.back().max[random.below(3)] = random.chance(0.5f) ? kInfinity : kNan;
        // Many boxes exactly at the edge of the skin, by one face in each of eight boxes.
        boxes.push_back(reference.back());
        if (random.chance(0.1f))
            boxes.back().min[random.below(3)] -= random.chance(0.5f) ? kSlack : 1.5f * kSlack;
        if (random.chance(0.02f))
            boxes.back() = kEmptyAabb;
    }
    for (const ColumnKernels* kernels : kernelsHere())
    {
        for (const std::uint32_t begin : {0u, 5u, 1999u, kCount})
        {
            std::vector<std::uint32_t> expected;
            for (std::uint32_t row = begin; row < kCount; ++row)
            {
                if (!isInsideSkin(boxes[row], reference[row], kSlack))
                    expected.push_back(row);
            }
            std::vector<std::uint32_t> outside(kCount);
            outside.resize(kernels->findBoxesOutsideSkin({boxes.data(), reference.data(), kSlack}, begin,
                                                         kCount, outside.data()));
            EXPECT_EQ(outside, expected) << kernels->name;
            EXPECT_TRUE(begin != 0 || (expected.size() > 100 && expected.size() < 400));
        }
    }
}

TEST(RestingMode, FindsEveryListedPairThatChangesWithEveryKernelSet)
{
    constexpr float kMargin = 0.125f;
    using State = VerletPairs::State;
    Random random(52);
    std::vector<Aabb> boxes;
    for (int i = 0; i < 300; ++i)
        boxes.push_back(randomBox(random, 3));
    boxes[7] = kEmptyAabb;
    boxes[8].max[1] = kInfinity;
    VerletPairs pairs;
    pairs.add({0, 1}, State::Persistent);
    for (int i = 0; i < 4000; ++i)
    {
        constexpr State kStates[] = {State::Overlapping, State::Candidate, State::Expired};
        const State state = kStates[random.below(3)];
        pairs.add({random.below(300), random.below(300)}, state);
    }
    const auto changes = [&](std::uint32_t index)
    {
        const Aabb& a = boxes[pairs.pair(index).a];
        const Aabb& b = boxes[pairs.pair(index).b];
        return (pairs.state(index) == State::Candidate && overlaps(a, b)) ||
               (pairs.state(index) == State::Overlapping && !overlapsWithMargin(a, b, kMargin));
    };
    const auto end = static_cast<std::uint32_t>(pairs.size());
    std::vector<std::uint32_t> expected;
    for (auto i = static_cast<std::uint32_t>(pairs.firstChangeable()); i < end; ++i)
    {
        if (changes(i))
            expected.push_back(i);
    }
    EXPECT_GT(expected.size(), 1000u);
    EXPECT_LT(expected.size(), 3000u);
    for (const ColumnKernels* kernels : kernelsHere())
    {
        std::vector<std::uint32_t> changed(end);
        changed.resize(kernels->findChangedPairs(pairs.pairStateSource(boxes.data(), kMargin),
                                                 static_cast<std::uint32_t>(pairs.firstChangeable()), end,
                                                 changed.data()));
        EXPECT_EQ(changed, expected) << kernels->name;
    }
}

/// Every box of a heap jitters in each step; one or two move away, one becomes empty or unbounded, one is destroyed and
/// another created in its row.
class RestingHeap
{
public:
    static constexpr std::uint32_t kCount = 1500;

    RestingHeap()
    {
        for (std::uint32_t row = 0; row < kCount; ++row)
        {
            m_rest.push_back(randomBox(m_random, 12));
            table.create(m_rest.back(), row + 1, {1, -1});
        }
    }

    void step()
    {
        if (m_gone != kCount)
            m_gone = table.create(m_rest[m_gone], m_nextId++, {1, -1});
        const std::uint32_t leaver = m_random.below(kCount);
        m_rest[leaver] = randomBox(m_random, 12);
        m_gone = m_random.below(kCount);
        for (std::uint32_t row = 0; row < kCount; ++row)
        {
            if (row != m_gone)
                table.setBox(row, jittered(m_rest[row], m_random, 0.04f));
        }
        const std::uint32_t odd = m_random.below(kCount);
        if (odd != m_gone)
            table.setBox(odd, m_random.chance(0.5f) ? kEmptyAabb : cube(-kInfinity, 2));
        table.destroy(m_gone);
    }

    ProxyTable table;

private:
    Random m_random{53};
    std::vector<Aabb> m_rest;
    std::uint32_t m_gone = kCount;
    std::uint32_t m_nextId = kCount + 1;
};

TEST(RestingMode, ReportsEveryChangeWhenNearlyAllBoxesRest)
{
    GridOptions options;
    options.threads = 1;
    options.rebuildFraction = 1;  // enters the resting mode at once, and stays in it
    ColumnGridBackend grid(options);
    const std::unique_ptr<Backend> brute = makeBruteForceBackend();
    RestingHeap heap;
    PairDelta found;
    PairDelta expected;
    std::size_t changes = 0;
    std::uint64_t tests = 0;
    for (int step = 0; step < 40; ++step)
    {
        const ProxyView view = heap.table.beginUpdate(0.125f, false);
        ASSERT_EQ(grid.update(view, found), Status::Ok);
        ASSERT_EQ(brute->update(view, expected), Status::Ok);
        heap.table.endUpdate();
        ASSERT_EQ(found.added, expected.added) << step;
        ASSERT_EQ(found.removed, expected.removed) << step;
        changes += step > 1 ? found.added.size() + found.removed.size() : 0;
        tests += grid.stats().path == std::string("incremental") ? grid.stats().candidates : 0;
        heap.step();
    }
    EXPECT_GT(changes, 1000u);
    EXPECT_GT(tests, 10000u);
}

/// Groups of awake boxes far from resting ones. Three boxes of a group stand on places of a diagonal, farther apart than any
/// skin; the fourth touches only the box on the last place.
class SwappingGroups
{
public:
    SwappingGroups()
    {
        for (std::uint32_t i = 0; i < 400; ++i)
            table.create(boxAt(m_random.point(0, 20)), i + 1, kEverything);
        for (int i = 0; i < 4 * kGroups; ++i)
            m_boxes.push_back(table.create(boxAt(0, 0, 200.0f + 2.0f * float(i)),
                                           3000 + static_cast<std::uint32_t>(i), kEverything));
    }

    void stand()
    {
        for (int i = 0; i < 4 * kGroups; ++i)
        {
            const bool isFourth = i % 4 == 3;
            const float along = isFourth ? 2.1f : 0.6f * float(m_places[i % 4]);
            const float aside = isFourth ? m_aside : 0;
            table.setBox(m_boxes[static_cast<std::size_t>(i)],
                         boxAt(100 + along, 8.0f * float(i / 4) + along - aside, along));
        }
    }
    /// The fourth boxes move for once, and are awake from then on.
    void swapPlaces()
    {
        std::swap(m_places[0], m_places[2]);
        m_aside = 0.2f;
    }

    ProxyTable table;

private:
    static constexpr int kGroups = 20;
    Random m_random{57};
    std::vector<ProxyId> m_boxes;
    std::array<int, 3> m_places{0, 1, 2};
    float m_aside = 0;
};

TEST(RestingMode, ReportsEveryChangeWhenAwakeBoxesTakeEachOthersPlaces)
{
    GridOptions options;
    options.threads = 1;
    options.rebuildFraction = 1;  // enters the resting mode at once, and stays in it
    ColumnGridBackend grid(options);
    const std::unique_ptr<Backend> brute = makeBruteForceBackend();
    SwappingGroups groups;
    PairDelta found;
    PairDelta expected;
    int swaps = 0;
    // Awake boxes are ordered anew after 65 updates, so that one of six times they change places in that update.
    for (int step = 0; step < 430; ++step)
    {
        if (step > 2 && step % 6 == 0)
            groups.swapPlaces();
        if (step > 2)
            groups.stand();
        const ProxyView view = groups.table.beginUpdate(0.125f, false);
        ASSERT_EQ(grid.update(view, found), Status::Ok);
        ASSERT_EQ(brute->update(view, expected), Status::Ok);
        groups.table.endUpdate();
        ASSERT_EQ(found.added, expected.added) << step;
        ASSERT_EQ(found.removed, expected.removed) << step;
        swaps += step > 10 && !found.added.empty() ? 1 : 0;
    }
    EXPECT_STREQ(grid.stats().path, "incremental");
    EXPECT_GT(swaps, 60);
}
}  // namespace
}  // namespace cullet::test
