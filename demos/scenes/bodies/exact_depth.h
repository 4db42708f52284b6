// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How deep objects of a world overlap, by their shapes instead of contact points: a depth for each pair of the pair cache
/// that overlaps, that of its deepest parts, metres, in the order of the pairs.
///
/// Boxes have sharp corners; hulls, triangles, capsules and spheres are rounded by their margins, as contacts take them. A
/// triangle is as deep as it has to move in any direction. Left out are parts of other classes (cylinders, cones, planes)
/// and objects that do not collide or do not respond.
///
/// Cost: some microseconds for each pair of the cache, and for each triangle in the box of a body.
std::vector<double> exactDepths(btCollisionWorld& world);
}  // namespace CULLET_PRECISION
}  // namespace cullet
