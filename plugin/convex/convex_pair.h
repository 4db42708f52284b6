// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/narrow/math/lanes.h"
#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/plugin/shapes/hull_cache.h"
#include "cullet/plugin/shapes/separating_axis.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>

#include <array>
#include <cstdint>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
inline btScalar marginOf(const btConvexShape& shape, ConvexKind kind)
{
    if (kind == ConvexKind::Hull)
        return static_cast<const btConvexInternalShape&>(shape).getMarginNV();
    if (kind == ConvexKind::Box)
        return boxMargin(static_cast<const btBoxShape&>(shape));
    return shape.getMarginNonVirtual();
}

/// One of the two shapes of a call.
struct ConvexSide
{
    ConvexSide(const btCollisionShape& collisionShape, const btTransform& where)
        : shape(static_cast<const btConvexShape&>(collisionShape)),
          transform(where),
          kind(convexKindOf(shape)),
          margin(kind == ConvexKind::Unsupported ? btScalar(0) : marginOf(shape, kind))
    {
    }

    bool isRound() const { return kind == ConvexKind::Sphere || kind == ConvexKind::Capsule; }
    bool isThinBox() const
    {
        return kind == ConvexKind::Box && isThinnerThanMargin(static_cast<const btBoxShape&>(shape));
    }

    /// Bullet's faces, if the application had them computed; else null.
    const btConvexPolyhedron* features() const
    {
        return shape.isPolyhedral() ? static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron()
                                    : nullptr;
    }

    bool isFinite() const
    {
        const btMatrix3x3& basis = transform.getBasis();
        Components sum, row;
        read(transform.getOrigin(), sum);
        for (int i = 0; i < 3; ++i)
        {
            read(basis[i], row);
            sum += row;
        }
        // Infinities and NaN become NaN; the fourth component is unused.
        return (quadBits<btScalar>(sum - sum == Components{}) & 7u) == 7u;
    }

    /// False for a hull shape without points or with a point that is not finite, and for a triangle with such a corner.
    bool hasPoints() const
    {
        if (kind == ConvexKind::Triangle)
            return hasFiniteCorners(static_cast<const btTriangleShape&>(shape));
        if (kind != ConvexKind::Hull)
            return true;
        const auto& hull = static_cast<const btConvexHullShape&>(shape);
        for (int i = 0; i < hull.getNumPoints(); ++i)
        {
            if (!toEigen(hull.getUnscaledPoints()[i]).allFinite())
                return false;
        }
        return hull.getNumPoints() > 0;
    }

    const btConvexShape& shape;
    const btTransform& transform;
    ConvexKind kind;
    btScalar margin;
};

/// Both shapes of a call and their transforms.
struct ConvexPair
{
    ConvexPair(const btCollisionObjectWrapper& bodyA, const btCollisionObjectWrapper& bodyB)
        : a(*bodyA.getCollisionShape(), bodyA.getWorldTransform()),
          b(*bodyB.getCollisionShape(), bodyB.getWorldTransform()),
          wrapA(&bodyA),
          wrapB(&bodyB)
    {
    }
    ConvexPair(const btCollisionObject& objectA, const btCollisionObject& objectB)
        : a(*objectA.getCollisionShape(), objectA.getWorldTransform()),
          b(*objectB.getCollisionShape(), objectB.getWorldTransform())
    {
    }
    ConvexPair(const ConvexSide& sideA, const ConvexSide& sideB) : a(sideA), b(sideB) {}

    btScalar margins() const { return a.margin + b.margin; }
    /// Two bodies share one hull shape, so its points must be compared with the cached ones only once.
    bool sharesHullShape() const { return &a.shape == &b.shape && a.kind == ConvexKind::Hull; }
    /// A body may have got any other shape since its pairs were created.
    bool isConvex() const { return a.shape.isConvex() && b.shape.isConvex(); }
    /// Pairs for Bullet's algorithm: unsupported shapes, and two round ones, for which Bullet has a closed form. Beside a
    /// shape whose contacts are Bullet's, a thin box is what Bullet takes it for: with the core of cullet, a pair would be
    /// apart or touch depending on which of the two was asked.
    bool isLeftToBullet() const
    {
        return a.kind == ConvexKind::Unsupported || b.kind == ConvexKind::Unsupported ||
               (a.isRound() && b.isRound()) || (a.kind == ConvexKind::Support && b.isThinBox()) ||
               (b.kind == ConvexKind::Support && a.isThinBox());
    }

    ConvexSide a, b;
    const btCollisionObjectWrapper* wrapA = nullptr;
    const btCollisionObjectWrapper* wrapB = nullptr;
};

/// Hulls whose points this call has already compared with those of their shapes; null if it has not.
using KnownHulls = std::array<const Hull<btScalar>*, 2>;

