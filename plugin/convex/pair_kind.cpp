// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/pair_kind.h"

#include "cullet/plugin/convex/box_box_algorithm.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionDispatch/btBox2dBox2dCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvex2dConvex2dAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btEmptyCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereBoxCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereTriangleCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
template <class... Classes, class Base>
bool isOneOf(const Base& object)
{
    return (isExactly<Classes>(object) || ...);
}

/// The dispatcher that created an algorithm, which Bullet shows to derived classes only.
struct Creator : btCollisionAlgorithm
{
    static const btDispatcher* of(const btCollisionAlgorithm& algorithm)
    {
        return algorithm.*(&Creator::m_dispatcher);
    }
};

/// Whether a mesh's triangles are read by Bullet's own functions, which write nothing.
bool hasKnownTriangles(const btTriangleMeshShape& mesh)
{
    return isOneOf<btTriangleIndexVertexArray, btTriangleMesh>(*mesh.getMeshInterface());
}

bool isKnownMesh(const btCollisionShape& shape)
{
    if (isExactly<btBvhTriangleMeshShape>(shape))
        return hasKnownTriangles(static_cast<const btBvhTriangleMeshShape&>(shape));
    if (!isExactly<btScaledBvhTriangleMeshShape>(shape))
        return isExactly<btHeightfieldTerrainShape>(shape);
    const btBvhTriangleMeshShape& child =
        *static_cast<const btScaledBvhTriangleMeshShape&>(shape).getChildShape();
    return isExactly<btBvhTriangleMeshShape>(child) && hasKnownTriangles(child);
}

int typeOf(const btCollisionObject& body)
{
    return body.getCollisionShape()->getShapeType();
}

/// Whether shapes of a known class, or triangles, may have this type.
bool isOfKnownShape(int shapeType)
{
    switch (shapeType)
    {
        case BOX_SHAPE_PROXYTYPE:
        case TRIANGLE_SHAPE_PROXYTYPE:
        case CONVEX_HULL_SHAPE_PROXYTYPE:
        case SPHERE_SHAPE_PROXYTYPE:
        case CAPSULE_SHAPE_PROXYTYPE:
        case CONE_SHAPE_PROXYTYPE:
        case CYLINDER_SHAPE_PROXYTYPE:
            return true;
        default:
            return false;
    }
}

bool isRound(int shapeType)
{
    return shapeType == SPHERE_SHAPE_PROXYTYPE || shapeType == CAPSULE_SHAPE_PROXYTYPE;
}
}  // namespace

bool hasCallbackOfChildren()
{
    return gCompoundChildShapePairCallback != nullptr || gCompoundCompoundChildShapePairCallback != nullptr;
}

PairKinds::Algorithm PairKinds::classOf(const btCollisionAlgorithm& algorithm)
{
    if (isExactly<IsaGjkAlgorithm>(algorithm))
        return Algorithm::IsaGjk;
    if (isOneOf<BoxBoxAlgorithm, btBoxBoxCollisionAlgorithm>(algorithm))
        return Algorithm::Boxes;
    if (isOneOf<btSphereSphereCollisionAlgorithm, btSphereBoxCollisionAlgorithm>(algorithm))
        return Algorithm::Spheres;
    if (isExactly<btConvexConvexAlgorithm>(algorithm))
        return Algorithm::Convex;
    if (isExactly<btConvexPlaneCollisionAlgorithm>(algorithm))
        return Algorithm::Plane;
    if (isExactly<btConvexConcaveCollisionAlgorithm>(algorithm) || IsaGjkRegistration::isOfMesh(algorithm))
        return Algorithm::Mesh;
    if (isOneOf<btCompoundCollisionAlgorithm, btCompoundCompoundCollisionAlgorithm>(algorithm) ||
        IsaGjkRegistration::isOfCompound(algorithm))
        return Algorithm::Compound;
    return isOneOf<btEmptyAlgorithm, btSphereTriangleCollisionAlgorithm, btConvex2dConvex2dAlgorithm,
                   btBox2dBox2dCollisionAlgorithm>(algorithm)
               ? Algorithm::InOrder
               : Algorithm::Unknown;
}

