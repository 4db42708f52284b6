// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/small_world_backend.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Boxes in a cube, some of them without bounds, some invalid (NaN in the arrays).
struct RandomColumns
{
    explicit RandomColumns(std::uint32_t count) : limits(6 * std::size_t{count}, kNan)
    {
        for (std::uint32_t column = 0; column < count; ++column)
        {
            boxes.push_back(randomBox());
            for (std::uint32_t axis = 0; axis < 3 && isValid(boxes.back()); ++axis)
            {
                limits[2 * axis * count + column] = boxes.back().min[axis];
                limits[(2 * axis + 1) * count + column] = boxes.back().max[axis];
            }
        }
    }

    Aabb randomBox()
    {
        Aabb box = boxAt(random.point(0, 4));
        if (random.chance(0.05f))
            box.max[random.below(3)] = kInfinity;
        return random.chance(0.05f) ? kEmptyAabb : box;
    }

    Random random{7};
    std::vector<Aabb> boxes;
    std::vector<float> limits;
};

TEST(OverlapKernels, AreThoseOfTheBaselineWhenAsked)
{
    EXPECT_EQ(&chooseOverlapKernels(true), &kOverlapKernelsBaseline);
    EXPECT_STREQ(kOverlapKernelsBaseline.name, "baseline");
}

TEST(OverlapKernels, FindOverlapsOfPredicateWithEveryWidth)
{
    constexpr std::uint32_t kColumns = 192;
    const RandomColumns columns(kColumns);
    std::vector<const OverlapKernels*> kernels = {&kOverlapKernelsBaseline};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") != 0)
        kernels.push_back(&kOverlapKernelsAvx2);
    if (__builtin_cpu_supports("avx512f") != 0)
        kernels.push_back(&kOverlapKernelsAvx512);
#endif
    std::size_t hits = 0;
    for (const OverlapKernels* kernel : kernels)
    {
        SCOPED_TRACE(kernel->name);
        for (std::uint32_t row = 0; row < kColumns; ++row)
        {
            const std::uint32_t firstWord = row / 64;
            std::uint64_t bits[kColumns / 64] = {};
            kernel->findOverlaps({columns.limits.data(), kColumns, kColumns}, row, 0.0f, firstWord, bits);
            std::uint64_t someBits[kColumns / 64] = {};
            kernel->findOverlaps({columns.limits.data(), kColumns, row + 1}, row, 0.0f, firstWord, someBits);
            EXPECT_EQ(someBits[firstWord] & 1, bits[firstWord] & 1);
            EXPECT_EQ((someBits[firstWord] ^ bits[firstWord]) >> row % 64 & 1, 0u);
            for (std::uint32_t word = firstWord + 1; word < kColumns / 64; ++word)
                EXPECT_EQ(someBits[word], 0u);
            for (std::uint32_t column = 64 * firstWord; column < kColumns; ++column)
            {
                const Aabb& a = columns.boxes[row];
                const Aabb& b = columns.boxes[column];
                const bool expected = isValid(a) && isValid(b) && overlaps(a, b);
                ASSERT_EQ(bits[column / 64] >> column % 64 & 1, expected ? 1u : 0u) << row << ' ' << column;
                hits += expected ? 1 : 0;
            }
        }
    }
    EXPECT_GT(hits, 200u * kernels.size());
}

/// A block of touching unit boxes that jitter around their places.
class Heap
{
public:
    explicit Heap(BackendSession& session) : m_session(session)
    {
        session.margin = 0.05f;
        for (int i = 0; i < 6 * 6 * 6; ++i)
        {
            m_places.push_back(boxAt(float(i % 6) * 1.02f, float(i / 6 % 6) * 1.02f, float(i / 36) * 1.02f));
            m_rows.push_back(session.add(m_places.back()));
        }
    }

    void jitter(float reach)
    {
        for (std::size_t i = 0; i < m_rows.size(); ++i)
            m_session.table.setBox(m_rows[i], translated(m_places[i], m_random.point(-reach, reach)));
    }
    void throwOut(std::size_t i) { m_places[i] = translated(m_places[i], 0, 0, 3.0f); }

    const std::vector<ProxyId>& rows() const { return m_rows; }

private:
    BackendSession& m_session;
    std::vector<Aabb> m_places;
    std::vector<ProxyId> m_rows;
    Random m_random{11};
};

