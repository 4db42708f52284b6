// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

namespace cullet::test
{
namespace
{
btPersistentManifold& manifoldOf(btCollisionAlgorithm& algorithm)
{
    btManifoldArray manifolds;
    algorithm.getAllContactManifolds(manifolds);
    return *manifolds[0];
}

struct AskForEach final : btTriangleCallback
{
    void processTriangle(btVector3* corners, int part, int index) override
    {
        if (!TestTriangleAgainstAabb2(corners, low, high))
            return;
        btTriangleShape shape(corners[0], corners[1], corners[2]);
        shape.setMargin(margin);
        const btCollisionObjectWrapper wrap(mesh, &shape, mesh->getCollisionObject(),
                                            mesh->getWorldTransform(), part, index);
        btCollisionAlgorithm* const algorithm =
            dispatcher->findAlgorithm(convex, &wrap, manifold, BT_CONTACT_POINT_ALGORITHMS);
        const bool isFirst = result->getBody0Internal() == mesh->getCollisionObject();
        if (isFirst)
        {
            result->setBody0Wrap(&wrap);
            result->setShapeIdentifiersA(part, index);
        }
        else
        {
            result->setBody1Wrap(&wrap);
            result->setShapeIdentifiersB(part, index);
        }
        algorithm->processCollision(convex, &wrap, *info, result);
        if (isFirst)
            result->setBody0Wrap(mesh);
        else
            result->setBody1Wrap(mesh);
        algorithm->~btCollisionAlgorithm();
        dispatcher->freeCollisionAlgorithm(algorithm);
    }

    btVector3 low, high;
    btScalar margin;
    const btCollisionObjectWrapper *convex, *mesh;
    const btDispatcherInfo* info;
    btManifoldResult* result;
    btPersistentManifold* manifold;
    btDispatcher* dispatcher;
};
}  // namespace

PlainLoop::PlainLoop(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                     const btCollisionObjectWrapper* b, bool isSwapped)
    : btConvexConcaveCollisionAlgorithm(info, a, b, isSwapped), m_isSwapped(isSwapped)
{
}

void PlainLoop::processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                 const btDispatcherInfo& info, btManifoldResult* result)
{
    AskForEach each;
    each.convex = m_isSwapped ? b : a;
    each.mesh = m_isSwapped ? a : b;
    each.info = &info;
    each.result = result;
    each.manifold = &manifoldOf(*this);
    each.dispatcher = m_dispatcher;
    result->setPersistentManifold(each.manifold);
    const auto& mesh = static_cast<const btConcaveShape&>(*each.mesh->getCollisionShape());
    each.margin = mesh.getMargin();
    const btTransform inMesh = each.mesh->getWorldTransform().inverse() * each.convex->getWorldTransform();
    each.convex->getCollisionShape()->getAabb(inMesh, each.low, each.high);
    const btVector3 margin(each.margin, each.margin, each.margin);
    each.low -= margin;
    each.high += margin;
    mesh.processAllTriangles(&each, each.low, each.high);
    result->refreshContactPoints();
}

MeshBench::MeshBench(Loop loop, btCollisionShape& convex, btCollisionShape& mesh, bool isMeshFirst,
                     const IsaGjkOptions& options)
    : m_isaGjk(loop == Loop::Stock ? nullptr : &registerIsaGjk(m_dispatcher, options)),
      m_isMeshFirst(isMeshFirst)
{
    m_convex.setCollisionShape(&convex);
    m_mesh.setCollisionShape(&mesh);
    const btCollisionObject &a = isMeshFirst ? m_mesh : m_convex, &b = isMeshFirst ? m_convex : m_mesh;
    const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1),
        wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
    if (loop != Loop::Plain)
    {
        m_algorithm = m_dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        return;
    }
    const btCollisionAlgorithmConstructionInfo info(&m_dispatcher, 0);
    void* const memory = m_dispatcher.allocateCollisionAlgorithm(sizeof(PlainLoop));
    m_algorithm = new (memory) PlainLoop(info, &wrapA, &wrapB, isMeshFirst);
}

MeshBench::~MeshBench()
{
    m_algorithm->~btCollisionAlgorithm();
    m_dispatcher.freeCollisionAlgorithm(m_algorithm);
}

const btPersistentManifold& MeshBench::step(const btTransform& convexAt, const btTransform& meshAt)
{
    m_convex.setWorldTransform(convexAt);
    m_mesh.setWorldTransform(meshAt);
    const btCollisionObject &a = m_isMeshFirst ? m_mesh : m_convex, &b = m_isMeshFirst ? m_convex : m_mesh;
    const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1),
        wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
    btManifoldResult result(&wrapA, &wrapB);
    m_algorithm->processCollision(&wrapA, &wrapB, m_info, &result);
    m_manifolds.resize(0);
    m_algorithm->getAllContactManifolds(m_manifolds);
    return *m_manifolds[0];
}

const btPersistentManifold& MeshBench::stepFromNothing(const btTransform& convexAt, const btTransform& meshAt)
{
    m_dispatcher.clearManifold(m_dispatcher.getManifoldByIndexInternal(0));
    return step(convexAt, meshAt);
}

bool arePointsEqual(const btPersistentManifold& a, const btPersistentManifold& b)
{
    if (a.getNumContacts() != b.getNumContacts())
        return false;
    const auto areSame = [](const btVector3& v, const btVector3& w)
    { return std::memcmp(v.m_floats, w.m_floats, 3 * sizeof(btScalar)) == 0; };
    for (int i = 0; i < a.getNumContacts(); ++i)
    {
        const btManifoldPoint &p = a.getContactPoint(i), &q = b.getContactPoint(i);
        if (!areSame(p.m_localPointA, q.m_localPointA) || !areSame(p.m_localPointB, q.m_localPointB) ||
            !areSame(p.m_normalWorldOnB, q.m_normalWorldOnB) || p.getDistance() != q.getDistance() ||
            p.getLifeTime() != q.getLifeTime() || p.m_partId0 != q.m_partId0 || p.m_partId1 != q.m_partId1 ||
            p.m_index0 != q.m_index0 || p.m_index1 != q.m_index1)
            return false;
    }
    return true;
}

int posesToTry(int usual)
{
    const char* const times = std::getenv("CULLET_MESH_POSES");
    return times != nullptr ? usual * std::max(1, std::atoi(times)) : usual;
}

void TriangleSoup::processAllTriangles(btTriangleCallback* callback, const btVector3&, const btVector3&) const
{
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    {
        btVector3 scratch[3] = {corners[i], corners[i + 1], corners[i + 2]};
        callback->processTriangle(scratch, 0, static_cast<int>(i / 3));
    }
}

void TriangleSoup::getAabb(const btTransform&, btVector3& low, btVector3& high) const
{
    low.setValue(-1000, -1000, -1000);
    high.setValue(1000, 1000, 1000);
}
}  // namespace cullet::test
