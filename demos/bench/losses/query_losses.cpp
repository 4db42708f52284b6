// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/query_losses.h"

#include "cullet/demos/bench/aim_ray.h"
#include "cullet/demos/bench/losses/scripted_broadphase.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"

#include <LinearMath/btAabbUtil2.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Stores the proxies that the broad phase reports, of which a tree of fat boxes may report too many.
class Ray : public btBroadphaseRayCallback
{
public:
    Ray(const btVector3& from, const btVector3& to) : m_from(from), m_to(to) { aimRay(*this, from, to); }

    bool process(const btBroadphaseProxy* proxy) override
    {
        m_reported.push_back(proxy);
        return true;
    }

    void cast(btBroadphaseInterface& broadphase) { broadphase.rayTest(m_from, m_to, *this); }
    const std::vector<const btBroadphaseProxy*>& reported() const { return m_reported; }

    bool hits(const btVector3& low, const btVector3& high) const
    {
        const btVector3 bounds[2] = {low, high};
        btScalar parameter = 1;
        return btRayAabb2(m_from, m_rayDirectionInverse, m_signs, bounds, parameter, btScalar(0),
                          m_lambda_max);
    }

private:
    btVector3 m_from, m_to;
    std::vector<const btBroadphaseProxy*> m_reported;
};

class RayLoss : public ScriptedBroadphase
{
public:
    RayLoss(const LossSetup& setup, std::uint32_t rays, bool moves)
        : ScriptedBroadphase(setup),
          m_scene(findBoxScene("W1")->make({setup.bodies, false, setup.seed})),
          m_random(setup.seed),
          m_count(rays),
          m_moves(moves)
    {
        for (const Aabb& box : m_scene->boxes())
            add(toExactBox(box));
        makeBroadphase();
        createProxies();
        findPairs();
    }

    double run() override
    {
        if (m_moves)
        {
            m_scene->step();
            for (std::uint32_t row = 0; row < size(); ++row)
                place(row, toExactBox(m_scene->boxes()[row]));
            setBoxes();
        }
        findPairs();
        drawRays();
        const Stopwatch watch;
        for (Ray& ray : m_rays)
            ray.cast(broadphase());
        return watch.wallMs();
    }

    PairDigest answer() override
    {
        PairDigest digest;
        for (std::uint32_t i = 0; i < m_rays.size(); ++i)
        {
            for (const btBroadphaseProxy* proxy : m_rays[i].reported())
            {
                if (m_rays[i].hits(proxy->m_aabbMin, proxy->m_aabbMax))
                    digest.add({i, rowOf(*proxy)});
            }
        }
        return digest;
    }

    PairDigest exactAnswer() override
    {
        PairDigest digest;
        for (std::uint32_t i = 0; i < m_rays.size(); ++i)
        {
            for (std::uint32_t row = 0; row < size(); ++row)
            {
                const double *low = box(row).min, *high = box(row).max;
                if (m_rays[i].hits(btVector3(btScalar(low[0]), btScalar(low[1]), btScalar(low[2])),
                                   btVector3(btScalar(high[0]), btScalar(high[1]), btScalar(high[2]))))
                    digest.add({i, row});
            }
        }
        return digest;
    }

private:
    static constexpr btScalar kReach = 20;

    /// Rays from the centre of a random body in a random direction.
    void drawRays()
    {
        m_rays.clear();
        for (std::uint32_t i = 0; i < m_count; ++i)
        {
            const std::uint64_t drawn = m_random.next();
            const ExactBox& start = box(static_cast<std::uint32_t>(drawn % size()));
            btVector3 from, direction;
            for (int axis = 0; axis < 3; ++axis)
            {
                from[axis] = btScalar((start.min[axis] + start.max[axis]) / 2);
                direction[axis] = btScalar(m_random.uniform(-1.0f, 1.0f));
            }
            if (direction.length2() < btScalar(0.01))
                direction = btVector3(1, 0, 0);
            m_rays.emplace_back(from, from + direction.normalized() * kReach);
        }
    }

    std::unique_ptr<BoxScene> m_scene;
    SplitMix64 m_random;
    std::uint32_t m_count;
    bool m_moves;
    std::vector<Ray> m_rays;
};
}  // namespace

std::unique_ptr<LossSide> makeRayMovingLoss(const LossSetup& setup)
{
    return std::make_unique<RayLoss>(setup, 1, true);
}

std::unique_ptr<LossSide> makeRaysMovingLoss(const LossSetup& setup)
{
    return std::make_unique<RayLoss>(setup, 100, true);
}

std::unique_ptr<LossSide> makeRayRestingLoss(const LossSetup& setup)
{
    return std::make_unique<RayLoss>(setup, 1, false);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
