// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// One broad phase for several worlds in turn: remains of an earlier world must have no effect.
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
// All coordinates are multiples of this, so that no sum is rounded.
constexpr double kUnit = 1.0 / 16;
constexpr btScalar kMargin = btScalar(2 * kUnit);

/// Refuses a third of all pairs, by their ids.
struct ThirdRefused final : btOverlapFilterCallback
{
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        return (a->m_uniqueId + b->m_uniqueId) % 3 != 0;
    }
};

class Lives
{
public:
    Lives(std::uint32_t seed, const BroadphaseOptions& options) : m_random(seed), m_broadphase(options) {}

    void run(int lifeCount)
    {
        for (int life = 0; life < lifeCount && !testing::Test::HasFailure(); ++life)
        {
            SCOPED_TRACE("life " + std::to_string(life));
            live();
        }
    }

    struct Sample
    {
        std::size_t pairs = 0, entered = 0, left = 0, refused = 0, ghostPairs = 0;
        int resets = 0, largest = 0, smallest = 1000;
    };
    const Sample& sample() const { return m_sample; }

private:
    btOverlappingPairCache& cache() { return *m_broadphase.getOverlappingPairCache(); }

    void live()
    {
        if (m_random.chance(0.7f))
            destroyDownTo(0);
        if (m_random.chance(0.8f))
            resetPool();
        chooseCallbacks();
        destroyDownTo(m_random.below(20));
        const std::size_t count = m_random.chance(0.3f) ? 3 + m_random.below(8) : 20 + m_random.below(100);
        while (m_bodies.size() < count)
        {
            create();
            if (m_random.chance(0.05f))
                update();
        }
        m_sample.largest = std::max(m_sample.largest, int(count));
        m_sample.smallest = std::min(m_sample.smallest, int(count));
        const std::uint32_t frames = 2 + m_random.below(25);
        const float activity = m_random.chance(0.5f) ? 0.03f : 0.6f;
        for (std::uint32_t frame = 0; frame < frames && !testing::Test::HasFailure(); ++frame)
        {
            for (std::size_t i = 0; i < m_bodies.size(); ++i)
            {
                if (m_random.chance(activity))
                    move(i);
            }
            if (m_random.chance(0.2f))
                destroy(m_random.below(std::uint32_t(m_bodies.size())));
            if (m_random.chance(0.2f) || m_bodies.empty())
                create();
            update();
        }
    }

    void chooseCallbacks()
    {
        cache().setOverlapFilterCallback(m_random.chance(0.5f) ? &m_filter : nullptr);
        // Bullet's caches need a callback while they have pairs of ghosts.
        if (m_bodies.empty())
        {
            m_hasGhosts = m_random.chance(0.5f);
            cache().setInternalGhostPairCallback(m_hasGhosts ? &m_ghostCallback : nullptr);
        }
        update();
    }

    double coordinate(std::uint32_t units) { return kUnit * double(m_random.below(units)); }
    /// From z to x, as Random::point().
    btVector3 drawVec(std::uint32_t unitsX, std::uint32_t unitsY, std::uint32_t unitsZ)
    {
        const double z = coordinate(unitsZ), y = coordinate(unitsY), x = coordinate(unitsX);
        return vec(x, y, z);
    }
    btVector3 place() { return drawVec(160, 160, 32); }
    btVector3 size() { return drawVec(32, 32, 32); }

    void create()
    {
        Body body;
        if (m_random.chance(0.2f))
            body.object = std::make_unique<btGhostObject>();
        else
            body.object = std::make_unique<btCollisionObject>();
        const btVector3 min = place();
        const int mask = m_random.chance(0.3f) ? 1 : 3, group = 1 + int(m_random.below(2));
        body.proxy = m_broadphase.createProxy(min, min + size(), 0, body.object.get(), group, mask, nullptr);
        m_bodies.push_back(std::move(body));
        enterAtOnce(m_bodies.size() - 1);
    }

    void move(std::size_t i)
    {
        btBroadphaseProxy& proxy = *m_bodies[i].proxy;
        btVector3 min = place(), max = min + size();
        if (m_random.chance(0.8f))
        {
            const double y = coordinate(5) - 2 * kUnit, x = coordinate(5) - 2 * kUnit;
            const btVector3 way = vec(x, y, 0);
            min = proxy.m_aabbMin + way;
            max = proxy.m_aabbMax + way;
        }
        m_broadphase.setAabb(&proxy, min, max, nullptr);
        enterAtOnce(i);
    }

    void destroy(std::size_t i)
    {
        const std::uint32_t id = idOf(m_bodies[i].proxy);
        for (auto pair = m_pairs.begin(); pair != m_pairs.end();)
            pair = pair->first == id || pair->second == id ? m_pairs.erase(pair) : std::next(pair);
        m_broadphase.destroyProxy(m_bodies[i].proxy, nullptr);
        m_bodies.erase(m_bodies.begin() + std::ptrdiff_t(i));
    }

