// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/broadphase_factory.h"
#include "cullet/demos/scenes/bodies/phase_clock.h"
#include "cullet/demos/scenes/hulls/mesh_hull.h"
#include "cullet/plugin/prepared_mesh.h"

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

class btRaycastVehicle;

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct WorldSceneOptions
{
    std::uint32_t bodies = 0;            ///< moving bodies; 0: the scene's default
    std::uint64_t seed = 1;              ///< of positions, rotations, velocities and shapes
    btScalar dt = btScalar(1.0 / 60.0);  ///< length of a step, seconds
    bool sleeping = true;                ///< let resting bodies fall asleep, as Bullet does by default
    std::string narrow = "bullet";       ///< narrow phase: one of narrowPhaseNames()
    std::string backend = "auto";        ///< broad phase: one of broadphaseNames()
    std::string update = "bullet";       ///< update of the boxes: one of boxUpdateNames()
    std::string solver = "bullet";       ///< of constraints: one of solverNames()
    double reuse = 0;                    ///< IsaGjkOptions::reusePose of narrow: its distance in metres
    bool activeEdges = false;            ///< IsaGjkOptions::activeEdges of narrow, unless that is Bullet's
    bool prepares = false;               ///< declare meshes constant before the first step: prepare()
    bool isMt = false;                   ///< Bullet's own multithreaded world; narrow and update are ignored
    int threads = 0;                ///< of backend, narrow, update and isMt; 0: as many as the machine has
    std::vector<HullPoints> hulls;  ///< shapes for the scenes that take meshes
    std::size_t hullPoints = 20;    ///< vertices of a random hull
    std::string file;               ///< the .bullet file of scene "file"
};

/// "bullet"; "isa-gjk": Bullet's dispatcher with registerIsaGjk(); "dispatcher": cullet::Dispatcher; "active-edges": as
/// "isa-gjk", with IsaGjkOptions::activeEdges.
const std::vector<std::string>& narrowPhaseNames();

/// "bullet"; "parallel": cullet::World.
const std::vector<std::string>& boxUpdateNames();

/// "bullet": that of the scene's world; "cullet": cullet::Solver; "cullet-soft": with SolverModel::Soft.
const std::vector<std::string>& solverNames();

/// The Bullet classes from which a scene is built.
struct WorldKind
{
    std::unique_ptr<btDefaultCollisionConfiguration> (*makeConfiguration)();
    std::unique_ptr<btConstraintSolver> (*makeSolver)();  ///< of the class that the world requires
    std::unique_ptr<btDiscreteDynamicsWorld> (*makeWorld)(btDispatcher&, btBroadphaseInterface&,
                                                          btConstraintSolver&, btCollisionConfiguration&);
    /// Makes a world whose boxes are updated by a number of threads.
    std::unique_ptr<btDiscreteDynamicsWorld> (*makeParallelWorld)(btDispatcher&, btBroadphaseInterface&,
                                                                  btConstraintSolver&,
                                                                  btCollisionConfiguration&, int threads);
};

/// btDefaultCollisionConfiguration and btDiscreteDynamicsWorld.
const WorldKind& rigidWorld();

/// A Bullet world and its script. Lengths in metres, y is up, gravity -10, mass 1, Bullet's defaults for all other
/// parameters that a scene does not set.
///
/// Deterministic: two scenes with equal names and options are equal, and with backends of cullet remain bitwise equal.
/// Owns all objects of the world.
class WorldScene
{
public:
    virtual ~WorldScene();
    WorldScene(const WorldScene&) = delete;
    WorldScene& operator=(const WorldScene&) = delete;

    /// One step of dt, phase by phase. The times exclude the scene's script, except that creating and removing bodies
    /// counts in Phase::Rest.
    PhaseTimes step();

    /// Later steps write the zones of Bullet's profiler to a trace.
    void setTrace(TraceLane trace) { m_trace = std::move(trace); }

    const std::string& name() const noexcept { return m_name; }
    btDiscreteDynamicsWorld& world() noexcept { return *m_world; }
    const btDiscreteDynamicsWorld& world() const noexcept { return *m_world; }
    const NamedBroadphase& broadphase() const noexcept { return m_broadphase; }
    const WorldSceneOptions& options() const noexcept { return m_options; }

    /// The most threads that a step may use; 1 if nothing but Bullet's serial parts makes the world.
    int threads() const;

    /// The ray-cast vehicles, whose wheels are no objects of the world.
    virtual std::vector<const btRaycastVehicle*> vehicles() const { return {}; }

    /// Pairs in the pair cache.
    std::uint64_t pairCount() const;

    /// Pairs with at least one contact point.
    std::uint64_t contactPairCount() const;