/// Both cores in world space; empty if a side is no polytope, or has no valid core.
struct ConvexCores
{
    ConvexCores(const ConvexPair& pair, const KnownHulls& known, HullUse (&hulls)[2], std::uint64_t pass)
        : a(poseSide(pair.a, known[0], hulls[0], pass)),
          b(poseSide(pair.b, a && pair.sharesHullShape() ? &a->hull() : known[1], hulls[1], pass))
    {
        if (pair.a.kind == ConvexKind::Triangle || pair.b.kind == ConvexKind::Triangle)
            placeFromAnchor(pair);
    }

    /// @param core of A; B follows
    explicit ConvexCores(const std::optional<PosedShape>& core) : a(core) {}

    /// False if the core of a polytope is missing.
    bool haveCores(const ConvexPair& pair) const
    {
        return (a || !isPolytope(pair.a.kind)) && (b || !isPolytope(pair.b.kind));
    }

    /// Whether a hull has points only, and no graph.
    bool hasCloud() const { return isCloud(a) || isCloud(b); }

    /// Whether buildGraphs() may build any.
    bool mayBuildGraphs(const ConvexPair& pair, const HullUse (&hulls)[2]) const
    {
        return (isCloud(a) && hulls[0].mayBuild(a->hull())) ||
               (isCloud(b) && hulls[pair.sharesHullShape() ? 0 : 1].mayBuild(b->hull()));
    }

    void forgetFans()
    {
        fanA.reset();
        fanB.reset();
    }

    /// Builds the faces of hulls, which some contacts need; see HullCache::graphOf().
    ///
    /// @return false if out of memory
    bool buildGraphs(const ConvexPair& pair, HullUse (&hulls)[2], std::uint64_t pass)
    {
        forgetFans();
        return buildGraph(pair.a, hulls[0], pass, a) &&
               buildGraph(pair.b, hulls[pair.sharesHullShape() ? 0 : 1], pass, b);
    }

    /// Finds the faces at the support vertices of hulls without a graph.
    ///
    /// @param normal from B to A
    /// @return false if a graph is necessary
    bool findFans(const Eigen::Vector3d& normal, std::int32_t vertexA, std::int32_t vertexB)
    {
        return findFan(*a, -normal, vertexA, fanA) && findFan(*b, normal, vertexB, fanB);
    }

    std::optional<PosedShape> a, b;
    std::optional<VertexFan<btScalar>> fanA, fanB;
    /// Point in world space to which both origins are relative.
    Eigen::Vector3d anchor = Eigen::Vector3d::Zero();

private:
    /// The origin of a triangle's core is its first corner. Far from the world's origin, rounding of the corner
    /// exceeds what a contact tolerates, unless the corner is relative to the other shape. The remaining rounding
    /// error is subtracted from the other core's origin.
    void placeFromAnchor(const ConvexPair& pair)
    {
        const bool isB = pair.b.kind == ConvexKind::Triangle;
        const ConvexSide &triangle = isB ? pair.b : pair.a, &other = isB ? pair.a : pair.b;
        std::optional<PosedShape>&core = isB ? b : a, &otherCore = isB ? a : b;
        if (!core)
            return;
        anchor = toEigen(other.transform.getOrigin()).cast<double>();
        const Eigen::Vector3d offset =
            offsetToOrigin(anchor, triangle.shape, triangle.kind, triangle.transform);
        core->moveTo(offset);
        const Eigen::Vector3d rest = offset - core->origin();
        if (otherCore)
            otherCore->moveTo(offsetToOrigin(anchor, other.shape, other.kind, other.transform) - rest);
        anchor += rest;
    }

    static bool isCloud(const std::optional<PosedShape>& core)
    {
        return core && core->hull().kind() == HullKind::Cloud;
    }

    static bool findFan(const PosedShape& posed, const Eigen::Vector3d& outward, std::int32_t vertex,
                        std::optional<VertexFan<btScalar>>& fan)
    {
        if (posed.hull().kind() != HullKind::Cloud)
            return true;
        fan.emplace(posed.hull(), vertex, posed.basis().transpose() * outward);
        return fan->isKnown();
    }

    static bool buildGraph(const ConvexSide& side, HullUse& use, std::uint64_t pass,
                           std::optional<PosedShape>& posed)
    {
        if (!isCloud(posed))
            return true;
        const Hull<btScalar>* graph = use.graphOf(static_cast<const btConvexHullShape&>(side.shape), pass);
        if (graph == nullptr)
            return false;
        const Eigen::Vector3d place = posed->origin();
        posed.emplace(poseHull(*graph, side.shape, side.transform));
        posed->moveTo(place);
        return true;
    }

    static std::optional<PosedShape> poseSide(const ConvexSide& side, const Hull<btScalar>* known,
                                              HullUse& use, std::uint64_t pass)
    {
        if (known != nullptr && side.kind == ConvexKind::Hull)
            return poseHull(*known, side.shape, side.transform);
        return poseShape(side.shape, side.kind, side.transform, use, pass);
    }
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