    void destroyDownTo(std::size_t count)
    {
        while (m_bodies.size() > count)
            destroy(m_random.below(std::uint32_t(m_bodies.size())));
    }

    void resetPool()
    {
        m_broadphase.resetPool(nullptr);
        if (!m_bodies.empty())
            return;
        ++m_sample.resets;
        const BroadphaseStats stats = m_broadphase.stats();
        EXPECT_EQ(stats.bodies + stats.ghosts + stats.pairs + stats.pendingPairs + stats.provisionalPairs,
                  0u);
    }

    bool isGhost(std::size_t i) const
    {
        return m_hasGhosts && btGhostObject::upcast(m_bodies[i].object.get()) != nullptr;
    }

    bool mayEnter(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        const auto first = const_cast<btBroadphaseProxy*>(&a), second = const_cast<btBroadphaseProxy*>(&b);
        return cache().needsBroadphaseCollision(first, second);
    }

    void enterAtOnce(std::size_t i)
    {
        for (std::size_t j = 0; m_hasGhosts && j < m_bodies.size(); ++j)
        {
            const btBroadphaseProxy &a = *m_bodies[i].proxy, &b = *m_bodies[j].proxy;
            if (i != j && (isGhost(i) || isGhost(j)) && overlapNow(a, b) && mayEnter(a, b))
                m_sample.ghostPairs += m_pairs.insert(makePair(idOf(&a), idOf(&b))).second ? 1 : 0;
        }
    }

    /// Updates the expected pairs by brute force from the previously held ones.
    void followUpdate()
    {
        for (std::size_t j = 0; j < m_bodies.size(); ++j)
        {
            for (std::size_t i = 0; i < j; ++i)
            {
                const btBroadphaseProxy &a = *m_bodies[i].proxy, &b = *m_bodies[j].proxy;
                const Pair pair = makePair(idOf(&a), idOf(&b));
                if (!overlapNow(a, b, 2 * kMargin))
                    m_sample.left += m_pairs.erase(pair);
                else if (overlapNow(a, b) && mayEnter(a, b))
                    m_sample.entered += m_pairs.insert(pair).second ? 1 : 0;
                else if (overlapNow(a, b))
                    ++m_sample.refused;
            }
        }
        m_sample.pairs += m_pairs.size();
    }

    void update()
    {
        m_broadphase.calculateOverlappingPairs(nullptr);
        followUpdate();
        const Pairs expected(m_pairs.begin(), m_pairs.end());
        EXPECT_EQ(pairsOf(m_broadphase), expected);
        EXPECT_EQ(boxHits(m_broadphase, vec(-9, -9, -9), vec(99, 99, 99)).size(), m_bodies.size());
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
        {
            if (!isGhost(i))
                continue;
            const std::uint32_t id = idOf(m_bodies[i].proxy);
            const auto hasId = [id](Pair pair) { return pair.first == id || pair.second == id; };
            EXPECT_EQ(btGhostObject::upcast(m_bodies[i].object.get())->getNumOverlappingObjects(),
                      std::count_if(m_pairs.begin(), m_pairs.end(), hasId));
        }
    }

    struct Body
    {
        std::unique_ptr<btCollisionObject> object;
        btBroadphaseProxy* proxy = nullptr;
    };

    Random m_random;
    ThirdRefused m_filter;
    btGhostPairCallback m_ghostCallback;
    bool m_hasGhosts = false;
    Broadphase m_broadphase;
    std::vector<Body> m_bodies;
    std::set<Pair> m_pairs;
    Sample m_sample;
};

BroadphaseOptions withMargin(BackendChoice backend, int threads, std::uint32_t flatLimit)
{
    BroadphaseOptions options;
    options.backend = backend;
    options.threads = threads;
    options.grid.flatLimit = flatLimit;
    options.margin = kMargin;
    return options;
}

TEST(BroadphaseLives, MatchBruteForceWhateverEarlierWorldsLeftBehind)
{
    const BroadphaseOptions all[] = {
        withMargin(BackendChoice::Brute, 1, 0), withMargin(BackendChoice::Grid, 1, GridOptions::kMeasured),
        withMargin(BackendChoice::Grid, 2, 40), withMargin(BackendChoice::Grid, 1, 0)};
    std::uint32_t seed = 1;
    for (const BroadphaseOptions& options : all)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Lives lives(seed++, options);
        lives.run(40);
        const Lives::Sample& sample = lives.sample();
        EXPECT_GT(sample.resets, 12);
        EXPECT_LT(sample.smallest, 8);
        EXPECT_GT(sample.largest, 100);
        EXPECT_GT(sample.entered, 1500u);
        EXPECT_GT(sample.left, 500u);
        EXPECT_GT(sample.refused, 1000u);
        EXPECT_GT(sample.ghostPairs, 200u);
    }
}
}  // namespace
}  // namespace cullet::test
