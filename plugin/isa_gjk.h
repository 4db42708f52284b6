// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/core/isa_gjk_options.h"
#include "cullet/plugin/shapes/hull_preparation.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Lets ISA-GJK find the contacts of convex pairs. Call once after the dispatcher is created, before bodies are added.
///
/// Fills both tables of the dispatcher, for both orders of every pair of convex types, except pairs for which Bullet
/// has a closed form: sphere-sphere, sphere-triangle, capsule-capsule, capsule-sphere, and the two-dimensional types.
/// Two boxes have an algorithm of their own (IsaGjkOptions::boxPairs) in the table of contact points, and so have compounds
/// (IsaGjkOptions::compounds). Children of compounds and triangles of meshes are handled like any other pair.
///
/// For pairs of polytopes (hull, box, triangle, capsule, sphere) each query makes a patch of up to four contact points.
/// With any other shape, ISA-GJK only decides whether a pair is too far apart for contacts, and Bullet's own algorithm
/// makes the contacts.
///
/// @return counters and options; lives as long as the process. Registering again for a dispatcher at the same address
///         returns the same object with counters at zero; pairs that the options now exclude are Bullet's again.
/// Errors: std::bad_alloc.
CULLET_API IsaGjkRegistration& registerIsaGjk(btCollisionDispatcher& dispatcher, IsaGjkOptions options = {});
}  // namespace CULLET_PRECISION
}  // namespace cullet
