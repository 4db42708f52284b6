// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/tests/fuzz/worlds/pair_filter.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
/// A broad phase that passes every call on to another one and knows by brute force which pairs that must hold.
class WatchedBroadphase final : public btBroadphaseInterface
{
public:
    enum class Promise : std::uint8_t
    {
        Exact,      ///< cullet::Broadphase
        NoneMissed  ///< DBVT: pairs of boxes near each other come and go as its tree likes
    };

    /// @param margin    negative: Bullet's gDbvtMargin
    /// @param hasGhosts whether there is a ghost pair callback
    WatchedBroadphase(std::unique_ptr<btBroadphaseInterface> inner, Promise promise, btScalar margin,
                      bool hasGhosts);

    /// First thing that was wrong, or empty.
    const std::string& fault() const { return m_fault; }

    /// Compares the pair cache with the pairs that are known, outside of every call.
    void checkPairs();
    /// Compares a ray's and a box's hits with brute force.
    void checkQueries(const btVector3& from, const btVector3& to, const btVector3& halfExtents);

    btBroadphaseInterface& inner() { return *m_inner; }

    btBroadphaseProxy* createProxy(const btVector3& min, const btVector3& max, int shapeType, void* client,
                                   int group, int mask, btDispatcher* dispatcher) override;
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;
    void setAabb(btBroadphaseProxy* proxy, const btVector3& min, const btVector3& max,
                 btDispatcher* dispatcher) override;
    void getAabb(btBroadphaseProxy* proxy, btVector3& min, btVector3& max) const override
    {
        m_inner->getAabb(proxy, min, max);
    }
    void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& callback,
                 const btVector3& min, const btVector3& max) override
    {
        m_inner->rayTest(from, to, callback, min, max);
    }
    void aabbTest(const btVector3& min, const btVector3& max, btBroadphaseAabbCallback& callback) override
    {
        m_inner->aabbTest(min, max, callback);
    }
    void calculateOverlappingPairs(btDispatcher* dispatcher) override;
    btOverlappingPairCache* getOverlappingPairCache() override { return m_inner->getOverlappingPairCache(); }
    const btOverlappingPairCache* getOverlappingPairCache() const override
    {
        return m_inner->getOverlappingPairCache();
    }
    void getBroadphaseAabb(btVector3& min, btVector3& max) const override
    {
        m_inner->getBroadphaseAabb(min, max);
    }
    void resetPool(btDispatcher* dispatcher) override { m_inner->resetPool(dispatcher); }
    void printStats() override {}

private:
    struct Watched
    {
        btBroadphaseProxy* proxy = nullptr;
        btVector3 min, max;         ///< at the begin of the update
        std::pair<int, int> words;  ///< group and mask at the last box, or at an update without a filter
        bool isTouched = false;     ///< since the begin of the update
        int updatesToNotice = 0;    ///< so many of these may pass until the words are noticed
        bool areWordsKnown() const
        {
            return updatesToNotice == 0 &&
                   words == std::pair<int, int>(proxy->m_collisionFilterGroup, proxy->m_collisionFilterMask);
        }
    };
    using Proxies = std::map<std::uint32_t, Watched>;

    Pairs cachedPairs();
    void expectPairsOfGhosts(btBroadphaseProxy& proxy);
    const PairFilter* filter() const;
    bool passes(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const;
    void beginUpdate();
    void endUpdate(bool isInterrupted);
    void checkHeld(const Pairs& cached, bool isInterrupted);
    void checkMissed(const Pairs& cached, bool isInterrupted);
    bool mayHold(Pair pair, bool isInterrupted) const;
    bool mustHold(Pair pair, const Watched& a, const Watched& b, bool isInterrupted) const;
    bool isKnown(Pair pair) const;
    void noticeWords(Watched& watched) const;
    void noticeFarBox(const btVector3& min, const btVector3& max);
    btScalar tolerance(const Watched& a, const Watched& b) const;
    const Watched* find(std::uint32_t id) const;
    void fail(const std::string& what, Pair pair);

    std::unique_ptr<btBroadphaseInterface> m_inner;
    Promise m_promise;
    btScalar m_margin;
    bool m_hasGhosts;
    Proxies m_proxies;
    Pairs m_held;                                       ///< sorted
    const btOverlapFilterCallback* m_filter = nullptr;  ///< of the last update
    bool m_isUpdating = false;
    bool m_hasMovingOrigin = false;  ///< may have: the place that boxes are kept relative to
    int m_creations = 0;             ///< calls of createProxy() that run: their proxies are not known yet
    std::string m_fault;
};
}  // namespace cullet::test
