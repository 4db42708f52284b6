// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex_dispatcher.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/convex/body_motions.h"
#include "cullet/plugin/convex/child_memory.h"
#include "cullet/plugin/convex/contact_jobs.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/prefetch.h"
#include "cullet/plugin/near_pass.h"
#include "cullet/plugin/pair_cache/pair_cache.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Pairs per task: about ten microseconds of work.
constexpr std::size_t kPairGrain = 256;

/// Nanoseconds for the motion of a body, for a pair, and additionally for a pair whose shapes are tested; the number of
/// tests is that of the last dispatch.
constexpr double kCostOfBody = 30, kCostOfPair = 8, kCostOfTest = 100;

/// Pairs between the prefetch of a pair's memory and its use.
constexpr std::size_t kPairsAhead = 12;

/// Prefetches the algorithm and the proxies of one pair, and the bodies of an earlier one.
[[gnu::always_inline]] inline void prefetch(const btBroadphasePair& later, const btBroadphasePair& sooner)
{
    prefetchBytes(later.m_algorithm, 0, sizeof(IsaGjkAlgorithm));
    __builtin_prefetch(later.m_pProxy0);
    __builtin_prefetch(later.m_pProxy1);
    prefetchBody(sooner.m_pProxy0->m_clientObject);
    prefetchBody(sooner.m_pProxy1->m_clientObject);
}

bool tryReserve(std::vector<std::uint32_t>& list, std::size_t count) noexcept
try
{
    list.reserve(count);
    return true;
}
catch (const std::exception&)
{
    return false;
}

/// Scope of a pass, during which shapes do not change; an exception of a callback ends it too.
class PassScope
{
public:
    explicit PassScope(IsaGjkRegistration& isaGjk) : m_isaGjk(isaGjk) { m_isaGjk.beginPass(); }
    ~PassScope() { m_isaGjk.endPass(); }
    PassScope(const PassScope&) = delete;
    PassScope& operator=(const PassScope&) = delete;

private:
    IsaGjkRegistration& m_isaGjk;
};

bool isIdle(const btBroadphasePair& pair)
{
    const btCollisionObject &a = bodyOf(pair.m_pProxy0), &b = bodyOf(pair.m_pProxy1);
    return !areAsleep(a, b) && static_cast<IsaGjkAlgorithm*>(pair.m_algorithm)->isIdle(a, b);
}
}  // namespace

IsaGjkAlgorithm* isaGjkOf(const btBroadphasePair& pair, const btDispatcher& dispatcher)
{
    if (pair.m_algorithm == nullptr || !isExactly<IsaGjkAlgorithm>(*pair.m_algorithm))
        return nullptr;
    auto* const algorithm = static_cast<IsaGjkAlgorithm*>(pair.m_algorithm);
    return algorithm->belongsTo(dispatcher) ? algorithm : nullptr;
}

Dispatcher::Dispatcher(btCollisionConfiguration* configuration, const DispatcherOptions& options)
    : btCollisionDispatcher(configuration),
      m_isaGjk(registerIsaGjk(*this, options.isaGjk)),
      m_workers(std::make_unique<ParallelLoops>(options.threads)),
      m_jobs(std::make_unique<ContactJobs>(*m_workers, *this)),
      m_callbacksAreThreadSafe(options.callbacksAreThreadSafe),
      m_ownNearCallback(getNearCallback())
{
    // The registration may be left from an earlier dispatcher at this address, whose pairs no longer exist.
    m_isaGjk.motions().clear();
}

Dispatcher::~Dispatcher()
{
    m_isaGjk.motions().pairs().forget();
    // The registration stays: a world may outlive its dispatcher, and addresses are used again.
    m_isaGjk.motions().freeIfUnused();
    m_isaGjk.leave();
}

void Dispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pairCache, const btDispatcherInfo& info,
                                           btDispatcher* dispatcher)
{
    if (isAsleep(*pairCache, info) || areFewAndAsleep(*pairCache, info))
        return skipDispatch();
    const PassScope pass(m_isaGjk);
    if (m_jobs->hasRecords())
        m_jobs->repeatRecords();
    m_idlePairs = m_stillPairs = 0;
    m_hadForeignPairs = false;
    m_testsInTurn = false;
    btBroadphasePair* pairs = pairCache->getOverlappingPairArrayPtr();
    if (getNearCallback() == m_ownNearCallback && info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE)
        findIdlePairs(pairs, static_cast<std::size_t>(pairCache->getNumOverlappingPairs()),
                      m_isaGjk.motions().serves(pairCache));
    else
        m_idle.clear();
    NearPass nearPass(*this, *pairCache, info);
    try
    {
        nearPass.run(dispatcher);
    }
    catch (...)
    {
        // Pairs before the one that failed have their contacts, as in Bullet.
        nearPass.finish();
        throw;
    }
    nearPass.finish();
}