TEST(SmallWorldBackend, ReportsExactPairsOfHeapThatJittersInsideSkins)
{
    BackendSession session(std::make_unique<SmallWorldBackend>(false));
    Heap heap(session);
    std::map<std::string, int> updates;
    std::size_t addedInShells = 0;
    for (int step = 0; step < 120; ++step)
    {
        heap.jitter(0.012f);
        ASSERT_TRUE(session.step()) << "step " << step;
        const std::string path = session.backend().stats().path;
        ++updates[path];
        addedInShells += path == "flat in shells" ? session.delta().added.size() : 0;
    }
    EXPECT_GT(updates["flat in shells"], 80);
    // Pairs were added while the boxes stayed in their skins.
    EXPECT_GT(addedInShells, 50u);
    EXPECT_LT(session.backend().stats().candidates, 216u * 12u);
}

TEST(SmallWorldBackend, ReportsExactPairsWhenBoxesLeaveTheirSkins)
{
    BackendSession session(std::make_unique<SmallWorldBackend>(false));
    Heap heap(session);
    std::map<std::string, int> updates;
    std::vector<ProxyId> late;
    for (int step = 0; step < 300; ++step)
    {
        heap.jitter(step < 250 ? 0.01f : 0.3f);
        if (step > 30 && step % 3 == 0)
            heap.throwOut(static_cast<std::size_t>(step) * 7 % heap.rows().size());
        if (step > 40 && step % 10 == 0)
            late.push_back(session.add(boxAt(2.5f, 2.5f, 2.5f, 0.8f)));
        if (step % 50 == 49 && !late.empty())
        {
            session.table.destroy(late.back());
            late.pop_back();
        }
        if (step == 100)
            session.margin = 0.08f;
        ASSERT_TRUE(session.step()) << "step " << step;
        ++updates[session.backend().stats().path];
    }
    EXPECT_GT(updates["flat in shells"], 100);
    EXPECT_GT(updates["flat"], 20);
    EXPECT_GT(session.removedTotal(), 200u);
}

TEST(SmallWorldBackend, FindsOthersWhereTheyMovedInsideTheirSkins)
{
    BackendSession session(std::make_unique<SmallWorldBackend>(false));
    Heap heap(session);
    for (int step = 0; step < 20; ++step)
    {
        heap.jitter(0.001f);
        ASSERT_TRUE(session.step()) << "step " << step;
    }
    // All boxes rise, for which no row is tested; then one overlaps another at a position that the other has had for an
    // update.
    for (const ProxyId row : heap.rows())
        session.table.setBox(row, translated(session.table.box(row), 0, 0, 0.015f));
    ASSERT_TRUE(session.step());
    ASSERT_STREQ(session.backend().stats().path, "flat in shells");
    const Aabb& top = session.table.box(heap.rows().back());
    const float height = top.max[2] - top.min[2];
    session.table.setBox(heap.rows().front(), {{top.min[0], top.min[1], top.max[2]},
                                               {top.max[0], top.max[1], top.max[2] + height}});
    ASSERT_TRUE(session.step());
    ASSERT_STREQ(session.backend().stats().path, "flat in shells");
    EXPECT_GE(session.delta().added.size(), 1u);
}

