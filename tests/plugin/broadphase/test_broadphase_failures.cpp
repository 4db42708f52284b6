// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The pairs after a failed allocation, for each allocation of a small scene.
#include "cullet/broad/log.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/support/process/failing_new.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <ostream>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::size_t kCubes = 36;
constexpr int kRefused = 2;  // group of cubes whose pairs the filter refuses

struct FailureCase
{
    const char* name;
    bool hasFilter;
    bool hasGhostLog;  ///< a ghost callback of the application
    bool hasGhosts;    ///< every third client object is one, with Bullet's callback
    bool hasOwnCache;  ///< the pair cache is the application's
    bool hasRows;      ///< the column grid, for large worlds
    bool isBrute;
};

void PrintTo(const FailureCase& scene, std::ostream* out)
{
    *out << scene.name;
}

class RefuseGroup final : public btOverlapFilterCallback
{
public:
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        if (m_goodCalls-- == 0)
            throw std::bad_alloc();
        return a->m_collisionFilterGroup != kRefused || b->m_collisionFilterGroup != kRefused;
    }
    void failAfter(int goodCalls) { m_goodCalls = goodCalls; }
    bool hasFailed() const { return m_goodCalls < 0; }

private:
    mutable int m_goodCalls = std::numeric_limits<int>::max();
};

BroadphaseOptions optionsOf(const FailureCase& scene)
{
    BroadphaseOptions options;
    options.backend = scene.isBrute ? BackendChoice::Brute : BackendChoice::Grid;
    options.threads = 1;
    options.margin = 0;
    if (scene.hasRows)
        options.grid.flatLimit = 0;
    return options;
}

/// A scene with a deterministic life cycle, except for the failing allocation.
class FragileScene
{
public:
    explicit FragileScene(const FailureCase& scene)
        : m_scene(scene), m_broadphase(scene.hasOwnCache ? &m_ownCache : nullptr, optionsOf(scene))
    {
        m_log.added.reserve(10000);
        m_log.removed.reserve(10000);
        btOverlappingPairCache& cache = *m_broadphase.getOverlappingPairCache();
        if (scene.hasFilter)
            cache.setOverlapFilterCallback(&m_filter);
        if (scene.hasGhostLog)
            cache.setInternalGhostPairCallback(&m_log);
        if (scene.hasGhosts)
            cache.setInternalGhostPairCallback(&m_ghostCallback);
    }

    int thrown() const { return m_thrown; }

    /// @return whether the failing allocation was reached
    bool liveWithFailingNew(std::uint64_t goodAllocations)
    {
        const OneNewFails failure(goodAllocations);
        m_hasFailed = [&failure] { return failure.hasHappened(); };
        live();
        return failure.hasHappened();
    }

    /// @return whether the throwing call of the filter was reached
    bool liveWithThrowingFilter(int goodCalls)
    {
        m_filter.failAfter(goodCalls);
        m_hasFailed = [this] { return m_filter.hasFailed(); };
        live();
        return m_filter.hasFailed();
    }

    void expectNothingMissing()
    {
        EXPECT_EQ(updatedPairs(m_broadphase), bruteForce());
        EXPECT_EQ(boxHits(m_broadphase, vec(-100, -100, -100), vec(100, 100, 100)), liveIds());
        if (m_scene.hasGhostLog)
        {
            EXPECT_EQ(m_log.added.size() - m_log.removed.size(), bruteForce().size());
        }
        for (std::size_t i = 0; m_scene.hasGhosts && i < kCubes; i += 3)
        {
            EXPECT_EQ(m_ghosts[i].getNumOverlappingObjects(), m_proxies[i] != nullptr ? pairCountOf(i) : 0);
        }
        for (std::size_t i = 0; i < kCubes; ++i)
            destroy(i);
        EXPECT_TRUE(updatedPairs(m_broadphase).empty());
        EXPECT_EQ(m_broadphase.stats().provisionalPairs, 0u);
        EXPECT_EQ(m_broadphase.stats().pendingPairs, 0u);
    }

private:
    void live()
    {
        createAll();
        update();
        for (std::size_t i = 0; i < kCubes; i += 2)
            move(i, 3.0 * static_cast<double>(i % 5));
        update();
        allow();
        update();
        query();
        for (std::size_t i = 0; i < kCubes; i += 3)
            destroy(i);
        update();
        createAll();
        for (std::size_t i = 1; i < kCubes; i += 4)
            move(i, 0.25 * static_cast<double>(i));
        query();
        update();
    }