void Dispatcher::expectSleep(const PairCache* cache)
{
    m_sleepingCache = cache;
    m_sleepingVersion = cache != nullptr ? cache->version() : 0;
}

/// Whether a cache is as it was when no body of its pairs was active.
bool Dispatcher::isAsleep(const btOverlappingPairCache& cache, const btDispatcherInfo& info) const
{
    return m_sleepingCache != nullptr && m_sleepingCache == &cache &&
           m_sleepingCache->version() == m_sleepingVersion && !m_sleepingCache->hasDetachedPairs() &&
           mayLeaveOutSleepers(info);
}

/// Whether a pair of bodies that are not active calls nothing.
bool Dispatcher::mayLeaveOutSleepers(const btDispatcherInfo& info) const
{
    return isExactly<Dispatcher>(*this) && getNearCallback() == m_ownNearCallback &&
           info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE && !m_jobs->hasRecords();
}

/// Whether Bullet's near callback would do nothing for any pair, and the pairs are so few that to ask costs less than to
/// prepare a pass.
bool Dispatcher::areFewAndAsleep(const btOverlappingPairCache& cache, const btDispatcherInfo& info) const
{
    constexpr int kFewPairs = 64;
    // By address, which is the faster comparison: a pass does the same.
    const std::type_info* const type = dynamicType(cache);
    const bool isOwn = type == &typeid(PairCache) && !static_cast<const PairCache&>(cache).hasDetachedPairs();
    const int count = cache.getNumOverlappingPairs();
    if (count > kFewPairs || (!isOwn && type != &typeid(btHashedOverlappingPairCache)) ||
        !mayLeaveOutSleepers(info))
        return false;
    const btBroadphasePair* const pairs = cache.getOverlappingPairArrayPtr();
    return std::all_of(pairs, pairs + count,
                       [](const btBroadphasePair& pair)
                       { return areAsleep(bodyOf(pair.m_pProxy0), bodyOf(pair.m_pProxy1)); });
}

/// Counts a dispatch in which no pair was processed.
void Dispatcher::skipDispatch()
{
    m_idlePairs = m_stillPairs = 0;
    m_idle.clear();
    m_hadForeignPairs = false;
    m_hasMissedUpdate = true;
    ContactStats& stats = m_jobs->stats();
    stats.reason = m_workers->threads() == 1 ? SerialReason::OneThread : SerialReason::FewPairs;
    stats.pairs = stats.jobs = 0;
    ++stats.dispatchesTotal[std::size_t(stats.reason)];
}

const ContactStats& Dispatcher::contactStats() const
{
    return m_jobs->stats();
}

btPersistentManifold* Dispatcher::getNewManifold(const btCollisionObject* a, const btCollisionObject* b)
{
    Recording* const recording = Recording::ofThisThread(this);
    if (recording != nullptr)
        return &recording->create(*a, *b, breakingThresholdOf(*a, *b));
    m_jobs->repeatRecords();
    return btCollisionDispatcher::getNewManifold(a, b);
}

void Dispatcher::releaseManifold(btPersistentManifold* manifold)
{
    Recording* const recording = Recording::ofThisThread(this);
    if (recording != nullptr)
        recording->release(*manifold);
    else if (!m_jobs->hasRecords())
        btCollisionDispatcher::releaseManifold(manifold);
    else
        Recording(*this, m_jobs->lastRecord(), Recording::Of::Pass).release(*manifold);
}

void* Dispatcher::allocateCollisionAlgorithm(int size)
{
    ChildMemory* const memory = ChildMemory::ofThisThread();
    if (Recording::isInJob(this))
        return Recording::allocate(std::size_t(size));
    return memory != nullptr ? memory->allocate(std::size_t(size))
                             : btCollisionDispatcher::allocateCollisionAlgorithm(size);
}

void Dispatcher::freeCollisionAlgorithm(void* algorithm)
{
    ChildMemory* const memory = ChildMemory::ofThisThread();
    if (Recording::isInJob(this))
        Recording::ofThisThread(this)->free(algorithm);
    else if (memory != nullptr)
        memory->free(algorithm);
    else
        btCollisionDispatcher::freeCollisionAlgorithm(algorithm);
}

/// Creates the algorithms of new pairs, for a pair cache whose pairs do not track their bodies.
///
/// @param isaGjkPairs [out] indices of the pairs of ISA-GJK
/// @return false if out of memory
bool Dispatcher::makeAlgorithms(btBroadphasePair* pairs, std::size_t count,
                                std::vector<std::uint32_t>& isaGjkPairs)
{
    if (!tryReserve(isaGjkPairs, count))
        return false;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (pairs[i].m_algorithm != nullptr ? isaGjkOf(pairs[i], *this) : makeAlgorithm(pairs[i]))
            isaGjkPairs.push_back(static_cast<std::uint32_t>(i));
    }
    return true;
}

