// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The addresses of bodies, shapes, proxies, pairs and algorithms change no bit: nothing is sorted or hashed by them where it
// could be seen.
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/support/process/shuffled_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeeds = 6;

TEST(ShuffledMemory, GivesAddressesInNoOrder)
{
    const ShuffledMemory shuffled(1);
    std::vector<std::unique_ptr<std::array<char, 500>>> blocks;
    int above = 0;
    for (int i = 0; i < 1000; ++i)
    {
        blocks.push_back(std::make_unique<std::array<char, 500>>());
        above += i > 0 && blocks[i].get() > blocks[i - 1].get();
    }
    EXPECT_GT(above, 400);
    EXPECT_LT(above, 650);
    void* const bullets = btAlignedAlloc(500, 16);
    const std::uint64_t before = shuffledBlocks();
    btAlignedFree(bullets);
    btAlignedFree(btAlignedAlloc(500, 16));
    EXPECT_EQ(shuffledBlocks(), before + 1);
}

class DeterminismOfAddresses : public testing::TestWithParam<Narrow>
{
};

TEST_P(DeterminismOfAddresses, GivesSameBitsWhereverBlocksLie)
{
    for (const HistoryScene scene : {HistoryScene::Pour, HistoryScene::Drift})
    {
        HistoryOptions options;
        options.scene = scene;
        options.narrow = GetParam();
        options.threads = 3;
        options.isParallelWorld = true;
        const History expected = historyOf(options);
        for (std::uint32_t seed = 1; seed <= kSeeds; ++seed)
        {
            const std::uint64_t before = shuffledBlocks();
            const ShuffledMemory shuffled(seed);
            HashLedger::instance().expectSame("addresses shuffled", expected, historyOf(options),
                                              "seed " + std::to_string(seed));
            ASSERT_FALSE(HasFailure());
            EXPECT_GT(shuffledBlocks(), before + 1000);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, DeterminismOfAddresses,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace
}  // namespace cullet::test
