// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// One random sequence of operations on several broad phases: cullet's with different backends, which must agree
// completely, and Bullet's DBVT, which must agree in the pairs whose boxes overlap now.
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
/// A broad phase with its own client objects, in the same order in all worlds.
struct World
{
    explicit World(std::unique_ptr<btBroadphaseInterface> made,
                   std::unique_ptr<btOverlappingPairCache> external = nullptr)
        : cache(std::move(external)), broadphase(std::move(made))
    {
        broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&ghosts);
    }
    ~World()
    {
        for (btBroadphaseProxy* proxy : proxies)
            broadphase->destroyProxy(proxy, nullptr);
    }
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    void create(bool isGhost, const btVector3& min, const btVector3& max, int group, int mask)
    {
        if (isGhost)
        {
            clients.push_back(std::make_unique<btGhostObject>());
        }
        else
        {
            clients.push_back(std::make_unique<btCollisionObject>());
        }
        proxies.push_back(broadphase->createProxy(min, max, 0, clients.back().get(), group, mask, nullptr));
    }
    void destroy(std::size_t i)
    {
        broadphase->destroyProxy(proxies[i], nullptr);
        proxies.erase(proxies.begin() + std::ptrdiff_t(i));
        clients.erase(clients.begin() + std::ptrdiff_t(i));
    }
    /// Does the same as btCollisionWorld::refreshBroadphaseProxy(), with new filter words.
    void refresh(std::size_t i, int group, int mask)
    {
        const btVector3 min = proxies[i]->m_aabbMin;
        const btVector3 max = proxies[i]->m_aabbMax;
        broadphase->destroyProxy(proxies[i], nullptr);
        proxies[i] = broadphase->createProxy(min, max, 0, clients[i].get(), group, mask, nullptr);
    }

    btGhostPairCallback ghosts;
    std::vector<std::unique_ptr<btCollisionObject>> clients;
    std::vector<btBroadphaseProxy*> proxies;
    std::unique_ptr<btOverlappingPairCache> cache;
    std::unique_ptr<btBroadphaseInterface> broadphase;
};

struct Counts
{
    std::size_t pairs = 0;
    std::size_t ghostOverlaps = 0;
    std::size_t hits = 0;
    int destroyed = 0;
    int invalid = 0;
};

class Fuzz
{
public:
    Fuzz(std::uint32_t seed, bool withInvalidBoxes) : m_random(seed), m_withInvalidBoxes(withInvalidBoxes)
    {
        addOwn(BackendChoice::Brute, 0, nullptr);
        addOwn(BackendChoice::Grid, 1, nullptr);
        addOwn(BackendChoice::Grid, 2, nullptr, 0);
        addOwn(BackendChoice::Grid, 3, std::make_unique<btHashedOverlappingPairCache>());
        m_ownCount = m_worlds.size();
        // Boxes with a NaN corrupt the bounds of DBVT's tree.
        if (!withInvalidBoxes)
            m_worlds.push_back(std::make_unique<World>(std::make_unique<btDbvtBroadphase>()));
    }

    Counts run(int operationCount)
    {
        for (int i = 0; i < 60; ++i)
            create();
        for (int i = 0; i < operationCount && !testing::Test::HasFatalFailure(); ++i)
        {
            SCOPED_TRACE("operation " + std::to_string(i));
            operate();
            checkGhosts();
        }
        return m_counts;
    }

private:
    void addOwn(BackendChoice backend, int threads, std::unique_ptr<btOverlappingPairCache> cache,
                std::uint32_t flatLimit = GridOptions::kMeasured)
    {
        BroadphaseOptions options;
        options.backend = backend;
        options.threads = threads;
        options.grid.flatLimit = flatLimit;
        auto broadphase = std::make_unique<Broadphase>(cache.get(), options);
        m_worlds.push_back(std::make_unique<World>(std::move(broadphase), std::move(cache)));
    }

