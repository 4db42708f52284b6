// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_shape.h"
#include "cullet/demos/bench/narrow/narrow_subject.h"
#include "cullet/plugin/convex_dispatcher.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include <algorithm>
#include <array>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A body and its proxy, whose pairs are added by hand.
struct ProxiedBody
{
    ProxiedBody(btCollisionShape& shape, const btTransform& place, int id)
        : proxy(btVector3(0, 0, 0), btVector3(0, 0, 0), &body, btBroadphaseProxy::DefaultFilter,
                btBroadphaseProxy::AllFilter)
    {
        body.setCollisionShape(&shape);
        body.setWorldTransform(place);
        body.setBroadphaseHandle(&proxy);
        proxy.m_uniqueId = id;
    }
    ProxiedBody(const ProxiedBody&) = delete;
    ProxiedBody& operator=(const ProxiedBody&) = delete;

    btCollisionObject body;
    btBroadphaseProxy proxy;
};

std::unique_ptr<btCollisionDispatcher> makeDispatcher(btCollisionConfiguration& configuration, bool isCullets)
{
    if (!isCullets)
        return std::make_unique<btCollisionDispatcher>(&configuration);
    DispatcherOptions options;
    options.threads = 1;
    return std::make_unique<Dispatcher>(&configuration, options);
}

/// Offsets to the following neighbours of a body in a lattice: across faces and edges.
constexpr std::array<std::array<int, 3>, 9> kNeighbours = {
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}}};

/// Pairs in Bullet's pair cache, all dispatched once per frame; the timing includes moving the bodies.
class DispatcherNarrow final : public NarrowSubject
{
public:
    /// @param isStill one pair per query, of unmoving bodies in a lattice; a run is one frame
    DispatcherNarrow(const NarrowRequest& request, bool isCullets, bool isStill)
        : m_dispatcher(makeDispatcher(m_configuration, isCullets))
    {
        // One contact distance for all shapes, as in the other queries.
        m_dispatcher->setDispatcherFlags(m_dispatcher->getDispatcherFlags() &
                                         ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
        fillShape(request.trajectories.hull(), m_shape);
        if (isStill)
            addLattice(request.trajectories);
        else
            addTrajectories(request.trajectories);
        m_dispatcher->dispatchAllCollisionPairs(&m_cache, m_info, m_dispatcher.get());
    }

    ~DispatcherNarrow() override
    {
        for (const auto& body : m_bodies)
            m_cache.removeOverlappingPairsContainingProxy(&body->proxy, m_dispatcher.get());
    }

    void run(std::vector<NarrowAnswer>& answers) override
    {
        std::fill(answers.begin(), answers.end(), NarrowAnswer());
        const auto pairs = static_cast<std::size_t>(m_cache.getNumOverlappingPairs());
        for (std::size_t first = 0; first < answers.size(); first += pairs)
        {
            // The first body of a pair does not move along a trajectory.
            for (std::size_t i = 0; i < pairs && !m_places.empty(); ++i)
                m_bodies[2 * i + 1]->body.setWorldTransform(m_places[first + i]);
            m_dispatcher->dispatchAllCollisionPairs(&m_cache, m_info, m_dispatcher.get());
            readManifolds(answers.data() + first);
        }
    }

private:
    void addBody(const btTransform& place, int query)
    {
        m_bodies.push_back(
            std::make_unique<ProxiedBody>(m_shape, place, static_cast<int>(m_bodies.size()) + 1));
        m_bodies.back()->body.setUserIndex(query);
    }

    void addTrajectories(const NarrowTrajectories& trajectories)
    {
        for (const PairScene<btScalar>& scene : trajectories.scenes())
            m_places.push_back(transformOf(scene.b));
        for (int i = 0; i < NarrowTrajectories::kPairs; ++i)
        {
            const PairScene<btScalar>& scene = trajectories.scenes()[static_cast<std::size_t>(i)];
            addBody(transformOf(scene.a), i);
            addBody(transformOf(scene.b), i);
            m_cache.addOverlappingPair(&m_bodies[m_bodies.size() - 2]->proxy, &m_bodies.back()->proxy);
        }
    }

    /// Adds bodies rotated as in the trajectories, at distances at which their bounding spheres just have no contact.
    void addLattice(const NarrowTrajectories& trajectories)
    {
        constexpr int kSide = 10;
        const auto queries = static_cast<int>(trajectories.scenes().size());
        const btScalar spacing = btScalar(2 * trajectories.hull().radius() + 1.5 * kContactDistance);
        const auto idOf = [](int x, int y, int z) { return (x * kSide + y) * kSide + z; };
        for (int i = 0; i < kSide * kSide * kSide; ++i)
        {
            btTransform place = transformOf(trajectories.scenes()[static_cast<std::size_t>(i)].b);
            const btVector3 cell(btScalar(i / kSide / kSide), btScalar(i / kSide % kSide),
                                 btScalar(i % kSide));
            place.setOrigin(spacing * cell);
            addBody(place, 0);
        }
        for (int i = 0; i < kSide * kSide * kSide; ++i)
        {
            for (const auto& [dx, dy, dz] : kNeighbours)
            {
                const int x = i / kSide / kSide + dx, y = i / kSide % kSide + dy, z = i % kSide + dz;
                const bool isIn = x < kSide && y >= 0 && y < kSide && z >= 0 && z < kSide;
                if (isIn && m_cache.getNumOverlappingPairs() < queries)
                    m_cache.addOverlappingPair(&m_bodies[static_cast<std::size_t>(i)]->proxy,
                                               &m_bodies[static_cast<std::size_t>(idOf(x, y, z))]->proxy);
            }
        }
    }

    /// Reads all contact points, like a solver.
    void readManifolds(NarrowAnswer* answers)
    {
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *m_dispatcher->getManifoldByIndexInternal(i);
            NarrowAnswer& answer =
                answers[std::max(manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex())];
            for (int p = 0; p < manifold.getNumContacts(); ++p)
            {
                const double distance = manifold.getContactPoint(p).getDistance();
                answer.distance = answer.distance < distance ? answer.distance : distance;
            }
            answer.isOverlapping = answer.distance <= 0.0;
        }
    }

    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btDispatcherInfo m_info;
    btHashedOverlappingPairCache m_cache;
    btConvexHullShape m_shape;
    std::vector<btTransform> m_places;  ///< of the second body, by query; empty where nothing moves
    std::vector<std::unique_ptr<ProxiedBody>> m_bodies;
};
}  // namespace

std::unique_ptr<NarrowSubject> makeDispatcherNarrow(const NarrowRequest& request, bool isCullets)
{
    // A dispatcher cannot forget the state of an existing pair.
    if (isCullets && !request.isWarm)
        return nullptr;
    return std::make_unique<DispatcherNarrow>(request, isCullets, request.query == NarrowQuery::Still);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
