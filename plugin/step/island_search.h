// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/plugin/core/precision.h"

#include <LinearMath/btAlignedObjectArray.h>

#include <cstddef>
#include <vector>

class btCollisionObject;
class btCollisionWorld;
class btPersistentManifold;
class btSimulationIslandManager;
class btTypedConstraint;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Gives each object the number of its island, as btDiscreteDynamicsWorld::calculateSimulationIslands(): the same
/// unions in the same order. Objects are prefetched, and a static one is only read while it stays as it is. A manager of
/// the application is called as by Bullet.
class IslandSearch
{
public:
    /// The parts of a world.
    struct Step
    {
        btCollisionWorld& world;
        btSimulationIslandManager& manager;
        const btAlignedObjectArray<btPersistentManifold*>& predictive;  ///< of bodies with a CCD threshold
        const btAlignedObjectArray<btTypedConstraint*>& joints;
        const Array<int>* restless;  ///< indices of the objects that are not at rest; null: any may be
    };

    /// Reserves memory for run(). Throws std::bad_alloc.
    void reserve(std::size_t objects);

    void run(const Step& step);

private:
    void numberObjects(const Step& step);
    void numberObject(btCollisionObject& object, int index);
    void storeIslands(const btCollisionWorld& world, btSimulationIslandManager& manager) const;

    std::vector<int> m_movers;  ///< indices of the objects that have an island
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
