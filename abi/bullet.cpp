// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface for Bullet worlds.
#include "cullet/abi/status.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"

#include <algorithm>
#include <memory>

using namespace cullet;
using namespace cullet::abi;

struct cullet_broadphase
{
    Broadphase broadphase;
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
            const auto known = readOptions<sizeof(cullet_isa_gjk_options)>(options);
            IsaGjkOptions chosen;
            require(known.box_box >= 0 && known.box_box <= 2, CULLET_ERROR_ARGUMENT,
                    "box_box: 0 to 2 expected");
            chosen.boxPairs = static_cast<BoxPairs>(known.box_box);
            chosen.checkPoints = known.constant_points == 0;
            IsaGjkRegistration& made =
                registerIsaGjk(*static_cast<btCollisionDispatcher*>(dispatcher), chosen);
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
