// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/tiny_steps.h"

#include "cullet/demos/drop/pair_audit.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"

#include <btBulletDynamicsCommon.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// What the cubes of a tiny world do.
enum class TinyState : std::uint8_t
{
    Asleep,    ///< they sleep on a floor, each by itself
    Resting,   ///< the same, but they never sleep
    Drifting,  ///< they turn and drift slowly, without gravity and contacts
    Falling    ///< they fall, each alone
};

/// Which parts of cullet a side has.
enum class TinyParts : std::uint8_t
{
    All,
    World,
    Dispatcher,
    Broadphase,
    None  ///< Bullet's own
};

using Stock = btDiscreteDynamicsWorld;

bool isInAir(TinyState state)
{
    return state == TinyState::Drifting || state == TinyState::Falling;
}

std::unique_ptr<btCollisionDispatcher> makeTinyDispatcher(btCollisionConfiguration& configuration, bool isOwn,
                                                          int threads)
{
    DispatcherOptions options;
    options.threads = threads;
    if (isOwn)
        return std::make_unique<Dispatcher>(&configuration, options);
    return std::make_unique<btCollisionDispatcher>(&configuration);
}

std::unique_ptr<btBroadphaseInterface> makeTinyBroadphase(bool isOwn, int threads)
{
    BroadphaseOptions options;
    options.threads = threads;
    if (isOwn)
        return std::make_unique<Broadphase>(options);
    return std::make_unique<btDbvtBroadphase>();
}

class TinySteps : public LossSide
{
public:
    TinySteps(TinyState state, TinyParts parts, const LossSetup& setup)
        : m_state(state),
          m_parts(parts),
          m_dispatcher(makeTinyDispatcher(m_configuration, has(TinyParts::Dispatcher), setup.threads)),
          m_broadphase(makeTinyBroadphase(has(TinyParts::Broadphase), setup.threads)),
          m_world(makeWorld(setup.threads))
    {
        m_world->setGravity(btVector3(0, state == TinyState::Drifting ? 0 : -10, 0));
        add(m_floor, 0).setWorldTransform(placeAt(0, -1, 0));
        for (std::uint32_t i = 0; i < setup.bodies; ++i)
            addCube();
        constexpr int kUntilAsleep = 400;
        putBack();
        step(isInAir(state) ? 2 : kUntilAsleep);
    }
    ~TinySteps() override
    {
        for (const auto& body : m_bodies)
            m_world->removeRigidBody(body.get());
    }
    TinySteps(const TinySteps&) = delete;
    TinySteps& operator=(const TinySteps&) = delete;

    double run() override
    {
        constexpr int kSteps = 60;
        if (isInAir(m_state))
            putBack();
        step(2);
        const Stopwatch watch;
        step(kSteps);
        return watch.wallMs();
    }

    PairDigest answer() override { return digestCache(*m_world); }
    PairDigest exactAnswer() override { return digestExact(collectProxies(*m_world)); }

private:
    bool has(TinyParts part) const { return m_parts == part || m_parts == TinyParts::All; }

    std::unique_ptr<Stock> makeWorld(int threads)
    {
        if (!has(TinyParts::World))
            return std::make_unique<Stock>(m_dispatcher.get(), m_broadphase.get(), &m_solver,
                                           &m_configuration);
        auto world = std::make_unique<World<Stock>>(m_dispatcher.get(), m_broadphase.get(), &m_solver,
                                                    &m_configuration);
        world->setUpdateThreads(threads);
        return world;
    }

    static btTransform placeAt(btScalar x, btScalar y, btScalar z)
    {
        return btTransform(btQuaternion::getIdentity(), btVector3(x, y, z));
    }

    btRigidBody& add(btCollisionShape& shape, btScalar mass)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(mass, inertia);
        m_bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
        m_world->addRigidBody(m_bodies.back().get());
        return *m_bodies.back();
    }

    void addCube()
    {
        btRigidBody& cube = add(m_cube, 1);
        if (m_state != TinyState::Asleep)
            cube.setActivationState(DISABLE_DEACTIVATION);
    }

    /// Puts the cubes to where they began, three metres apart.
    void putBack()
    {
        constexpr std::size_t kInRow = 6;
        for (std::size_t i = 1; i < m_bodies.size(); ++i)
        {
            btRigidBody& cube = *m_bodies[i];
            const btScalar x = btScalar(3 * ((i - 1) % kInRow)), z = btScalar(3 * ((i - 1) / kInRow));
            cube.setWorldTransform(placeAt(x, isInAir(m_state) ? btScalar(20) : btScalar(0.5), z));
            cube.setInterpolationWorldTransform(cube.getWorldTransform());
            if (!isInAir(m_state))
                continue;
            cube.setLinearVelocity(btVector3(btScalar(0.01), btScalar(0.02), btScalar(0.01)));
            cube.setAngularVelocity(btVector3(btScalar(0.1), btScalar(0.2), btScalar(0.3)));
        }
    }

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world->stepSimulation(btScalar(1) / 60, 0);
    }

    TinyState m_state;
    TinyParts m_parts;
    btBoxShape m_floor{btVector3(100, 1, 100)},
        m_cube{btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))};
    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    std::unique_ptr<btBroadphaseInterface> m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;
    std::unique_ptr<Stock> m_world;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

template <TinyState kState, TinyParts kParts>
std::unique_ptr<LossSide> makeTinyStepLoss(const LossSetup& setup)
{
    return std::make_unique<TinySteps>(kState, setup.side == "cullet" ? kParts : TinyParts::None, setup);
}

template <TinyState kState>
void addCases(std::vector<LossCase>& cases, const char* const (&names)[4], const char* summary)
{
    const std::vector<std::string> sides = {"cullet", "bullet"};
    const auto add = [&](TinyParts parts, std::unique_ptr<LossSide> (*make)(const LossSetup&))
    {
        cases.push_back({names[std::size_t(parts)], summary, 32, LossMeasure::Time, 1, sides, make});
        cases.back().leastBodies = 1;
    };
    add(TinyParts::All, makeTinyStepLoss<kState, TinyParts::All>);
    add(TinyParts::World, makeTinyStepLoss<kState, TinyParts::World>);
    add(TinyParts::Dispatcher, makeTinyStepLoss<kState, TinyParts::Dispatcher>);
    add(TinyParts::Broadphase, makeTinyStepLoss<kState, TinyParts::Broadphase>);
}
}  // namespace

void addTinySteps(std::vector<LossCase>& cases)
{
    addCases<TinyState::Asleep>(cases, {"asleep", "asleep-world", "asleep-dispatcher", "asleep-broadphase"},
                                "cubes asleep on a floor, with all of cullet or one part: 60 whole steps");
    addCases<TinyState::Resting>(cases,
                                 {"resting", "resting-world", "resting-dispatcher", "resting-broadphase"},
                                 "the same cubes, awake: 60 whole steps");
    addCases<TinyState::Drifting>(
        cases, {"drifting", "drifting-world", "drifting-dispatcher", "drifting-broadphase"},
        "cubes turn and drift without contacts: 60 whole steps");
    addCases<TinyState::Falling>(cases,
                                 {"falling", "falling-world", "falling-dispatcher", "falling-broadphase"},
                                 "cubes fall, each alone: 60 whole steps");
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
