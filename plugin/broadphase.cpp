// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/broadphase.h"

#include "cullet/broad/log.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/plugin/pair_sync/backend_choice.h"
#include "cullet/plugin/pair_sync/ghost_pairs.h"
#include "cullet/plugin/pair_sync/pair_sync.h"
#include "cullet/plugin/proxies/debug_draw.h"
#include "cullet/plugin/proxies/proxy_store.h"
#include "cullet/plugin/proxies/queries.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <new>
#include <string>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct Broadphase::Parts
{
    Parts(std::unique_ptr<Backend> backend, btOverlappingPairCache* cache, const BroadphaseOptions& options)
        : margin(options.margin),
          index(std::make_unique<QueryIndex>(store.table())),
          pairSync(store, cache, std::move(backend), options),
          ghosts(store, pairSync)
    {
    }

    /// Replaces the backend where another one is faster for this number of bodies.
    void chooseBackend()
    {
        if (std::unique_ptr<Backend> next = chooser.choose(pairSync.backend(), store.table().liveCount()))
            pairSync.setBackend(std::move(next));
    }

    /// The rare part of setAabb() after the box is stored. Not inlined, so that the usual call saves no registers.
    [[gnu::noinline]] void addGhostPairs(Proxy& proxy)
    {
        ghosts.pollCallback();
        ghosts.addPairs(proxy, *index);
    }

    /// Adds a ghost to the ghost list, and the pairs of a proxy with ghosts.
    void addToGhosts(Proxy& proxy)
    {
        ghosts.add(proxy);
        ghosts.addPairs(proxy, *index);
    }

    QuerySources sources() const { return {*index, pairSync.rowSource(), pairSync.updatesTotal()}; }

    void destroy(Proxy& proxy, btDispatcher* dispatcher)
    {
        // Hidden first, so that callbacks of the removals neither find the proxy nor add pairs of it.
        store.hide(&proxy);
        pairSync.removePairsOf(proxy, dispatcher);
        ghosts.remove(proxy);
        store.destroy(&proxy);
    }

    btScalar margin;
    ProxyStore store;
    std::unique_ptr<QueryIndex> index;
    PairSync pairSync;
    GhostPairs ghosts;
    BackendChooser chooser;
    std::uint64_t formerTreeBuilds = 0, formerTreeSyncs = 0;  ///< of indices before resetPool()
};

namespace
{
/// Destroyed proxies may await the next update up to this number, or up to the number of live proxies.
constexpr std::uint32_t kSmallQuarantine = 1024;

Proxy* toProxy(btBroadphaseProxy* proxy)
{
    return static_cast<Proxy*>(proxy);
}

/// The comparison maps a NaN to 0. A margin that is too large for a float is as good as the largest one.
float toMargin(btScalar margin)
{
    constexpr float kMost = std::numeric_limits<float>::max();
    return margin > 0 ? static_cast<float>(std::min(margin, btScalar(kMost))) : 0.0f;
}

/// Returns the backend, or the grid if it is null.
std::unique_ptr<Backend> orFallback(std::unique_ptr<Backend> backend, const BroadphaseOptions& options)
{
    if (backend != nullptr)
        return backend;
    log(LogLevel::Warning, "no backend was given (null); the grid on the CPU is used");
    return makeFallbackBackend(options);
}
}  // namespace

Broadphase::Broadphase(btOverlappingPairCache* cache, const BroadphaseOptions& options)
    : Broadphase(makeBackend(options), cache, options)
{
    m->chooser = makeBackendChooser(options, m->pairSync.backend());
}

Broadphase::Broadphase(const BroadphaseOptions& options) : Broadphase(nullptr, options) {}

Broadphase::Broadphase(std::unique_ptr<Backend> backend, btOverlappingPairCache* cache,
                       const BroadphaseOptions& options)
    : m(std::make_unique<Parts>(orFallback(std::move(backend), options), cache, options)),
      m_paircache(m->pairSync.adapter().cache())
{
}

Broadphase::~Broadphase() = default;

btBroadphaseProxy* Broadphase::createProxy(const btVector3& aabbMin, const btVector3& aabbMax,
                                           int /*shapeType*/, void* userPtr, int collisionFilterGroup,
                                           int collisionFilterMask, btDispatcher* dispatcher)
{
    m->ghosts.pollCallback();
    Proxy* proxy = m->store.create(aabbMin, aabbMax, userPtr, {collisionFilterGroup, collisionFilterMask});
    const std::uint32_t uniqueId = uniqueIdOf(proxy);
    try
    {
        m->addToGhosts(*proxy);
    }
    catch (...)
    {
        // The caller never receives the proxy. A callback may have destroyed it before the exception.
        if (m->store.find(uniqueId) == proxy)
            m->destroy(*proxy, dispatcher);
        throw;
    }
    return proxy;
}

void Broadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    Proxy* own = toProxy(proxy);
    CULLET_ASSERT(m->store.find(uniqueIdOf(own)) == own,
                  "destroy a proxy once, in the broad phase that made it");
    m->destroy(*own, dispatcher);
    // A world that only answers ray queries never updates.
    if (m->store.quarantinedCount() <= std::max(kSmallQuarantine, m->store.table().liveCount()))
        return;
    try
    {
        m->pairSync.skipChanges();
    }
    catch (const std::bad_alloc&)
    {
        // The proxy is destroyed; the next destroyProxy() tries again.
    }
}

void Broadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                         btDispatcher* /*dispatcher*/)
{
    Proxy* own = toProxy(proxy);
    const btVector3 newMin = readByParts(aabbMin), newMax = readByParts(aabbMax);
    if (!own->hasKnownFilter())
        m->store.refreshFilter(own);
    if (isSameBox(own->m_aabbMin, own->m_aabbMax, newMin, newMax))
        return;
    m->store.setBox(own, newMin, newMax);
    if (m->ghosts.hasWork())
        m->addGhostPairs(*own);
}

void Broadphase::getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const
{
    aabbMin = proxy->m_aabbMin;
    aabbMax = proxy->m_aabbMax;
}

void Broadphase::rayTest(const btVector3& rayFrom, const btVector3& /*rayTo*/,
                         btBroadphaseRayCallback& rayCallback, const btVector3& aabbMin,
                         const btVector3& aabbMax)
{
    testRay(m->store, m->sources(), rayFrom, aabbMin, aabbMax, rayCallback);
}

void Broadphase::aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                          btBroadphaseAabbCallback& callback)
{
    testBox(m->store, m->sources(), aabbMin, aabbMax, callback);
}

void Broadphase::calculateOverlappingPairs(btDispatcher* dispatcher)
{
    m->ghosts.pollCallback();
    m->chooseBackend();
    m->pairSync.update(toMargin(m->margin < 0 ? gDbvtMargin : m->margin), *m->index, dispatcher);
    m->ghosts.tighten();
}

btOverlappingPairCache* Broadphase::getOverlappingPairCache()
{
    return m->pairSync.adapter().cache();
}

const btOverlappingPairCache* Broadphase::getOverlappingPairCache() const
{
    return m->pairSync.adapter().cache();
}

void Broadphase::getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const
{
    bool isFirst = true;
    m->store.forEach(
        [&](const Proxy* proxy, std::uint32_t row)
        {
            if (!isValid(m->store.table().box(row)))
                return;
            if (isFirst)
            {
                aabbMin = proxy->m_aabbMin;
                aabbMax = proxy->m_aabbMax;
            }
            aabbMin.setMin(proxy->m_aabbMin);
            aabbMax.setMax(proxy->m_aabbMax);
            isFirst = false;
        });
    if (isFirst)
        aabbMin = aabbMax = btVector3(0, 0, 0);
}

void Broadphase::resetPool(btDispatcher* /*dispatcher*/)
{
    if (m->store.table().liveCount() != 0)
        return;
    auto index = std::make_unique<QueryIndex>(m->store.table());
    m->formerTreeBuilds += m->index->buildsTotal();
    m->formerTreeSyncs += m->index->syncsTotal();
    m->store.reset();
    m->index = std::move(index);
    m->pairSync.skipChanges();
}

void Broadphase::printStats()
{
    const BroadphaseStats now = stats();
    char text[256];
    std::snprintf(
        text, sizeof(text),
        "%u bodies, %llu pairs, %llu pending, %llu provisional, %llu updates, %llu bytes; backend %s (%s)",
        now.bodies, static_cast<unsigned long long>(now.pairs),
        static_cast<unsigned long long>(now.pendingPairs),
        static_cast<unsigned long long>(now.provisionalPairs),
        static_cast<unsigned long long>(now.updatesTotal), static_cast<unsigned long long>(now.bytes),
        now.backendName, now.backend.path);
    log(LogLevel::Info, text);
}

BroadphaseStats Broadphase::stats() const
{
    BroadphaseStats stats;
    stats.bodies = m->store.table().liveCount();
    stats.ghosts = m->ghosts.count();
    stats.invalidBoxesTotal = m->store.invalidBoxesTotal();
    stats.queryTreeBuildsTotal = m->formerTreeBuilds + m->index->buildsTotal();
    stats.queryTreeSyncsTotal = m->formerTreeSyncs + m->index->syncsTotal();
    stats.bytes = m->store.bytes() + m->ghosts.bytes() + m->index->bytes();
    m->pairSync.addTo(stats);
    return stats;
}

void Broadphase::debugDraw(btIDebugDraw& drawer) const
{
    debugDraw(drawer, {});
}

void Broadphase::debugDraw(btIDebugDraw& drawer, const DebugDrawOptions& options) const
{
    DebugDrawing(m->store, drawer, options).draw(*m->pairSync.adapter().cache(), m->pairSync.backend());
}

void Broadphase::setBackend(std::unique_ptr<Backend> backend)
{
    if (backend == nullptr)
    {
        const std::string message =
            std::string("no backend was given (null); '") + m->pairSync.backend().name() + "' stays";
        log(LogLevel::Warning, message.c_str());
        return;
    }
    m->pairSync.setBackend(std::move(backend));
    // The chooser identifies its backend by the address, which a later backend may reuse.
    m->chooser = BackendChooser();
}

void Broadphase::setGhostPairsImmediate(bool immediate)
{
    m->pairSync.adapter().setGhosts(immediate);
}

bool Broadphase::canSetAabbsConcurrently()
{
    m->ghosts.pollCallback();
    return m->ghosts.count() == 0;
}

std::uint32_t Broadphase::upcomingUniqueId() const
{
    return m->store.upcomingUniqueId();
}

const Backend& Broadphase::backend() const
{
    return m->pairSync.backend();
}

const ProxyTable& Broadphase::table() const
{
    return m->store.table();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
