// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/queries.h"

#include "cullet/broad/queries/ray_path.h"

#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Has no destructor, so that it can be read until the end of the thread.
thread_local bool areReusableIdsGone = false;

/// A buffer that a thread reuses from query to query.
struct ReusableIds
{
    ReusableIds() = default;
    ~ReusableIds() { areReusableIdsGone = true; }
    ReusableIds(const ReusableIds&) = delete;
    ReusableIds& operator=(const ReusableIds&) = delete;

    std::vector<std::uint32_t> ids;
};

/// The hits of one query, by unique id. The buffer belongs to the thread; a nested query allocates its own.
class Hits
{
public:
    Hits()
    {
        if (std::vector<std::uint32_t>* ids = reusableIds())
            m_ids = std::move(*ids);
        m_ids.clear();
    }
    ~Hits()
    {
        if (std::vector<std::uint32_t>* ids = reusableIds())
            *ids = std::move(m_ids);
    }
    Hits(const Hits&) = delete;
    Hits& operator=(const Hits&) = delete;

    void add(const Proxy& proxy) { m_ids.push_back(uniqueIdOf(&proxy)); }

    void report(const ProxyStore& store, btBroadphaseAabbCallback& callback)
    {
        std::sort(m_ids.begin(), m_ids.end());
        // A RowSource may find a row twice.
        m_ids.erase(std::unique(m_ids.begin(), m_ids.end()), m_ids.end());
        for (const std::uint32_t id : m_ids)
        {
            // Bullet ignores the callback's result, so applications return arbitrary values.
            if (const Proxy* proxy = store.find(id))
                callback.process(proxy);
        }
    }

private:
    /// Null in queries from destructors of static objects, which run after the main thread's thread_local destructors.
    static std::vector<std::uint32_t>* reusableIds()
    {
        if (areReusableIdsGone)
            return nullptr;
        thread_local ReusableIds own;
        return &own.ids;
    }

    std::vector<std::uint32_t> m_ids;
};

/// Calls a function for each row of a batch.
template <class Test>
class TestedRows final : public RowSink
{
public:
    explicit TestedRows(Test& test) : m_test(test) {}
    void take(const std::uint32_t* rows, std::uint32_t count) override
    {
        for (std::uint32_t i = 0; i < count; ++i)
            m_test(rows[i]);
    }

private:
    Test& m_test;
};

/// Tests the rows that a RowSource finds; returns whether it did.
///
/// @param find calls the source and returns the cost
template <class Test, class Find>
bool testRowsOfSource(const QuerySources& sources, Test& test, Find find)
{
    if (sources.rows == nullptr || !sources.index.prefersSource(sources.update))
        return false;
    TestedRows<Test> sink(test);
    const std::uint32_t cost = find(*sources.rows, sink);
    sources.index.countSource(cost);
    return cost != 0;
}

RaySegment toSegment(const btVector3& from, const btVector3& boxMin, const btVector3& boxMax,
                     const btBroadphaseRayCallback& callback, const btVector3& origin)
{
    RaySegment segment = {};
    for (int axis = 0; axis < 3; ++axis)
    {
        // Bullet's test rounds sums of the size of the origin; 0 at the world's own.
        const btScalar rounding = 8 * SIMD_EPSILON * btFabs(origin[axis]);
        segment.origin[axis] = from[axis] - origin[axis];
        segment.inverseDirection[axis] = callback.m_rayDirectionInverse[axis];
        segment.growMin[axis] = boxMin[axis] - rounding;
        segment.growMax[axis] = boxMax[axis] + rounding;
    }
    segment.lambdaMax = callback.m_lambda_max;
    return segment;
}
}  // namespace

void testRay(const ProxyStore& store, const QuerySources& sources, const btVector3& from,
             const btVector3& boxMin, const btVector3& boxMax, btBroadphaseRayCallback& callback)
{
    unsigned int signs[3];
    for (int axis = 0; axis < 3; ++axis)
    {
        // Bullet leaves the signs, which are used as indices, to the author of the callback; they may be uninitialised.
        signs[axis] = callback.m_rayDirectionInverse[axis] < 0 ? 1 : 0;
    }
    Hits hits;
    const auto test = [&](std::uint32_t row)
    {
        const Proxy& proxy = *store.at(row);
        const btVector3 bounds[2] = {proxy.m_aabbMin - boxMax, proxy.m_aabbMax - boxMin};
        btScalar entry = 0;
        if (btRayAabb2(from, callback.m_rayDirectionInverse, signs, bounds, entry, btScalar(0),
                       callback.m_lambda_max))
            hits.add(proxy);
    };
    const RaySegment segment = toSegment(from, boxMin, boxMax, callback, store.origin().place());
    RayPath path;
    const auto find = [&](const RowSource& source, RowSink& sink)
    { return makeRayPath(segment, path) ? source.findNearRay(path, store.table().boxes(), sink) : 0; };
    if (!testRowsOfSource(sources, test, find))
        sources.index.forEachOnRay(segment, test);
    hits.report(store, callback);
}

void testBox(const ProxyStore& store, const QuerySources& sources, const btVector3& boxMin,
             const btVector3& boxMax, btBroadphaseAabbCallback& callback)
{
    Hits hits;
    const auto test = [&](std::uint32_t row)
    {
        const Proxy& proxy = *store.at(row);
        if (overlapsExactly(proxy.m_aabbMin, proxy.m_aabbMax, boxMin, boxMax))
            hits.add(proxy);
    };
    const Aabb box = store.origin().toTable(boxMin, boxMax);
    const auto find = [&](const RowSource& source, RowSink& sink)
    { return isValid(box) ? source.findNearBox(box, store.table().boxes(), sink) : 0; };
    if (!testRowsOfSource(sources, test, find))
        sources.index.forEachOverlap(box, test);
    hits.report(store, callback);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
