// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/mesh/active_edges.h"
#include "cullet/plugin/mesh/kept_triangles.h"
#include "cullet/plugin/mesh/mesh_points.h"
#include "cullet/plugin/mesh/mesh_region.h"
#include "cullet/plugin/mesh/triangle_batch.h"
#include "cullet/plugin/mesh/triangle_search.h"
#include "cullet/plugin/shapes/convex_mesh_hull.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class ManifoldRenewal;

/// Where the search for a triangle ended in the last step; its axis is in the mesh's frame.
struct TriangleMemory
{
    int part, index;
    GjkCache<btScalar> search;
};

/// What a pair of a convex shape and a mesh keeps between steps. Nothing of it is trusted.
struct MeshQuery
{
    explicit MeshQuery(btPersistentManifold& pairManifold) : manifold(pairManifold) {}

    static constexpr std::size_t kAxes = 4;

    btPersistentManifold& manifold;
    HullUse hulls[2];                              ///< of the convex body; the second is never used
    std::array<std::array<float, 3>, kAxes> axes;  ///< that have dropped triangles; in the mesh's frame
    std::size_t axisCount = 0;
    static constexpr std::size_t kMostKnown = 64;
    std::vector<TriangleMemory> known;                ///< of the last step, in its order
    std::vector<TriangleMemory> next;                 ///< of this step
    std::vector<TriangleBatch::Triangle> candidates;  ///< of this step, for IsaGjkOptions::activeEdges
    ConvexMeshHull convexMesh;                        ///< of the convex body, if it is a mesh
    std::unique_ptr<KeptMeshContacts> kept;  ///< for IsaGjkOptions::reusePose; null before there are any
};

/// One call of a MeshAlgorithm: reads the triangles in the convex body's box, drops those that cannot touch, finds where
/// the rest touches, and gives the manifold the few points that carry the contact.
///
/// Each triangle that touches has a closest or deepest point. A triangle whose point is the corner or edge of one before
/// it is dropped if nothing else of it is near. Where the shapes may touch in more than a point, a patch is made; of many
/// such triangles, for those that are farthest apart. If a callback of the application may change contacts
/// (gContactAddedCallback and CF_CUSTOM_MATERIAL_CALLBACK), the manifold gets every point of every triangle, as from
/// Bullet's loop; and so it does where Bullet's algorithm finds the points, one in a step.
class TrianglePass final : public btTriangleCallback
{
public:
    /// @param core   the shape of the convex body, or a hull in place of it
    /// @param region from which run() reads the triangles that it covers; null: none
    TrianglePass(IsaGjkRegistration& isaGjk, MeshQuery& query, const btCollisionShape& core,
                 const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& mesh,
                 btDispatcher& dispatcher, const btDispatcherInfo& info, btManifoldResult& result,
                 MeshRegion* region);

    /// False for a pose that is no rotation or not finite.
    bool isPossible() const { return m_frame.isUsable(); }

    /// Lets run() hash the triangles that it reads.
    void hashTriangles() { m_hash.emplace(); }
    /// The triangles that run() has hashed, and the box in which they are.
    void storeTriangles(KeptMeshContacts& kept) const;

    void run();

    void processTriangle(btVector3* corners, int part, int index) override;

private:
    struct UsedAxis
    {
        CoreAxis axis;
        std::array<float, 3> inMesh;
        int dropped = 0;
    };

    /// Of the touches with patches, so many are kept. Of as few triangles, bounds of the core and axes would cost more than
    /// they save, and none is left out for another.
    static constexpr int kMostPatches = 4;

    /// What is done with a triangle that the mesh names.
    enum class Reading
    {
        Batch,      ///< it goes to the batch
        Candidates  ///< it is kept, since contacts at edges are corrected by their neighbours
    };

    CoreFrame frameOf(MeshRegion* region) const;
    bool correctsEdges() const;
    void readMesh();
    void readCandidates();
    void addToBatch(const btVector3* corners, int part, int index);
    EdgeVerdict correctAt(const TriangleBatch::Triangle& triangle, TriangleContact& contact);
    bool correct(const TriangleSearch::Corners& corners, const TriangleBatch::Triangle& triangle);
    bool correct(MeshPoint& point);
    bool examineCore();
    void flush();
    void placeBatch();
    void ask(int i);
    ContactSearchResult search(int i, const TriangleSearch::Corners& corners);
    void addTouch(int i, const TriangleSearch::Corners& corners);
    void askBullet(const TriangleBatch::Triangle& triangle);
    void askBullet(const btCollisionObjectWrapper& triangle, btManifoldResult& result);
    void makePatches();
    void showPoints();
    void useAxes();
    void learnAxis(const Eigen::Vector3d& direction, int next);
    CoreAxis axisAlong(const Eigen::Vector3d& direction) const;
    GjkCache<btScalar> recall(const TriangleBatch::Triangle& triangle);
    void remember(const TriangleBatch::Triangle& triangle, GjkCache<btScalar> search);
    void recallAxes();
    void storeAxes();
    bool showsEveryPoint() const;
    void renewManifold();
    void addAtOnce(ManifoldRenewal& renewal);
    template <class AfterEach>
    void addToManifold(const AfterEach& afterEach);

    IsaGjkRegistration& m_isaGjk;
    MeshQuery& m_query;
    const btCollisionObjectWrapper &m_convex, &m_mesh;
    ConvexSide m_side;  ///< the convex body in the world
    btDispatcher& m_dispatcher;
    const btDispatcherInfo& m_info;
    btManifoldResult& m_result;
    CoreFrame m_frame;
    MeshLimits m_limits;
    btVector3 m_boxMin, m_boxMax;            ///< of the convex body, in the mesh's frame
    btVector3 m_readMin, m_readMax;          ///< the box whose triangles are read
    std::optional<TriangleHash> m_hash;      ///< of the triangles that are read, if there shall be one
    std::optional<TriangleSearch> m_search;  ///< exists once there are triangles
    std::optional<CoreBounds> m_bounds;      ///< exist once there are more than kMostPatches triangles
    std::array<UsedAxis, MeshQuery::kAxes> m_axes;
    std::size_t m_axisCount = 0;
    std::size_t m_likely = 0;  ///< place of the next triangle in what the query knows
    bool m_showsEveryPoint;
    Reading m_reading;
    std::size_t m_candidate = 0;  ///< of the last corrected triangle
    TriangleBatch m_batch;
    MeshPoints m_touches;  ///< without their patches; of few triangles, the points of these
    MeshPoints m_points;
    MeshPoints* m_found = &m_points;  ///< all points, after makePatches()
    MeshRegion* const m_region;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
