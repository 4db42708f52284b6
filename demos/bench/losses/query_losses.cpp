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
enum class QueryKind
{
    Ray,
    Sweep,  ///< of a box of a metre
    Box     ///< of two metres around the beginning of the ray
};

/// Stores the proxies that the broad phase reports, of which a tree of fat boxes may report too many.
class Query : public btBroadphaseRayCallback
{
public:
    Query(QueryKind kind, const btVector3& from, const btVector3& to) : m_kind(kind), m_from(from), m_to(to)
    {
        aimRay(*this, from, to);
    }

    bool process(const btBroadphaseProxy* proxy) override
    {
        m_reported.push_back(proxy);
        return true;
    }

    void ask(btBroadphaseInterface& broadphase)
    {
        if (m_kind == QueryKind::Box)
            broadphase.aabbTest(m_from - m_reach, m_from + m_reach, *this);
        else
            broadphase.rayTest(m_from, m_to, *this, -castBox(), castBox());
    }
    const std::vector<const btBroadphaseProxy*>& reported() const { return m_reported; }

    bool finds(const btVector3& low, const btVector3& high) const
    {
        if (m_kind == QueryKind::Box)
            return TestAabbAgainstAabb2(m_from - m_reach, m_from + m_reach, low, high);
        const btVector3 bounds[2] = {low - castBox(), high + castBox()};
        btScalar parameter = 1;
        return btRayAabb2(m_from, m_rayDirectionInverse, m_signs, bounds, parameter, btScalar(0),
                          m_lambda_max);
    }

private:
    /// The upper corner of the box that is swept; the lower one is its opposite.
    btVector3 castBox() const { return m_kind == QueryKind::Sweep ? m_reach / 2 : btVector3(0, 0, 0); }

    const btVector3 m_reach = btVector3(1, 1, 1);
    QueryKind m_kind;
    btVector3 m_from, m_to;
    std::vector<const btBroadphaseProxy*> m_reported;
};

class QueryLoss : public ScriptedBroadphase
{
public:
    /// @param queries in each frame
    QueryLoss(const LossSetup& setup, QueryKind kind, std::uint32_t queries, bool moves)
        : ScriptedBroadphase(setup),
          m_scene(findBoxScene("W1")->make({setup.bodies, false, setup.seed})),
          m_random(setup.seed),
          m_kind(kind),
          m_count(queries),
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
        drawQueries();
        const Stopwatch watch;
        for (Query& query : m_queries)
            query.ask(broadphase());
        return watch.wallMs();
    }

    PairDigest answer() override
    {
        PairDigest digest;
        for (std::uint32_t i = 0; i < m_queries.size(); ++i)
        {
            for (const btBroadphaseProxy* proxy : m_queries[i].reported())
            {
                if (m_queries[i].finds(proxy->m_aabbMin, proxy->m_aabbMax))
                    digest.add({i, rowOf(*proxy)});
            }
        }
        return digest;
    }

    PairDigest exactAnswer() override
    {
        PairDigest digest;
        for (std::uint32_t i = 0; i < m_queries.size(); ++i)
        {
            for (std::uint32_t row = 0; row < size(); ++row)
            {
                const double *low = box(row).min, *high = box(row).max;
                if (m_queries[i].finds(btVector3(btScalar(low[0]), btScalar(low[1]), btScalar(low[2])),
                                       btVector3(btScalar(high[0]), btScalar(high[1]), btScalar(high[2]))))
                    digest.add({i, row});
            }
        }
        return digest;
    }

private:
    static constexpr btScalar kReach = 20;

    /// From the centre of a random body, in a random direction.
    void drawQueries()
    {
        m_queries.clear();
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
            m_queries.emplace_back(m_kind, from, from + direction.normalized() * kReach);
        }
    }

    std::unique_ptr<BoxScene> m_scene;
    SplitMix64 m_random;
    QueryKind m_kind;
    std::uint32_t m_count;
    bool m_moves;
    std::vector<Query> m_queries;
};
}  // namespace

std::unique_ptr<LossSide> makeRayMovingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Ray, 1, true);
}

std::unique_ptr<LossSide> makeRaysMovingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Ray, 100, true);
}

std::unique_ptr<LossSide> makeRayRestingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Ray, 1, false);
}

std::unique_ptr<LossSide> makeSweepMovingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Sweep, 1, true);
}

std::unique_ptr<LossSide> makeSweepRestingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Sweep, 1, false);
}

std::unique_ptr<LossSide> makeBoxMovingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Box, 1, true);
}

std::unique_ptr<LossSide> makeBoxRestingLoss(const LossSetup& setup)
{
    return std::make_unique<QueryLoss>(setup, QueryKind::Box, 1, false);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
