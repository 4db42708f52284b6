// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/scenes/body_shapes.h"
#include "demos/scenes/broadphase_factory.h"
#include "demos/scenes/phase_clock.h"

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct BodyWorldOptions
{
    std::uint32_t bodies = 4000;
    std::uint64_t seed = 1;
    btScalar dt = btScalar(1.0 / 60.0);
    bool sleeping = true;           ///< let resting bodies fall asleep, as Bullet does by default
    std::string narrow = "bullet";  ///< narrow phase: one of narrowPhaseNames()
    int threads = 0;                ///< of the narrow phase "dispatcher"; 0: as many as the machine has
};

/// "bullet"; "isa-gjk": Bullet's dispatcher with registerIsaGjk(); "dispatcher": cullet::Dispatcher.
const std::vector<std::string>& narrowPhaseNames();

/// A Bullet world in which bodies of about one metre fall from a loose column onto a floor within four walls.
///
/// Two worlds with the same shapes and options, but for the narrow phase, differ in what is named only. Mass 1 each, gravity -10, Bullet's
/// defaults for everything else. The floor is the top of a static box at y = 0; the walls reach above the column.
class BodyWorld
{
public:
    /// @param shapes one is drawn for each body; they must outlive the world
    BodyWorld(NamedBroadphase broadphase, const BodyShapes& shapes, const BodyWorldOptions& options);
    ~BodyWorld();
    BodyWorld(const BodyWorld&) = delete;
    BodyWorld& operator=(const BodyWorld&) = delete;

    /// One step of dt, phase by phase.
    PhaseTimes step();

    const std::string& name() const noexcept { return m_broadphase.name; }
    const NamedBroadphase& broadphase() const noexcept { return m_broadphase; }
    const std::string& narrow() const noexcept { return m_options.narrow; }
    btCollisionWorld& world() noexcept { return *m_world; }

    /// Pairs in the pair cache.
    std::uint64_t pairCount() const;

    /// Pairs with at least one contact point.
    std::uint64_t contactPairCount() const;

    /// FNV-1a over the transforms of all bodies, bit by bit: equal for equal simulations.
    std::uint64_t stateHash() const;

    /// Lowest centre of a body; below 0 something fell through the floor.
    btScalar lowestHeight() const;

private:
    void addGround(btScalar halfWidth, btScalar height);
    void addStaticBox(const btVector3& halfExtents, const btVector3& centre);
    void addBodies(const BodyShapes& shapes);
    void addBody(btCollisionShape* shape, const btTransform& transform);

    BodyWorldOptions m_options;
    NamedBroadphase m_broadphase;
    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btSequentialImpulseConstraintSolver m_solver;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    std::vector<std::unique_ptr<btCollisionShape>> m_groundShapes;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;  ///< ground first
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
