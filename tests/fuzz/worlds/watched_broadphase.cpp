// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/watched_broadphase.h"

#include "cullet/tests/fuzz/pair_difference.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace cullet::test
{
namespace
{
std::uint32_t idOf(const btBroadphaseProxy& proxy)
{
    return static_cast<std::uint32_t>(proxy.m_uniqueId);
}

/// The largest distance of two boxes along an axis; infinite for boxes with min > max or a NaN.
btScalar gapOf(const btVector3& minA, const btVector3& maxA, const btVector3& minB, const btVector3& maxB)
{
    btScalar gap = -std::numeric_limits<btScalar>::infinity();
    for (int axis = 0; axis < 3; ++axis)
    {
        if (!(minA[axis] <= maxA[axis] && minB[axis] <= maxB[axis]))
            return std::numeric_limits<btScalar>::infinity();
        if (minA[axis] <= maxB[axis] && minB[axis] <= maxA[axis])
            continue;
        gap = std::max(gap, std::max(minA[axis] - maxB[axis], minB[axis] - maxA[axis]));
    }
    return gap;
}

/// By value, NaN equal to NaN.
bool hasBox(const btBroadphaseProxy& proxy, const btVector3& min, const btVector3& max)
{
    const auto isSame = [](btScalar a, btScalar b) { return a == b || (a != a && b != b); };
    for (int axis = 0; axis < 3; ++axis)
        if (!isSame(proxy.m_aabbMin[axis], min[axis]) || !isSame(proxy.m_aabbMax[axis], max[axis]))
            return false;
    return true;
}

bool overlap(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
{
    return gapOf(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax) ==
           -std::numeric_limits<btScalar>::infinity();
}

/// Boxes are kept by their roundings to float: what those may add to a gap, relative to the world's origin.
btScalar roundingOf(const btVector3& min, const btVector3& max)
{
    btScalar most = 0;
    for (int axis = 0; axis < 3; ++axis)
        most = std::max({most, std::abs(min[axis]), std::abs(max[axis])});
    return most * 4 * btScalar(std::numeric_limits<float>::epsilon());
}

bool isGhost(const btBroadphaseProxy& proxy)
{
    return static_cast<const btCollisionObject*>(proxy.m_clientObject)->getInternalType() ==
           btCollisionObject::CO_GHOST_OBJECT;
}

std::pair<int, int> wordsOf(const btBroadphaseProxy& proxy)
{
    return {proxy.m_collisionFilterGroup, proxy.m_collisionFilterMask};
}

/// Ids in the order of the reports.
struct Hits final : btBroadphaseRayCallback
{
    bool process(const btBroadphaseProxy* proxy) override
    {
        ids.push_back(idOf(*proxy));
        return false;
    }
    std::vector<std::uint32_t> ids;
};

/// Counts itself while it lives.
class Creation
{
public:
    explicit Creation(int& count) : m_count(count) { ++m_count; }
    ~Creation() { --m_count; }
    Creation(const Creation&) = delete;
    Creation& operator=(const Creation&) = delete;

private:
    int& m_count;
};

/// As btCollisionWorld prepares a ray.
void prepareRay(Hits& ray, const btVector3& from, const btVector3& to)
{
    const btVector3 direction = (to - from).normalized();
    for (int axis = 0; axis < 3; ++axis)
    {
        ray.m_rayDirectionInverse[axis] =
            direction[axis] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[axis];
        ray.m_signs[axis] = ray.m_rayDirectionInverse[axis] < 0 ? 1 : 0;
    }
    ray.m_lambda_max = direction.dot(to - from);
}
}  // namespace

WatchedBroadphase::WatchedBroadphase(std::unique_ptr<btBroadphaseInterface> inner, Promise promise,
                                     btScalar margin, bool hasGhosts)
    : m_inner(std::move(inner)),
      m_promise(promise),
      m_margin(margin < 0 ? gDbvtMargin : margin),
      m_hasGhosts(hasGhosts)
{
}

void WatchedBroadphase::fail(const std::string& what, Pair pair)
{
    if (m_fault.empty())
        m_fault = what + ", pair " + std::to_string(pair.first) + "-" + std::to_string(pair.second);
}

const WatchedBroadphase::Watched* WatchedBroadphase::find(std::uint32_t id) const
{
    const auto known = m_proxies.find(id);
    return known == m_proxies.end() ? nullptr : &known->second;
}

bool WatchedBroadphase::isKnown(Pair pair) const
{
    return std::binary_search(m_held.begin(), m_held.end(), pair);
}

const PairFilter* WatchedBroadphase::filter() const
{
    const auto* cache = static_cast<const btOverlappingPairCache*>(m_inner->getOverlappingPairCache());
    return static_cast<const PairFilter*>(
        const_cast<btOverlappingPairCache*>(cache)->getOverlapFilterCallback());
}

bool WatchedBroadphase::passes(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const
{
    if (const PairFilter* callback = filter())
        return callback->answers(a, b);
    return (a.m_collisionFilterGroup & b.m_collisionFilterMask) != 0 &&
           (b.m_collisionFilterGroup & a.m_collisionFilterMask) != 0;
}

Pairs WatchedBroadphase::cachedPairs()
{
    Pairs pairs;
    const btBroadphasePairArray& array = getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < array.size(); ++i)
    {
        const btBroadphaseProxy *a = array[i].m_pProxy0, *b = array[i].m_pProxy1;
        const Watched *first = find(idOf(*a)), *second = find(idOf(*b));
        const Pair pair{idOf(*a), idOf(*b)};
        // A proxy that is being created is not known yet.
        if (m_creations == 0 &&
            (first == nullptr || second == nullptr || first->proxy != a || second->proxy != b))
            fail("pair of a proxy that does not live", pair);
        if (pair.first >= pair.second)
            fail("pair with the higher id first", pair);
        pairs.push_back(pair);
    }
    std::sort(pairs.begin(), pairs.end());
    const auto twice = std::adjacent_find(pairs.begin(), pairs.end());
    if (twice != pairs.end())
        fail("pair that is there twice", *twice);
    return pairs;
}

btBroadphaseProxy* WatchedBroadphase::createProxy(const btVector3& min, const btVector3& max, int shapeType,
                                                  void* client, int group, int mask, btDispatcher* dispatcher)
{
    const Creation creation(m_creations);
    btBroadphaseProxy* proxy = m_inner->createProxy(min, max, shapeType, client, group, mask, dispatcher);
    if (!hasBox(*proxy, min, max))
        fail("createProxy() keeps another box", {idOf(*proxy), 0});
    noticeFarBox(min, max);
    m_proxies[idOf(*proxy)] = {proxy, min, max, wordsOf(*proxy), true};
    expectPairsOfGhosts(*proxy);
    return proxy;
}

void WatchedBroadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    const std::uint32_t id = idOf(*proxy);
    m_proxies.erase(id);
    const auto isOfProxy = [id](Pair pair) { return pair.first == id || pair.second == id; };
    m_held.erase(std::remove_if(m_held.begin(), m_held.end(), isOfProxy), m_held.end());
    m_inner->destroyProxy(proxy, dispatcher);
}

void WatchedBroadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& min, const btVector3& max,
                                btDispatcher* dispatcher)
{
    const std::uint32_t id = idOf(*proxy);
    const bool isChanged = !hasBox(*proxy, min, max);
    Watched& watched = m_proxies[id];
    watched.isTouched = true;
    watched.words = wordsOf(*proxy);
    watched.updatesToNotice = 0;
    noticeFarBox(min, max);
    m_inner->setAabb(proxy, min, max, dispatcher);
    // The filter may have destroyed it.
    if (isChanged && find(id) != nullptr)
        expectPairsOfGhosts(*proxy);
}