PairKinds::Shape PairKinds::classOf(const btCollisionShape& shape)
{
    if (isOneOf<btConvexHullShape, btBoxShape, btSphereShape, btCapsuleShape, btCylinderShape, btConeShape,
                btCapsuleShapeX, btCapsuleShapeZ, btCylinderShapeX, btCylinderShapeZ, btConeShapeX,
                btConeShapeZ>(shape))
        return Shape::Convex;
    if (isExactly<btStaticPlaneShape>(shape))
        return Shape::Plane;
    if (isExactly<btCompoundShape>(shape))
        return Shape::Compound;
    return isOneOf<btBvhTriangleMeshShape, btScaledBvhTriangleMeshShape, btHeightfieldTerrainShape>(shape)
               ? Shape::Mesh
               : Shape::Unknown;
}

PairKinds::Shape PairKinds::shapeOf(const btCollisionShape& shape)
{
    return m_shapes.kindOf(shape, [](const btCollisionShape& which) { return classOf(which); });
}

bool PairKinds::areConvex(const btCollisionObject& a, const btCollisionObject& b)
{
    return shapeOf(a) == Shape::Convex && shapeOf(b) == Shape::Convex;
}

PairKind PairKinds::kindOf(btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                           const btCollisionObject& b)
{
    const auto ofConvex = [&](PairKind kind) { return areConvex(a, b) ? kind : PairKind::InOrder; };
    switch (m_algorithms.kindOf(algorithm, [](const btCollisionAlgorithm& which) { return classOf(which); }))
    {
        case Algorithm::IsaGjk:
            return static_cast<const IsaGjkAlgorithm&>(algorithm).belongsTo(m_dispatcher)
                       ? ofConvex(PairKind::IsaGjk)
                       : PairKind::Unknown;
        case Algorithm::Boxes:
            return ofConvex(PairKind::Boxes);
        case Algorithm::Spheres:
            return ofConvex(PairKind::Round);
        case Algorithm::Convex:
            return roundOrOther(algorithm, a, b);
        case Algorithm::Plane:
            return (shapeOf(a) == Shape::Plane && shapeOf(b) == Shape::Convex) ||
                           (shapeOf(a) == Shape::Convex && shapeOf(b) == Shape::Plane)
                       ? PairKind::Plane
                       : PairKind::InOrder;
        case Algorithm::Mesh:
            return meshOrOther(algorithm, a, b);
        case Algorithm::Compound:
            return compoundOrOther(algorithm, a, b);
        case Algorithm::InOrder:
            return PairKind::InOrder;
        default:
            return PairKind::Unknown;
    }
}

/// Two round shapes have a closed form. Their manifold is created by the first call, which takes place in order.
PairKind PairKinds::roundOrOther(btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                                 const btCollisionObject& b)
{
    if (!isRound(typeOf(a)) || !isRound(typeOf(b)) || !areConvex(a, b))
        return PairKind::InOrder;
    m_manifolds.resizeNoInitialize(0);
    algorithm.getAllContactManifolds(m_manifolds);
    return m_manifolds.size() == 1 ? PairKind::Round : PairKind::InOrder;
}

PairKind PairKinds::meshOrOther(const btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                                const btCollisionObject& b)
{
    const bool isSwapped = shapeOf(a) == Shape::Mesh;
    const btCollisionObject &convex = isSwapped ? b : a, &mesh = isSwapped ? a : b;
    if (shapeOf(convex) != Shape::Convex || shapeOf(mesh) != Shape::Mesh ||
        !isKnownMesh(*mesh.getCollisionShape()) || Creator::of(algorithm) != &m_dispatcher)
        return parent();
    const btCollisionAlgorithmCreateFunc* child = m_createFuncs[typeOf(convex)][TRIANGLE_SHAPE_PROXYTYPE];
    const bool isKnownChild = child == m_isaGjk.contactPoints() ||
                              isExactly<btSphereTriangleCollisionAlgorithm::CreateFunc>(*child);
    return isKnownChild ? PairKind::Mesh : parent();
}

