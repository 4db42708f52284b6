// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The loop of a motion planner: no world, a scene of static boxes, and a robot whose links stand somewhere else in each
// check. Prints how many convex queries each broad phase asks for. docs/guide/motion-planner.md explains it.

#include "cullet/plugin/broadphase.h"  // <cullet/plugin/broadphase.h> outside of this source tree

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <cstdio>
#include <random>
#include <vector>

namespace
{
constexpr int kStatics = 300, kLinks = 10, kChecks = 1000;
constexpr int kStaticGroup = 1, kLinkGroup = 2;

/// A planner's narrow phase stands here. It returns false, so that the pair stays in the cache.
struct ConvexQueries : btOverlapCallback
{
    bool processOverlap(btBroadphasePair& pair) override
    {
        ++asked;
        const btBroadphaseProxy &a = *pair.m_pProxy0, &b = *pair.m_pProxy1;
        const bool overlap = a.m_aabbMin.x() <= b.m_aabbMax.x() && b.m_aabbMin.x() <= a.m_aabbMax.x() &&
                             a.m_aabbMin.y() <= b.m_aabbMax.y() && b.m_aabbMin.y() <= a.m_aabbMax.y() &&
                             a.m_aabbMin.z() <= b.m_aabbMax.z() && b.m_aabbMin.z() <= a.m_aabbMax.z();
        overlapping += overlap ? 1 : 0;
        return false;
    }
    long asked = 0;
    long overlapping = 0;  ///< of those asked
};

/// The boxes of the scene and of the robot, the same for every broad phase.
class Scene
{
public:
    explicit Scene(btBroadphaseInterface& broadphase) : m_broadphase(broadphase)
    {
        for (int i = 0; i < kStatics + kLinks; ++i)
        {
            const bool isLink = i >= kStatics;
            place();
            m_proxies.push_back(
                m_broadphase.createProxy(m_min, m_max, 0, nullptr, isLink ? kLinkGroup : kStaticGroup,
                                         isLink ? kStaticGroup | kLinkGroup : kLinkGroup, nullptr));
        }
    }

    ~Scene()
    {
        for (btBroadphaseProxy* proxy : m_proxies)
            m_broadphase.destroyProxy(proxy, nullptr);
    }

    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    void check(ConvexQueries& queries)
    {
        for (int link = kStatics; link < kStatics + kLinks; ++link)
        {
            place();
            m_broadphase.setAabb(m_proxies[std::size_t(link)], m_min, m_max, nullptr);
        }
        m_broadphase.calculateOverlappingPairs(nullptr);
        m_broadphase.getOverlappingPairCache()->processAllOverlappingPairs(&queries, nullptr);
    }

private:
    /// The next box: 10 to 30 cm, in a room of 4 m.
    void place()
    {
        const btScalar half = draw(btScalar(0.05), btScalar(0.15));
        const btScalar x = draw(-2, 2);
        const btScalar y = draw(-2, 2);
        const btScalar z = draw(-2, 2);
        m_min = btVector3(x - half, y - half, z - half);
        m_max = btVector3(x + half, y + half, z + half);
    }

    btScalar draw(btScalar low, btScalar high)
    {
        return low + (high - low) * btScalar(m_random()) / btScalar(std::mt19937::max());
    }

    std::mt19937 m_random{7};
    btBroadphaseInterface& m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;
    btVector3 m_min, m_max;
};

ConvexQueries runChecks(btBroadphaseInterface& broadphase)
{
    Scene scene(broadphase);
    ConvexQueries queries;
    for (int check = 0; check < kChecks; ++check)
        scene.check(queries);
    return queries;
}
}  // namespace

int main()
{
    gDbvtMargin = 0;  // as planners do; cullet::Broadphase reads it too
    btDbvtBroadphase dbvt;
    const ConvexQueries stock = runChecks(dbvt);
    cullet::BroadphaseOptions options;
    options.backend = cullet::BackendChoice::Grid;
    options.threads = 1;  // a planner has a broad phase for each of its threads
    cullet::Broadphase broadphase(options);
    const ConvexQueries exact = runChecks(broadphase);
    std::printf("%d checks: DBVT asks for %ld convex queries, cullet for %ld; boxes overlap in %ld\n",
                kChecks, stock.asked, exact.asked, exact.overlapping);
    const bool isExact = exact.asked == exact.overlapping && exact.overlapping == stock.overlapping;
    return isExact && exact.asked > 0 && stock.asked > 4 * exact.asked ? 0 : 1;
}
