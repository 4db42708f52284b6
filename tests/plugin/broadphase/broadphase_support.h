// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/plugin/broadphase.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
inline constexpr int kAllGroups = -1;

inline BroadphaseOptions bruteOptions()
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Brute;
    return options;
}

inline btVector3 vec(double x, double y, double z)
{
    return btVector3(btScalar(x), btScalar(y), btScalar(z));
}

inline btVector3 vec(const std::array<float, 3>& point)
{
    return vec(point[0], point[1], point[2]);
}

inline std::uint32_t idOf(const btBroadphaseProxy* proxy)
{
    return static_cast<std::uint32_t>(proxy->m_uniqueId);
}

/// A proxy with a cube of half size `half` around the centre.
inline btBroadphaseProxy* addCube(btBroadphaseInterface& broadphase, const btVector3& centre,
                                  double half = 0.5, int group = 1, int mask = kAllGroups,
                                  void* client = nullptr)
{
    const btVector3 extent = vec(half, half, half);
    return broadphase.createProxy(centre - extent, centre + extent, 0, client, group, mask, nullptr);
}

inline void moveCube(btBroadphaseInterface& broadphase, btBroadphaseProxy* proxy, const btVector3& centre,
                     double half = 0.5)
{
    const btVector3 extent = vec(half, half, half);
    broadphase.setAabb(proxy, centre - extent, centre + extent, nullptr);
}

/// The pairs of the cache by ids, sorted. Fails the test when the array breaks a rule: null or equal proxies, the
/// higher id first, a pair twice.
inline Pairs pairsOf(btBroadphaseInterface& broadphase)
{
    Pairs pairs;
    const btBroadphasePairArray& array = broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < array.size(); ++i)
    {
        const btBroadphasePair& pair = array[i];
        if (pair.m_pProxy0 == nullptr || pair.m_pProxy1 == nullptr)
        {
            ADD_FAILURE() << "null proxy in the pair array";
            continue;
        }
        EXPECT_LT(pair.m_pProxy0->m_uniqueId, pair.m_pProxy1->m_uniqueId);
        pairs.push_back({idOf(pair.m_pProxy0), idOf(pair.m_pProxy1)});
    }
    std::sort(pairs.begin(), pairs.end());
    EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end()) << "a pair is in the array twice";
    return pairs;
}

inline Pairs updatedPairs(btBroadphaseInterface& broadphase)
{
    broadphase.calculateOverlappingPairs(nullptr);
    return pairsOf(broadphase);
}

inline bool hasPair(btBroadphaseInterface& broadphase, const btBroadphaseProxy* a, const btBroadphaseProxy* b)
{
    const Pairs pairs = pairsOf(broadphase);
    return std::binary_search(pairs.begin(), pairs.end(), makePair(idOf(a), idOf(b)));
}

/// btDbvtBroadphase that frees the remaining proxies, which its own destructor leaks.
class StockBroadphase final : public btDbvtBroadphase
{
public:
    ~StockBroadphase() override
    {
        for (btBroadphaseProxy* proxy : boxesOf(*this))
            destroyProxy(proxy, nullptr);
    }
    StockBroadphase() = default;
    StockBroadphase(const StockBroadphase&) = delete;
    StockBroadphase& operator=(const StockBroadphase&) = delete;

private:
    static std::vector<btBroadphaseProxy*> boxesOf(btBroadphaseInterface& broadphase)
    {
        struct All final : btBroadphaseAabbCallback
        {
            bool process(const btBroadphaseProxy* proxy) override
            {
                proxies.push_back(const_cast<btBroadphaseProxy*>(proxy));
                return true;
            }
            std::vector<btBroadphaseProxy*> proxies;
        } all;
        const btVector3 far(btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT));
        broadphase.aabbTest(-far, far, all);
        return all.proxies;
    }
};

/// Collects the results of a query, in order.
struct BoxHits final : btBroadphaseAabbCallback
{
    bool process(const btBroadphaseProxy* proxy) override
    {
        ids.push_back(idOf(proxy));
        return false;  // without effect, as in Bullet
    }
    std::vector<std::uint32_t> ids;
};

/// A ray as prepared by btCollisionWorld: normalised direction, 1 / 0 as BT_LARGE_FLOAT.
struct RayHits : btBroadphaseRayCallback
{
    RayHits(const btVector3& from, const btVector3& to, btScalar parallel = btScalar(BT_LARGE_FLOAT))
    {
        const btVector3 direction = (to - from).normalized();
        for (int axis = 0; axis < 3; ++axis)
        {
            m_rayDirectionInverse[axis] =
                direction[axis] == btScalar(0) ? parallel : btScalar(1) / direction[axis];
            m_signs[axis] = m_rayDirectionInverse[axis] < 0 ? 1 : 0;
        }
        m_lambda_max = direction.dot(to - from);
    }
    bool process(const btBroadphaseProxy* proxy) override
    {
        ids.push_back(idOf(proxy));
        return false;
    }
    std::vector<std::uint32_t> ids;
};

inline std::vector<std::uint32_t> boxHits(btBroadphaseInterface& broadphase, const btVector3& min,
                                          const btVector3& max)
{
    BoxHits hits;
    broadphase.aabbTest(min, max, hits);
    return hits.ids;
}

inline std::vector<std::uint32_t> rayHits(btBroadphaseInterface& broadphase, const btVector3& from,
                                          const btVector3& to)
{
    RayHits hits(from, to);
    broadphase.rayTest(from, to, hits);
    return hits.ids;
}

/// Bytes of a body in DBVT: a proxy of 88 bytes (120 in double builds) and two nodes of 64 (96), without malloc's overhead.
constexpr std::uint64_t kDbvtBytesPerBody = sizeof(btScalar) == 4 ? 88 + 2 * 64 : 120 + 2 * 96;

using Ids = std::vector<std::uint32_t>;
}  // namespace cullet::test

namespace cullet
{
inline void PrintTo(Pair pair, std::ostream* out)
{
    *out << pair.first << "-" << pair.second;
}
}  // namespace cullet
