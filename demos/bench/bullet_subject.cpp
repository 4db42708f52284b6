// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/bullet_subject.h"

#include "cullet/comparison/backends.h"
#include "cullet/plugin/broadphase.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
NamedBroadphase makeBroadphase(const SubjectRequest& request)
{
    if (request.name == "grid-cells")
    {
        auto broadphase = std::make_unique<Broadphase>(makeCellGridBackend());
        NamedBroadphase result;
        result.cullet = broadphase.get();
        result.broadphase = std::move(broadphase);
        result.name = request.name;
        result.margin = gDbvtMargin;
        result.threads = request.threads;
        return result;
    }
    BroadphaseRequest broadphase;
    broadphase.name = request.name;
    broadphase.threads = request.threads;
    broadphase.worldBounds = request.bounds;
    broadphase.mostProxies = request.bodies + 16;
    return makeNamedBroadphase(broadphase);
}
}  // namespace

btVector3 toVector(const float* coordinates)
{
    return btVector3(btScalar(coordinates[0]), btScalar(coordinates[1]), btScalar(coordinates[2]));
}

BulletSubject::BulletSubject(const SubjectRequest& request) : m_broadphase(makeBroadphase(request)) {}

BulletSubject::~BulletSubject()
{
    // Pairs first, from the end: Bullet's cache scans all pairs for each proxy that is destroyed.
    btOverlappingPairCache& cache = *broadphase().getOverlappingPairCache();
    while (cache.getNumOverlappingPairs() > 0)
    {
        const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
        cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, nullptr);
    }
    for (btBroadphaseProxy* proxy : m_proxies)
    {
        if (proxy != nullptr)
            broadphase().destroyProxy(proxy, nullptr);
    }
}

std::uint32_t BulletSubject::rowOf(const btBroadphaseProxy& proxy)
{
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(proxy.m_clientObject) - 1);
}

void BulletSubject::create(const Aabb* boxes, std::size_t count)
{
    const MarginScope margin(m_broadphase.margin);
    for (std::size_t i = 0; i < count; ++i)
    {
        // A row, not an address: it is never dereferenced.
        void* client = reinterpret_cast<void*>(m_proxies.size() + 1);  // NOLINT(performance-no-int-to-ptr)
        m_proxies.push_back(broadphase().createProxy(toVector(boxes[i].min), toVector(boxes[i].max), 0,
                                                     client, 1, -1, nullptr));
    }
}

void BulletSubject::setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows)
{
    const MarginScope margin(m_broadphase.margin);
    for (const std::uint32_t row : rows)
        broadphase().setAabb(m_proxies[row], toVector(boxes[row].min), toVector(boxes[row].max), nullptr);
}

void BulletSubject::remove(std::uint32_t row)
{
    broadphase().destroyProxy(m_proxies[row], nullptr);
    m_proxies[row] = nullptr;
}

void BulletSubject::findPairs()
{
    const MarginScope margin(m_broadphase.margin);
    broadphase().calculateOverlappingPairs(nullptr);
}

PairDigest BulletSubject::digest(const std::vector<Aabb>& boxes)
{
    PairDigest digest;
    const btBroadphasePairArray& pairs = broadphase().getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
    {
        const Pair rows = makePair(rowOf(*pairs[i].m_pProxy0), rowOf(*pairs[i].m_pProxy1));
        if (overlaps(boxes[rows.first], boxes[rows.second]))
            digest.add(rows);
    }
    return digest;
}

std::uint64_t BulletSubject::heldPairs()
{
    return static_cast<std::uint64_t>(broadphase().getOverlappingPairCache()->getNumOverlappingPairs());
}

std::string BulletSubject::path() const
{
    return m_broadphase.cullet != nullptr ? m_broadphase.cullet->stats().backend.path : "";
}

std::unique_ptr<Subject> makeBulletSubject(const SubjectRequest& request)
{
    return std::make_unique<BulletSubject>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
