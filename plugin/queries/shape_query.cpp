// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/shape_query.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/queries/mesh_ray.h"
#include "cullet/plugin/queries/mesh_registry.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btCollisionObjectWrapper wrapOf(const ShapeOfObject& tested)
{
    return {nullptr, tested.shape, tested.object, tested.at, -1, tested.child};
}

/// Whether Bullet's loop over the parts of a shape is done here.
bool mayHavePreparedParts(const btCollisionShape& shape)
{
    return shape.getShapeType() == COMPOUND_SHAPE_PROXYTYPE && !MeshRegistry::shared().isEmpty() &&
           isExactly<btCompoundShape>(shape);
}

template <class Callback>
struct HitOf;
template <>
struct HitOf<btCollisionWorld::RayResultCallback>
{
    using Type = btCollisionWorld::LocalRayResult;
};
template <>
struct HitOf<btCollisionWorld::ConvexResultCallback>
{
    using Type = btCollisionWorld::LocalConvexResult;
};

/// Passes hits of a part on to the application's callback. As Bullet does, it names the part where a shape has no triangles,
/// and asks for hits before the callback's closest one.
///
/// @tparam Callback btCollisionWorld::RayResultCallback or ConvexResultCallback
template <class Callback>
class PartCallback final : public Callback
{
public:
    PartCallback(int part, Callback& callback) : m_part(part), m_callback(callback)
    {
        this->m_closestHitFraction = callback.m_closestHitFraction;
    }

    bool needsCollision(btBroadphaseProxy* proxy) const override { return m_callback.needsCollision(proxy); }

    btScalar addSingleResult(typename HitOf<Callback>::Type& hit, bool isNormalInWorld) override
    {
        btCollisionWorld::LocalShapeInfo info;
        info.m_shapePart = -1;
        info.m_triangleIndex = m_part;
        if (hit.m_localShapeInfo == nullptr)
            hit.m_localShapeInfo = &info;
        const btScalar result = m_callback.addSingleResult(hit, isNormalInWorld);
        this->m_closestHitFraction = m_callback.m_closestHitFraction;
        return result;
    }

private:
    int m_part;
    Callback& m_callback;
};

/// Calls test(part) for the parts of a compound that a tree finds, or for all.
template <class Test>
class PartVisitor final : public btDbvt::ICollide
{
public:
    PartVisitor(const ShapeOfObject& whole, const Test& test)
        : m_whole(whole), m_compound(static_cast<const btCompoundShape&>(*whole.shape)), m_test(test)
    {
    }

    void visit(int part) const
    {
        const btTransform at = m_whole.at * m_compound.getChildTransform(part);
        m_test(ShapeOfObject{m_whole.object, m_compound.getChildShape(part), at, part});
    }

    void Process(const btDbvtNode* leaf) override { visit(leaf->dataAsInt); }

    void visitAll() const
    {
        for (int part = 0; part < m_compound.getNumChildShapes(); ++part)
            visit(part);
    }

    const btDbvt* tree() const { return m_compound.getDynamicAabbTree(); }

private:
    const ShapeOfObject& m_whole;
    const btCompoundShape& m_compound;
    const Test& m_test;
};
}  // namespace

void testRay(const btTransform& from, const btTransform& to, const ShapeOfObject& tested, HitsWanted wanted,
             btCollisionWorld::RayResultCallback& callback)
{
    const MeshTarget target = meshTargetOf(*tested.shape);
    if (target.mesh != nullptr &&
        testMeshRay(from.getOrigin(), to.getOrigin(), tested, target, wanted, callback))
        return;
    if (!mayHavePreparedParts(*tested.shape))
    {
        const btCollisionObjectWrapper wrap = wrapOf(tested);
        return btCollisionWorld::rayTestSingleInternal(from, to, &wrap, callback);
    }
    const auto testPart = [&](const ShapeOfObject& part)
    {
        PartCallback<btCollisionWorld::RayResultCallback> ofPart(part.child, callback);
        ofPart.m_flags = callback.m_flags;
        testRay(from, to, part, wanted, ofPart);
    };
    PartVisitor<decltype(testPart)> parts(tested, testPart);
    if (parts.tree() == nullptr)
        return parts.visitAll();
    btDbvt::rayTest(parts.tree()->m_root, tested.at.inverseTimes(from).getOrigin(),
                    tested.at.inverseTimes(to).getOrigin(), parts);
}

void sweepConvex(const ConvexSweep& sweep, const ShapeOfObject& tested, HitsWanted wanted,
                 btCollisionWorld::ConvexResultCallback& callback)
{
    const MeshTarget target = meshTargetOf(*tested.shape);
    if (target.mesh != nullptr && sweepMesh(sweep, tested, target, wanted, callback))
        return;
    if (!mayHavePreparedParts(*tested.shape))
    {
        const btCollisionObjectWrapper wrap = wrapOf(tested);
        return btCollisionWorld::objectQuerySingleInternal(sweep.shape, *sweep.from, *sweep.to, &wrap,
                                                           callback, sweep.allowedPenetration);
    }
    const auto sweepPart = [&](const ShapeOfObject& part)
    {
        PartCallback<btCollisionWorld::ConvexResultCallback> ofPart(part.child, callback);
        sweepConvex(sweep, part, wanted, ofPart);
    };
    PartVisitor<decltype(sweepPart)> parts(tested, sweepPart);
    if (parts.tree() == nullptr)
        return parts.visitAll();
    btVector3 low, high, endLow, endHigh;
    const btTransform toCompound = tested.at.inverse();
    sweep.shape->getAabb(toCompound * *sweep.from, low, high);
    sweep.shape->getAabb(toCompound * *sweep.to, endLow, endHigh);
    low.setMin(endLow);
    high.setMax(endHigh);
    parts.tree()->collideTV(parts.tree()->m_root, btDbvtVolume::FromMM(low, high), parts);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
