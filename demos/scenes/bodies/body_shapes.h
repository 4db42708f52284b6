// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/mesh_hull.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btQuaternion.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The hull with Bullet's margin around it.
std::unique_ptr<btCollisionShape> makeHullShape(const HullPoints& hull);

/// Shapes of about one metre that bodies share.
class BodyShapes
{
public:
    void addHull(const HullPoints& hull);

    /// A cube with this edge.
    void addBox(btScalar edge);

    void addSphere(btScalar radius);

    std::size_t size() const noexcept { return m_shapes.size(); }
    btCollisionShape* at(std::size_t index) const { return m_shapes[index].get(); }

private:
    std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
};

/// A rotation drawn uniformly.
btQuaternion randomRotation(SplitMix64& random);

/// A direction drawn uniformly, times `length`.
btVector3 randomVector(SplitMix64& random, btScalar length);

/// A sphere of 80 triangles: an icosahedron whose faces are split in four, 42 vertices at `radius`.
HullPoints makeIcosphere(float radius);

struct Ring
{
    float height;  ///< of its plane, along the axis
    float radius;
};

/// Rings of points around axis 0 (x) or 1 (y).
HullPoints makeRings(const std::string& name, const std::vector<Ring>& rings, int axis, int perRing = 11);

/// `count` random hulls with `points` vertices each, on spheres of diameter 1; the same for the same seed.
std::vector<HullPoints> makeRandomHulls(std::size_t count, std::size_t points, std::uint64_t seed);
}  // namespace CULLET_PRECISION
}  // namespace cullet
