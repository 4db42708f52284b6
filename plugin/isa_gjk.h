// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/core/thread_counter.h"

#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class BodyMotions;

/// What finds the contacts of two boxes in a step. Queries for closest points are left to Bullet, except with IsaGjk.
enum class BoxPairs : std::uint8_t
{
    SeparatingAxes,  ///< cullet's separating axis test and patch; the manifold is kept as by Bullet's algorithm
    IsaGjk,          ///< ISA-GJK, as for any other convex pair
    Bullet           ///< Bullet's own algorithm: the same bits as without cullet
};

/// How far a pair may move until its contacts are computed again.
struct ReusePose
{
    /// Length by which points of the smaller shape may have moved, relative to the other shape, since the contacts were
    /// computed. 0: they are computed in every step.
    btScalar distance = 0;
    /// Angle in radians by which the shapes may have turned relative to each other since then, up to 1. It matters for
    /// small shapes.
    btScalar angle = btScalar(0.035);

    bool isOn() const { return distance > 0; }
};

struct IsaGjkOptions
{
    /// With SeparatingAxes, shapes of a class derived from btBoxShape are left to Bullet.
    BoxPairs boxPairs = BoxPairs::SeparatingAxes;
    /// Compare a hull shape's points with the cached ones in every query: about a nanosecond for three points. With
    /// cullet::Dispatcher once per dispatch, and in every query from a callback during it. If false, call
    /// invalidate(shape) after every edit and before a shape is deleted.
    bool checkPoints = true;
    /// Upper limit of contact points per pair and step, 1 to 4. A pair has as many points as support the contact: four
    /// for a box on its face, two for an edge, one for a vertex. The deepest point is always among them. With 1 or 2,
    /// bodies do not rest on their faces. Other numbers are clamped, with a warning.
    int patchPoints = 4;
    /// Let cullet choose the triangles of meshes, height fields and other concave shapes that a convex shape may touch, and
    /// the points that carry the contact. If false, Bullet's loop over triangles does.
    bool meshes = true;
    /// Correct the normals of contacts at edges and corners of triangles that their neighbours cover, so that a body that
    /// slides over a mesh does not hit the edges between its triangles. The application prepares nothing; contacts of
    /// meshes with a btTriangleInfoMap are left to btAdjustInternalEdgeContacts(). Off by default, since normals differ
    /// from Bullet's. Needs `meshes`. A body at rest costs as much as without.
    bool activeEdges = false;
    /// Keep the contacts of a pair that hardly moves: a world at rest costs a fraction. See the guide, docs/guide/reuse.md.
    ///
    /// While neither `distance` nor `angle` is left, a pair of hulls, boxes, capsules and spheres, of one of these and a
    /// mesh, height field or other concave shape, or of such parts of compounds, keeps its points. In each step they get
    /// their positions and distances from the bodies' transforms (btManifoldResult::refreshContactPoints(), which calls
    /// gContactProcessedCallback and gContactEndedCallback as always), their normals turn with the second body, and
    /// friction and restitution are read. Contacts are computed again at once when a shape, its scale or its margin
    /// changes, when the body has another shape, when points were added to the manifold or removed from it, when the
    /// breaking threshold changes, and when a triangle of the mesh near the body has other vertices.
    ///
    /// Never kept: no contacts; pairs with a cylinder, cone or another shape whose points Bullet's algorithm finds;
    /// contacts that gContactAddedCallback sees (with CF_CUSTOM_MATERIAL_CALLBACK); bodies with contact stiffness or
    /// friction anchors; perturbation and enableSatConvex; BoxPairs::Bullet.
    ///
    /// Off by default: contacts then depend on the poses of earlier steps, too. They never depend on threads.
    ReusePose reusePose = {};
};

