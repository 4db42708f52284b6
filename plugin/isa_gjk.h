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

struct IsaGjkOptions
{
    /// Take box against box too. Bullet has an algorithm of its own for this pair, by default left in place.
    bool boxBox = false;
    /// Compare a hull shape's points with those of its graph in every query: about a nanosecond for three points. With
    /// cullet::Dispatcher once per dispatch, and in every query that a callback makes meanwhile. If false, call
    /// invalidate(shape) after every edit and before a shape is deleted.
    bool checkPoints = true;
    /// Contact points of a pair and step at most, 1 to 4. There are as many as carry the contact: four of a box on its face,
    /// two of an edge, one of a corner. The deepest always is; with 1 or 2 bodies do not rest on their faces. Other numbers
    /// are taken for the nearest of these, with a warning.
    int patchPoints = 4;
};

/// Counters since the registration, summed over all pairs.
struct IsaGjkStats
{
    std::uint64_t separatedTotal = 0;  ///< queries that an axis answered: no contact
    std::uint64_t touchingTotal = 0;   ///< queries that made contact points
    std::uint64_t depthsTotal = 0;     ///< of these, with overlapping cores
    /// Queries without an answer, or without memory for one, which Bullet's own detector got.
    std::uint64_t notConvergedTotal = 0;
    /// Queries that Bullet's own algorithm gets as planned: cylinders, cones and other round shapes that are close,
    /// enableSatConvex, perturbation.
    std::uint64_t delegatedTotal = 0;
    /// Of depthsTotal, those that took an examination of all faces and pairs of edges, as no polytope proved them: nearly
    /// coincident round hulls of thousands of points, for which it takes tens of milliseconds, and thin ones.
    std::uint64_t exactTotal = 0;
};

/// What all pairs of one dispatcher have in common: create functions, options, counters.
class CULLET_API IsaGjkRegistration
{
public:
    /// @param dispatcher its configuration has to outlive it, as Bullet demands
    IsaGjkRegistration(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options);
    ~IsaGjkRegistration();
    IsaGjkRegistration(const IsaGjkRegistration&) = delete;
    IsaGjkRegistration& operator=(const IsaGjkRegistration&) = delete;

    /// Fills the cells of both tables of the dispatcher.
    void registerWith(btCollisionDispatcher& dispatcher);
    void reset(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options);

    const IsaGjkOptions& options() const { return m_options; }
    IsaGjkStats stats() const;

    /// Between beginPass() and endPass() no shape of the step changes.
    void beginPass();
    void endPass() { m_pass = queryPass(); }
    /// See HullCache::hullOf().
    std::uint64_t pass() const { return m_pass; }
    /// For queries that are not of the step, whose shapes a callback may have made since the pass began.
    std::uint64_t queryPass() const { return m_options.checkPoints ? 0 : kUncheckedPass; }

    /// The last use by an algorithm or a dispatcher: what it did here happens before a reset(), since another thread may
    /// make its dispatcher at the address of one that is gone.
    void leave() noexcept { m_leftTotal.fetch_add(1, std::memory_order_release); }

    /// Bullet's own create function, whose multipoint settings may change at any time.
    const btConvexConvexAlgorithm::CreateFunc& stock() const { return *m_stock; }

    /// Those of IsaGjkStats.
    struct Counters
    {
        ThreadCounter separated, touching, depths, notConverged, delegated, exact;
    };
    Counters& counters() { return m_counters; }

    /// Makes the algorithms of a step's pairs; in the cells of the dispatcher's table that registerWith() has filled.
    const btCollisionAlgorithmCreateFunc* contactPoints() const { return &m_contactPoints; }

    /// Of the bodies whose pairs a Dispatcher watches.
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

    static constexpr std::uint64_t kUncheckedPass = ~std::uint64_t(0);

    IsaGjkOptions m_options;
    Counters m_counters;
    std::unique_ptr<BodyMotions> m_motions;
    std::uint64_t m_pass = 0;
    std::atomic<std::uint64_t> m_leftTotal{0};
    const btConvexConvexAlgorithm::CreateFunc* m_stock;
    btGjkEpaPenetrationDepthSolver m_depthSolver;
    btConvexConvexAlgorithm::CreateFunc m_ownStock{&m_depthSolver};
    CreateFunc m_contactPoints{*this, false};
    CreateFunc m_closestPoints{*this, true};
};

/// Lets ISA-GJK find the contacts of convex pairs: one line after the dispatcher is made, before bodies are added.
///
/// Both tables of the dispatcher and both orders of every pair of convex types are filled, but for pairs with shorter
/// algorithms of their own: sphere-sphere, sphere-triangle, capsule-capsule, capsule-sphere, box-box (see options), and
/// the two-dimensional types. Children of compounds and triangles of meshes are pairs like any other.
///
/// Pairs of polytopes (hull, box, triangle, capsule, sphere) get their contacts here, a patch of up to four points per
/// query, as many as carry. Where another shape is involved, ISA-GJK only decides that a pair is too far apart for
/// contacts, and Bullet's own algorithm makes them.
///
/// @return counters and options; lives as long as the process. Registering again for a dispatcher at the same address
///         gives the same object, with counters at zero; what the options give up goes back to Bullet.
/// Errors: std::bad_alloc.
CULLET_API IsaGjkRegistration& registerIsaGjk(btCollisionDispatcher& dispatcher,
                                              const IsaGjkOptions& options = {});

struct HullCacheStats
{
    std::uint64_t shapes = 0;  ///< addresses known
    std::uint64_t graphs = 0;  ///< different point sets among them, each with its graph once that is wanted
    std::uint64_t buildsTotal = 0;  ///< graphs built
    std::uint64_t pointSets = 0;    ///< these, and point sets that are gone and not yet forgotten
};

/// Builds the graph of a shape now instead of when contacts need it (2 ms for 1,000 points), and keeps it until
/// invalidate(). Call when a level is loaded. A shape of more than 4,096 points has no graph without: each query then scans its
/// points, and makes one contact point as Bullet does, not a patch.
CULLET_API void prepare(const btConvexHullShape& shape);

/// For a shape with level faces, such as a box, whose points are rewritten in most steps: no graph is built for it, whatever it
/// touches. Where its faces are level, a query makes one contact point as Bullet does, not a patch. Without, each change costs a
/// graph when the shape touches something, 3 microseconds a point. Other shapes need none. Take it back with false, or with
/// invalidate() before the shape is deleted.
CULLET_API void setDeforming(const btConvexHullShape& shape, bool isDeforming = true);

/// Takes back prepare() and setDeforming(), lets the next query compare the points again, and lets go of the graph if no pair
/// uses it. Needed for nothing else: edited, deleted and reallocated shapes are recognised by their points; with cullet::Dispatcher those of its
/// pairs from one dispatch to the next.
CULLET_API void invalidate(const btConvexHullShape& shape);

/// Lets go of all graphs that no pair uses and that were not prepared, at once: when a level has been unloaded. Without it,
/// graphs of shapes that are gone stay until as much is new as was in use before, and at least 260,000 points, some
/// 100 MB. prepare() keeps a graph for good.
CULLET_API void trimHullCache();

CULLET_API HullCacheStats hullCacheStats();
}  // namespace CULLET_PRECISION
}  // namespace cullet
