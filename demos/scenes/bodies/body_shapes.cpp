// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/body_shapes.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
std::unique_ptr<btCollisionShape> makeHullShape(const HullPoints& hull)
{
    auto shape = std::make_unique<btConvexHullShape>();
    for (const Point& point : hull.points)
        shape->addPoint(btVector3(btScalar(point[0]), btScalar(point[1]), btScalar(point[2])), false);
    shape->recalcLocalAabb();
    return shape;
}

void BodyShapes::addHull(const HullPoints& hull)
{
    m_shapes.push_back(makeHullShape(hull));
}

void BodyShapes::addBox(btScalar edge)
{
    m_shapes.push_back(std::make_unique<btBoxShape>(btVector3(edge / 2, edge / 2, edge / 2)));
}

void BodyShapes::addSphere(btScalar radius)
{
    m_shapes.push_back(std::make_unique<btSphereShape>(radius));
}

btQuaternion randomRotation(SplitMix64& random)
{
    btQuaternion rotation;
    do
    {
        // In the order in which GCC evaluates arguments, which recorded hashes rely on.
        const float w = random.uniform(-1, 1), z = random.uniform(-1, 1);
        const float y = random.uniform(-1, 1), x = random.uniform(-1, 1);
        rotation = btQuaternion(btScalar(x), btScalar(y), btScalar(z), btScalar(w));
    } while (rotation.length2() > btScalar(1) || rotation.length2() < btScalar(0.01));
    return rotation.normalize();
}

btVector3 randomVector(SplitMix64& random, btScalar length)
{
    btVector3 vector(0, 0, 0);
    do
    {
        for (int axis = 0; axis < 3; ++axis)
            vector[axis] = btScalar(random.uniform(-1, 1));
    } while (vector.length2() > btScalar(1) || vector.length2() < btScalar(0.01));
    return vector.normalize() * length;
}

HullPoints makeIcosphere(float radius)
{
    const float golden = 0.5f * (1.0f + std::sqrt(5.0f));
    std::vector<Point> corners;
    for (const float a : {-1.0f, 1.0f})
    {
        for (const float b : {-golden, golden})
        {
            corners.push_back({0, a, b});
            corners.push_back({a, b, 0});
            corners.push_back({b, 0, a});
        }
    }
    HullPoints sphere;
    sphere.name = "icosphere";
    const auto addOnSphere = [&](const Point& p)
    {
        const float scale = radius / std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        sphere.points.push_back({p[0] * scale, p[1] * scale, p[2] * scale});
    };
    for (std::size_t i = 0; i < corners.size(); ++i)
    {
        addOnSphere(corners[i]);
        for (std::size_t j = 0; j < i; ++j)
        {
            const Point& p = corners[i];
            const Point& q = corners[j];
            const Point d = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
            // The edges of this icosahedron are 2 long; the next larger distance of vertices is 3.2.
            if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < 5.0f)
                addOnSphere({p[0] + q[0], p[1] + q[1], p[2] + q[2]});
        }
    }
    sphere.meshVertices = sphere.points.size();
    return sphere;
}

HullPoints makeRings(const std::string& name, const std::vector<Ring>& rings, int axis, int perRing)
{
    const float turn = 6.28318531f / static_cast<float>(perRing);
    HullPoints hull;
    hull.name = name;
    for (const Ring& ring : rings)
    {
        for (int i = 0; i < perRing; ++i)
        {
            const float angle = turn * static_cast<float>(i);
            const float across = ring.radius * std::cos(angle), up = ring.radius * std::sin(angle);
            hull.points.push_back(axis == 0 ? Point{ring.height, across, up}
                                            : Point{across, ring.height, up});
        }
    }
    hull.meshVertices = hull.points.size();
    return hull;
}

std::vector<HullPoints> makeRandomHulls(std::size_t count, std::size_t points, std::uint64_t seed)
{
    SplitMix64 random(seed);
    std::vector<HullPoints> hulls(count);
    for (HullPoints& hull : hulls)
    {
        hull.name = "random";
        hull.meshVertices = points;
        while (hull.points.size() < points)
        {
            const Point p = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
            const float squared = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            if (squared > 1.0f || squared < 0.01f)
                continue;
            const float scale = 0.5f / std::sqrt(squared);
            hull.points.push_back({p[0] * scale, p[1] * scale, p[2] * scale});
        }
    }
    return hulls;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
