// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/convex_dispatcher.h"

#include "broad/worker_pool.h"
#include "plugin/isa_gjk_algorithm.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <algorithm>
#include <exception>
#include <typeinfo>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Pairs per task: some ten microseconds of work.
constexpr std::size_t kGrain = 256;

/// Pairs between the first touch of a pair's memory and its use.
constexpr std::size_t kAhead = 12;

[[gnu::always_inline]] inline void prefetchBytes(const void* object, std::size_t from, std::size_t to)
{
    const auto* bytes = static_cast<const char*>(object);
    for (std::size_t at = from; at < to; at += 64)
        __builtin_prefetch(bytes + at);
    __builtin_prefetch(bytes + to - 1);
}

/// The algorithm and the proxies of a pair that comes later; the bodies of one that comes sooner.
[[gnu::always_inline]] inline void prefetch(const btBroadphasePair& later, const btBroadphasePair& sooner)
{
    prefetchBytes(later.m_algorithm, 0, sizeof(IsaGjkAlgorithm));
    __builtin_prefetch(later.m_pProxy0);
    __builtin_prefetch(later.m_pProxy1);
    // The transform comes first in a body; its shape and state follow behind the second transform and five vectors.
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    for (const btBroadphaseProxy* proxy : {sooner.m_pProxy0, sooner.m_pProxy1})
    {
        prefetchBytes(proxy->m_clientObject, 0, sizeof(btTransform) + 16);
        prefetchBytes(proxy->m_clientObject, kShape, kShape + 40);
    }
}

bool isIdle(const btBroadphasePair& pair)
{
    if (pair.m_algorithm == nullptr || typeid(*pair.m_algorithm) != typeid(IsaGjkAlgorithm))
        return false;
    const auto& a = *static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    const auto& b = *static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    // Bullet's path knows at once that there is nothing to do for two sleepers.
    if (!a.isActive() && !b.isActive())
        return false;
    return static_cast<IsaGjkAlgorithm*>(pair.m_algorithm)->isIdle(a, b);
}
}  // namespace

class Dispatcher::Callback : public btOverlapCallback
{
public:
    Callback(Dispatcher& dispatcher, const btBroadphasePair* pairs, const btDispatcherInfo& info)
        : m_dispatcher(dispatcher), m_pairs(pairs), m_info(info)
    {
    }

    bool processOverlap(btBroadphasePair& pair) override
    {
        const std::ptrdiff_t place = &pair - m_pairs;
        const auto& idle = m_dispatcher.m_idle;
        const bool isKnown = static_cast<std::size_t>(place) < idle.size();
        if (isKnown && pair.m_algorithm != nullptr &&
            idle[static_cast<std::size_t>(place)] == pair.m_algorithm)
            return false;
        m_dispatcher.getNearCallback()(pair, m_dispatcher, m_info);
        return false;
    }

private:
    Dispatcher& m_dispatcher;
    const btBroadphasePair* m_pairs;
    const btDispatcherInfo& m_info;
};

Dispatcher::Dispatcher(btCollisionConfiguration* configuration, const DispatcherOptions& options)
    : btCollisionDispatcher(configuration),
      m_isaGjk(registerIsaGjk(*this, options.isaGjk)),
      m_workers(std::make_unique<WorkerPool>(options.threads)),
      m_ownNearCallback(getNearCallback())
{
}

Dispatcher::~Dispatcher()
{
    m_isaGjk.leave();
}

void Dispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pairCache, const btDispatcherInfo& info,
                                           btDispatcher* dispatcher)
{
    m_isaGjk.beginPass();
    m_idle.clear();
    m_idlePairs = 0;
    btBroadphasePair* pairs = pairCache->getOverlappingPairArrayPtr();
    if (getNearCallback() == m_ownNearCallback && info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE)
    {
        const auto count = static_cast<std::size_t>(pairCache->getNumOverlappingPairs());
        makeAlgorithms(pairs, count);
        findIdlePairs(pairs, count);
    }
    Callback callback(*this, pairs, info);
    pairCache->processAllOverlappingPairs(&callback, dispatcher, info);
    m_isaGjk.endPass();
}

/// What the near callback would do for a new pair, as far as the algorithm; only for those that may be idle at once.
void Dispatcher::makeAlgorithms(btBroadphasePair* pairs, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
    {
        btBroadphasePair& pair = pairs[i];
        if (pair.m_algorithm != nullptr)
            continue;
        auto& a = *static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
        auto& b = *static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
        // Bullet's islands wake what shares a manifold, even an empty one, with a moving kinematic body.
        if (a.isKinematicObject() || b.isKinematicObject() || !needsCollision(&a, &b))
            continue;
        const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1,
                                             -1);
        const btCollisionObjectWrapper wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1,
                                             -1);
        pair.m_algorithm = findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        if (pair.m_algorithm != nullptr && typeid(*pair.m_algorithm) == typeid(IsaGjkAlgorithm))
            static_cast<IsaGjkAlgorithm*>(pair.m_algorithm)->expect(breakingThresholdOf(a, b));
    }
}

/// As in btCollisionDispatcher::getNewManifold().
btScalar Dispatcher::breakingThresholdOf(const btCollisionObject& a, const btCollisionObject& b) const
{
    if ((m_dispatcherFlags & CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) == 0)
        return gContactBreakingThreshold;
    return btMin(a.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold),
                 b.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold));
}

void Dispatcher::findIdlePairs(const btBroadphasePair* pairs, std::size_t count)
try
{
    m_idle.assign(count, nullptr);
    const unsigned tasks =
        m_workers->threads() == 1 ? 1u : static_cast<unsigned>(std::max<std::size_t>(1, count / kGrain));
    std::atomic<std::uint64_t> found{0};
    m_workers->run(tasks,
                   [&](unsigned task)
                   {
                       const TaskRange range(count, task, tasks);
                       found += findIdlePairs(pairs, range.begin, range.end);
                   });
    m_idlePairs = found;
    m_isaGjk.counters().separated.add(m_idlePairs);
}
catch (const std::exception&)
{
    // Without memory or threads every pair takes Bullet's path.
    m_idle.clear();
}

std::uint64_t Dispatcher::findIdlePairs(const btBroadphasePair* pairs, std::size_t begin, std::size_t end)
{
    std::uint64_t found = 0;
    for (std::size_t i = begin; i < end; ++i)
    {
        if (i + kAhead < end)
            prefetch(pairs[i + kAhead], pairs[i + kAhead / 2]);
        if (!isIdle(pairs[i]))
            continue;
        m_idle[i] = pairs[i].m_algorithm;
        ++found;
    }
    return found;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
