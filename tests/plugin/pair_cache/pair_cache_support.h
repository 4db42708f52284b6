// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/pair_cache/pair_cache.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>

#include <deque>
#include <functional>
#include <new>
#include <utility>
#include <vector>

namespace cullet::test
{
using RowPair = std::pair<int, int>;

inline RowPair idsOf(const btBroadphasePair& pair)
{
    return {pair.m_pProxy0->m_uniqueId, pair.m_pProxy1->m_uniqueId};
}

inline std::vector<RowPair> idsOf(const PairCache& cache)
{
    std::vector<RowPair> ids;
    const btBroadphasePair* pairs = cache.getOverlappingPairArrayPtr();
    for (int i = 0; i < cache.getNumOverlappingPairs(); ++i)
        ids.push_back(idsOf(pairs[i]));
    return ids;
}

/// Proxies at fixed addresses; with given ids, or 1, 2, 3...
class Proxies
{
public:
    explicit Proxies(int count = 0)
    {
        for (int id = 1; id <= count; ++id)
            add(id);
    }

    btBroadphaseProxy* add(int id)
    {
        m_proxies.emplace_back();
        btBroadphaseProxy* proxy = &m_proxies.back();
        proxy->m_uniqueId = id;
        proxy->m_collisionFilterGroup = btBroadphaseProxy::DefaultFilter;
        proxy->m_collisionFilterMask = btBroadphaseProxy::AllFilter;
        return proxy;
    }

    /// The proxy created with index `index`, from 0.
    btBroadphaseProxy* operator[](std::size_t index) { return &m_proxies[index]; }
    std::size_t size() const { return m_proxies.size(); }

private:
    std::deque<btBroadphaseProxy> m_proxies;
};

/// A dispatcher that only creates and frees algorithms without function.
class FakeDispatcher final : public btDispatcher
{
public:
    struct Algorithm final : btCollisionAlgorithm
    {
        explicit Algorithm(FakeDispatcher& dispatcher) : owner(dispatcher) {}
        ~Algorithm() override
        {
            ++owner.destroyedCount;
            if (onDestroy)
                onDestroy();
        }
        void processCollision(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                              const btDispatcherInfo&, btManifoldResult*) override
        {
        }
        btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                       btManifoldResult*) override
        {
            return 1;
        }
        void getAllContactManifolds(btManifoldArray&) override {}

        FakeDispatcher& owner;
        std::function<void()> onDestroy;
    };

    Algorithm* makeAlgorithm()
    {
        ++madeCount;
        return new (allocateCollisionAlgorithm(sizeof(Algorithm))) Algorithm(*this);
    }

    void* allocateCollisionAlgorithm(int size) override
    {
        return ::operator new(static_cast<std::size_t>(size));
    }
    void freeCollisionAlgorithm(void* memory) override
    {
        ++freedCount;
        ::operator delete(memory);
    }

    btCollisionAlgorithm* findAlgorithm(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                                        btPersistentManifold*, ebtDispatcherQueryType) override
    {
        return nullptr;
    }
    btPersistentManifold* getNewManifold(const btCollisionObject*, const btCollisionObject*) override
    {
        return nullptr;
    }
    void releaseManifold(btPersistentManifold*) override {}
    void clearManifold(btPersistentManifold*) override {}
    bool needsCollision(const btCollisionObject*, const btCollisionObject*) override { return true; }
    bool needsResponse(const btCollisionObject*, const btCollisionObject*) override { return true; }
    void dispatchAllCollisionPairs(btOverlappingPairCache*, const btDispatcherInfo&, btDispatcher*) override
    {
    }
    int getNumManifolds() const override { return 0; }
    btPersistentManifold* getManifoldByIndexInternal(int) override { return nullptr; }
    btPersistentManifold** getInternalManifoldPointer() override { return nullptr; }
    btPoolAllocator* getInternalManifoldPool() override { return nullptr; }
    const btPoolAllocator* getInternalManifoldPool() const override { return nullptr; }

    int madeCount = 0;
    int destroyedCount = 0;
    int freedCount = 0;
};

/// Calls a function for each pair.
class Visit final : public btOverlapCallback
{
public:
    explicit Visit(std::function<bool(btBroadphasePair&)> function) : m_function(std::move(function)) {}
    bool processOverlap(btBroadphasePair& pair) override
    {
        visited.push_back(idsOf(pair));
        return m_function(pair);
    }

    std::vector<RowPair> visited;

private:
    std::function<bool(btBroadphasePair&)> m_function;
};

/// Records the calls of a ghost callback.
class GhostLog final : public btOverlappingPairCallback
{
public:
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) override
    {
        added.push_back({proxy0->m_uniqueId, proxy1->m_uniqueId});
        if (onAdd)
            onAdd(proxy0, proxy1);
        return nullptr;
    }
    void* removeOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                btDispatcher* dispatcher) override
    {
        removed.push_back({proxy0->m_uniqueId, proxy1->m_uniqueId});
        lastDispatcher = dispatcher;
        if (onRemove)
            onRemove(proxy0, proxy1);
        return nullptr;
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override
    {
        ++forbiddenCalls;
    }

    std::vector<RowPair> added;
    std::vector<RowPair> removed;
    btDispatcher* lastDispatcher = nullptr;
    int forbiddenCalls = 0;
    std::function<void(btBroadphaseProxy*, btBroadphaseProxy*)> onAdd;
    std::function<void(btBroadphaseProxy*, btBroadphaseProxy*)> onRemove;
};

inline bool keep(btBroadphasePair&)
{
    return false;
}

/// Every pair of the first `count` proxies.
inline void addAllPairs(PairCache& cache, Proxies& proxies, std::size_t count)
{
    for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = a + 1; b < count; ++b)
            cache.addOverlappingPair(proxies[a], proxies[b]);
}

inline btDispatcherInfo deterministic()
{
    btDispatcherInfo info;
    info.m_deterministicOverlappingPairs = true;
    return info;
}
}  // namespace cullet::test
