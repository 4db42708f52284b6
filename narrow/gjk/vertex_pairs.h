// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Vertex pairs of a simplex, or of a triangle of A - B.
struct VertexPairs
{
    std::array<std::int32_t, 3> a, b;
    int count = 0;  ///< 0: unknown
};

/// Distinct vertices of one shape, in ascending order.
struct DistinctVertices
{
    std::array<std::int32_t, 3> id = {-1, -1, -1};
    int count = 0;
};

/// The distinct vertices of the first `count` ids.
inline DistinctVertices distinctVertices(const std::array<std::int32_t, 3>& from, int count)
{
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    DistinctVertices ids;
    for (int i = 0; i < count; ++i)
    {
        int place = 0;
        while (place < ids.count && ids.id[at(place)] < from[at(i)])
            ++place;
        if (place < ids.count && ids.id[at(place)] == from[at(i)])
            continue;
        for (int k = ids.count; k > place; --k)
            ids.id[at(k)] = ids.id[at(k - 1)];
        ids.id[at(place)] = from[at(i)];
        ++ids.count;
    }
    return ids;
}

/// The vertex pairs of the cached simplex, three at most; none if one is a vertex whose id the cache cannot store.
template <class S>
VertexPairs pairsOf(const GjkCache<S>& cache)
{
    VertexPairs pairs;
    pairs.count = std::min<int>(cache.count, 3);
    for (std::size_t i = 0; i < 3; ++i)
    {
        pairs.a[i] = cache.verticesA[i];
        pairs.b[i] = cache.verticesB[i];
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(pairs.count); ++i)
    {
        if (cache.verticesA[i] == GjkCache<S>::kUnknown || cache.verticesB[i] == GjkCache<S>::kUnknown)
            pairs.count = 0;
    }
    return pairs;
}

/// Stores vertex pairs as the simplex of a cache.
template <class S>
void rememberPairs(const VertexPairs& pairs, GjkCache<S>& cache)
{
    cache.count = static_cast<std::uint8_t>(pairs.count);
    for (std::size_t i = 0; i < static_cast<std::size_t>(pairs.count); ++i)
    {
        cache.verticesA[i] = narrowId<S>(pairs.a[i]);
        cache.verticesB[i] = narrowId<S>(pairs.b[i]);
    }
}
}  // namespace cullet
