// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Plans that a search makes while its boxes change.

#include "tests/broad/watched_search.h"

namespace cullet::test
{
namespace
{
// Then most boxes are far away from where most were when the last plan was made.
TEST(PsapPlans, OfAWorldThatHasGrownKeepToTheirRoom)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    const std::vector<Aabb> dense = cubesIn(6000, 4, random);
    const std::vector<Aabb> sparse = cubesIn(6000, 4000, random);
    const std::vector<Pair> pairs = everyPair(sparse);
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Radix})
    {
        SCOPED_TRACE(static_cast<int>(order));
        WatchedSearch search(order);
        search.find(dense);
        for (int update = 0; update < 80; ++update)
            ASSERT_EQ(search.find(sparse), pairs) << update;
    }
}
}  // namespace
}  // namespace cullet::test
