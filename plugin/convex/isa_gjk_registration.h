// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/isa_gjk_options.h"
#include "cullet/plugin/core/thread_counter.h"

#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class BodyMotions;

/// The state that all pairs of one dispatcher share: create functions, options, counters.
///
/// isa_gjk.cpp has the create functions, since these know the algorithms of all rooms.
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

    /// Whether an algorithm is cullet's for a compound.
    static bool isOfCompound(const btCollisionAlgorithm& algorithm);

    /// Whether a function of this registration creates such algorithms.
    bool makesCompounds(const btCollisionAlgorithmCreateFunc* create) const
    {
        return create == &m_compounds || create == &m_swappedCompounds || create == &m_compoundPairs;
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

    /// For a compound and another shape.
    struct CompoundCreateFunc : btCollisionAlgorithmCreateFunc
    {
        explicit CompoundCreateFunc(bool isSwapped) { m_swapped = isSwapped; }
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override;
    };

    /// For two compounds.
    struct CompoundPairCreateFunc : btCollisionAlgorithmCreateFunc
    {
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper* a,
                                                       const btCollisionObjectWrapper* b) override;
    };

    void registerCompounds(btCollisionDispatcher& dispatcher);
    void giveBackCompounds();
    void registerMeshes(btCollisionDispatcher& dispatcher);
    void giveBackMeshes();

    static constexpr std::uint64_t kUncheckedPass = ~std::uint64_t(0);

    IsaGjkOptions m_options;
    std::uint32_t m_resets = 0;
    Counters m_counters;
    std::unique_ptr<BodyMotions> m_motions;
    std::uint64_t m_pass = 0;
    std::uint64_t m_lastPass = 0, m_endOfPasses = 0;  ///< pass numbers that are left: those between
    std::atomic<std::uint64_t> m_leftTotal{0};
    const btConvexConvexAlgorithm::CreateFunc* m_stock;
    btGjkEpaPenetrationDepthSolver m_depthSolver;
    btConvexConvexAlgorithm::CreateFunc m_ownStock{&m_depthSolver};
    CreateFunc m_contactPoints{*this, false};
    CreateFunc m_closestPoints{*this, true};
    BoxCreateFunc m_boxes{*this};
    MeshCreateFunc m_meshes{*this, false};
    MeshCreateFunc m_swappedMeshes{*this, true};
    CompoundCreateFunc m_compounds{false};
    CompoundCreateFunc m_swappedCompounds{true};
    CompoundPairCreateFunc m_compoundPairs;
    btCollisionDispatcher* m_dispatcher = nullptr;
    btCollisionAlgorithmCreateFunc* m_stockBoxes = nullptr;  ///< Bullet's own for two boxes
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