TEST(SmallWorldBackend, KeepsRestingBoxesAndTheirPairsWhenWorldGrows)
{
    BackendSession session(std::make_unique<SmallWorldBackend>(false));
    std::vector<ProxyId> resting;
    for (int i = 0; i < 60; ++i)
        resting.push_back(session.add(boxAt(float(i) * 0.9f, 0, 0)));
    ASSERT_TRUE(session.step());
    ASSERT_EQ(session.pairs().size(), 59u);
    // The arrays grow with every 64 rows. Each new box lies on a resting one.
    for (int i = 0; i < 10; ++i)
        session.add(boxAt(float(i) * 4.5f, 0.5f, 0));
    ASSERT_TRUE(session.step());
    EXPECT_STREQ(session.backend().stats().path, "flat");
    EXPECT_GE(session.delta().added.size(), 10u);
    // A pair of two resting boxes is not reported again when one of them moves and stays in it.
    session.table.setBox(resting[31], translated(session.table.box(resting[31]), 0, 0, 0.1f));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST(SmallWorldBackend, KeepsPairsWhenColumnGridTakesOver)
{
    GridOptions options;
    options.flatLimit = 100;
    BackendSession session(makeGridBackend(options));
    for (int i = 0; i < 100; ++i)
        session.add(boxAt(float(i) * 0.9f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_STREQ(session.backend().stats().path, "flat restart");
    EXPECT_EQ(session.pairs().size(), 99u);
    session.add(boxAt(0, 100, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    EXPECT_NE(std::string(session.backend().stats().path).substr(0, 4), "flat");
    EXPECT_EQ(session.pairs().size(), 99u);
}

TEST(SmallWorldBackend, TestsFewBoxesOnceForEachPairAndHasPairsOfOracle)
{
    constexpr std::uint32_t kSeed = 43;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    std::size_t mostPairs = 0;
    int inShells = 0;
    for (const std::uint32_t count : {1u, 2u, 3u, 8u, 16u})
    {
        BackendSession session(std::make_unique<SmallWorldBackend>(false));
        session.margin = 0.05f;
        const auto anyBox = [&]
        {
            Aabb box = boxAt(random.point(0, 2));
            if (random.chance(0.1f))
                box = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
            return random.chance(0.1f) ? kEmptyAabb : box;
        };
        std::vector<ProxyId> rows;
        for (std::uint32_t i = 0; i < count; ++i)
            rows.push_back(session.add(anyBox()));
        for (int update = 0; update < 300; ++update)
        {
            // Some updates move all, some a few, and in some phases boxes stay inside their skins.
            const bool isCalm = update / 60 % 2 == 1;
            for (const ProxyId row : rows)
            {
                if (isCalm)
                    session.table.setBox(
                        row, translated(session.table.box(row), 0, 0, update % 2 == 0 ? 1e-3f : -1e-3f));
                else if (update % 3 == 0 || random.chance(0.2f))
                    session.table.setBox(row, anyBox());
            }
            if (update % 11 == 5)
            {
                ProxyId& row = rows[random.below(count)];
                session.table.destroy(row);
                row = session.add(anyBox());
            }
            ASSERT_TRUE(session.step()) << count << " rows, update " << update;
            const BackendStats stats = session.backend().stats();
            inShells += std::string(stats.path) == "flat in shells";
            // A row that was destroyed is one more for an update.
            if (std::string(stats.path) == "flat" && update > 0 && session.table.size() <= 16)
            {
                ASSERT_LE(stats.candidates, std::uint64_t{session.table.size()} * session.table.size());
            }
            mostPairs = std::max(mostPairs, session.pairs().size());
        }
    }
    EXPECT_GT(mostPairs, 20u);
    EXPECT_GT(inShells, 50);
}

TEST(SmallWorldBackend, TestsEachPairOnceWhereMostBoxesMoveAndSomeDoNot)
{
    constexpr std::uint32_t kRows = 320;
    BackendSession session(std::make_unique<SmallWorldBackend>(false));
    Random random(44);
    std::vector<ProxyId> rows;
    for (std::uint32_t i = 0; i < kRows; ++i)
        rows.push_back(session.add(boxAt(random.point(0, 12))));
    ASSERT_TRUE(session.step());
    for (const std::uint32_t moved : {kRows, kRows - 1, kRows / 2 + 1, 20u})
    {
        for (std::uint32_t i = 0; i < moved; ++i)
            session.table.setBox(rows[i], boxAt(random.point(0, 12)));
        ASSERT_TRUE(session.step());
        // 64 rows are tested at a time.
        const std::uint32_t most = 2 * moved > kRows ? kRows * (kRows / 2 + 64) : moved * kRows;
        EXPECT_LE(session.backend().stats().candidates, most) << moved;
    }
    EXPECT_GT(session.pairs().size(), 50u);
}

/// A world of the default grid with a hundred rows more than a SmallWorldBackend takes in any case.
struct MidWorld
{
    MidWorld()
    {
        const std::uint32_t count = SmallWorldBackend(false).worthwhileRows() + 100;
        for (std::uint32_t i = 0; i < count; ++i)
            rows.push_back(session.add(boxAt(float(i) * 0.9f, 0, 0)));
    }

    void move(std::uint32_t first, std::uint32_t count)
    {
        for (std::uint32_t i = first; i < first + count; ++i)
            session.table.setBox(rows[i], translated(session.table.box(rows[i]), 0, 0, 0.001f));
    }

    bool isFlat() { return std::string(session.backend().stats().path).substr(0, 4) == "flat"; }

    /// Updates with `count` moved boxes each, up to the change of the backend.
    int updatesUntil(bool flat, std::uint32_t count)
    {
        for (int update = 1; update <= 2000; ++update)
        {
            move(5, count);
            EXPECT_TRUE(session.step());
            EXPECT_TRUE(session.reported({}, {})) << "the change of the backend must not change pairs";
            if (isFlat() == flat)
                return update;
        }
        return 2000;
    }

    BackendSession session{makeGridBackend()};
    std::vector<ProxyId> rows;
};

TEST(SmallWorldBackend, TakesOverFromColumnGridWhileFewBoxesMove)
{
    MidWorld world;
    ASSERT_TRUE(world.session.step());
    EXPECT_FALSE(world.isFlat());
    EXPECT_EQ(world.updatesUntil(true, 10), 8);
    const auto count = static_cast<std::uint32_t>(world.rows.size());
    // Only those that moved are tested.
    world.move(5, 10);
    ASSERT_TRUE(world.session.step());
    EXPECT_LE(world.session.backend().stats().candidates, 10u * (count + 63));
    EXPECT_EQ(world.updatesUntil(false, count / 4), 4);
    // Each further change takes longer, so that a world in between does not change back and forth.
    EXPECT_EQ(world.updatesUntil(true, 10), 16);
    EXPECT_EQ(world.updatesUntil(false, count / 4), 4);
    EXPECT_EQ(world.updatesUntil(true, 10), 32);
}

TEST(SmallWorldBackend, KeepsColumnGridInLargeWorldsWhereFewBoxesMove)
{
    BackendSession session(makeGridBackend());
    const std::uint32_t count = 4 * SmallWorldBackend(false).worthwhileRows() + 1;
    for (std::uint32_t i = 0; i < count; ++i)
        session.add(boxAt(float(i) * 0.9f, 0, 0));
    ASSERT_TRUE(session.step());
    for (int update = 0; update < 20; ++update)
    {
        session.table.setBox(3, translated(session.table.box(3), 0, 0, 0.001f));
        ASSERT_TRUE(session.step());
        ASSERT_NE(std::string(session.backend().stats().path).substr(0, 4), "flat");
    }
}

TEST(SmallWorldBackend, HasPairsOfOracleWhileShareOfMovingBoxesChanges)
{
    constexpr std::uint32_t kSeed = 41;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    BackendSession session(makeGridBackend());
    session.margin = 0.05f;
    const std::uint32_t count = SmallWorldBackend(false).worthwhileRows() + 40;
    std::vector<ProxyId> rows;
    for (std::uint32_t i = 0; i < count; ++i)
        rows.push_back(session.add(boxAt(random.point(0, 9))));
    int flatUpdates = 0, gridUpdates = 0;
    for (int update = 0; update < 400; ++update)
    {
        const bool moveMany = update / 40 % 2 == 0;
        const std::uint32_t moved = moveMany ? count / 2 : 5;
        for (std::uint32_t i = 0; i < moved; ++i)
        {
            const ProxyId row = rows[random.below(count)];
            session.table.setBox(row, boxAt(random.point(0, 9)));
        }
        if (update % 7 == 0)
        {
            ProxyId& row = rows[random.below(count)];
            session.table.destroy(row);
            row = session.add(boxAt(random.point(0, 9)));
        }
        if (update % 90 == 50)
            session.useFilter = !session.useFilter;
        if (update % 70 == 30)
            session.margin = session.margin == 0.0f ? 0.05f : 0.0f;
        ASSERT_TRUE(session.step()) << "update " << update;
        ++(std::string(session.backend().stats().path).substr(0, 4) == "flat" ? flatUpdates : gridUpdates);
    }
    EXPECT_GT(flatUpdates, 50);
    EXPECT_GT(gridUpdates, 50);
    EXPECT_GT(session.addedTotal(), 10000u);
}
}  // namespace
}  // namespace cullet::test
