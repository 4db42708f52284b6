// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/world/saved_world.h"

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <ostream>
#include <vector>

namespace cullet::test
{
enum class SavedScene
{
    Hulls,
    Boxes,
    /// Two compounds may touch with several of their parts.
    Compounds,
    /// Each part of a compound touches a body of its own.
    SparseCompounds,
    Mesh,
    Ragdolls,
    Multibodies
};

inline void PrintTo(SavedScene scene, std::ostream* out)
{
    constexpr const char* kNames[] = {"Hulls", "Boxes",    "Compounds",  "SparseCompounds",
                                      "Mesh",  "Ragdolls", "Multibodies"};
    *out << kNames[static_cast<int>(scene)];
}

/// Scenes of bodies that fall, touch and roll, and their shapes, which several worlds can share.
class SavedScenes
{
public:
    SavedScenes();

    /// Fills an empty world. The same scene is always filled in the same way.
    ///
    /// @param sleeps false: no body comes to rest
    void build(SavedWorld& saved, SavedScene scene, bool sleeps) const;

private:
    using Shape = std::unique_ptr<btCollisionShape>;

    void addHeap(SavedWorld& saved, const std::vector<const Shape*>& kinds, double spacing) const;
    void addSparseCompounds(SavedWorld& saved) const;
    void addRagdolls(SavedWorld& saved) const;
    void addChains(SavedWorld& saved) const;

    btTriangleMesh m_triangles;
    Shape m_ground, m_brick, m_ball, m_cube, m_box, m_plank, m_limb, m_pair, m_dumbbell, m_mesh;
};
}  // namespace cullet::test
