// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/coarse_boxes.h"

#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/plugin/core/box_convert.h"
#include "cullet/plugin/core/proxy_ids.h"

#include <algorithm>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
bool CoarseBoxes::haveChanged(const ProxyView& view)
{
    if (sizeof(btScalar) == sizeof(float))
        return false;
    // The largest coordinate of all boxes is tested first, since coarse boxes are very rare.
    Float4 most = {};
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const Aabb& box = view.boxes[view.dirty[i]];
        for (const Float4& part : {loadFloat4(box.min), loadFloat4(box.min + 2)})
        {
            const Float4 magnitudes = part < 0 ? -part : part;
            most = magnitudes > most ? magnitudes : most;
        }
    }
    const float largest = std::max({most[0], most[1], most[2], most[3]});
    return isCoarse({{largest, largest, largest}, {largest, largest, largest}}, view.margin) &&
           std::any_of(view.dirty, view.dirty + view.dirtyCount,
                       [&](std::uint32_t row)
                       { return isValid(view.boxes[row]) && isCoarse(view.boxes[row], view.margin); });
}

bool CoarseBoxes::tryRecentre(std::uint64_t update)
{
    if (update < m_nextUpdate)
        return false;
    bool hasMoved = false;
    try
    {
        hasMoved = m_store.recentre();
    }
    catch (const std::bad_alloc&)
    {
        // Coarse boxes cost time only.
    }
    m_wait = hasMoved ? kShortestWait : std::min(2 * m_wait, kLongestWait);
    m_nextUpdate = update + m_wait;
    return hasMoved;
}

void CoarseBoxes::collectSeparated(btOverlappingPairCache& cache, float margin, Pairs& separated) const
{
    const auto hasCoarseBox = [&](const btBroadphaseProxy* proxy)
    { return isCoarse(m_store.origin().toTableOrEmpty(proxy->m_aabbMin, proxy->m_aabbMax), margin); };
    const btBroadphasePairArray& cached = cache.getOverlappingPairArray();
    for (int i = 0; i < cached.size(); ++i)
    {
        const btBroadphasePair& pair = cached[i];
        if (areSeparatedBy(*pair.m_pProxy0, *pair.m_pProxy1, margin) && m_store.owns(pair.m_pProxy0) &&
            m_store.owns(pair.m_pProxy1) && (hasCoarseBox(pair.m_pProxy0) || hasCoarseBox(pair.m_pProxy1)))
            separated.push_back(pairOf(pair));
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