    template <class Operation>
    void attempt(const Operation& operation)
    {
        try
        {
            operation();
        }
        catch (const std::bad_alloc&)
        {
            ++m_thrown;
        }
    }

    void createAll()
    {
        for (std::size_t i = 0; i < kCubes; ++i)
        {
            const int group = i % 4 == 0 ? kRefused : 1;
            void* client = m_scene.hasGhosts ? clientOf(i) : nullptr;
            if (m_proxies[i] == nullptr)
                attempt(
                    [&]
                    {
                        m_proxies[i] = addCube(m_broadphase, vec(0.7 * static_cast<double>(i), 0, 0), 0.5,
                                               group, kAllGroups, client);
                    });
        }
    }

    void* clientOf(std::size_t i)
    {
        return i % 3 == 0 ? static_cast<btCollisionObject*>(&m_ghosts[i]) : &m_objects[i];
    }

    void move(std::size_t i, double x)
    {
        if (m_proxies[i] != nullptr)
            attempt([&] { moveCube(m_broadphase, m_proxies[i], vec(x, 0.25 * double(i % 3), 0)); });
    }

    void destroy(std::size_t i)
    {
        // Must run, and does not throw.
        if (m_proxies[i] != nullptr)
            m_broadphase.destroyProxy(m_proxies[i], nullptr);
        m_proxies[i] = nullptr;
    }

    /// Allows pairs of resting cubes that the filter had refused.
    void allow()
    {
        for (std::size_t i = 0; i < kCubes; i += 8)
        {
            btBroadphaseProxy* proxy = m_proxies[i];
            if (proxy == nullptr)
                continue;
            proxy->m_collisionFilterGroup = 1;
            attempt([&] { m_broadphase.setAabb(proxy, proxy->m_aabbMin, proxy->m_aabbMax, nullptr); });
        }
    }

    void query()
    {
        Counter hits;
        attempt([&] { m_broadphase.aabbTest(vec(-1, -1, -1), vec(5, 1, 1), hits); });
    }

    void update()
    {
        const bool hadFailed = m_hasFailed();
        attempt([&] { m_broadphase.calculateOverlappingPairs(nullptr); });
        // Allocations of the comparison must not fail.
        if (hadFailed)
        {
            EXPECT_EQ(pairsOf(m_broadphase), bruteForce()) << "in an update after the failure";
        }
    }

    struct Counter final : btBroadphaseAabbCallback
    {
        bool process(const btBroadphaseProxy*) override { return ++count != 0; }
        int count = 0;
    };

    bool isPair(std::size_t i, std::size_t j) const
    {
        const btBroadphaseProxy *a = m_proxies[i], *b = m_proxies[j];
        if (a == nullptr || b == nullptr)
            return false;
        if (m_scene.hasFilter && a->m_collisionFilterGroup == kRefused &&
            b->m_collisionFilterGroup == kRefused)
            return false;
        for (int axis = 0; axis < 3; ++axis)
        {
            if (a->m_aabbMin[axis] > b->m_aabbMax[axis] || b->m_aabbMin[axis] > a->m_aabbMax[axis])
                return false;
        }
        return true;
    }