/// Creates the algorithm of a new pair as the near callback would, but only if the pair may be idle at once. Some of
/// Bullet's own algorithms create their manifolds in their constructors; they must be created in Bullet's order.
///
/// @return the algorithm if it is an IsaGjkAlgorithm, else null
IsaGjkAlgorithm* Dispatcher::makeAlgorithm(btBroadphasePair& pair)
{
    btCollisionObject &a = bodyOf(pair.m_pProxy0), &b = bodyOf(pair.m_pProxy1);
    if (areAsleep(a, b))
        return nullptr;
    const int typeA = a.getCollisionShape()->getShapeType(), typeB = b.getCollisionShape()->getShapeType();
    if (m_doubleDispatchContactPoints[typeA][typeB] != m_isaGjk.contactPoints())
        return nullptr;
    m_hadForeignPairs = true;
    if (!needsCollision(&a, &b))
        return nullptr;
    const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
    pair.m_algorithm = findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    IsaGjkAlgorithm* const algorithm = isaGjkOf(pair, *this);
    if (algorithm != nullptr)
        algorithm->setBreakingThreshold(breakingThresholdOf(a, b));
    return algorithm;
}

/// Afterwards every tracked body exists, since a pair of the array tracks it.
///
/// @return false if out of memory
bool Dispatcher::makeAndTrack(btBroadphasePair* pairs, std::size_t count)
{
    const MotionTrackedPairs& tracked = m_isaGjk.motions().pairs();
    if (!classify(pairs, count))
        return false;
    if (tracked.trackingCount() == tracked.trackingTotal())
        return true;
    trackAgain(pairs, count);
    return classify(pairs, count);
}

/// Determines for each pair in the array whether it tracks its bodies.
bool Dispatcher::classify(btBroadphasePair* pairs, std::size_t count)
{
    MotionTrackedPairs& tracked = m_isaGjk.motions().pairs();
    if (tracked.areClassified(pairs, count))
        return true;
    if (!tracked.tryReserve(count))
        return false;
    for (std::size_t i = 0; (i = tracked.firstUnclassified(pairs, i, count)) < count; ++i)
        classify(pairs[i], i);
    tracked.endCount();
    return true;
}

[[gnu::noinline]] void Dispatcher::classify(btBroadphasePair& pair, std::size_t place)
{
    IsaGjkAlgorithm* algorithm = nullptr;
    if (pair.m_algorithm != nullptr)
        algorithm = isaGjkOf(pair, *this);
    else if ((algorithm = makeAlgorithm(pair)) != nullptr)
        algorithm->track(bodyOf(pair.m_pProxy0), bodyOf(pair.m_pProxy1));
    using Kind = MotionTrackedPairs::Kind;
    const Kind ofIsaGjk = algorithm != nullptr && algorithm->isTracking() ? Kind::Tracking : Kind::Untracked;
    m_isaGjk.motions().pairs().record(place, pair.m_algorithm, algorithm != nullptr ? ofIsaGjk : Kind::Other);
}

/// Tracks all bodies anew, after tracked pairs have left the array together with their algorithms and maybe bodies.
void Dispatcher::trackAgain(btBroadphasePair* pairs, std::size_t count)
{
    m_isaGjk.motions().abandon();
    for (std::size_t i = 0; i < count; ++i)
    {
        IsaGjkAlgorithm* const algorithm = isaGjkOf(pairs[i], *this);
        if (algorithm != nullptr && algorithm->isTracking())
            algorithm->track(bodyOf(pairs[i].m_pProxy0), bodyOf(pairs[i].m_pProxy1));
    }
}

/// The threshold that btCollisionDispatcher::getNewManifold() would use.
btScalar Dispatcher::breakingThresholdOf(const btCollisionObject& a, const btCollisionObject& b) const
{
    if ((m_dispatcherFlags & CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) == 0)
        return gContactBreakingThreshold;
    return btMin(a.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold),
                 b.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold));
}

/// Calls body(begin, end) for parts of [0, count) on all threads, in the floating-point mode of this one.
template <class Body>
void Dispatcher::parallelFor(std::size_t count, const Body& body)
{
    const auto tasks = static_cast<unsigned>(std::max<std::size_t>(1, count / kPairGrain));
    m_workers->run(tasks,
                   [&](unsigned task)
                   {
                       const TaskRange range(count, task, tasks);
                       body(range.begin, range.end);
                   });
}

