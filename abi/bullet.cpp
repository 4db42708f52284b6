// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface for Bullet worlds.
#include "cullet/abi/status.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/solver.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>

using namespace cullet;
using namespace cullet::abi;

struct cullet_broadphase
{
    Broadphase broadphase;
};

struct cullet_solver
{
    Solver solver;
};

struct cullet_isa_gjk;

namespace
{
void requirePrecision(std::uint32_t scalarBytes)
{
    require(scalarBytes == 4 || scalarBytes == 8, CULLET_ERROR_ARGUMENT,
            "scalar_bytes: sizeof(btScalar) expected");
    require(scalarBytes == sizeof(btScalar), CULLET_ERROR_PRECISION,
            sizeof(btScalar) == 4 ? "a program in double precision needs libcullet-float64"
                                  : "a program in single precision needs libcullet");
}

BackendChoice choiceOf(std::int32_t backend)
{
    switch (backend)
    {
        case CULLET_BACKEND_AUTO:
            return BackendChoice::Auto;
        case CULLET_BACKEND_GRID:
            return BackendChoice::Grid;
        case CULLET_BACKEND_BRUTE:
            return BackendChoice::Brute;
        case CULLET_BACKEND_CUDA:
            return BackendChoice::Cuda;
        default:
            throw Failure{CULLET_ERROR_ARGUMENT, "backend: one of CULLET_BACKEND_* expected"};
    }
}

/// In the C interface 0 is the default and a negative margin is none; in Broadphase it is the other way round.
btScalar marginOf(double margin)
{
    require(margin == margin, CULLET_ERROR_ARGUMENT, "margin: NaN");
    return margin == 0 ? btScalar(-1) : btScalar(checkedMargin(std::max(margin, 0.0)));
}

BroadphaseOptions toOptions(const cullet_broadphase_options& requested)
{
    BroadphaseOptions options;
    options.backend = choiceOf(requested.backend);
    options.threads = checkedThreads(requested.threads);
    options.margin = marginOf(requested.margin);
    if (requested.device_bodies != 0)
        options.deviceBodies = requested.device_bodies;
    return options;
}

/// Takes a number above 0 that is one in btScalar too; 0 leaves the default.
void takePositive(double requested, const char* text, btScalar& option)
{
    if (requested == 0)
        return;
    const bool isInRange = requested > 0 && requested <= std::numeric_limits<btScalar>::max();
    option = isInRange ? static_cast<btScalar>(requested) : btScalar(0);
    require(option > 0, CULLET_ERROR_ARGUMENT, text);
}

IsaGjkOptions toOptions(const cullet_isa_gjk_options& requested)
{
    IsaGjkOptions options;
    require(requested.box_box >= 0 && requested.box_box <= 2, CULLET_ERROR_ARGUMENT,
            "box_box: 0 to 2 expected");
    require(requested.patch_points >= 0 && requested.patch_points <= 4, CULLET_ERROR_ARGUMENT,
            "patch_points: 0 to 4 expected");
    options.boxPairs = static_cast<BoxPairs>(requested.box_box);
    options.checkPoints = requested.constant_points == 0;
    options.meshes = requested.stock_meshes == 0;
    options.compounds = requested.stock_compounds == 0;
    options.activeEdges = requested.active_edges != 0;
    if (requested.patch_points != 0)
        options.patchPoints = requested.patch_points;
    takePositive(requested.reuse_distance, "reuse_distance: 0 or more expected", options.reusePose.distance);
    takePositive(requested.reuse_angle, "reuse_angle: 0 to 1 expected", options.reusePose.angle);
    require(options.reusePose.angle <= 1, CULLET_ERROR_ARGUMENT, "reuse_angle: 0 to 1 expected");
    return options;
}

SolverOptions toOptions(const cullet_solver_options& requested)
{
    SolverOptions options;
    require(requested.model == CULLET_SOLVER_BULLET || requested.model == CULLET_SOLVER_SOFT,
            CULLET_ERROR_ARGUMENT, "model: one of CULLET_SOLVER_* expected");
    require(requested.substeps >= 0 && requested.substeps <= 64, CULLET_ERROR_ARGUMENT,
            "substeps: 0 to 64 expected");
    if (requested.model == CULLET_SOLVER_SOFT)
        options.model = SolverModel::Soft;
    options.threads = checkedThreads(requested.threads);
    if (requested.substeps != 0)
        options.substeps = requested.substeps;
    takePositive(requested.contact_frequency, "contact_frequency: a finite number above 0 expected",
                 options.contactFrequency);
    takePositive(requested.contact_damping, "contact_damping: a finite number above 0 expected",
                 options.contactDamping);
    takePositive(requested.push_speed, "push_speed: a finite number above 0 expected", options.pushSpeed);
    return options;
}

/// The handle is the registration itself; it needs no other data.
const IsaGjkRegistration* registrationOf(const cullet_isa_gjk* handle)
{
    return reinterpret_cast<const IsaGjkRegistration*>(handle);
}
}  // namespace

