// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/near_pass.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/compound/compound_algorithm.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/convex/serial_reason.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/mix_bits.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/step/prefetch_step.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Whether the passes of a pair cache run no code of the application between two pairs.
bool isKnownCache(const btOverlappingPairCache& cache)
{
    return isExactlyAnyOf<PairCache, btHashedOverlappingPairCache, btSortedOverlappingPairCache>(cache);
}

/// Whether the body's virtual functions are Bullet's own. By name, since programs without dynamics lack btRigidBody.
bool isOfBullet(const btCollisionObject& body)
{
    return isExactly<btCollisionObject>(body) || std::strcmp(dynamicType(body)->name(), "11btRigidBody") == 0;
}

/// btCollisionDispatcher::needsCollision(), for bodies that are not both asleep.
bool mayCollide(const btCollisionObject& a, const btCollisionObject& b)
{
    return a.checkCollideWith(&b) && b.checkCollideWith(&a);
}
}  // namespace

Dispatcher::NearPass::NearPass(Dispatcher& dispatcher, btOverlappingPairCache& cache,
                               const btDispatcherInfo& info)
    : m_dispatcher(dispatcher),
      m_cache(cache),
      m_pairs(cache.getOverlappingPairArrayPtr()),
      m_unreadPairs(unreadPairs()),
      m_wereMostAsleep(2 * dispatcher.m_jobs->stats().pairs < std::uint64_t(cache.getNumOverlappingPairs())),
      m_info(info),
      m_jobs(*dispatcher.m_jobs),
      m_isInLine(isExactly<Dispatcher>(dispatcher) &&
                 info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE),
      m_findsForeign(dispatcher.m_findsForeignPairs && m_isInLine && usesOwnNearCallback() &&
                     isKnownCache(cache) && !hasCallbackOfChildren() &&
                     findSerialReason(dispatcher, dispatcher.m_isaGjk, info, false) == SerialReason::None),
      m_reason(serialReason())
{
    ContactStats& stats = m_jobs.stats();
    if (m_reason == SerialReason::None && m_jobs.areTooFew(stats.pairs))
        m_reason = SerialReason::FewPairs;
    stats.reason = m_reason;
    stats.jobs = 0;
}

/// The pairs of a cache, if no search for idle pairs has read their bodies and they are enough for a prefetch.
const PairCache* Dispatcher::NearPass::unreadPairs() const
{
    const bool areUnread =
        m_cache.getNumOverlappingPairs() > 2 * kPrefetchDistance && m_dispatcher.m_idle.empty();
    return areUnread && isExactly<PairCache>(m_cache) ? static_cast<const PairCache*>(&m_cache) : nullptr;
}

/// The loop of Bullet's own cache is here too, since its call, its profile zone and a virtual call a pair cost more than
/// sleeping pairs. No pair is removed, since processOverlap() returns false.
void Dispatcher::NearPass::run(btDispatcher* dispatcher)
{
    // By address: where a library has a class of its own with this name, the call does the same.
    const bool isBullets = dynamicType(m_cache) == &typeid(btHashedOverlappingPairCache);
    if (m_info.m_deterministicOverlappingPairs || !isBullets)
        return m_cache.processAllOverlappingPairs(this, dispatcher, m_info);
    btBroadphasePairArray& pairs = m_cache.getOverlappingPairArray();
    // Callbacks may add and remove pairs.
    for (int i = 0; i < pairs.size(); ++i)
        processOverlap(pairs[i]);
}

void Dispatcher::NearPass::finish()
{
    m_jobs.run(m_info);
    ContactStats& stats = m_jobs.stats();
    stats.pairs = m_near;
    stats.inOrderTotal += m_near - stats.jobs;
    ++stats.dispatchesTotal[std::size_t(stats.reason)];
}