void Dispatcher::findIdlePairs(btBroadphasePair* pairs, std::size_t count, bool isTracked)
{
    m_idle.clear();
    std::vector<std::uint32_t> untracked;
    if (isTracked ? !makeAndTrack(pairs, count) : !makeAlgorithms(pairs, count, untracked))
        return;
    try
    {
        const BodyMotions& motions = m_isaGjk.motions();
        const std::vector<std::uint32_t>& isaGjkPairs = isTracked ? motions.pairs().isaGjkPairs() : untracked;
        if (isaGjkPairs.empty())
            return;
        m_testsInTurn = isTracked && motions.areMostAsleep();
        m_hasMissedUpdate = m_hasMissedUpdate || m_testsInTurn;
        if (m_testsInTurn)
            return;
        const double tests =
            !isTracked || m_hasMissedUpdate ? double(isaGjkPairs.size()) : double(m_testedPairs);
        const double work = kCostOfTest * tests + kCostOfPair * double(isaGjkPairs.size()) +
                            (isTracked ? kCostOfBody * double(motions.size()) : 0.0);
        m_workers->runRegion(work,
                             [&]
                             {
                                 if (isTracked)
                                     updateMotions();
                                 findIdle(pairs, count, isaGjkPairs);
                             });
        m_hasMissedUpdate = m_hasMissedUpdate && !isTracked;
    }
    catch (const std::exception&)
    {
        // Without memory or threads every pair takes Bullet's path.
        m_idle.clear();
    }
}

/// m_hasMissedUpdate is true until both this update and the search for idle pairs have ended.
void Dispatcher::updateMotions()
{
    const bool missedUpdates = std::exchange(m_hasMissedUpdate, true);
    BodyMotions& motions = m_isaGjk.motions();
    parallelFor(motions.size(), [&](std::size_t begin, std::size_t end)
                { motions.update(begin, end, m_isaGjk.pass(), missedUpdates); });
}

/// @param isaGjkPairs indices of the pairs of ISA-GJK in the array
void Dispatcher::findIdle(const btBroadphasePair* pairs, std::size_t count,
                          const std::vector<std::uint32_t>& isaGjkPairs)
{
    m_idle.resize(count);
    std::atomic<std::uint64_t> idle{0}, still{0}, tested{0};
    parallelFor(isaGjkPairs.size(),
                [&](std::size_t begin, std::size_t end)
                {
                    const IdleCounts found =
                        findIdle(pairs, isaGjkPairs.data() + begin, isaGjkPairs.data() + end);
                    idle += found.idle;
                    still += found.still;
                    tested += found.tested;
                });
    m_idlePairs = idle;
    m_stillPairs = still;
    m_testedPairs = tested;
    m_isaGjk.counters().separated.add(m_idlePairs);
}

Dispatcher::IdleCounts Dispatcher::findIdle(const btBroadphasePair* pairs, const std::uint32_t* isaGjkPairs,
                                            const std::uint32_t* end)
{
    BodyMotions& motions = m_isaGjk.motions();
    IdleCounts found;
    std::array<std::uint32_t, kPairGrain> left;
    while (isaGjkPairs < end)
    {
        const std::uint32_t* const last =
            isaGjkPairs + std::min<std::ptrdiff_t>(kPairGrain, end - isaGjkPairs);
        std::size_t count = 0;
        for (; isaGjkPairs < last; ++isaGjkPairs)
        {
            if (isaGjkPairs + kPairsAhead < end)
                prefetchBytes(pairs[isaGjkPairs[kPairsAhead]].m_algorithm, 0, IsaGjkAlgorithm::kFirstBytes);
            auto* const algorithm = static_cast<IsaGjkAlgorithm*>(pairs[*isaGjkPairs].m_algorithm);
            const IsaGjkAlgorithm::Stillness stillness = algorithm->stillness(motions);
            if (stillness != IsaGjkAlgorithm::Stillness::Unknown)
                m_idle[*isaGjkPairs] = algorithm;
            else
                left[count++] = *isaGjkPairs;
            // A pair that is asleep is left out for that reason, and counts as idle for none.
            found.still += stillness == IsaGjkAlgorithm::Stillness::Idle ? 1 : 0;
        }
        found.tested += count;
        for (std::size_t k = 0; k < count; ++k)
        {
            if (k + kPairsAhead < count)
                prefetch(pairs[left[k + kPairsAhead]], pairs[left[k + kPairsAhead / 2]]);
            if (!isIdle(pairs[left[k]]))
                continue;
            m_idle[left[k]] = pairs[left[k]].m_algorithm;
            ++found.idle;
        }
    }
    found.idle += found.still;
    return found;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
