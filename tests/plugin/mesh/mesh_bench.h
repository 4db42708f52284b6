// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/isa_gjk.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <btBulletCollisionCommon.h>

#include <vector>

namespace cullet::test
{
/// Bullet's loop over triangles without its early out: the algorithm of each triangle is made, asked and destroyed, and
/// the manifold gets every point of each.
class PlainLoop final : public btConvexConcaveCollisionAlgorithm
{
public:
    PlainLoop(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
              const btCollisionObjectWrapper* b, bool isSwapped);
    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;

private:
    bool m_isSwapped;
};

enum class Loop
{
    Ours,
    Plain,
    Stock  ///< Bullet's own algorithms throughout
};

/// Leaves the loop over triangles to Bullet.
inline IsaGjkOptions bulletsLoop()
{
    IsaGjkOptions options;
    options.meshes = false;
    return options;
}

/// One pair of a convex body and a mesh, whose contacts are computed step by step.
class MeshBench
{
public:
    MeshBench(Loop loop, btCollisionShape& convex, btCollisionShape& mesh, bool isMeshFirst = false,
              const IsaGjkOptions& options = {});
    ~MeshBench();
    MeshBench(const MeshBench&) = delete;
    MeshBench& operator=(const MeshBench&) = delete;

    /// Computes the contacts of the next step, as Bullet's near callback does.
    const btPersistentManifold& step(const btTransform& convexAt, const btTransform& meshAt);

    /// step() with a manifold that had no points.
    const btPersistentManifold& stepFromNothing(const btTransform& convexAt, const btTransform& meshAt);

    const btPersistentManifold& manifold() { return *m_dispatcher.getManifoldByIndexInternal(0); }
    btCollisionDispatcher& dispatcher() { return m_dispatcher; }
    /// @pre not Loop::Stock
    IsaGjkRegistration& isaGjk() { return *m_isaGjk; }
    btCollisionAlgorithm& algorithm() { return *m_algorithm; }
    btCollisionObject& convex() { return m_convex; }
    btCollisionObject& mesh() { return m_mesh; }
    btDispatcherInfo& info() { return m_info; }

private:
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    IsaGjkRegistration* m_isaGjk;
    btCollisionObject m_convex, m_mesh;
    bool m_isMeshFirst;
    btDispatcherInfo m_info;
    btCollisionAlgorithm* m_algorithm;
    btManifoldArray m_manifolds;
};

/// Whether all points are the same bits in the same order.
bool arePointsEqual(const btPersistentManifold& a, const btPersistentManifold& b);

/// How many random poses a test tries: CULLET_MESH_POSES times as many as usual.
int posesToTry(int usual);

/// Triangles of the application's own. Bullet takes CUSTOM_CONCAVE_SHAPE_TYPE for its signed distance fields.
class TriangleSoup final : public btConcaveShape
{
public:
    TriangleSoup() { m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE; }

    void processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                             const btVector3& high) const override;
    void getAabb(const btTransform&, btVector3& low, btVector3& high) const override;
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return m_scaling; }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "TriangleSoup"; }

    std::vector<btVector3> corners;

private:
    btVector3 m_scaling{1, 1, 1};
};
}  // namespace cullet::test
