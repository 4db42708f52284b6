// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What bodies of one compound shape do, and where.
struct CompoundCase
{
    std::string child = "hull16";  ///< of compoundChildNames()
    std::string other = "mesh";    ///< of compoundOtherNames()
    std::string motion = "rest";   ///< of compoundMotionNames()
    int children = 64;
    int bodies = 4;
    std::uint64_t seed = 1;
};

/// Children: box, sphere, hull16 (a prism of 16 points).
const std::vector<std::string>& compoundChildNames();

/// What bodies meet: plane, box, hull (a wide one below each body), compound (of the same shape, below each body), tiles (a
/// compound of 1,600 boxes of 1 m), mesh and mesh5 (triangles of 0.5 m and of 5 m).
const std::vector<std::string>& compoundOtherNames();

/// rest; sliding: at 2 m/s without friction; falling: in any rotation.
const std::vector<std::string>& compoundMotionNames();

/// Bodies of 2 m that are compounds: children in a cube of rows, two side by side. They meet what lies below, and not each
/// other.
class CompoundStand final : public WorldScene
{
public:
    /// @param narrow one of narrowPhaseNames(); of one thread
    CompoundStand(const CompoundCase& compoundCase, const std::string& narrow);

    /// Transforms of the bodies.
    std::vector<btTransform> poses() const;

    /// Moves the bodies and finds their contacts.
    ///
    /// @return microseconds of thread CPU time of the dispatch
    double dispatchAt(const std::vector<btTransform>& poses);

    int contactCount();

protected:
    void direct() override;

private:
    btCollisionShape& makeChild(btScalar half);
    btCompoundShape& makeCompound();
    void addGround(const btCompoundShape& shape);
    btCollisionShape& makeTiles();
    btCollisionShape& makeMesh(double spacing);
    btCollisionShape& makeWideHull();
    void addBodies(btCompoundShape& shape);
    void place(std::size_t i);

    CompoundCase m_case;
    SplitMix64 m_random;
    std::vector<btRigidBody*> m_bodies;
    std::vector<btVector3> m_sites;
    int m_step = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
