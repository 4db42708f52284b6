// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/scripted_broadphase.h"

#include "cullet/demos/program/heap_usage.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btVector3 toPoint(const double* coordinates)
{
    return btVector3(btScalar(coordinates[0]), btScalar(coordinates[1]), btScalar(coordinates[2]));
}

ExactBox storedBox(const btBroadphaseProxy& proxy)
{
    ExactBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = proxy.m_aabbMin[axis];
        box.max[axis] = proxy.m_aabbMax[axis];
    }
    return box;
}
}  // namespace

ScriptedBroadphase::ScriptedBroadphase(const LossSetup& setup, btScalar margin)
    : m_setup(setup), m_margin(margin)
{
}

ScriptedBroadphase::~ScriptedBroadphase()
{
    destroy();
}

void ScriptedBroadphase::add(const ExactBox& box, int group, int mask, void* client)
{
    m_bodies.push_back({box, group, mask, client});
}

void ScriptedBroadphase::makeBroadphase()
{
    BroadphaseRequest request;
    request.name = m_setup.side == "cullet" ? "grid" : m_setup.side;
    request.threads = m_setup.threads;
    m_broadphase = makeNamedBroadphase(request);
    if (m_margin >= 0)
        m_broadphase.margin = m_margin;
    m_rows.clear();
}

void ScriptedBroadphase::createProxy(std::uint32_t row)
{
    Body& body = m_bodies[row];
    body.proxy = broadphase().createProxy(toPoint(body.box.min), toPoint(body.box.max), 0, body.client,
                                          body.group, body.mask, dispatcher());
    const auto id = static_cast<std::uint32_t>(body.proxy->m_uniqueId);
    m_rows.resize(std::max<std::size_t>(m_rows.size(), id + 1));
    m_rows[id] = row;
}

void ScriptedBroadphase::createProxies()
{
    const MarginScope margin(m_broadphase.margin);
    for (std::uint32_t row = 0; row < size(); ++row)
        createProxy(row);
}

void ScriptedBroadphase::createAgain(std::uint32_t row, int group, int mask)
{
    const MarginScope margin(m_broadphase.margin);
    Body& body = m_bodies[row];
    broadphase().destroyProxy(body.proxy, dispatcher());
    body.group = group;
    body.mask = mask;
    createProxy(row);
}

void ScriptedBroadphase::setBoxes(std::uint32_t first)
{
    const MarginScope margin(m_broadphase.margin);
    for (std::uint32_t row = first; row < size(); ++row)
        broadphase().setAabb(m_bodies[row].proxy, toPoint(m_bodies[row].box.min),
                             toPoint(m_bodies[row].box.max), dispatcher());
}

void ScriptedBroadphase::findPairs()
{
    const MarginScope margin(m_broadphase.margin);
    broadphase().calculateOverlappingPairs(dispatcher());
}

void ScriptedBroadphase::destroy()
{
    if (!m_broadphase.broadphase)
        return;
    // Pairs first, from the end: Bullet's cache scans all pairs for each proxy that is destroyed.
    btOverlappingPairCache& cache = *broadphase().getOverlappingPairCache();
    while (cache.getNumOverlappingPairs() > 0)
    {
        const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
        cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, dispatcher());
    }
    for (Body& body : m_bodies)
    {
        if (body.proxy != nullptr)
            broadphase().destroyProxy(body.proxy, dispatcher());
        body.proxy = nullptr;
    }
    m_broadphase = {};
}

PairDigest ScriptedBroadphase::answer()
{
    PairDigest digest;
    const btBroadphasePairArray& pairs = broadphase().getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
    {
        const btBroadphaseProxy& a = *pairs[i].m_pProxy0;
        const btBroadphaseProxy& b = *pairs[i].m_pProxy1;
        if (overlaps(storedBox(a), storedBox(b)))
            digest.add(makePair(rowOf(a), rowOf(b)));
    }
    return digest;
}

PairDigest ScriptedBroadphase::exactAnswer()
{
    PairDigest digest;
    std::vector<ExactBox> boxes;
    for (const Body& body : m_bodies)
        boxes.push_back(storedBox(*body.proxy));
    for (const Pair pair : findExactPairs(boxes))
    {
        const Body& a = m_bodies[pair.first];
        const Body& b = m_bodies[pair.second];
        if ((a.group & b.mask) != 0 && (b.group & a.mask) != 0 && allows(*a.proxy, *b.proxy))
            digest.add(pair);
    }
    return digest;
}

std::uint64_t ScriptedBroadphase::releaseAndMeasure()
{
    const std::uint64_t before = heapBytesInUse();
    destroy();
    const std::uint64_t after = heapBytesInUse();
    return before > after ? before - after : 0;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
