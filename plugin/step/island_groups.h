// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <LinearMath/btAlignedObjectArray.h>

#include <cstddef>
#include <cstdint>
#include <vector>

class btCollisionWorld;
class btDispatcher;
class btPersistentManifold;
class btSimulationIslandManager;
class btTypedConstraint;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The island of a contact or joint of two objects.
inline int islandOf(const btCollisionObject& a, const btCollisionObject& b)
{
    return a.getIslandTag() >= 0 ? a.getIslandTag() : b.getIslandTag();
}

/// What one call of solveGroup() gets: one island, or several small ones.
struct IslandGroup
{
    struct Range
    {
        std::uint32_t begin = 0;
        std::uint32_t end = 0;
        int size() const { return static_cast<int>(end - begin); }
    };
    Range bodies;
    Range manifolds;
    Range joints;
};

/// The islands of a world: the same groups in the same order, each with the same bodies, manifolds and joints in the same
/// order, as btSimulationIslandManager and btDiscreteDynamicsWorld give to the solver.
///
/// Bullet's sort is not stable, so that its result depends on each comparison and exchange. It sorts keys here, which
/// lie side by side, instead of pointers to objects that lie anywhere. Bullet scans all joints for each island; here
/// each island knows its own.
class IslandGroups
{
public:
    using Joints = btAlignedObjectArray<btTypedConstraint*>;

    /// Something that the solver writes to and that does not belong to one island: a kinematic body, a joint's feedback.
    struct SharedThing
    {
        const void* thing;
        int island;
    };

    /// Reserves memory for all that follows. Throws std::bad_alloc, before anything has changed.
    void reserve(btCollisionWorld& world, btSimulationIslandManager& manager, std::size_t joints);

    /// Sorts the joints and the manifolds, and lets islands sleep or wakes them.
    ///
    /// @param joints in the order of the world; sorted afterwards
    /// @param minimumBatch manifolds and joints up to which islands are put into one group
    void build(btCollisionWorld& world, btSimulationIslandManager& manager, Joints& joints, int minimumBatch);

    /// Finds the next group of awake islands. Bullet calls the solver between two islands, so do the bodies of an
    /// island count that are active when it is asked for.
    ///
    /// @return false after the last group, which may be empty
    bool next(IslandGroup& group);

    btCollisionObject** bodies(const IslandGroup& group) { return at(m_bodies, group.bodies); }
    btPersistentManifold** manifolds(const IslandGroup& group) { return at(m_manifolds, group.manifolds); }
    btTypedConstraint** joints(const IslandGroup& group) { return at(m_joints, group.joints); }

    const std::vector<SharedThing>& sharedThings() const { return m_sharedThings; }
    /// An upper bound of their number.
    std::size_t mostSharedThings() const { return m_sharedThings.capacity(); }

    static constexpr std::uint32_t kNoGroup = ~std::uint32_t{0};
    /// Number of the group of an island, kNoGroup if it sleeps or does not exist.
    std::uint32_t groupOf(int island) const
    {
        return static_cast<std::size_t>(island) < m_groupOfIsland.size()
                   ? m_groupOfIsland[static_cast<std::size_t>(island)]
                   : kNoGroup;
    }

private:
    struct ManifoldKey
    {
        int island;
        btPersistentManifold* manifold;
    };
    struct JointKey
    {
        int island;
        btTypedConstraint* joint;
    };

    template <class T>
    static T* at(std::vector<T>& items, const IslandGroup::Range& range)
    {
        return range.begin == range.end ? nullptr : items.data() + range.begin;
    }

    void sortJoints(Joints& joints);
    void updateSleep(btCollisionWorld& world);
    void collectManifolds(btCollisionWorld& world);
    void addManifold(btPersistentManifold& manifold);
    void sortManifoldsByIds();
    void noteShared(const btCollisionObject& object, int island);
    bool addBodies(int island);
    void addManifolds(int island, bool isActive);
    void addJoints(int island);
    IslandGroup takeGroup();

    // Of the step.
    btSimulationIslandManager* m_manager = nullptr;
    const btCollisionObjectArray* m_objects = nullptr;
    int m_minimumBatch = 0;
    std::vector<ManifoldKey> m_manifoldKeys;     ///< sorted by island
    std::vector<JointKey> m_jointKeys;           ///< sorted by island
    std::vector<std::uint32_t> m_firstJointKey;  ///< [island], kNoGroup if it has none
    std::vector<std::uint32_t> m_groupOfIsland;  ///< [island]
    std::vector<SharedThing> m_sharedThings;

    // Those of all groups, one after the other.
    std::vector<btCollisionObject*> m_bodies;
    std::vector<btPersistentManifold*> m_manifolds;
    std::vector<btTypedConstraint*> m_joints;

    // Where next() continues.
    int m_element = 0;
    std::size_t m_manifoldKey = 0;
    IslandGroup m_group;
    std::uint32_t m_groups = 0;
    bool m_isFinished = true;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
