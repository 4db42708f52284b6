// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/pair_audit.h"

#include "cullet/demos/program/heap_usage.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
ExactBox boxOfProxy(const btBroadphaseProxy& proxy)
{
    ExactBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = proxy.m_aabbMin[axis];
        box.max[axis] = proxy.m_aabbMax[axis];
    }
    return box;
}

template <class RowOf>
PairDigest digestPairs(btOverlappingPairCache& cache, RowOf rowOf)
{
    PairDigest digest;
    const btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
    {
        const btBroadphaseProxy& a = *pairs[i].m_pProxy0;
        const btBroadphaseProxy& b = *pairs[i].m_pProxy1;
        if (overlaps(boxOfProxy(a), boxOfProxy(b)))
            digest.add(makePair(rowOf(a), rowOf(b)));
    }
    return digest;
}

btVector3 toBullet(const double* coordinates)
{
    return btVector3(btScalar(coordinates[0]), btScalar(coordinates[1]), btScalar(coordinates[2]));
}
}  // namespace

std::vector<AuditedProxy> collectProxies(const btCollisionWorld& world)
{
    std::vector<AuditedProxy> proxies;
    const btCollisionObjectArray& objects = world.getCollisionObjectArray();
    proxies.reserve(static_cast<std::size_t>(objects.size()));
    for (int i = 0; i < objects.size(); ++i)
    {
        const btBroadphaseProxy& proxy = *objects[i]->getBroadphaseHandle();
        proxies.push_back({boxOfProxy(proxy), proxy.m_collisionFilterGroup, proxy.m_collisionFilterMask});
    }
    return proxies;
}

PairDigest digestExact(const std::vector<AuditedProxy>& proxies)
{
    std::vector<ExactBox> boxes;
    boxes.reserve(proxies.size());
    for (const AuditedProxy& proxy : proxies)
        boxes.push_back(proxy.box);
    PairDigest digest;
    for (const Pair pair : findExactPairs(boxes))
    {
        const AuditedProxy& a = proxies[pair.first];
        const AuditedProxy& b = proxies[pair.second];
        if ((a.group & b.mask) != 0 && (b.group & a.mask) != 0)
            digest.add(pair);
    }
    return digest;
}

PairDigest digestCache(btCollisionWorld& world)
{
    const auto rowOf = [](const btBroadphaseProxy& proxy)
    {
        const auto* object = static_cast<const btCollisionObject*>(proxy.m_clientObject);
        return static_cast<std::uint32_t>(object->getWorldArrayIndex());
    };
    return digestPairs(*world.getPairCache(), rowOf);
}

ShadowBroadphase::ShadowBroadphase(NamedBroadphase broadphase, const std::vector<AuditedProxy>& proxies)
    : m_broadphase(std::move(broadphase))
{
    const MarginScope margin(m_broadphase.margin);
    for (const AuditedProxy& proxy : proxies)
    {
        // The row replaces the object pointer; without a ghost callback it is never dereferenced.
        void* row = reinterpret_cast<void*>(m_proxies.size() + 1);  // NOLINT(performance-no-int-to-ptr)
        m_proxies.push_back(m_broadphase.broadphase->createProxy(
            toBullet(proxy.box.min), toBullet(proxy.box.max), 0, row, proxy.group, proxy.mask, nullptr));
    }
}

ShadowBroadphase::~ShadowBroadphase()
{
    if (m_broadphase.broadphase)
        release();
}

bool ShadowBroadphase::fits(const std::vector<AuditedProxy>& proxies) const
{
    const auto isSame = [](const btBroadphaseProxy* own, const AuditedProxy& other)
    { return own->m_collisionFilterGroup == other.group && own->m_collisionFilterMask == other.mask; };
    return std::equal(m_proxies.begin(), m_proxies.end(), proxies.begin(), proxies.end(), isSame);
}

PairDigest ShadowBroadphase::update(const std::vector<AuditedProxy>& proxies)
{
    const MarginScope margin(m_broadphase.margin);
    btBroadphaseInterface& broadphase = *m_broadphase.broadphase;
    for (std::size_t row = 0; row < proxies.size(); ++row)
        broadphase.setAabb(m_proxies[row], toBullet(proxies[row].box.min), toBullet(proxies[row].box.max),
                           nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    const auto rowOf = [](const btBroadphaseProxy& proxy)
    { return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(proxy.m_clientObject) - 1); };
    return digestPairs(*broadphase.getOverlappingPairCache(), rowOf);
}

std::uint64_t ShadowBroadphase::pairCount()
{
    return static_cast<std::uint64_t>(
        m_broadphase.broadphase->getOverlappingPairCache()->getNumOverlappingPairs());
}

void ShadowBroadphase::release()
{
    // Pairs first, from the end: Bullet's cache scans all pairs for each proxy that is destroyed.
    btOverlappingPairCache& cache = *m_broadphase.broadphase->getOverlappingPairCache();
    while (cache.getNumOverlappingPairs() > 0)
    {
        const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
        cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, nullptr);
    }
    for (btBroadphaseProxy* proxy : m_proxies)
        m_broadphase.broadphase->destroyProxy(proxy, nullptr);
    m_broadphase.broadphase.reset();
}

std::uint64_t ShadowBroadphase::releaseAndMeasure()
{
    const std::uint64_t before = heapBytesInUse();
    release();
    const std::uint64_t after = heapBytesInUse();
    return before > after ? before - after : 0;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