    World& first() { return *m_worlds[0]; }
    std::size_t anyone() { return m_random.below(std::uint32_t(first().proxies.size())); }
    btVector3 place()
    {
        // From z to x, as Random::point(); so below.
        const float z = m_random.between(0, 3), y = m_random.between(0, 5), x = m_random.between(0, 5);
        return vec(x, y, z);
    }
    btVector3 size()
    {
        const float z = m_random.chance(0.03f) ? 9.0f : m_random.unit();
        const float y = m_random.unit(), x = m_random.unit();
        return vec(x, y, z);
    }

    void create()
    {
        const bool isGhost = m_random.chance(0.15f);
        const btVector3 min = place();
        const btVector3 max = min + size();
        const int mask = m_random.chance(0.3f) ? 1 : 3;
        for (auto& world : m_worlds)
            world->create(isGhost, min, max, 1 + int(min.x()) % 2, mask);
    }

    void set(std::size_t i, const btVector3& min, const btVector3& max)
    {
        for (auto& world : m_worlds)
            world->broadphase->setAabb(world->proxies[i], min, max, nullptr);
    }

    void nudge()
    {
        const std::size_t i = anyone();
        const float reach = m_random.chance(0.5f) ? 0.04f : 0.4f;
        const float y = m_random.between(-reach, reach), x = m_random.between(-reach, reach);
        const btVector3 way = vec(x, y, 0);
        set(i, first().proxies[i]->m_aabbMin + way, first().proxies[i]->m_aabbMax + way);
    }

    void spoil()
    {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        const btVector3 min = vec(0, m_random.chance(0.5f) ? nan : 3, 0);
        set(anyone(), min, vec(1, 1, 1));
        ++m_counts.invalid;
    }

    void destroy()
    {
        const std::size_t i = anyone();
        for (auto& world : m_worlds)
            world->destroy(i);
        ++m_counts.destroyed;
    }

    void refresh()
    {
        const std::size_t i = anyone();
        const int mask = m_random.chance(0.5f) ? 1 : 3;
        for (auto& world : m_worlds)
            world->refresh(i, 1 + mask % 2, mask);
    }

    void operate()
    {
        const std::uint32_t dice = m_random.below(100);
        const std::size_t i = anyone();
        const btVector3 min = place();
        if (dice < 45)
            return nudge();
        if (dice < 55)
            return set(i, min, min + size());
        if (dice < 58)
            return set(i, first().proxies[i]->m_aabbMin, first().proxies[i]->m_aabbMax);
        if (dice < 62)
            return m_withInvalidBoxes ? spoil() : nudge();
        if (dice < 68)
            return first().proxies.size() > 40 ? destroy() : create();
        if (dice < 74)
            return create();
        if (dice < 78)
            return refresh();
        if (dice < 88)
            return query();
        update();
    }

    /// Pairs within a gap of each other that the masks allow.
    Pairs near(btScalar gap)
    {
        Pairs pairs;
        const auto& proxies = first().proxies;
        for (std::size_t i = 0; i < proxies.size(); ++i)
        {
            for (std::size_t j = i + 1; j < proxies.size(); ++j)
            {
                if (overlapNow(*proxies[i], *proxies[j], gap) && maskRule(*proxies[i], *proxies[j]))
                    pairs.push_back(makePair(idOf(proxies[i]), idOf(proxies[j])));
            }
        }
        std::sort(pairs.begin(), pairs.end());
        return pairs;
    }

    void update()
    {
        for (auto& world : m_worlds)
            world->broadphase->calculateOverlappingPairs(nullptr);
        const Pairs exact = near(0);
        const Pairs ours = pairsOf(*first().broadphase);
        ASSERT_TRUE(containsAll(ours, exact)) << "a pair is missed";
        ASSERT_TRUE(containsAll(near(btScalar(0.1001)), ours))
            << "a pair is kept too long, or was never allowed";
        const btBroadphasePairArray& order =
            first().broadphase->getOverlappingPairCache()->getOverlappingPairArray();
        const btBroadphasePairArray& other =
            m_worlds[1]->broadphase->getOverlappingPairCache()->getOverlappingPairArray();
        ASSERT_EQ(order.size(), other.size());
        for (int i = 0; i < order.size(); ++i)
        {
            ASSERT_EQ(order[i].m_pProxy0->m_uniqueId, other[i].m_pProxy0->m_uniqueId);
            ASSERT_EQ(order[i].m_pProxy1->m_uniqueId, other[i].m_pProxy1->m_uniqueId);
        }
        ASSERT_EQ(pairsOf(*m_worlds[2]->broadphase), ours);
        if (m_worlds.size() > m_ownCount)
        {
            ASSERT_TRUE(containsAll(pairsOf(*m_worlds.back()->broadphase), exact))
                << "the oracle and DBVT disagree";
        }
        m_counts.pairs += exact.size();
    }

