// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/vertex_pairs.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

/// Vertices whose ids do not fit into the 16 bits of a cache.
namespace cullet::test
{
namespace
{
constexpr unsigned kSeed = 31;

TEST(VertexPairs, AreUnknownWhereTheCacheCannotStoreAVertex)
{
    GjkCache<float> cache;
    cache.count = 2;
    cache.verticesA = {7, narrowId<float>(65534), 0, 0};
    cache.verticesB = {1, 2, 0, 0};
    EXPECT_EQ(pairsOf(cache).count, 2);
    EXPECT_EQ(pairsOf(cache).a[1], 65534);
    for (const std::int32_t id : {65535, 65536, 200000})
    {
        cache.verticesA[1] = narrowId<float>(id);
        EXPECT_EQ(pairsOf(cache).count, 0);
    }
    cache.count = 1;
    EXPECT_EQ(pairsOf(cache).count, 1);
}

TEST(EpaCache, StoresNoSurfaceWithAVertexWhoseIdDoesNotFit)
{
    using Vector = Eigen::Vector3f;
    const Points round = ellipsoidPoints(70000, {1.0, 1.0, 1.0}, kSeed);
    const Hull<float> cloud = makeCloud(castPoints<float>(round)), box = hullOf<float>(boxPoints(1, 1, 1));
    const PosedHull<float> a(cloud, Eigen::Matrix3f::Identity(), Vector(0, 1.9f, 0));
    int storedCount = 0, largeCount = 0;
    for (int i = 0; i < 40; ++i)
    {
        const PosedHull<float> b(box, Eigen::Matrix3f::Identity(), Vector(0.02f * i, 0, 0.01f * i));
        GjkCache<float> cache;
        EpaCache memory;
        const PenetrationResult<float> deep = penetration(a, b, cache, &memory);
        ASSERT_EQ(deep.state, GjkState::Overlapping) << i;
        const auto end = memory.verticesA.begin() + memory.vertexCount;
        EXPECT_EQ(std::count(memory.verticesA.begin(), end, GjkCache<float>::kUnknown), 0);
        storedCount += memory.vertexCount > 0 ? 1 : 0;
        largeCount += memory.vertexCount == 0 ? 1 : 0;
    }
    EXPECT_GT(storedCount, 0);
    EXPECT_GT(largeCount, 0);
}
}  // namespace
}  // namespace cullet::test
