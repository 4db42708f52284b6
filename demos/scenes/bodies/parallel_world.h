// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world.h"

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
template <class Solver>
std::unique_ptr<btConstraintSolver> makeSolver()
{
    return std::make_unique<Solver>();
}

/// Makes a World<Base> of a number of threads, whose zones PhaseClock may measure.
///
/// @tparam Solver the class of the solver, if Base requires one
template <class Base, class Solver = btConstraintSolver>
std::unique_ptr<btDiscreteDynamicsWorld> makeParallelWorld(btDispatcher& dispatcher,
                                                           btBroadphaseInterface& broadphase,
                                                           btConstraintSolver& solver,
                                                           btCollisionConfiguration& configuration,
                                                           int threads)
{
    auto world = std::make_unique<World<Base>>(&dispatcher, &broadphase, static_cast<Solver*>(&solver),
                                               &configuration);
    world->setUpdateThreads(threads);
    world->setThreadSafeProfiler(true);
    return world;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
