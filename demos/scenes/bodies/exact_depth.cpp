// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/exact_depth.h"

#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <optional>
#include <unordered_map>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d toDouble(const btVector3& v)
{
    return {double(v.x()), double(v.y()), double(v.z())};
}

/// A convex shape: a hull that a radius enlarges.
struct Core
{
    Hull<double> hull;
    double radius;
};

struct PlacedCore
{
    const Core& core;
    btTransform at;
};

Points cornersOf(const btBoxShape& box)
{
    const btVector3 half = box.getHalfExtentsWithMargin();
    Points corners;
    for (int i = 0; i < 8; ++i)
        corners.push_back(toDouble(half * btVector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    return corners;
}

Points pointsOf(const btConvexHullShape& hull)
{
    Points points;
    for (int i = 0; i < hull.getNumPoints(); ++i)
        points.push_back(toDouble(hull.getScaledPoint(i)));
    return points;
}

Points endsOf(const btCapsuleShape& capsule)
{
    btVector3 end(0, 0, 0);
    end[capsule.getUpAxis()] = capsule.getHalfHeight();
    return {toDouble(end), toDouble(-end)};
}

std::optional<Core> makeCore(const btConvexShape& shape)
{
    switch (shape.getShapeType())
    {
        case BOX_SHAPE_PROXYTYPE:
            return Core{makeHull(cornersOf(static_cast<const btBoxShape&>(shape))), 0};
        case CONVEX_HULL_SHAPE_PROXYTYPE:
            return Core{makeHull(pointsOf(static_cast<const btConvexHullShape&>(shape))),
                        double(shape.getMargin())};
        case CAPSULE_SHAPE_PROXYTYPE:
        {
            const auto& capsule = static_cast<const btCapsuleShape&>(shape);
            return Core{makeHull(endsOf(capsule)), double(capsule.getRadius())};
        }
        case SPHERE_SHAPE_PROXYTYPE:
            return Core{makeHull(Points{{0, 0, 0}}),
                        double(static_cast<const btSphereShape&>(shape).getRadius())};
        default:
            return std::nullopt;
    }
}

PosedHull<double> posed(const PlacedCore& placed)
{
    Eigen::Matrix3d basis;
    for (int row = 0; row < 3; ++row)
        basis.row(row) = toDouble(placed.at.getBasis()[row]);
    return PosedHull<double>(placed.core.hull, basis, toDouble(placed.at.getOrigin()));
}

/// How deep two cores overlap; not above 0 where they do not.
double depthOf(const PlacedCore& a, const PlacedCore& b)
{
    const double reach = a.core.radius + b.core.radius;
    const PosedHull<double> posedA = posed(a), posedB = posed(b);
    GjkCache<double> cache;
    const GjkResult<double> apart = gjkDistance(posedA, posedB, reach, cache);
    if (apart.state == GjkState::Near)
        return reach - apart.distance;
    if (apart.state != GjkState::Overlapping)
        return 0;
    const PenetrationResult<double> inside = penetration(posedA, posedB, cache);
    return inside.state == GjkState::Overlapping ? reach + inside.depth : reach;
}

class DepthSearch
{
public:
    /// @return the depth of the deepest parts; not above 0 if none overlap
    double depthOfPair(const btCollisionObject& a, const btCollisionObject& b)
    {
        m_depth = 0;
        compare(*a.getCollisionShape(), a.getWorldTransform(), *b.getCollisionShape(), b.getWorldTransform());
        return m_depth;
    }

private:
    void compare(const btCollisionShape& a, const btTransform& atA, const btCollisionShape& b,
                 const btTransform& atB)
    {
        if (b.isCompound() && !a.isCompound())
            return compare(b, atB, a, atA);
        if (a.isCompound())
        {
            const auto& compound = static_cast<const btCompoundShape&>(a);
            for (int i = 0; i < compound.getNumChildShapes(); ++i)
                compare(*compound.getChildShape(i), atA * compound.getChildTransform(i), b, atB);
            return;
        }
        if (a.isConcave() && b.isConvex())
            return compareTriangles(static_cast<const btConcaveShape&>(a), atA, b, atB);
        if (b.isConcave() && a.isConvex())
            return compareTriangles(static_cast<const btConcaveShape&>(b), atB, a, atA);
        if (a.isConvex() && b.isConvex())
            compareCores(coreOf(a), atA, coreOf(b), atB);
    }

    void compareCores(const Core* a, const btTransform& atA, const Core* b, const btTransform& atB)
    {
        if (a != nullptr && b != nullptr)
            m_depth = std::max(m_depth, depthOf({*a, atA}, {*b, atB}));
    }

    void compareTriangles(const btConcaveShape& mesh, const btTransform& atMesh,
                          const btCollisionShape& convex, const btTransform& atConvex)
    {
        // processAllTriangles() of a plane has triangles of the size of the box.
        const Core* const core = coreOf(convex);
        if (core == nullptr || mesh.getShapeType() == STATIC_PLANE_PROXYTYPE)
            return;
        struct Callback : btTriangleCallback
        {
            void processTriangle(btVector3* corners, int, int) override
            {
                const Core triangle{
                    makeHull(Points{toDouble(corners[0]), toDouble(corners[1]), toDouble(corners[2])}),
                    margin};
                search->compareCores(&triangle, *atMesh, convex, *atConvex);
            }
            DepthSearch* search;
            const Core* convex;
            const btTransform *atMesh, *atConvex;
            double margin;
        } callback;
        callback.search = this;
        callback.convex = core;
        callback.atMesh = &atMesh;
        callback.atConvex = &atConvex;
        callback.margin = double(mesh.getMargin());
        btVector3 min, max;
        convex.getAabb(atMesh.inverse() * atConvex, min, max);
        const btVector3 margin(mesh.getMargin(), mesh.getMargin(), mesh.getMargin());
        mesh.processAllTriangles(&callback, min - margin, max + margin);
    }

    /// Null for a shape of another class.
    const Core* coreOf(const btCollisionShape& shape)
    {
        const auto [known, isNew] = m_cores.try_emplace(&shape);
        if (isNew)
            known->second = makeCore(static_cast<const btConvexShape&>(shape));
        return known->second.has_value() ? &*known->second : nullptr;
    }

    std::unordered_map<const btCollisionShape*, std::optional<Core>> m_cores;
    double m_depth = 0;
};

bool collide(const btCollisionObject& a, const btCollisionObject& b)
{
    return a.hasContactResponse() && b.hasContactResponse() && a.checkCollideWith(&b) &&
           b.checkCollideWith(&a);
}
}  // namespace

std::vector<double> exactDepths(btCollisionWorld& world)
{
    DepthSearch search;
    std::vector<double> depths;
    const btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
    {
        const auto& a = *static_cast<const btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject);
        const auto& b = *static_cast<const btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject);
        const double depth = collide(a, b) ? search.depthOfPair(a, b) : 0;
        if (depth > 0)
            depths.push_back(depth);
    }
    return depths;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