    void query()
    {
        const btVector3 from = place();
        const btVector3 to = place();
        const Ids ray = rayHits(*first().broadphase, from, to);
        const Ids box = boxHits(*first().broadphase, from, from + vec(1, 1, 1));
        Ids expected;
        btBroadphaseProxy probe(from, from + vec(1, 1, 1), nullptr, 0, 0);
        for (const btBroadphaseProxy* proxy : first().proxies)
        {
            if (overlapNow(*proxy, probe))
                expected.push_back(idOf(proxy));
        }
        std::sort(expected.begin(), expected.end());
        ASSERT_EQ(box, expected);
        for (auto& world : m_worlds)
        {
            Ids theirs = rayHits(*world->broadphase, from, to);
            std::sort(theirs.begin(), theirs.end());
            // DBVT tests grown boxes.
            ASSERT_TRUE(std::includes(theirs.begin(), theirs.end(), ray.begin(), ray.end()));
        }
        m_counts.hits += ray.size() + box.size();
    }

    /// At any time a ghost has at least the allowed pairs whose boxes overlap.
    void checkGhosts()
    {
        for (auto& world : m_worlds)
        {
            for (std::size_t i = 0; i < world->proxies.size(); ++i)
            {
                const btGhostObject* ghost = btGhostObject::upcast(world->clients[i].get());
                if (ghost != nullptr)
                    checkGhost(*world, i, *ghost);
            }
        }
    }

    void checkGhost(const World& world, std::size_t ghostIndex, const btGhostObject& ghost)
    {
        const auto& objects = const_cast<btGhostObject&>(ghost).getOverlappingPairs();
        for (std::size_t i = 0; i < world.proxies.size(); ++i)
        {
            const btBroadphaseProxy& self = *world.proxies[ghostIndex];
            if (i == ghostIndex || !overlapNow(self, *world.proxies[i]) || !maskRule(self, *world.proxies[i]))
                continue;
            ++m_counts.ghostOverlaps;
            ASSERT_LT(objects.findLinearSearch(world.clients[i].get()), objects.size());
        }
    }

    Random m_random;
    bool m_withInvalidBoxes;
    std::vector<std::unique_ptr<World>> m_worlds;
    std::size_t m_ownCount = 0;
    Counts m_counts;
};

TEST(BroadphaseFuzz, FindsSameOverlapsWithAllBackendsAndDbvt)
{
    for (const std::uint32_t seed : {1u, 2u, 3u, 4u})
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Fuzz fuzz(seed, false);
        const Counts counts = fuzz.run(3000);
        ASSERT_FALSE(HasFailure());
        EXPECT_GT(counts.pairs, 3000u);
        EXPECT_GT(counts.ghostOverlaps, 3000u);
        EXPECT_GT(counts.hits, 300u);
        EXPECT_GT(counts.destroyed, 50);
    }
}

TEST(BroadphaseFuzz, FindsSameOverlapsWithAllBackendsAmongInvalidBoxes)
{
    for (const std::uint32_t seed : {5u, 6u})
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Fuzz fuzz(seed, true);
        const Counts counts = fuzz.run(3000);
        ASSERT_FALSE(HasFailure());
        EXPECT_GT(counts.pairs, 1000u);
        EXPECT_GT(counts.invalid, 50);
    }
}
}  // namespace
}  // namespace cullet::test
