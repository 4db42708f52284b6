// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

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

    /// The islands that next() has not taken yet.
    const SolverGroup& rest() const { return m_rest; }

private:
    SolverGroup m_rest;
    bool m_isDivided;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
