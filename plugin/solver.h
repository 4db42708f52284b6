// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/solver/solver_options.h"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct SolverTasks;

/// Why Bullet's solver solved a group, or an island of it.
enum class SolverRefusal : std::uint8_t
{
    No,           ///< it did not
    RandomOrder,  ///< SOLVER_RANDMIZE_ORDER
    ForeignRows,  ///< row functions of the application (setConstraintRowSolverGeneric())
    ForeignJoint,  ///< a joint of a class of the application, or one that solves itself (solveConstraintObsolete())
    NoMemory  ///< no memory for the rows
};

/// Counters of the last solveGroup() or, in a World, the last step.
struct SolverStats
{
    SolverRefusal refusal = SolverRefusal::No;  ///< of the last group that was refused
    /// Islands, or several small ones together; each island of a group that needs Bullet's solver counts, and the others as one.
    std::uint32_t groups = 0;
    std::uint32_t refusedGroups = 0;  ///< those that Bullet's solver solved
    std::uint32_t contacts = 0;       ///< manifolds with points, of the groups that were not refused
    std::uint32_t joints = 0;         ///< enabled joints with rows
    std::uint32_t serialConstraints =
        0;  ///< contacts and joints of a body with more than 64 of them, beyond the first 64: they take one thread
};

/// The functions of Solver. Its objects have the size of Bullet's class, and a derived class keeps their state.
class CULLET_API SolverWithoutState : public btSequentialImpulseConstraintSolver
{
public:
    struct Parts;

    btScalar solveGroup(btCollisionObject** bodies, int bodyCount, btPersistentManifold** manifolds,
                        int manifoldCount, btTypedConstraint** joints, int jointCount,
                        const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                        btDispatcher* dispatcher) override;

    /// Solves all groups of a step. For World.
    void solveTasks(const SolverTasks& tasks);

    /// Whether solveTasks() does what solveGroup() does, which a class of the application may have replaced.
    virtual bool takesTasks() const = 0;

    /// The options, with numbers out of range replaced.
    const SolverOptions& options() const;
    const SolverStats& stats() const;
    static const SolverStats& statsOf(const Parts& parts);

protected:
    /// The state of a solver, which may not be constructed yet.
    static std::shared_ptr<Parts> makeParts(btSequentialImpulseConstraintSolver& solver,
                                            const SolverOptions& options);

    virtual Parts& parts() const = 0;
};

/// Bullet's sequential impulse solver in SIMD registers and on all cores: `cullet::Solver solver;` instead of
/// `btSequentialImpulseConstraintSolver solver;`.
///
/// Contacts and joints are divided into colours: no two of a colour move the same body. Those of a colour are solved
/// eight at a time, and on several threads if they are many. Within a World<Base>, small islands are solved on
/// different threads too. Velocities and places after a step depend on the bodies, manifolds and joints of an island and
/// their order only: not on other islands, the number of threads or the instruction set. With a threshold of the residual, the
/// iterations of a group (m_minimumSolverBatchSize) end together.
///
/// Rows are those of btSequentialImpulseConstraintSolver 3.24, and so are their parameters in btContactSolverInfo, flags of
/// points and bodies, feedback and breaking of joints, and impulses of points. What differs: the order of the rows, that an
/// iteration goes over the points of a manifold twice, and that SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS puts
/// friction after the normals of a manifold, not of a point. What SolverRefusal names is left to Bullet's solver, whose results
/// depend on the order of manifolds.
///
/// SolverModel::Soft solves contacts as springs in substeps, with two directions of friction, and then takes the velocity
/// away that overlap caused (Catto, "Solver2D", 2024). m_erp2, m_globalCfm of contacts, m_sor, split impulse, the
/// warm-starting factor and the threshold of the residual do not concern it: one warning names what a world sets of
/// them. Contacts with a stiffness, damping, softness or anchor of their own are solved as with SolverModel::Bullet,
/// together with the rest of their island.
///
/// Threads: one step of one world at a time, as with Bullet's solver. Joints of Bullet's classes may be called on any thread.
/// Errors: none of its own; without memory for its rows, Bullet's solver solves what is left of the group.
class CULLET_API Solver : public SolverWithoutState
{
public:
    explicit Solver(const SolverOptions& options = {});
    ~Solver() override;
    Solver(const Solver&) = delete;
    Solver& operator=(const Solver&) = delete;

    bool takesTasks() const override;

private:
    Parts& parts() const override;

    std::shared_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
