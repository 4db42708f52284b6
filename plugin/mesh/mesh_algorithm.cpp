// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_algorithm.h"

#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/triangle_pass.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <LinearMath/btQuickprof.h>

#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool hasKnownCore(const btConvexShape& shape)
{
    const ConvexKind kind = convexKindOf(shape);
    return kind != ConvexKind::Unsupported && kind != ConvexKind::Triangle &&
           (kind != ConvexKind::Support || canRunConcurrently(shape.getShapeType()) ||
            ConvexMeshHull::isPossible(shape));
}

/// The shape whose contacts are searched; null if out of memory.
const btCollisionShape* coreOf(const btCollisionShape& convex, MeshQuery& query)
{
    return ConvexMeshHull::isPossible(convex)
               ? query.convexMesh.hullOf(static_cast<const btConvexTriangleMeshShape&>(convex))
               : &convex;
}

/// Whether Bullet tests a convex shape and a triangle by separating axes.
bool usesSeparatingAxes(const btConvexShape& shape, const btDispatcherInfo& info)
{
    return info.m_enableSatConvex && shape.isPolyhedral() &&
           static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron() != nullptr;
}

btPersistentManifold* manifoldOf(btCollisionAlgorithm& algorithm)
{
    // Not on the heap: an allocator of the application may not be made for several threads.
    btPersistentManifold* room[1];
    btManifoldArray manifolds;
    manifolds.initializeFromBuffer(room, 0, 1);
    algorithm.getAllContactManifolds(manifolds);
    return manifolds.size() == 1 ? manifolds[0] : nullptr;
}
}  // namespace

MeshAlgorithm::MeshAlgorithm(IsaGjkRegistration& isaGjk, const btCollisionAlgorithmConstructionInfo& info,
                             const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                             bool isSwapped)
    : btConvexConcaveCollisionAlgorithm(info, a, b, isSwapped), m_isSwapped(isSwapped), m_isaGjk(isaGjk)
{
}

MeshAlgorithm::~MeshAlgorithm() = default;

/// Whether this class's loop gives what Bullet's would; the other shape may have become anything since the last call.
bool MeshAlgorithm::canAsk(const btCollisionShape& body, const btCollisionShape& mesh,
                           const btDispatcherInfo& info, const btManifoldResult& result) const
{
    if (!body.isConvex() || !mesh.isConcave())
        return false;
    const auto& convex = static_cast<const btConvexShape&>(body);
    return mesh.getShapeType() != SDF_SHAPE_PROXYTYPE && hasKnownCore(convex) &&
           !usesSeparatingAxes(convex, info) && isExactly<btManifoldResult>(result) &&
           result.m_closestPointDistanceThreshold == 0 && m_isaGjk.answersTriangles(convex.getShapeType()) &&
           m_isaGjk.stock().m_numPerturbationIterations == 0;
}

/// @return null if out of memory
MeshQuery* MeshAlgorithm::query()
{
    if (m_query)
        return m_query.get();
    btPersistentManifold* const manifold = manifoldOf(*this);
    if (manifold == nullptr)
        return nullptr;
    m_query.reset(new (std::nothrow) MeshQuery(*manifold));
    return m_query.get();
}

/// Keeps the contacts of the last call and refreshes the manifold, if they still hold.
///
/// @param query [in, out] without contacts that do not hold
/// @return whether they do
bool MeshAlgorithm::keepContacts(MeshQuery& query, const ContactCall& call)
{
    if (query.kept == nullptr)
        return false;
    KeptMeshContacts& kept = *query.kept;
    if (!call.mayKeep() || !kept.holdFor(call))
    {
        kept.forget();
        return false;
    }
    // If this fails, a hash of the triangles is stored next.
    if (!kept.haveTrianglesOf(static_cast<const btConcaveShape&>(*call.b.getCollisionShape())))
        return false;
    kept.renew(call);
    call.result.refreshContactPoints();
    m_isaGjk.counters().reused.add(1);
    return true;
}

/// Stores the contacts that a pass has found, to keep them.
void MeshAlgorithm::storeContacts(MeshQuery& query, const ContactCall& call, const TrianglePass& pass)
{
    if (query.kept != nullptr)
        query.kept->forget();
    if (!call.mayKeep() || call.manifold.getNumContacts() == 0)
        return;
    if (query.kept == nullptr)
        query.kept.reset(new (std::nothrow) KeptMeshContacts);
    if (query.kept == nullptr)
        return;
    query.kept->store(call);
    pass.storeTriangles(*query.kept);
}

void MeshAlgorithm::runBulletsLoop(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                   const btDispatcherInfo& info, btManifoldResult* result)
{
    if (m_query != nullptr && m_query->kept != nullptr)
        m_query->kept->forget();
    btConvexConcaveCollisionAlgorithm::processCollision(a, b, info, result);
}

void MeshAlgorithm::processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                     const btDispatcherInfo& info, btManifoldResult* result)
{
    process(*a, *b, info, nullptr, *result);
}

void MeshAlgorithm::processNear(MeshRegion& region, const btCollisionObjectWrapper& a,
                                const btCollisionObjectWrapper& b, const btDispatcherInfo& info,
                                btManifoldResult& result)
{
    process(a, b, info, &region, result);
}

/// @param region null: none
void MeshAlgorithm::process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                            const btDispatcherInfo& info, MeshRegion* region, btManifoldResult& result)
{
    const btCollisionObjectWrapper &convex = m_isSwapped ? b : a, &mesh = m_isSwapped ? a : b;
    MeshQuery* const asked =
        canAsk(*convex.getCollisionShape(), *mesh.getCollisionShape(), info, result) ? query() : nullptr;
    if (asked == nullptr)
        return runBulletsLoop(&a, &b, info, &result);
    BT_PROFILE("btConvexConcaveCollisionAlgorithm::processCollision");
    result.setPersistentManifold(&asked->manifold);
    asked->manifold.setBodies(convex.getCollisionObject(), mesh.getCollisionObject());
    const ContactCall call = {m_isaGjk, convex, mesh, info, result, asked->manifold, asked->hulls};
    if (keepContacts(*asked, call))
        return;
    const btCollisionShape* const core = coreOf(*convex.getCollisionShape(), *asked);
    if (core == nullptr)
        return runBulletsLoop(&a, &b, info, &result);
    TrianglePass pass(m_isaGjk, *asked, *core, convex, mesh, *m_dispatcher, info, result, region);
    if (!pass.isPossible())
        return runBulletsLoop(&a, &b, info, &result);
    // Of a pair that has hardly moved.
    if (asked->kept != nullptr && asked->kept->isStored())
        pass.hashTriangles();
    pass.run();
    storeContacts(*asked, call, pass);
    result.refreshContactPoints();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
