// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <vector>

namespace cullet::test
{
/// The core of a hull, a box or a triangle in double, from the points and the transform as Bullet rounded them.
class CoreOracle
{
public:
    CoreOracle(const btCollisionShape& shape, const btTransform& transform)
    {
        m_hull = makeHull(pointsOf(shape));
        for (int row = 0; row < 3; ++row)
        {
            for (int column = 0; column < 3; ++column)
                m_basis(row, column) = double(transform.getBasis()[row][column]);
            m_origin[row] = double(transform.getOrigin()[row]);
        }
    }
    PosedHull<double> posed() const { return {m_hull, m_basis, m_origin}; }

private:
    static Eigen::Vector3d product(const btVector3& p, const btVector3& scale)
    {
        return {double(p.x()) * double(scale.x()), double(p.y()) * double(scale.y()),
                double(p.z()) * double(scale.z())};
    }

    static std::vector<Eigen::Vector3d> pointsOf(const btCollisionShape& shape)
    {
        std::vector<Eigen::Vector3d> points;
        if (shape.getShapeType() == BOX_SHAPE_PROXYTYPE)
        {
            const btVector3& half = static_cast<const btBoxShape&>(shape).getImplicitShapeDimensions();
            for (int i = 0; i < 8; ++i)
                points.push_back(product(half, btVector3(btScalar(i & 1 ? 1 : -1), btScalar(i & 2 ? 1 : -1),
                                                         btScalar(i & 4 ? 1 : -1))));
            return points;
        }
        if (shape.getShapeType() == TRIANGLE_SHAPE_PROXYTYPE)
        {
            for (const btVector3& corner : static_cast<const btTriangleShape&>(shape).m_vertices1)
                points.push_back(product(corner, btVector3(1, 1, 1)));
            return points;
        }
        const auto& hull = static_cast<const btConvexHullShape&>(shape);
        for (int i = 0; i < hull.getNumPoints(); ++i)
            points.push_back(product(hull.getUnscaledPoints()[i], hull.getLocalScalingNV()));
        return points;
    }

    Hull<double> m_hull;
    Eigen::Matrix3d m_basis;
    Eigen::Vector3d m_origin;
};
}  // namespace cullet::test
