// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world_layers.h"

#include <BulletDynamics/Dynamics/btSimpleDynamicsWorld.h>

#include <type_traits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One of Bullet's worlds that uses all cores: `World<btDiscreteDynamicsWorld> world(...)` instead of
/// `btDiscreteDynamicsWorld world(...)`, with the same constructors.
///
/// The whole simulation is the same as with Base, bit for bit, with any number of threads and any broad phase:
/// transforms, velocities, impulses, activation states, pairs, deactivated bodies and warnings. What runs on several
/// threads depends on Base:
///
/// - all: updateAabbs(); WorldBoxes lists the shapes that are handled on the calling thread
/// - btDiscreteDynamicsWorld, btSoftRigidDynamicsWorld: the solver, island by island (WorldIslands says when the calling
///   thread solves all), and the loops over bodies (WorldBodies); a soft world predicts its bodies as before
/// - btSimpleDynamicsWorld: nothing else; it has no islands
/// - btMultiBodyDynamicsWorld and the soft and deformable worlds that derive from it: of the loops over bodies, those
///   that the class inherits from btDiscreteDynamicsWorld; multibodies and their solver are left to Base
/// - btDiscreteDynamicsWorldMt: likewise; it has islands of its own
///
/// @tparam Base btCollisionWorld, btDiscreteDynamicsWorld, btSimpleDynamicsWorld, btMultiBodyDynamicsWorld, a soft or
///              deformable world, or a class of the application that inherits updateAabbs() from one of these. Of the
///              other functions it keeps its own.
/// @tparam Holder where the world keeps what is not of Base; a program leaves it as it is
///
/// rayTest() uses the trees of meshes for which prepare() was called (world_queries.h), where Base inherits it from
/// btCollisionWorld.
///
/// Threads: as for Base. During stepSimulation() no other thread may change bodies, shapes or joints, which holds for
/// Base too. All callbacks, motion states, actions and classes of the application run on the calling thread, in
/// Bullet's order. Callbacks of the broad phase may add and remove bodies during updateAabbs(), but must not move
/// existing ones.
template <class Base, template <class> class Holder = world_layers::WithMembers>
class World : public world_layers::Stack<Base, Holder>::All
{
    using Layers = typename world_layers::Stack<Base, Holder>::All;

public:
    using Layers::Layers;

    /// @param threads 0, the default: as many as the machine has
    void setUpdateThreads(int threads)
    {
        this->stepParts().boxes.setThreads(threads);
        this->stepParts().islands.setThreads(threads);
        this->stepParts().bodies.setThreads(threads);
        this->stepParts().rest.setThreads(threads);
    }

    /// Lets a custom profiler (btSetCustomEnterProfileZoneFunc) be called on any thread; while there is another one, one
    /// thread solves all islands.
    void setThreadSafeProfiler(bool isThreadSafe)
    {
        this->stepParts().islands.setThreadSafeProfiler(isThreadSafe);
    }

    /// Gives fast bodies contacts with what they would meet in a step, so that they do not pass through it; see
    /// WorldSpeculation. For a Base that inherits createPredictiveContacts() from btDiscreteDynamicsWorld.
    ///
    /// @param motion bodies are fast if they move by more than this share of the thinnest side of their box in one step;
    ///               0, the default: none are. Bodies that Bullet sweeps (setCcdMotionThreshold()) are left to Bullet.
    void setSpeculation(btScalar motion) { this->stepParts().speculation.setMotion(motion); }

    void updateAabbs() override
    {
        if (this->getNumCollisionObjects() < WorldBoxes::kLeastObjects ||
            !this->stepParts().boxes.update(*this, kRule, this->stepParts().rest))
            Base::updateAabbs();
    }

    /// Statistics of the last updateAabbs() with at least 512 objects; with fewer, Base::updateAabbs() runs.
    const WorldBoxesStats& updateStats() const { return this->stepParts().boxes.stats(); }

    /// Statistics of the last solveConstraints(), if Base inherits it from btDiscreteDynamicsWorld.
    const WorldIslandsStats& islandStats() const { return this->stepParts().islands.stats(); }

    /// Statistics of the last step, if Base inherits the loops over bodies from btDiscreteDynamicsWorld.
    const WorldBodiesStats& bodyStats() const { return this->stepParts().bodies.stats(); }

    /// Statistics of the last step: the static objects at rest and the sleeping bodies, and how often all objects were
    /// visited. With at least 512 objects and a cullet::Broadphase.
    const WorldRestStats& restStats() const { return this->stepParts().rest.stats(); }

    /// Statistics of the last step with setSpeculation() above 0.
    const SpeculationStats& speculationStats() const { return this->stepParts().speculation.stats(); }

private:
    using Update = decltype(&Base::updateAabbs);
    static constexpr bool kIsSimple = std::is_same_v<Update, void (btSimpleDynamicsWorld::*)()>;
    static_assert(kIsSimple || std::is_same_v<Update, void (btCollisionWorld::*)()>,
                  "Base has an updateAabbs() of its own, which World would replace");
    static constexpr BoxRule kRule = kIsSimple ? BoxRule::Simple : BoxRule::Collision;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