    Pairs bruteForce() const
    {
        Pairs pairs;
        for (std::size_t j = 0; j < kCubes; ++j)
        {
            for (std::size_t i = 0; i < j; ++i)
            {
                if (isPair(i, j))
                    pairs.push_back(makePair(idOf(m_proxies[i]), idOf(m_proxies[j])));
            }
        }
        std::sort(pairs.begin(), pairs.end());
        return pairs;
    }

    int pairCountOf(std::size_t i) const
    {
        int count = 0;
        for (std::size_t j = 0; j < kCubes; ++j)
            count += j != i && isPair(i, j) ? 1 : 0;
        return count;
    }

    Ids liveIds() const
    {
        Ids ids;
        for (const btBroadphaseProxy* proxy : m_proxies)
        {
            if (proxy != nullptr)
                ids.push_back(idOf(proxy));
        }
        std::sort(ids.begin(), ids.end());
        return ids;
    }

    const FailureCase m_scene;
    RefuseGroup m_filter;
    GhostLog m_log;
    btGhostPairCallback m_ghostCallback;
    std::array<btGhostObject, kCubes> m_ghosts;
    std::array<btCollisionObject, kCubes> m_objects;
    std::array<btBroadphaseProxy*, kCubes> m_proxies{};
    PairCache m_ownCache;
    Broadphase m_broadphase;
    std::function<bool()> m_hasFailed;
    int m_thrown = 0;
};

class BroadphaseFailures : public testing::TestWithParam<FailureCase>
{
protected:
    BroadphaseFailures()
    {
        setLogFunction([](LogLevel, const char*) {});
    }
    ~BroadphaseFailures() override { setLogFunction(nullptr); }
};

TEST_P(BroadphaseFailures, HasThePairsOfBruteForceInTheNextUpdateWhenAnyAllocationFails)
{
    std::uint64_t failures = 0;
    int thrown = 0;
    bool hasFailed = true;
    for (; hasFailed && !HasFailure(); ++failures)
    {
        const auto scene = std::make_unique<FragileScene>(GetParam());
        hasFailed = scene->liveWithFailingNew(failures);
        SCOPED_TRACE(testing::Message() << "after " << failures << " good allocations");
        scene->expectNothingMissing();
        thrown += scene->thrown();
    }
    EXPECT_GT(failures, 60u);
    EXPECT_GT(thrown, 40) << "most of them reach the caller";
    EXPECT_LT(thrown, static_cast<int>(failures)) << "some of them do not";
}

TEST_P(BroadphaseFailures, HasThePairsOfBruteForceInTheNextUpdateWhenAnyCallOfTheFilterThrows)
{
    int failures = 0;
    bool hasFailed = true;
    for (; hasFailed && !HasFailure(); ++failures)
    {
        const auto scene = std::make_unique<FragileScene>(GetParam());
        hasFailed = scene->liveWithThrowingFilter(failures);
        SCOPED_TRACE(testing::Message() << "after " << failures << " good calls");
        scene->expectNothingMissing();
        EXPECT_EQ(scene->thrown(), hasFailed ? 1 : 0);
    }
    EXPECT_EQ(failures > 1, GetParam().hasFilter);
    EXPECT_TRUE(failures == 1 || failures > 100) << failures;
}

constexpr FailureCase kCases[] = {
    {"Plain", false, false, false, false, false, false},
    {"Filter", true, false, false, false, false, false},
    {"FilterAndRows", true, false, false, false, true, false},
    {"GhostCallback", false, true, false, false, false, true},
    {"FilterAndGhostCallback", true, true, false, true, false, true},
    {"Ghosts", false, false, true, false, false, false},
    {"FilterAndGhosts", true, false, true, true, false, true},
};
INSTANTIATE_TEST_SUITE_P(Scenes, BroadphaseFailures, testing::ValuesIn(kCases),
                         [](const testing::TestParamInfo<FailureCase>& scene) { return scene.param.name; });
}  // namespace
}  // namespace cullet::test
