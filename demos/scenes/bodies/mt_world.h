// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether the Bullet library has threads: it was built with BT_THREADSAFE, see CULLET_THREADSAFE_BULLET.
bool isBulletThreadSafe();

/// btCollisionDispatcherMt.
///
/// @param threads at most 64; 0: as many as Bullet's scheduler has
/// @throws ProgramError (kExitUnavailable) unless isBulletThreadSafe()
std::unique_ptr<btCollisionDispatcher> makeMtDispatcher(btCollisionConfiguration& configuration, int threads);

/// btDiscreteDynamicsWorldMt with a pool of solvers, and btSequentialImpulseConstraintSolverMt for large islands, as Bullet's own
/// examples make it. Bullet has one scheduler per process, whose number of threads each step sets to `threads` of its
/// WorldSceneOptions.
const WorldKind& mtWorld();
}  // namespace CULLET_PRECISION
}  // namespace cullet
