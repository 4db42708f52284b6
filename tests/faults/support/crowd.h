// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/faults/support/sweep.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace cullet::test
{
/// A filter of an application: refuses pairs of two cubes of group 2, and may throw.
class FaultyFilter final : public btOverlapFilterCallback
{
public:
    static constexpr int kRefused = 2;

    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        failInCallback();
        return passes(*a, *b);
    }
    static bool passes(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        return a.m_collisionFilterGroup != kRefused || b.m_collisionFilterGroup != kRefused;
    }
};

/// Bullet's ghost callback, which may throw before and after it adds a pair, and after it has removed one.
class FaultyGhosts final : public btGhostPairCallback
{
public:
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        failInCallback();
        btBroadphasePair* const added = btGhostPairCallback::addOverlappingPair(a, b);
        failInCallback();
        return added;
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher* dispatcher) override
    {
        void* const info = btGhostPairCallback::removeOverlappingPair(a, b, dispatcher);
        failInCallback();
        return info;
    }
};

/// What cubes of a Crowd are, and what the application has installed.
struct CrowdOptions
{
    std::size_t cubes = 40;
    bool hasFilter = false;
    bool hasGhosts = false;  ///< every third cube is a ghost
    /// Every sixth cube is a ghost with pairs of its own, in a cache of Bullet's that a failed allocation breaks.
    bool hasPairCachingGhosts = false;
    int idsBefore = 0;  ///< used up by former proxies: lists by id grow in pages of 1,024
    BroadphaseOptions broadphase;
};

inline CrowdOptions crowdOf(std::size_t cubes, std::uint32_t flatLimit = 512)
{
    CrowdOptions options;
    options.cubes = cubes;
    options.broadphase.backend = BackendChoice::Grid;
    options.broadphase.threads = 1;
    options.broadphase.margin = 0;
    options.broadphase.grid.flatLimit = static_cast<int>(flatLimit);
    return options;
}

/// Cubes in a broad phase; every update that succeeds is compared with brute force.
class Crowd
{
public:
    /// Makes the broad phase: a second time where a fault has prevented it.
    Crowd(FaultRun& run, const CrowdOptions& options, btOverlappingPairCache* cache = nullptr)
        : m_run(run), m_options(options), m_cubes(options.cubes)
    {
        m_run.insist([&] { m_broadphase = std::make_unique<Broadphase>(cache, options.broadphase); });
        btOverlappingPairCache& pairs = *m_broadphase->getOverlappingPairCache();
        useUpIds();
        if (options.hasFilter)
            pairs.setOverlapFilterCallback(&m_filter);
        if (options.hasGhosts)
            pairs.setInternalGhostPairCallback(&m_ghosts);
    }
    ~Crowd()
    {
        for (std::size_t i = 0; i < m_cubes.size(); ++i)
            destroy(i);
        EXPECT_TRUE(hasFaultHappened() || m_mostPairs > size() / 4) << "too few pairs to be a test";
        m_run.certain([&] { m_broadphase.reset(); });
    }
    Crowd(const Crowd&) = delete;
    Crowd& operator=(const Crowd&) = delete;

    Broadphase& broadphase() { return *m_broadphase; }
    std::size_t size() const { return m_cubes.size(); }
    btBroadphaseProxy* proxy(std::size_t i) { return m_cubes[i].proxy; }

    /// Where a fault prevents that, the cube stays away.
    void create(std::size_t i, const btVector3& centre)
    {
        Cube& cube = m_cubes[i];
        if (cube.proxy != nullptr)
            return;
        if (m_options.hasGhosts)
            makeClient(i);
        m_run.attempt(
            [&]
            {
                cube.proxy = addCube(*m_broadphase, centre, 0.5, i % 4 == 0 ? FaultyFilter::kRefused : 1,
                                     kAllGroups, cube.client.get());
            });
        if (cube.proxy == nullptr)
            cube.client.reset();
    }

    /// The box is stored even where the search for pairs of a ghost fails.
    void move(std::size_t i, const btVector3& centre)
    {
        if (m_cubes[i].proxy == nullptr)
            return;
        m_run.attempt([&] { moveCube(*m_broadphase, m_cubes[i].proxy, centre); });
        EXPECT_EQ(m_cubes[i].proxy->m_aabbMin, centre - vec(0.5, 0.5, 0.5));
    }

    void destroy(std::size_t i)
    {
        Cube& cube = m_cubes[i];
        if (cube.proxy == nullptr)
            return;
        const auto destroyIt = [&] { m_broadphase->destroyProxy(cube.proxy, nullptr); };
        // Throws only what a callback throws, and can then be called again.
        if (m_options.hasGhosts)
            m_run.insist(destroyIt);
        else
            m_run.certain(destroyIt);
        cube.proxy = nullptr;
        cube.client.reset();
    }

