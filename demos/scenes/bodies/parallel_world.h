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
/// Makes a world of class Base whose boxes are updated by a number of threads.
template <class Base>
std::unique_ptr<btDiscreteDynamicsWorld> makeParallelWorld(btDispatcher& dispatcher,
                                                           btBroadphaseInterface& broadphase,
                                                           btConstraintSolver& solver,
                                                           btCollisionConfiguration& configuration,
                                                           int threads)
{
    auto world = std::make_unique<World<Base>>(&dispatcher, &broadphase, &solver, &configuration);
    world->setUpdateThreads(threads);
    return world;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
