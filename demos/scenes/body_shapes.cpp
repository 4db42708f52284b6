// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/body_shapes.h"

#include "demos/scenes/splitmix64.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void BodyShapes::addHull(const HullPoints& hull)
{
    auto shape = std::make_unique<btConvexHullShape>();
    for (const Point& point : hull.points)
        shape->addPoint(btVector3(btScalar(point[0]), btScalar(point[1]), btScalar(point[2])), false);
    shape->recalcLocalAabb();
    m_shapes.push_back(std::move(shape));
}

void BodyShapes::addBox(btScalar edge)
{
    m_shapes.push_back(std::make_unique<btBoxShape>(btVector3(edge / 2, edge / 2, edge / 2)));
}

void BodyShapes::addSphere(btScalar radius)
{
    m_shapes.push_back(std::make_unique<btSphereShape>(radius));
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