cullet_status cullet_broadphase_create(uint32_t scalar_bytes, const cullet_broadphase_options* options,
                                       cullet_broadphase** broadphase)
{
    return guarded(
        [&]
        {
            requirePointer(broadphase, "broadphase is NULL");
            requirePrecision(scalar_bytes);
            const auto known = readOptions<sizeof(cullet_broadphase_options)>(options);
            *broadphase = new cullet_broadphase{Broadphase(toOptions(known))};
            return CULLET_OK;
        });
}

void* cullet_broadphase_interface(cullet_broadphase* broadphase)
{
    return broadphase == nullptr ? nullptr : static_cast<btBroadphaseInterface*>(&broadphase->broadphase);
}

cullet_status cullet_broadphase_get_stats(cullet_broadphase* broadphase, cullet_broadphase_stats* stats)
{
    return guarded(
        [&]
        {
            requirePointer(broadphase, "broadphase is NULL");
            requireResult<sizeof(cullet_broadphase_stats)>(stats);
            const BroadphaseStats now = broadphase->broadphase.stats();
            cullet_broadphase_stats known{};
            known.bodies = now.bodies;
            known.ghosts = now.ghosts;
            known.pairs = now.pairs;
            known.invalid_boxes = now.invalidBoxesTotal;
            known.updates = now.updatesTotal;
            known.fallbacks = now.fallbacksTotal;
            known.bytes = now.bytes;
            known.backend = now.backendName;
            writeResult(known, stats);
            return CULLET_OK;
        });
}

void cullet_broadphase_destroy(cullet_broadphase* broadphase)
{
    delete broadphase;
}

cullet_status cullet_isa_gjk_register(uint32_t scalar_bytes, void* dispatcher,
                                      const cullet_isa_gjk_options* options, cullet_isa_gjk** isa_gjk)
{
    return guarded(
        [&]
        {
            requirePointer(dispatcher, "dispatcher is NULL");
            requirePrecision(scalar_bytes);
            const auto known = readOptions<offsetof(cullet_isa_gjk_options, stock_meshes)>(options);
            IsaGjkRegistration& made =
                registerIsaGjk(*static_cast<btCollisionDispatcher*>(dispatcher), toOptions(known));
            if (isa_gjk != nullptr)
                *isa_gjk = reinterpret_cast<cullet_isa_gjk*>(&made);
            return CULLET_OK;
        });
}

cullet_status cullet_isa_gjk_get_stats(const cullet_isa_gjk* isa_gjk, cullet_isa_gjk_stats* stats)
{
    return guarded(
        [&]
        {
            requirePointer(isa_gjk, "isa_gjk is NULL");
            requireResult<sizeof(cullet_isa_gjk_stats)>(stats);
            const IsaGjkStats now = registrationOf(isa_gjk)->stats();
            cullet_isa_gjk_stats known{};
            known.separated = now.separatedTotal;
            known.touching = now.touchingTotal;
            known.depths = now.depthsTotal;
            known.not_converged = now.notConvergedTotal;
            known.delegated = now.delegatedTotal;
            writeResult(known, stats);
            return CULLET_OK;
        });
}

cullet_status cullet_solver_create(uint32_t scalar_bytes, const cullet_solver_options* options,
                                   cullet_solver** solver)
{
    return guarded(
        [&]
        {
            requirePointer(solver, "solver is NULL");
            requirePrecision(scalar_bytes);
            const auto known = readOptions<sizeof(cullet_solver_options)>(options);
            *solver = new cullet_solver{Solver(toOptions(known))};
            return CULLET_OK;
        });
}

void* cullet_solver_interface(cullet_solver* solver)
{
    return solver == nullptr ? nullptr : static_cast<btConstraintSolver*>(&solver->solver);
}

cullet_status cullet_solver_get_stats(cullet_solver* solver, cullet_solver_stats* stats)
{
    return guarded(
        [&]
        {
            requirePointer(solver, "solver is NULL");
            requireResult<sizeof(cullet_solver_stats)>(stats);
            const SolverStats& now = solver->solver.stats();
            cullet_solver_stats known{};
            known.refusal = static_cast<std::int32_t>(now.refusal);
            known.groups = now.groups;
            known.refused_groups = now.refusedGroups;
            known.contacts = now.contacts;
            known.joints = now.joints;
            known.serial_constraints = now.serialConstraints;
            writeResult(known, stats);
            return CULLET_OK;
        });
}

void cullet_solver_destroy(cullet_solver* solver)
{
    delete solver;
}