SerialReason Dispatcher::NearPass::serialReason() const
{
    if (m_dispatcher.m_workers->threads() == 1)
        return SerialReason::OneThread;
    if (!usesOwnNearCallback())
        return SerialReason::NearCallback;
    if (m_info.m_dispatchFunc != btDispatcherInfo::DISPATCH_DISCRETE)
        return SerialReason::ContinuousDispatch;
    if (!m_isInLine)
        return SerialReason::DerivedDispatcher;
    if (!isKnownCache(m_cache))
        return SerialReason::UnknownPairCache;
    return findSerialReason(m_dispatcher, m_dispatcher.m_isaGjk, m_info,
                            m_dispatcher.m_callbacksAreThreadSafe);
}

bool Dispatcher::NearPass::processOverlap(btBroadphasePair& pair)
{
    if (m_unreadPairs != nullptr)
        prefetchAhead(pair);
    if (isIdle(pair))
    {
        noteForeign(pair);
        return false;
    }
    btCollisionObject &a = bodyOf(pair.m_pProxy0), &b = bodyOf(pair.m_pProxy1);
    const bool isInLine = m_isInLine && usesOwnNearCallback();
    if (isInLine && areAsleep(a, b))
        return false;
    noteForeign(pair);
    if (!isInLine)
        takeBulletsPath(pair);
    else if (!(m_dispatcher.m_testsInTurn && isIdleInTurn(pair)) && mayCollide(a, b))
        collide(pair, a, b);
    return false;
}

bool Dispatcher::NearPass::isIdle(const btBroadphasePair& pair) const
{
    const auto place = static_cast<std::size_t>(&pair - m_pairs);
    const auto& idle = m_dispatcher.m_idle;
    return place < idle.size() && pair.m_algorithm != nullptr && idle[place] == pair.m_algorithm;
}

/// Prefetches the proxies of a later pair, and of an earlier one what shows whether its bodies are awake. Callbacks of
/// the pass may have changed the array.
[[gnu::always_inline]] inline void Dispatcher::NearPass::prefetchAhead(const btBroadphasePair& pair) const
{
    const std::ptrdiff_t left =
        m_unreadPairs->getOverlappingPairArrayPtr() + m_unreadPairs->getNumOverlappingPairs() - &pair;
    if (left <= 2 * kPrefetchDistance)
        return;
    const btBroadphasePair &later = (&pair)[2 * kPrefetchDistance], &sooner = (&pair)[kPrefetchDistance];
    __builtin_prefetch(later.m_pProxy0);
    __builtin_prefetch(later.m_pProxy1);
    const void *const a = sooner.m_pProxy0->m_clientObject, *const b = sooner.m_pProxy1->m_clientObject;
    prefetchState(a);
    prefetchState(b);
    if (m_wereMostAsleep)
        return;
    __builtin_prefetch(later.m_algorithm);
    prefetchBody(a);
    prefetchBody(b);
}

/// Notes whether a pair with an awake body may call the application. After the first one the others are not examined.
[[gnu::always_inline]] inline void Dispatcher::NearPass::noteForeign(const btBroadphasePair& pair)
{
    if (!m_dispatcher.m_hadForeignPairs)
        m_dispatcher.m_hadForeignPairs = !m_findsForeign || isForeign(pair);
}

bool Dispatcher::NearPass::isForeign(const btBroadphasePair& pair)
{
    const btCollisionObject &a = bodyOf(pair.m_pProxy0), &b = bodyOf(pair.m_pProxy1);
    return pair.m_algorithm == nullptr || !m_bodies.kindOf(a, isOfBullet) ||
           !m_bodies.kindOf(b, isOfBullet) || !isJob(kindOf(*pair.m_algorithm, a, b));
}

PairKind Dispatcher::NearPass::kindOf(btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                                      const btCollisionObject& b)
{
    if (!m_kinds)
        m_kinds.emplace(m_dispatcher, m_dispatcher.m_isaGjk, m_dispatcher.m_doubleDispatchContactPoints,
                        m_dispatcher.m_callbacksAreThreadSafe);
    return m_kinds->kindOf(algorithm, a, b);
}

[[gnu::noinline]] void Dispatcher::NearPass::takeBulletsPath(btBroadphasePair& pair)
{
    const bool isIdle = m_dispatcher.m_testsInTurn && usesOwnNearCallback() &&
                        !areAsleep(bodyOf(pair.m_pProxy0), bodyOf(pair.m_pProxy1)) && isIdleInTurn(pair);
    if (!isIdle)
        m_dispatcher.getNearCallback()(pair, m_dispatcher, m_info);
}