/// Pairs of ghosts are there at once. Other pairs enter in the update, with DBVT sooner.
void WatchedBroadphase::expectPairsOfGhosts(btBroadphaseProxy& proxy)
{
    btOverlappingPairCache& cache = *getOverlappingPairCache();
    // A refusal by an earlier filter, or by earlier words, stays until the update or the next box.
    if (!m_hasGhosts || cache.getOverlapFilterCallback() != m_filter)
        return;
    for (const auto& [id, other] : m_proxies)
    {
        btBroadphaseProxy& second = *other.proxy;
        if (&second == &proxy || !(isGhost(proxy) || isGhost(second)) || !other.areWordsKnown() ||
            !overlap(proxy, second) || !passes(proxy, second))
            continue;
        const Pair pair = makePair(idOf(proxy), id);
        if (cache.findPair(&proxy, &second) == nullptr)
            fail("pair of a ghost that is not there at once", pair);
        else if (!isKnown(pair))
            m_held.insert(std::lower_bound(m_held.begin(), m_held.end(), pair), pair);
    }
}

void WatchedBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher)
{
    // From within a filter: cullet leaves it to the update that runs.
    if (m_isUpdating)
        return m_inner->calculateOverlappingPairs(dispatcher);
    beginUpdate();
    try
    {
        m_inner->calculateOverlappingPairs(dispatcher);
    }
    catch (...)
    {
        endUpdate(true);
        throw;
    }
    endUpdate(false);
}

