// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <vector>

class btCollisionObject;
class btPersistentManifold;
class btTypedConstraint;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Bodies, contacts and joints that one call of btConstraintSolver::solveGroup() gets: an island, or several small ones, one
/// after the other.
struct SolverGroup
{
    btCollisionObject** bodies;
    int bodyCount;
    btPersistentManifold** manifolds;
    int manifoldCount;
    btTypedConstraint** joints;
    int jointCount;
};

/// Divides a group into its islands, by the tags of the bodies.
///
/// A group whose bodies Bullet has not sorted by tags, or in which something joins two tags, is one island: so are all bodies of
/// a world that does not split islands, and what an application has put together for the solver itself.
class GroupIslands
{
public:
    explicit GroupIslands(const SolverGroup& group);

    /// Whether a group may have more than one island. Costs nothing.
    static bool areMany(const SolverGroup& group);

    /// Takes the next island.
    ///
    /// @return false if there is none
    bool next(SolverGroup& island);

private:
    SolverGroup m_rest;
    bool m_isDivided;
};

/// Islands of a group that have something in common, in their order, as a group of their own: small islands share lanes.
class IslandSelection
{
public:
    /// Throws std::bad_alloc.
    ///
    /// @param isWanted called with each island
    /// @return the islands that are wanted, until the next call
    template <class IsWanted>
    SolverGroup select(const SolverGroup& group, const IsWanted& isWanted)
    {
        clear();
        GroupIslands islands(group);
        for (SolverGroup island; islands.next(island);)
        {
            if (isWanted(island))
                add(island);
        }
        return selected();
    }

private:
    void clear();
    void add(const SolverGroup& island);
    SolverGroup selected();

    std::vector<btCollisionObject*> m_bodies;
    std::vector<btPersistentManifold*> m_manifolds;
    std::vector<btTypedConstraint*> m_joints;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
