// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletDynamicsCommon.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

/// Worlds that are run several times in other circumstances, and fingerprints of each of their steps.
namespace cullet::test
{
enum class HistoryScene
{
    /// Bodies of all kinds of shapes that fall onto each other, with a ghost among them, through Bullet's solver.
    Pour,
    /// Bodies on given ways, which no solver and no function of the math library but the root has a part in: the same on
    /// every machine.
    Drift
};

struct HistoryOptions
{
    HistoryScene scene = HistoryScene::Pour;
    /// Makes the backend; by default the one that Broadphase chooses.
    std::function<std::unique_ptr<Backend>(int threads)> makeBackend;
    int threads = 1;  ///< of broad phase, dispatcher and world
    Narrow narrow = Narrow::Dispatcher;
    bool isParallelWorld = false;  ///< World<btDiscreteDynamicsWorld> instead of btDiscreteDynamicsWorld
    /// Order of creation: position -> number of the body in the scene. Empty: as numbered.
    std::vector<std::size_t> order;
};

/// Hashes of the bits of a world after a step.
struct Fingerprint
{
    std::uint64_t pairs = 0;     ///< the pair array in its order, and the guests of the ghost
    std::uint64_t contacts = 0;  ///< manifolds in their order, with their points
    std::uint64_t bodies = 0;    ///< boxes, transforms, velocities, activation

    bool operator==(const Fingerprint& other) const
    {
        return pairs == other.pairs && contacts == other.contacts && bodies == other.bodies;
    }
};

using History = std::vector<Fingerprint>;

/// One of the scenes with all parts of cullet.
class HistoryWorld
{
public:
    explicit HistoryWorld(const HistoryOptions& options);
    ~HistoryWorld();
    HistoryWorld(const HistoryWorld&) = delete;
    HistoryWorld& operator=(const HistoryWorld&) = delete;

    void step();
    Fingerprint fingerprint() const;
    History run(int steps);

    btDiscreteDynamicsWorld& world() { return *m_world; }
    const std::vector<std::unique_ptr<btRigidBody>>& bodies() const { return m_bodies; }
    int contacts() const;
    int pairs() const;

private:
    void makeShapes();
    void makeBodies(const std::vector<std::size_t>& order);
    void add(std::size_t number, btCollisionShape& shape, double mass, const btTransform& at);
    void drift();

    HistoryScene m_scene;
    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btSequentialImpulseConstraintSolver m_solver;
    btGhostPairCallback m_ghostCallback;
    std::unique_ptr<Broadphase> m_broadphase;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
    std::vector<btVector3> m_ways;  ///< of Drift: by number of the body, in a step
    btSphereShape m_zone{btScalar(1.5)};
    btPairCachingGhostObject m_ghost;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;  ///< by number
};

/// Steps of a history that has contacts of all kinds.
int stepsOf(HistoryScene scene);

/// Runs a scene from its start. Fails the test when it has hardly any pairs, contacts or changes.
History historyOf(const HistoryOptions& options);
}  // namespace cullet::test