void WatchedBroadphase::beginUpdate()
{
    m_isUpdating = true;
    m_filter = getOverlappingPairCache()->getOverlapFilterCallback();
    for (auto& [id, watched] : m_proxies)
    {
        watched.min = watched.proxy->m_aabbMin;
        watched.max = watched.proxy->m_aabbMax;
        watched.isTouched = false;
        if (m_filter == nullptr)
            noticeWords(watched);
    }
}

/// Words that change without a new box are noticed in the next update; those of many proxies within four.
void WatchedBroadphase::noticeWords(Watched& watched) const
{
    constexpr std::uint32_t kFew = 200;  // ids given so far, the last ones maybe in vain
    constexpr int kMostUpdates = 4;
    const std::pair<int, int> words = wordsOf(*watched.proxy);
    if (words != watched.words)
    {
        watched.words = words;
        watched.updatesToNotice = m_proxies.rbegin()->first <= kFew ? 1 : kMostUpdates;
    }
    watched.updatesToNotice = std::max(watched.updatesToNotice - 1, 0);
}

/// In double precision a box whose rounding is large beside the margin lets the broad phase keep all boxes relative to
/// the place where most are.
void WatchedBroadphase::noticeFarBox(const btVector3& min, const btVector3& max)
{
    m_hasMovingOrigin =
        m_hasMovingOrigin || (sizeof(btScalar) != sizeof(float) && 2 * roundingOf(min, max) > m_margin);
}

/// What the roundings of two boxes may add to their gap. Relative to another origin these may be larger, but up to half the
/// margin: beyond that the exact boxes are compared.
btScalar WatchedBroadphase::tolerance(const Watched& a, const Watched& b) const
{
    const btScalar rounding = std::max(roundingOf(a.min, a.max), roundingOf(b.min, b.max));
    return m_hasMovingOrigin ? std::max(rounding, m_margin / 2) : rounding;
}

void WatchedBroadphase::endUpdate(bool isInterrupted)
{
    m_isUpdating = false;
    const Pairs cached = cachedPairs();
    if (m_promise == Promise::Exact)
        checkHeld(cached, isInterrupted);
    checkMissed(cached, isInterrupted);
    m_held = cached;
}

void WatchedBroadphase::checkHeld(const Pairs& cached, bool isInterrupted)
{
    for (const Pair pair : cached)
        if (!mayHold(pair, isInterrupted))
            fail("pair that should have left, or was never allowed", pair);
}

bool WatchedBroadphase::mayHold(Pair pair, bool isInterrupted) const
{
    if (find(pair.first) == nullptr || find(pair.second) == nullptr)
        return m_creations > 0;
    const Watched &a = *find(pair.first), &b = *find(pair.second);
    if (a.isTouched || b.isTouched || (isInterrupted && isKnown(pair)))
        return true;
    const btScalar gap = gapOf(a.min, a.max, b.min, b.max);
    // Pairs of ghosts have entered since the last update.
    const bool wasHeld = isKnown(pair) || isGhost(*a.proxy) || isGhost(*b.proxy);
    if (wasHeld)
        return gap <= 2 * m_margin + tolerance(a, b);
    return gap < 0 && (passes(*a.proxy, *b.proxy) || !a.areWordsKnown() || !b.areWordsKnown());
}

