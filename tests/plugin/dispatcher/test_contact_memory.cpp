// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/dispatcher/crowd_world.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

namespace cullet::test
{
// Each allocation of the first dispatches with contacts fails once: of the list of jobs, and of what threads need.
TEST(ContactMemory, LosesNoContactWhenAnAllocationFails)
{
    constexpr int kSteps = 4;
    std::vector<std::uint64_t> expected;
    std::uint64_t outOfMemory = 0;
    bool hasHappened = true;
    std::size_t after = 0;
    for (; hasHappened; ++after)
    {
        SCOPED_TRACE(after);
        const auto world = makeCrowd(Crowd::Boxes, 4, onThreadCount(after == 0 ? 1 : 3));
        // The first dispatch finds pairs, and the second has jobs.
        world->run(1);
        const btBroadphasePairArray& pairs = world->world.getPairCache()->getOverlappingPairArray();
        std::vector<std::uint64_t> hashes;
        for (int i = 0; i < kSteps; ++i)
        {
            world->world.updateAabbs();
            world->world.computeOverlappingPairs();
            {
                const OneNewFails failing(after == 0 || i > 0 ? 1u << 30 : after - 1);
                world->dispatcher().dispatchAllCollisionPairs(
                    world->world.getPairCache(), world->world.getDispatchInfo(), &world->dispatcher());
                hasHappened = i == 0 ? failing.hasHappened() : hasHappened;
            }
            outOfMemory += world->stats().reason == SerialReason::OutOfMemory ? 1 : 0;
            ManifoldLog log;
            log.add(world->dispatcher(), *world->world.getPairCache());
            hashes.push_back(log.hash());
        }
        EXPECT_GT(pairs.size(), 60);
        hasHappened = hasHappened || after == 0;
        if (after == 0)
            expected = hashes;
        EXPECT_TRUE(hashes == expected);
    }
    EXPECT_GT(after, 3u);
    EXPECT_GT(outOfMemory, 0u);
}
}  // namespace cullet::test