/// Counters since the registration, summed over all pairs.
struct IsaGjkStats
{
    std::uint64_t separatedTotal = 0;  ///< queries in which an axis proved that there is no contact
    std::uint64_t touchingTotal = 0;   ///< queries that made contact points
    std::uint64_t depthsTotal = 0;     ///< the part of touchingTotal with overlapping cores
    /// Queries that ISA-GJK left to Bullet's own detector, because it found no answer or ran out of memory.
    std::uint64_t notConvergedTotal = 0;
    /// Queries that Bullet's own algorithm answers by design: cylinders, cones and other round shapes that are close,
    /// enableSatConvex, perturbation.
    std::uint64_t delegatedTotal = 0;
    /// The part of depthsTotal for which no polytope proved the depth, so that all faces and pairs of edges were
    /// tested: thin hulls, and nearly coincident round hulls of thousands of points, which take tens of milliseconds.
    std::uint64_t exactTotal = 0;
    /// Triangles of concave shapes in the boxes of convex ones, and those of them for which there was a query, since
    /// neither the box around the core nor an axis has dropped them.
    std::uint64_t trianglesTotal = 0, trianglesAskedTotal = 0;
    /// Queries in which a pair kept its contacts (IsaGjkOptions::reusePose); in touchingTotal they are not counted.
    std::uint64_t reusedTotal = 0;
};

/// The state that all pairs of one dispatcher share: create functions, options, counters.
class CULLET_API IsaGjkRegistration
{
public:
    /// @param dispatcher its configuration must outlive it, as Bullet requires
    IsaGjkRegistration(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options);
    ~IsaGjkRegistration();
    IsaGjkRegistration(const IsaGjkRegistration&) = delete;
    IsaGjkRegistration& operator=(const IsaGjkRegistration&) = delete;

    /// Fills the entries of both tables of the dispatcher.
    void registerWith(btCollisionDispatcher& dispatcher);
    void reset(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options);

    const IsaGjkOptions& options() const { return m_options; }
    /// The number of calls of reset(), after each of which the options may be others.
    std::uint32_t resets() const { return m_resets; }
    IsaGjkStats stats() const;

    /// Between beginPass() and endPass() the shapes of the step do not change.
    void beginPass();
    void endPass() { m_pass = queryPass(); }
    /// See HullCache::hullOf().
    std::uint64_t pass() const { return m_pass; }
    /// The pass for queries outside of the step: a callback may have created their shapes since the pass began.
    std::uint64_t queryPass() const { return m_options.checkPoints ? 0 : kUncheckedPass; }

    /// Called at the end of the last use by an algorithm or a dispatcher, so that its writes happen before a reset():
    /// another thread may create a dispatcher at the address of a destroyed one.
    void leave() noexcept { m_leftTotal.fetch_add(1, std::memory_order_release); }

    /// Bullet's own create function; its multipoint settings may change at any time.
    const btConvexConvexAlgorithm::CreateFunc& stock() const { return *m_stock; }

    /// The counters behind IsaGjkStats.
    struct Counters
    {
        ThreadCounter separated, touching, depths, notConverged, delegated, exact, triangles, trianglesAsked,
            reused;
    };
    Counters& counters() { return m_counters; }

    /// Creates the algorithms of a step's pairs; registerWith() stores it in the dispatcher's table.
    const btCollisionAlgorithmCreateFunc* contactPoints() const { return &m_contactPoints; }

    /// Creates the algorithms of two boxes with BoxPairs::SeparatingAxes.
    const btCollisionAlgorithmCreateFunc* boxes() const { return &m_boxes; }

    /// Whether an algorithm is cullet's for a convex and a concave shape.
    static bool isOfMesh(const btCollisionAlgorithm& algorithm);

    /// Whether a function of this registration creates such algorithms.
    bool makesMeshes(const btCollisionAlgorithmCreateFunc* create) const
    {
        return create == &m_meshes || create == &m_swappedMeshes;
    }

    /// Whether the dispatcher's table still has this registration's algorithm for a convex type and a triangle.
    bool answersTriangles(int convexType) const;

    /// The motions of the bodies whose pairs a Dispatcher tracks.
    BodyMotions& motions() { return *m_motions; }

private:
    struct CreateFunc : btCollisionAlgorithmCreateFunc
    {
        CreateFunc(IsaGjkRegistration& isaGjk, bool closestOnly)
            : m_isaGjk(isaGjk), m_closestOnly(closestOnly)
        {
        }
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override;
        IsaGjkRegistration& m_isaGjk;
        bool m_closestOnly;
    };

    /// For two boxes.
    struct BoxCreateFunc : btCollisionAlgorithmCreateFunc
    {
        explicit BoxCreateFunc(IsaGjkRegistration& isaGjk) : m_isaGjk(isaGjk) {}
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override;
        IsaGjkRegistration& m_isaGjk;
    };

    /// For a convex and a concave shape.
    struct MeshCreateFunc : btCollisionAlgorithmCreateFunc
    {
        MeshCreateFunc(IsaGjkRegistration& isaGjk, bool isSwapped) : m_isaGjk(isaGjk)
        {
            m_swapped = isSwapped;
        }
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override;
        IsaGjkRegistration& m_isaGjk;
    };