/// Bullet's algorithms of compounds, and cullet's, read bodies, shapes and trees. They write to themselves, to algorithms of children,
/// and to the manifolds of these.
PairKind PairKinds::compoundOrOther(const btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                                    const btCollisionObject& b)
{
    if (Creator::of(algorithm) != &m_dispatcher)
        return PairKind::Unknown;
    const bool isJob = children() == Children::Jobs && isKnownPart(*a.getCollisionShape()) &&
                       isKnownPart(*b.getCollisionShape());
    return isJob && (m_callbacksAreThreadSafe || !hasCallbackOfChildren()) ? PairKind::Compound : parent();
}

PairKind PairKinds::parent()
{
    if (hasCallbackOfChildren())
        return PairKind::Unknown;
    return children() == Children::Unknown ? PairKind::Unknown : PairKind::InOrder;
}

/// Whether all functions of a shape, and of its parts, are Bullet's and write nothing.
bool PairKinds::isKnownPart(const btCollisionShape& shape)
{
    switch (shapeOf(shape))
    {
        case Shape::Convex:
        case Shape::Plane:
            return true;
        case Shape::Mesh:
            return isKnownMesh(shape);
        case Shape::Compound:
            return isKnownCompound(static_cast<const btCompoundShape&>(shape));
        default:
            return false;
    }
}

bool PairKinds::isKnownCompound(const btCompoundShape& compound)
{
    if (!m_compounds)
        m_compounds.emplace();
    const auto address = reinterpret_cast<std::uintptr_t>(&compound);
    CompoundEntry& entry = (*m_compounds)[address * std::uint64_t(0x9e3779b97f4a7c15) >> 58];
    if (entry.shape == &compound)
        return entry.isKnown;
    bool isKnown = true;
    for (int i = 0; isKnown && i < compound.getNumChildShapes(); ++i)
        isKnown = isKnownPart(*compound.getChildShape(i));
    entry = {&compound, isKnown};
    return isKnown;
}

/// What the algorithms that compounds and meshes may create for their parts are.
PairKinds::Children PairKinds::children()
{
    if (m_children != Children::NotExamined)
        return m_children;
    m_children = Children::Jobs;
    const btCollisionAlgorithmCreateFunc* last = nullptr;
    for (int a = 0; a <= COMPOUND_SHAPE_PROXYTYPE; ++a)
    {
        for (int b = 0; b <= COMPOUND_SHAPE_PROXYTYPE; ++b)
        {
            // Neighbours in the table are often the same.
            const btCollisionAlgorithmCreateFunc* const create = m_createFuncs[a][b];
            if (create != last && !isKnown(*create))
                return m_children = Children::Unknown;
            last = create;
            if (!isJobOfChildren(a, b))
                m_children = Children::InOrder;
        }
    }
    return m_children;
}

bool PairKinds::isKnown(const btCollisionAlgorithmCreateFunc& create) const
{
    return &create == m_isaGjk.contactPoints() || &create == m_isaGjk.boxes() ||
           m_isaGjk.makesMeshes(&create) || m_isaGjk.makesCompounds(&create) ||
           isOneOf<btConvexConvexAlgorithm::CreateFunc, btConvexConcaveCollisionAlgorithm::CreateFunc,
                   btConvexConcaveCollisionAlgorithm::SwappedCreateFunc,
                   btCompoundCollisionAlgorithm::CreateFunc, btCompoundCollisionAlgorithm::SwappedCreateFunc,
                   btCompoundCompoundCollisionAlgorithm::CreateFunc, btEmptyAlgorithm::CreateFunc,
                   btSphereSphereCollisionAlgorithm::CreateFunc, btSphereBoxCollisionAlgorithm::CreateFunc,
                   btSphereTriangleCollisionAlgorithm::CreateFunc, btBoxBoxCollisionAlgorithm::CreateFunc,
                   btConvexPlaneCollisionAlgorithm::CreateFunc, btConvex2dConvex2dAlgorithm::CreateFunc,
                   btBox2dBox2dCollisionAlgorithm::CreateFunc>(create);
}

/// Whether Bullet's algorithm for two convex shapes, which counts its searches in global variables, serves no pair of known
/// shapes but those with a closed form.
bool PairKinds::isJobOfChildren(int a, int b) const
{
    return (isRound(a) && isRound(b)) || !isOfKnownShape(a) || !isOfKnownShape(b) ||
           !isExactly<btConvexConvexAlgorithm::CreateFunc>(*m_createFuncs[a][b]);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
