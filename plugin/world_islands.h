// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/array.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/world_bodies.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <LinearMath/btAlignedObjectArray.h>

#include <cstdint>
#include <memory>

class btConstraintSolver;
class btIDebugDraw;
class btPersistentManifold;
class btSimulationIslandManager;
class btTypedConstraint;
struct btContactSolverInfo;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Why the calling thread solved all islands of a step.
enum class SerialIslands : std::uint8_t
{
    No,          ///< several threads solved them
    FewThreads,  ///< one thread is allowed
    AtRest,      ///< all bodies asleep, and no joint: the solver was not called, which changes nothing
    FewBodies,  ///< Base solved the islands: few objects and joints (WorldBodies::fewBodies), and little work
    LittleWork,  ///< too little work for a second thread, or nearly all of it in one task
    NotSplit,    ///< setSplitIslands(false): Base solves all bodies together
    OwnSolver,   ///< they did not: a cullet::Solver divides the work among threads of its own (SolverStats)
    ForeignSolver,  ///< the solver is not exactly a btSequentialImpulseConstraintSolver
    ForeignRows,    ///< it has row functions of the application (setConstraintRowSolverGeneric)
    RandomOrder,    ///< SOLVER_RANDMIZE_ORDER: one sequence of random numbers runs through all islands
    Profiler,  ///< a custom profiler (btSetCustomEnterProfileZoneFunc), unless it is said to be thread-safe
    ForeignJoint,     ///< a joint is of a class of the application
    ForeignRounding,  ///< Bullet's library rounds otherwise than cullet (fused multiply-adds)
    NoMemory          ///< Base solved the islands
};

/// Counters of the last step.
struct WorldIslandsStats
{
    SerialIslands serial = SerialIslands::FewThreads;
    /// Calls of the solver, each with an island or with several small ones; 0 if Base solved the islands.
    std::uint32_t groups = 0;
    std::uint32_t tasks = 0;  ///< parts of the work that ran at the same time; 0 if the calling thread did it
    std::uint32_t sharingGroups =
        0;  ///< groups that shared a kinematic body, say, and so were in one task with others
};

/// Builds and solves the islands of a btDiscreteDynamicsWorld on several threads; a part of World<Base>.
///
/// Each group of islands gets the same bodies, manifolds and joints in the same order as from Bullet, and the same
/// arithmetic, so that results are the same bits for any number of threads. Each thread has a solver of its own.
/// Groups that share a kinematic body or a joint's feedback run one after the other, in Bullet's order. SerialIslands
/// says when the calling thread solves all islands with the application's solver.
///
/// The global counter gNumSplitImpulseRecoveries, which nothing reads, does not count on other threads. A custom
/// allocator (btAlignedAllocSetCustom) is called on all threads; what it throws is thrown to the caller of
/// stepSimulation(), after all threads have finished.
class CULLET_API WorldIslands
{
public:
    using Joints = btAlignedObjectArray<btTypedConstraint*>;

    /// The parts of a world.
    struct Step
    {
        btCollisionWorld& world;
        btSimulationIslandManager& manager;
        btConstraintSolver& solver;
        btContactSolverInfo& info;
        btIDebugDraw* debugDrawer;
        const Joints& joints;
        Joints& sortedJoints;
    };

    /// Whether the functions of the world itself are as fast as those that use several threads.
    static bool areFew(const btCollisionWorld& world, const Joints& joints)
    {
        constexpr int kFewJoints = 64;  // Bullet's loop compares all of them with each island
        return world.getNumCollisionObjects() <= WorldBodies::fewBodies && joints.size() <= kFewJoints;
    }

    WorldIslands();
    ~WorldIslands();

    /// @param threads 0: as many as the machine has
    void setThreads(int threads);

    /// Does the same as btDiscreteDynamicsWorld::calculateSimulationIslands(), on the calling thread.
    ///
    /// @param predictive contacts of bodies with a CCD threshold
    /// @param restless indices of the objects that are not at rest (WorldRest); null: any may be
    /// @return false, with nothing changed: no memory, or so few objects that the world's own function is as fast
    bool find(btCollisionWorld& world, btSimulationIslandManager& manager,
              const btAlignedObjectArray<btPersistentManifold*>& predictive, const Joints& joints,
              const Array<int>* restless);

    /// Whether neither the search for islands nor the solver would do anything if all bodies slept in the islands that they
    /// have: there is no joint, no predictive contact and no class of the application.
    static bool canKeep(const Step& step, const btAlignedObjectArray<btPersistentManifold*>& predictive);

    /// In place of find(), if canKeep() and they do: solve() will not call the solver.
    void keep();

    /// Lets custom profile functions be called on any thread. By default one thread solves all islands while there are
    /// some, since a profiler was written for Bullet's one thread.
    void setThreadSafeProfiler(bool isThreadSafe);

    /// Does the same as btDiscreteDynamicsWorld::solveConstraints(), bit for bit.
    ///
    /// @return false, with nothing changed: the world's own function must run
    bool solve(const Step& step);

    const WorldIslandsStats& stats() const;

private:
    struct Parts;

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