void WatchedBroadphase::checkMissed(const Pairs& cached, bool isInterrupted)
{
    for (auto first = m_proxies.begin(); first != m_proxies.end(); ++first)
    {
        for (auto second = std::next(first); second != m_proxies.end(); ++second)
        {
            const Pair pair{first->first, second->first};
            if (mustHold(pair, first->second, second->second, isInterrupted) &&
                !std::binary_search(cached.begin(), cached.end(), pair))
                fail("pair that is missed", pair);
        }
    }
}

bool WatchedBroadphase::mustHold(Pair pair, const Watched& a, const Watched& b, bool isInterrupted) const
{
    // Beside a filter, changed words are noticed with the next box.
    const bool areWordsKnown = a.areWordsKnown() && b.areWordsKnown();
    if (a.isTouched || b.isTouched)
        return false;
    const btScalar gap = gapOf(a.min, a.max, b.min, b.max);
    if (gap > 2 * m_margin)
        return false;
    if (isKnown(pair) && m_promise == Promise::Exact)
        return gap <= 2 * m_margin - std::max(roundingOf(a.min, a.max), roundingOf(b.min, b.max));
    // A pair comes when the filter's call for it has returned, and not in an update within that call.
    const bool isAsked = filter() != nullptr && filter()->isAsked(*a.proxy, *b.proxy);
    return gap < 0 && !isInterrupted && !isAsked && areWordsKnown && passes(*a.proxy, *b.proxy);
}

void WatchedBroadphase::checkPairs()
{
    if (m_promise != Promise::Exact)
        return;
    const Pairs cached = cachedPairs();
    for (const Pair pair : m_held)
        if (!std::binary_search(cached.begin(), cached.end(), pair))
            fail("pair that left before the update", pair);
    for (const Pair pair : cached)
    {
        const Watched *a = find(pair.first), *b = find(pair.second);
        if (a != nullptr && b != nullptr && !isKnown(pair) && !isGhost(*a->proxy) && !isGhost(*b->proxy))
            fail("pair that entered before the update", pair);
    }
}

void WatchedBroadphase::checkQueries(const btVector3& from, const btVector3& to, const btVector3& halfExtents)
{
    Hits ray, box;
    prepareRay(ray, from, to);
    std::vector<std::uint32_t> rayExpected, boxExpected;
    for (const auto& [id, watched] : m_proxies)
    {
        const btBroadphaseProxy& proxy = *watched.proxy;
        // No query finds an invalid box.
        if (gapOf(proxy.m_aabbMin, proxy.m_aabbMax, proxy.m_aabbMin, proxy.m_aabbMax) > 0)
            continue;
        const btVector3 bounds[2] = {proxy.m_aabbMin - halfExtents, proxy.m_aabbMax + halfExtents};
        btScalar entry = 0;
        if (btRayAabb2(from, ray.m_rayDirectionInverse, ray.m_signs, bounds, entry, btScalar(0),
                       ray.m_lambda_max))
            rayExpected.push_back(id);
        const btVector3 low = from - halfExtents, high = from + halfExtents;
        if (gapOf(proxy.m_aabbMin, proxy.m_aabbMax, low, high) < 0)
            boxExpected.push_back(id);
    }
    m_inner->rayTest(from, to, ray, -halfExtents, halfExtents);
    m_inner->aabbTest(from - halfExtents, from + halfExtents, box);
    if (m_promise != Promise::Exact)
        return;
    if (ray.ids != rayExpected)
        fail("ray finds " + std::to_string(ray.ids.size()) + " proxies of " +
                 std::to_string(rayExpected.size()),
             {});
    if (box.ids != boxExpected)
        fail("box finds " + std::to_string(box.ids.size()) + " proxies of " +
                 std::to_string(boxExpected.size()),
             {});
}
}  // namespace cullet::test
