// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/spot_losses.h"

#include "cullet/demos/bench/losses/scripted_broadphase.h"
#include "cullet/demos/program/stopwatch.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>

#include <cstddef>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
enum class SpotUse
{
    Pairs,      ///< nothing but pairs
    Filter,     ///< a filter callback that does what Bullet does without one
    Callback,   ///< a pair callback for ghosts, of which there are none
    Algorithms  ///< pairs get algorithms, without contacts, outside of the timing
};

/// Bullet's own rule.
struct WordFilter : btOverlapFilterCallback
{
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        return (a->m_collisionFilterGroup & b->m_collisionFilterMask) != 0 &&
               (b->m_collisionFilterGroup & a->m_collisionFilterMask) != 0;
    }
};

class SpotLoss : public ScriptedBroadphase
{
public:
    SpotLoss(SpotUse use, const LossSetup& setup)
        : ScriptedBroadphase(setup), m_use(use), m_objects(setup.bodies)
    {
        for (std::uint32_t row = 0; row < setup.bodies; ++row)
        {
            m_objects[row].setCollisionShape(&m_shape);
            add(kSpot, 1, -1, &m_objects[row]);
        }
    }

    // Before the callbacks and the dispatcher.
    ~SpotLoss() override { destroy(); }

    double run() override
    {
        destroy();
        for (std::uint32_t row = 0; row < size(); ++row)
            place(row, kSpot);
        makeBroadphase();
        installCallbacks(*broadphase().getOverlappingPairCache());
        const Stopwatch creation;
        createProxies();
        findPairs();
        const double created = creation.wallMs();
        if (m_use == SpotUse::Algorithms)
            m_dispatcher.dispatchAllCollisionPairs(broadphase().getOverlappingPairCache(), m_info,
                                                   &m_dispatcher);
        for (std::uint32_t row = 0; row < size(); ++row)
            place(row, {{2.0 * row, 0, 0}, {2.0 * row + 1, 1, 1}});
        const Stopwatch parting;
        setBoxes();
        findPairs();
        const double parted = parting.wallMs();
        // Within these, lists that were large for one update are freed.
        for (int update = 0; update < 3; ++update)
            findPairs();
        return created + parted;
    }

private:
    static constexpr ExactBox kSpot = {{0, 0, 0}, {1, 1, 1}};

    btDispatcher* dispatcher() override { return m_use == SpotUse::Algorithms ? &m_dispatcher : nullptr; }

    void installCallbacks(btOverlappingPairCache& cache)
    {
        if (m_use == SpotUse::Filter)
            cache.setOverlapFilterCallback(&m_filter);
        if (m_use == SpotUse::Callback)
            cache.setInternalGhostPairCallback(&m_callback);
    }

    SpotUse m_use;
    WordFilter m_filter;
    btGhostPairCallback m_callback;
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btDispatcherInfo m_info;
    btEmptyShape m_shape;
    std::vector<btCollisionObject> m_objects;
};

template <SpotUse kUse>
std::unique_ptr<LossSide> makeSpotLoss(const LossSetup& setup)
{
    return std::make_unique<SpotLoss>(kUse, setup);
}

template <SpotUse kUse>
void addCases(std::vector<LossCase>& cases, const char* const (&names)[4], const char* summary)
{
    constexpr std::uint32_t kBodies[] = {60, 300, 900, 3000};
    for (std::size_t i = 0; i < 4; ++i)
        cases.push_back({names[i],
                         i == 0 ? summary : "the same",
                         kBodies[i],
                         LossMeasure::Time,
                         1,
                         {"cullet", "dbvt", "dbvt-deferred"},
                         makeSpotLoss<kUse>});
}
}  // namespace

void addSpots(std::vector<LossCase>& cases)
{
    addCases<SpotUse::Pairs>(cases, {"spot-60", "spot-300", "spot-900", "spot"},
                             "bodies created at one spot, pairs, moved apart, pairs");
    addCases<SpotUse::Filter>(cases, {"spot-filter-60", "spot-filter-300", "spot-filter-900", "spot-filter"},
                              "the same with a filter callback that refuses nothing");
    addCases<SpotUse::Callback>(
        cases, {"spot-callback-60", "spot-callback-300", "spot-callback-900", "spot-callback"},
        "the same with the pair callback for ghosts, without a ghost");
    addCases<SpotUse::Algorithms>(
        cases, {"spot-algorithms-60", "spot-algorithms-300", "spot-algorithms-900", "spot-algorithms"},
        "the same with an algorithm for each pair, created outside of the timing");
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