    void update()
    {
        if (m_run.update([&] { m_broadphase->calculateOverlappingPairs(nullptr); }))
            expectPairs();
    }

    /// Boxes as they are, with a margin up to which pairs may stay.
    void expectPairs()
    {
        const FaultPause pause;
        const Pairs pairs = pairsOf(*m_broadphase);
        m_mostPairs = std::max(m_mostPairs, pairs.size());
        std::size_t expected = 0;
        for (std::size_t j = 0; j < size(); ++j)
            for (std::size_t i = 0; i < j; ++i)
                expected += expectPair(pairs, i, j) ? 1 : 0;
        EXPECT_EQ(pairs.size(), expected) << "pairs of cubes that do not exist";
        for (std::size_t i = 0; m_options.hasGhosts && i < size(); i += 3)
            expectObjectsOf(i);
    }

    /// Largest gap, on each axis, at which a pair may stay.
    double keptGap = 0;

private:
    struct Cube
    {
        btBroadphaseProxy* proxy = nullptr;
        std::unique_ptr<btCollisionObject> client;
    };

    void useUpIds()
    {
        for (int i = 0; i < m_options.idsBefore; ++i)
        {
            m_broadphase->destroyProxy(addCube(*m_broadphase, vec(0, 0, 0)), nullptr);
            m_broadphase->calculateOverlappingPairs(nullptr);
        }
    }

    void makeClient(std::size_t i)
    {
        if (i % 6 == 0 && m_options.hasPairCachingGhosts)
            m_cubes[i].client = std::make_unique<btPairCachingGhostObject>();
        else if (i % 3 == 0)
            m_cubes[i].client = std::make_unique<btGhostObject>();
        else
            m_cubes[i].client = std::make_unique<btCollisionObject>();
    }

    /// @return whether the cache has the pair
    bool expectPair(const Pairs& pairs, std::size_t i, std::size_t j)
    {
        const btBroadphaseProxy *a = m_cubes[i].proxy, *b = m_cubes[j].proxy;
        if (a == nullptr || b == nullptr)
            return false;
        const bool isThere = std::binary_search(pairs.begin(), pairs.end(), makePair(idOf(a), idOf(b)));
        const bool isAllowed = !m_options.hasFilter || FaultyFilter::passes(*a, *b);
        if (!isAllowed || gapOf(*a, *b) > keptGap)
        {
            EXPECT_FALSE(isThere) << i << " and " << j;
        }
        else if (gapOf(*a, *b) <= 0)
        {
            EXPECT_TRUE(isThere) << i << " and " << j;
        }
        return isThere;
    }

    static double gapOf(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        double gap = -1e9;
        for (int axis = 0; axis < 3; ++axis)
            gap = std::max({gap, double(a.m_aabbMin[axis]) - double(b.m_aabbMax[axis]),
                            double(b.m_aabbMin[axis]) - double(a.m_aabbMax[axis])});
        return gap;
    }

    void expectObjectsOf(std::size_t ghost)
    {
        if (m_cubes[ghost].proxy == nullptr)
            return;
        int expected = 0;
        for (const btBroadphasePair* pair = pairsBegin(); pair != pairsEnd(); ++pair)
            expected +=
                pair->m_pProxy0 == m_cubes[ghost].proxy || pair->m_pProxy1 == m_cubes[ghost].proxy ? 1 : 0;
        EXPECT_EQ(btGhostObject::upcast(m_cubes[ghost].client.get())->getNumOverlappingObjects(), expected)
            << "ghost " << ghost;
    }
    const btBroadphasePair* pairsBegin()
    {
        return m_broadphase->getOverlappingPairCache()->getOverlappingPairArrayPtr();
    }
    const btBroadphasePair* pairsEnd()
    {
        return pairsBegin() + m_broadphase->getOverlappingPairCache()->getNumOverlappingPairs();
    }

    FaultRun& m_run;
    const CrowdOptions m_options;
    FaultyFilter m_filter;
    FaultyGhosts m_ghosts;
    std::vector<Cube> m_cubes;
    std::unique_ptr<Broadphase> m_broadphase;
    std::size_t m_mostPairs = 0;
};

/// A place of a cube: in a row whose neighbours overlap.
inline btVector3 inRow(std::size_t i, double step = 0.7)
{
    return vec(step * double(i), 0.25 * double(i % 3), 0);
}
}  // namespace cullet::test