    void registerMeshes(btCollisionDispatcher& dispatcher);
    void giveBackMeshes();

    static constexpr std::uint64_t kUncheckedPass = ~std::uint64_t(0);

    IsaGjkOptions m_options;
    std::uint32_t m_resets = 0;
    Counters m_counters;
    std::unique_ptr<BodyMotions> m_motions;
    std::uint64_t m_pass = 0;
    std::atomic<std::uint64_t> m_leftTotal{0};
    const btConvexConvexAlgorithm::CreateFunc* m_stock;
    btGjkEpaPenetrationDepthSolver m_depthSolver;
    btConvexConvexAlgorithm::CreateFunc m_ownStock{&m_depthSolver};
    CreateFunc m_contactPoints{*this, false};
    CreateFunc m_closestPoints{*this, true};
    BoxCreateFunc m_boxes{*this};
    MeshCreateFunc m_meshes{*this, false};
    MeshCreateFunc m_swappedMeshes{*this, true};
    btCollisionDispatcher* m_dispatcher = nullptr;
    btCollisionAlgorithmCreateFunc* m_stockBoxes = nullptr;  ///< Bullet's own for two boxes
};

/// Lets ISA-GJK find the contacts of convex pairs. Call once after the dispatcher is created, before bodies are added.
///
/// Fills both tables of the dispatcher, for both orders of every pair of convex types, except pairs for which Bullet
/// has a closed form: sphere-sphere, sphere-triangle, capsule-capsule, capsule-sphere, and the two-dimensional types.
/// Two boxes have an algorithm of their own (IsaGjkOptions::boxPairs) in the table of contact points. Children of
/// compounds and triangles of meshes are handled like any other pair.
///
/// For pairs of polytopes (hull, box, triangle, capsule, sphere) each query makes a patch of up to four contact points.
/// With any other shape, ISA-GJK only decides whether a pair is too far apart for contacts, and Bullet's own algorithm
/// makes the contacts.
///
/// @return counters and options; lives as long as the process. Registering again for a dispatcher at the same address
///         returns the same object with counters at zero; pairs that the options now exclude are Bullet's again.
/// Errors: std::bad_alloc.
CULLET_API IsaGjkRegistration& registerIsaGjk(btCollisionDispatcher& dispatcher, IsaGjkOptions options = {});

struct HullCacheStats
{
    std::uint64_t shapes = 0;       ///< registered shape addresses
    std::uint64_t graphs = 0;       ///< point sets of living shapes; each has a graph once one is needed
    std::uint64_t buildsTotal = 0;  ///< graphs built
    std::uint64_t pointSets = 0;    ///< graphs, and point sets of destroyed shapes that are still stored
};

/// Builds the graph of a shape now instead of when contacts need it (2 ms for 1,000 points), and keeps it until
/// invalidate(). Call it when a level is loaded. Without it, a shape of more than 4,096 points has no graph: each query
/// then scans its points, and makes one contact point as Bullet does, not a patch.
CULLET_API void prepare(const btConvexHullShape& shape);

/// For a shape with level faces, such as a box, whose points are rewritten in most steps: no graph is ever built for
/// it. Where its faces are level, a query then makes one contact point as Bullet does, not a patch. Without this call,
/// each change costs a graph when the shape touches another one, 3 microseconds per point. Other shapes do not need
/// it. Undo it with false, or with invalidate() before the shape is deleted.
CULLET_API void setDeforming(const btConvexHullShape& shape, bool isDeforming = true);

/// Undoes prepare() and setDeforming(), makes the next query compare the points again, and frees the graph if no pair
/// uses it. No other case needs this call: edited, deleted and reallocated shapes are recognised by their points; with
/// cullet::Dispatcher, shapes of its pairs are compared once per dispatch.
CULLET_API void invalidate(const btConvexHullShape& shape);

/// Frees at once all graphs that no pair uses and that were not prepared, for example after a level was unloaded.
/// Without this call, graphs of destroyed shapes stay until the added graphs are as large as those in use before, and
/// at least 260,000 points, about 100 MB. A prepared graph is never freed.
CULLET_API void trimHullCache();

CULLET_API HullCacheStats hullCacheStats();
}  // namespace CULLET_PRECISION
}  // namespace cullet
