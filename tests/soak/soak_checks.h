// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/tests/soak/soak_world.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

namespace cullet::test
{
inline btVector3 toVector(const std::array<float, 3>& point)
{
    return btVector3(btScalar(point[0]), btScalar(point[1]), btScalar(point[2]));
}

/// Brute force beside a broad phase: every pair of boxes, in each checked step.
class SoakPairs
{
public:
    explicit SoakPairs(double margin) : m_margin(margin) {}

    /// Pairs of this proxy enter when a box is set, so that the margin may keep one which entered since the last update.
    void setGhost(const btBroadphaseProxy* ghost) { m_ghost = ghost; }

    /// Throws SoakFault unless the cache holds what the boxes ask for.
    ///
    /// @param proxies   all live ones
    /// @param isNextOne whether the step before was checked too, so that what the margin keeps is known
    void check(int step, const std::vector<btBroadphaseProxy*>& proxies, btOverlappingPairCache& cache,
               bool isNextOne, SoakCounts& counts, bool losesPair)
    {
        std::unordered_set<std::uint64_t> held = readCache(step, cache);
        if (losesPair)
            loseOne(proxies, held);
        ++counts.checkedSteps;
        counts.pairs += held.size();
        counts.comparedBoxes += proxies.size() * (proxies.size() - 1) / 2;
        std::size_t found = 0;
        for (std::size_t i = 0; i < proxies.size(); ++i)
        {
            for (std::size_t k = i + 1; k < proxies.size(); ++k)
                found += checkPair(step, *proxies[i], *proxies[k], held, isNextOne);
        }
        if (found != held.size())
            throw SoakFault(step, std::to_string(held.size() - found) + " pairs of proxies that are gone");
        m_before = std::move(held);
    }

private:
    static std::uint64_t keyOf(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        const auto idA = static_cast<std::uint32_t>(a.m_uniqueId),
                   idB = static_cast<std::uint32_t>(b.m_uniqueId);
        const std::uint32_t low = std::min(idA, idB), high = std::max(idA, idB);
        return std::uint64_t{low} << 32 | high;
    }

    static std::unordered_set<std::uint64_t> readCache(int step, btOverlappingPairCache& cache)
    {
        std::unordered_set<std::uint64_t> held;
        const btBroadphasePairArray& array = cache.getOverlappingPairArray();
        for (int i = 0; i < array.size(); ++i)
        {
            if (array[i].m_pProxy0->m_uniqueId >= array[i].m_pProxy1->m_uniqueId)
                throw SoakFault(step, "a pair with the higher id first");
            if (!held.insert(keyOf(*array[i].m_pProxy0, *array[i].m_pProxy1)).second)
                throw SoakFault(step, "a pair twice in the cache");
        }
        return held;
    }

    static bool isValid(const btBroadphaseProxy& proxy)
    {
        for (int axis = 0; axis < 3; ++axis)
            if (!(proxy.m_aabbMin[axis] <= proxy.m_aabbMax[axis]))
                return false;
        return true;
    }

    /// The largest distance along an axis; not above 0 where they overlap.
    static double gap(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        double gap = -1e300;
        for (int axis = 0; axis < 3; ++axis)
            gap = std::max({gap, double(a.m_aabbMin[axis]) - double(b.m_aabbMax[axis]),
                            double(b.m_aabbMin[axis]) - double(a.m_aabbMax[axis])});
        return gap;
    }

    /// One whose boxes overlap: another may be missing, since only the margin keeps it.
    static void loseOne(const std::vector<btBroadphaseProxy*>& proxies,
                        std::unordered_set<std::uint64_t>& held)
    {
        for (std::size_t i = 0; i < proxies.size(); ++i)
            for (std::size_t k = i + 1; k < proxies.size(); ++k)
                if (gap(*proxies[i], *proxies[k]) <= 0 && held.erase(keyOf(*proxies[i], *proxies[k])) != 0)
                    return;
    }

    /// @return whether the pair is held
    bool checkPair(int step, const btBroadphaseProxy& a, const btBroadphaseProxy& b,
                   const std::unordered_set<std::uint64_t>& held, bool isNextOne) const
    {
        const bool isHeld = held.count(keyOf(a, b)) != 0;
        const bool mayEnter = (a.m_collisionFilterGroup & b.m_collisionFilterMask) != 0 &&
                              (b.m_collisionFilterGroup & a.m_collisionFilterMask) != 0;
        const bool areValid = isValid(a) && isValid(b);
        const double between = areValid ? gap(a, b) : 1e300;
        // What rounding may do to a box that is grown by the margin.
        const double doubt =
            1e-6 * std::max({1.0, std::fabs(double(a.m_aabbMax[0])), std::fabs(double(a.m_aabbMax[1])),
                             std::fabs(double(a.m_aabbMax[2]))});
        const bool mustBe = areValid && mayEnter && between <= 0;
        const bool mustNotBe =
            !areValid || !mayEnter || between > 2 * m_margin + doubt ||
            (between > 0 && isNextOne && &a != m_ghost && &b != m_ghost && m_before.count(keyOf(a, b)) == 0);
        if (isHeld ? !mustNotBe : !mustBe)
            return isHeld;
        throw SoakFault(step, std::string(isHeld ? "a pair too many: " : "a pair is missing: ") +
                                  std::to_string(a.m_uniqueId) + " and " + std::to_string(b.m_uniqueId) +
                                  ", gap " + std::to_string(between));
    }

    double m_margin;
    const btBroadphaseProxy* m_ghost = nullptr;
    std::unordered_set<std::uint64_t> m_before;
};

/// Totals that must never fall.
class SoakTotals
{
public:
    void check(int step, const BroadphaseStats& stats)
    {
        expect(step,
               {stats.invalidBoxesTotal, stats.updatesTotal, stats.restartsTotal, stats.fallbacksTotal,
                stats.queryTreeBuildsTotal, stats.queryTreeSyncsTotal},
               m_broadphase, "broad phase");
        if (stats.fallbacksTotal != 0)
            throw SoakFault(step, "a backend failed");
    }
    /// @param isOther whether another backend has come
    void check(int step, const BackendStats& stats, bool isOther)
    {
        if (isOther)
            m_backend.clear();
        expect(step, {stats.rebuildsTotal, stats.retriesTotal}, m_backend, "backend");
    }
    void check(int step, const IsaGjkStats& stats)
    {
        expect(step,
               {stats.separatedTotal, stats.touchingTotal, stats.depthsTotal, stats.notConvergedTotal,
                stats.delegatedTotal, stats.exactTotal},
               m_narrow, "narrow phase");
    }

private:
    static void expect(int step, std::vector<std::uint64_t> now, std::vector<std::uint64_t>& before,
                       const char* whose)
    {
        for (std::size_t i = 0; i < before.size(); ++i)
            if (now[i] < before[i])
                throw SoakFault(step, std::string("total ") + std::to_string(i) + " of the " + whose +
                                          " fell from " + std::to_string(before[i]) + " to " +
                                          std::to_string(now[i]));
        before = std::move(now);
    }

    std::vector<std::uint64_t> m_broadphase, m_backend, m_narrow;
};
}  // namespace cullet::test
