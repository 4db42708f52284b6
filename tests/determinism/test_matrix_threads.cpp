// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Backends, numbers of threads and kinds of worlds change no bit of pairs, contacts and bodies.
#include "cullet/tests/determinism/box_history.h"
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/determinism/matrix_backends.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
constexpr int kThreads[] = {1, 2, 3, 8};

std::string on(const std::string& name, int threads)
{
    return name + " on " + std::to_string(threads) + " threads";
}

TEST(DeterminismOfBoxes, GivesSameChangesWithEveryBackendOnAnyNumberOfThreads)
{
    HashLedger& ledger = HashLedger::instance();
    for (const SceneKind kind : kBoxScenes)
    {
        SCOPED_TRACE(sceneName(kind));
        const std::vector<std::uint64_t> expected = boxHistory(*makeBruteForceBackend(), kind);
        for (const MatrixBackend& backend : matrixBackends())
        {
            for (const int threads : kThreads)
            {
                const auto hashes = boxHistory(*backend.make(threads), kind);
                for (std::size_t step = 0; step < expected.size(); ++step)
                    ledger.expectSame("boxes: backends, threads", expected[step], hashes[step],
                                      on(backend.name, threads) + ", step " + std::to_string(step));
                ASSERT_FALSE(HasFailure());
            }
        }
    }
}

class DeterminismOfWorlds : public testing::TestWithParam<Narrow>
{
protected:
    HistoryOptions optionsOf(HistoryScene scene) const
    {
        HistoryOptions options;
        options.scene = scene;
        options.narrow = GetParam();
        return options;
    }
};

TEST_P(DeterminismOfWorlds, GiveSameBitsWithEveryBackendOnAnyNumberOfThreads)
{
    for (const HistoryScene scene : {HistoryScene::Pour, HistoryScene::Drift})
    {
        HistoryOptions options = optionsOf(scene);
        options.makeBackend = [](int) { return makeBruteForceBackend(); };
        const History expected = historyOf(options);
        for (const MatrixBackend& backend : matrixBackends())
        {
            options.makeBackend = backend.make;
            // Few backends have threads of their own: those of the dispatcher vary beside.
            options.threads = options.threads % 8 + 1;
            HashLedger::instance().expectSame("worlds: backends", expected, historyOf(options),
                                              on(backend.name, options.threads));
            ASSERT_FALSE(HasFailure());
        }
    }
}

TEST_P(DeterminismOfWorlds, GiveSameBitsOnAnyNumberOfThreadsInBulletsWorldsAndParallelOnes)
{
    for (const HistoryScene scene : {HistoryScene::Pour, HistoryScene::Drift})
    {
        HistoryOptions options = optionsOf(scene);
        const History expected = historyOf(options);
        for (const bool isParallel : {false, true})
        {
            options.isParallelWorld = isParallel;
            for (options.threads = 1; options.threads <= 8; ++options.threads)
            {
                HashLedger::instance().expectSame(
                    "worlds: threads", expected, historyOf(options),
                    on(isParallel ? "parallel world" : "Bullet's world", options.threads));
                ASSERT_FALSE(HasFailure());
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, DeterminismOfWorlds,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace
}  // namespace cullet::test
