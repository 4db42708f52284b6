// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/mesh/triangle_batch.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Where the search for a triangle ended in the last step.
struct TriangleMemory
{
    int part, index;
    GjkCache<btScalar> search;
};

/// What a pair of a convex shape and a mesh keeps between steps. Nothing of it is trusted.
struct MeshQuery
{
    MeshQuery(IsaGjkRegistration& isaGjk, btPersistentManifold& pairManifold,
              const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& convex,
              const btCollisionObjectWrapper& mesh)
        : manifold(pairManifold), triangles(isaGjk, &pairManifold, info, &convex, &mesh, false)
    {
    }

    static constexpr std::size_t kAxes = 4;

    btPersistentManifold& manifold;
    IsaGjkAlgorithm triangles;  ///< answers for one triangle after the other
    HullUse hull;
    std::array<std::array<float, 3>, kAxes> axes;  ///< that have dropped triangles; in the mesh's frame
    std::size_t axisCount = 0;
    static constexpr std::size_t kMostKnown = 64;
    std::vector<TriangleMemory> known;  ///< of the last step, in its order
    std::vector<TriangleMemory> next;   ///< of this step
};

/// One call of a MeshAlgorithm: asks the mesh for the triangles in the convex body's box, drops those that cannot touch,
/// and lets the query answer for the rest.
class TrianglePass final : public btTriangleCallback
{
public:
    TrianglePass(IsaGjkRegistration& isaGjk, MeshQuery& query, const btCollisionObjectWrapper& convex,
                 const btCollisionObjectWrapper& mesh, const btDispatcherInfo& info,
                 btManifoldResult& result);

    /// False for a core without points, and for a pose that is no rotation or not finite.
    bool isPossible() const { return m_core && m_frame.isUsable(); }

    void run();

    void processTriangle(btVector3* corners, int part, int index) override;

private:
    struct UsedAxis
    {
        CoreAxis axis;
        std::array<float, 3> inMesh;
        int dropped = 0;
    };

    /// Bounds of the core in its own frame.
    struct CoreBounds
    {
        Eigen::Vector3d low, high;
    };

    void examineCore();
    void flush();
    void ask(const TriangleBatch::Triangle& triangle);
    void useAxes();
    void learnAxis(int next);
    CoreAxis axisAlong(const Eigen::Vector3d& direction) const;
    const GjkCache<btScalar>* recall(const TriangleBatch::Triangle& triangle);
    void remember(const TriangleBatch::Triangle& triangle);
    void recallAxes();
    void storeAxes();

    IsaGjkRegistration& m_isaGjk;
    MeshQuery& m_query;
    const btCollisionObjectWrapper &m_convex, &m_mesh;
    ConvexSide m_side;  ///< of the convex body
    const btDispatcherInfo& m_info;
    btManifoldResult& m_result;
    CoreFrame m_frame;
    std::optional<PosedShape> m_core;  ///< in its own frame
    btScalar m_margin;                 ///< of the mesh
    double m_limit;
    btVector3 m_boxMin, m_boxMax;        ///< of the convex body, in the mesh's frame
    std::optional<CoreBounds> m_bounds;  ///< known once there are triangles
    std::array<UsedAxis, MeshQuery::kAxes> m_axes;
    std::size_t m_axisCount = 0;
    std::size_t m_likely = 0;  ///< place of the next triangle in what the query knows
    TriangleBatch m_batch;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
