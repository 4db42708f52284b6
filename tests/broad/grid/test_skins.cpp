// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes that rest in their skins: kernels of every instruction set against the definition, and updates in which nearly
// all boxes rest.

#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/resting/verlet_pairs.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/broad/grid/column_kernels_here.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <string>

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
}  // namespace
}  // namespace cullet::test