/// For a dispatch that tests each pair when its turn has come.
[[gnu::noinline]] bool Dispatcher::NearPass::isIdleInTurn(const btBroadphasePair& pair)
{
    IsaGjkAlgorithm* const algorithm = isaGjkOf(pair, m_dispatcher);
    if (algorithm == nullptr || !algorithm->isIdle(bodyOf(pair.m_pProxy0), bodyOf(pair.m_pProxy1)))
        return false;
    ++m_dispatcher.m_idlePairs;
    m_dispatcher.m_isaGjk.counters().separated.add(1);
    return true;
}

[[gnu::noinline]] void Dispatcher::NearPass::makeAlgorithm(btBroadphasePair& pair, btCollisionObject& a,
                                                           btCollisionObject& b)
{
    const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
    pair.m_algorithm = m_dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
}

[[gnu::always_inline]] inline void Dispatcher::NearPass::collide(btBroadphasePair& pair, btCollisionObject& a,
                                                                 btCollisionObject& b)
{
    if (pair.m_algorithm == nullptr)
        makeAlgorithm(pair, a, b);
    if (pair.m_algorithm == nullptr)
        return;
    const ContactJob job = {pair.m_algorithm, &a, &b};
    if (m_compounds.kindOf(*pair.m_algorithm, IsaGjkRegistration::isOfCompound) && isAtRest(job))
    {
        ++m_dispatcher.m_idlePairs;
        return;
    }
    ++m_near;
    if (m_reason == SerialReason::None)
        deferOrRun(job);
    else
        job.run(m_info);
}

/// Whether nothing of a pair with a compound has changed since a call that found no contacts. If it has not moved since the
/// last dispatch, but it is unknown whether it has contacts, its next call finds that out.
[[gnu::noinline]] bool Dispatcher::NearPass::isAtRest(const ContactJob& job)
{
    CompoundRest& rest = static_cast<CompoundAlgorithm*>(job.algorithm)->rest();
    if (!rest.isUnmoved(job.a->getWorldTransform(), job.b->getWorldTransform()) || hasCallbackOfChildren())
        return false;
    if (!m_contents)
        m_contents.emplace();
    const std::uint64_t ofA = m_contents->hashOf(*job.a->getCollisionShape()),
                        ofB = m_contents->hashOf(*job.b->getCollisionShape());
    if (ofA == 0 || ofB == 0)
        return false;
    const std::uint64_t shapes = mixBits(mixBits(ofA, ofB), std::uint64_t(m_info.m_enableSatConvex ? 1 : 0));
    if (rest.isApart(shapes))
        return true;
    if (!rest.isTouching(shapes) && kindOf(*job.algorithm, *job.a, *job.b) == PairKind::Compound)
        rest.examine(shapes);
    return false;
}

void Dispatcher::NearPass::deferOrRun(const ContactJob& job)
{
    const PairKind kind = kindOf(*job.algorithm, *job.a, *job.b);
    if (kind == PairKind::Unknown)
        runUnknown(job);
    else if (!isJob(kind) || !defer(job, kind))
        job.run(m_info);
}

/// Such a pair sees the contacts of all earlier pairs and none of later ones, and may change anything.
void Dispatcher::NearPass::runUnknown(const ContactJob& job)
{
    m_jobs.run(m_info);
    ++m_jobs.stats().barriersTotal;
    job.run(m_info);
    m_jobs.stats().reason = m_reason = serialReason();
}

/// @return false if out of memory
bool Dispatcher::NearPass::defer(const ContactJob& job, PairKind kind)
{
    if (kind == PairKind::IsaGjk)
        static_cast<IsaGjkAlgorithm*>(job.algorithm)->makeManifold(*job.a, *job.b);
    if (m_jobs.tryAdd(job, kind))
        return true;
    m_jobs.stats().reason = SerialReason::OutOfMemory;
    m_jobs.run(m_info);
    return false;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