    /// FNV-1a over the transforms of all objects of the world in their order, and over the nodes of soft bodies, bit by
    /// bit: equal for equal simulations.
    std::uint64_t stateHash() const;

    /// Lowest origin of an object that is not static; BT_LARGE_FLOAT if there is none.
    btScalar lowestHeight() const;

protected:
    WorldScene(std::string name, NamedBroadphase broadphase, const WorldSceneOptions& options,
               const WorldKind& kind = rigidWorld());

    /// The scene's script before a step: velocities, steering, targets. Not in the times.
    virtual void direct() {}

    /// Creates and removes bodies before a step. In the times.
    virtual void change() {}

    /// Adds state beyond the transforms to the hash.
    virtual void hashMore(std::uint64_t& hash) const;

    /// Takes ownership of an object until the world is empty, and returns it.
    template <class T>
    T& keep(std::unique_ptr<T> thing)
    {
        T& reference = *thing;
        m_kept.push_back(std::shared_ptr<T>(std::move(thing)));
        return reference;
    }

    /// Makes a shape that the scene owns.
    template <class Shape, class... Arguments>
    Shape& makeShape(Arguments&&... arguments)
    {
        return keep(std::make_unique<Shape>(std::forward<Arguments>(arguments)...));
    }

    /// Adds a rigid body; mass 0: static.
    btRigidBody& addBody(btCollisionShape& shape, btScalar mass, const btTransform& transform);

    /// Adds a static box.
    btRigidBody& addStaticBox(const btVector3& halfExtents, const btVector3& centre);

    /// Adds a floor whose top is y = 0, and four walls around the square from -halfWidth to halfWidth, of static boxes.
    void addWalledFloor(btScalar halfWidth, btScalar height);

    /// Adds the plane y = 0, as a static body.
    btRigidBody& addFloor();

    /// Adds an object that takes part in the broad and the narrow phase and has no mass, velocity or response.
    btCollisionObject& addObject(btCollisionShape& shape, const btTransform& transform);

    /// For a scene whose number of bodies is determined while it is built.
    void setBodyCount(std::uint32_t count) { m_options.bodies = count; }

    /// Installs Bullet's ghost pair callback.
    void allowGhosts();

private:
    void prepareMeshes();

    std::string m_name;
    WorldSceneOptions m_options;
    NamedBroadphase m_broadphase;
    TraceLane m_trace;
    std::unique_ptr<btDefaultCollisionConfiguration> m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    std::unique_ptr<btConstraintSolver> m_solver;
    std::vector<std::shared_ptr<void>> m_kept;
    std::vector<PreparedMesh> m_prepared;
    bool m_hasStarted = false;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
};

/// Hashes a vector, bit by bit; -0 and 0 hash alike.
void hashScalars(std::uint64_t& hash, const btVector3& vector);

btTransform transformAt(const btVector3& origin);

/// Puts a body elsewhere, with a velocity and no rotation.
void restart(btRigidBody& body, const btTransform& at, const btVector3& velocity);

struct WorldSceneInfo
{
    const char* name;
    const char* summary;   ///< one line
    std::uint32_t bodies;  ///< by default
    double halfExtent;     ///< bound of all boxes' coordinates at all times
    std::unique_ptr<WorldScene> (*make)(const std::string& name, NamedBroadphase, const WorldSceneOptions&);
    bool takesMeshes = false;  ///< options.hulls are among its shapes
};

/// Every scene, in reading order.
const std::vector<WorldSceneInfo>& worldScenes();

/// The scene of that name (case matters), or null.
const WorldSceneInfo* findWorldScene(std::string_view name);

/// The scene of that name.
///
/// @throws std::invalid_argument if there is none, listing the known ones
const WorldSceneInfo& requireWorldScene(std::string_view name);

/// The requirements of this scene on a broad phase, which options.backend names.
///
/// @throws std::invalid_argument for an unknown scene, listing the known ones
BroadphaseRequest requestForScene(std::string_view name, const WorldSceneOptions& options);

/// Makes a scene with the broad phase options.backend.
///
/// @throws std::invalid_argument for an unknown scene, backend or narrow phase, listing the known ones; ProgramError
///         (kExitInput) for a file that cannot be read, (kExitUnavailable) for isMt with a Bullet library without
///         threads or a scene of soft bodies or multibodies; std::runtime_error if a backend cannot run here
std::unique_ptr<WorldScene> makeWorldScene(std::string_view name, const WorldSceneOptions& options);

/// makeWorldScene() with the caller's broad phase; options.backend is ignored.
std::unique_ptr<WorldScene> makeWorldScene(std::string_view name, const WorldSceneOptions& options,
                                           NamedBroadphase broadphase);
}  // namespace CULLET_PRECISION
}  // namespace cullet
