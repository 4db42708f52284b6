// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_box.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <LinearMath/btTransform.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
using TriangleVertices = std::array<Eigen::Vector3f, 3>;

/// What meets the triangles of a mesh: hulls, or the triangles of another mesh. One of the lists is empty.
struct MidphaseQueries
{
    const Hull<btScalar>* hull = nullptr;       ///< of all hulls
    std::vector<Eigen::Vector3f> hullPoints;    ///< of the hull
    std::vector<std::array<int, 3>> hullFaces;  ///< triangles of hullPoints
    std::vector<Eigen::Matrix3f> bases;         ///< of each hull
    std::vector<Eigen::Vector3f> origins;
    std::vector<TriangleVertices> triangles;

    std::size_t size() const { return hull != nullptr ? bases.size() : triangles.size(); }
    MeshBox boxOf(std::size_t query) const;
    /// A face of a hull, in the world.
    TriangleVertices faceOf(std::size_t query, std::size_t face) const;
};

/// A mesh and what moves over it, frame by frame.
class MidphaseScene
{
public:
    virtual ~MidphaseScene() = default;
    virtual void advance() = 0;

    const char* name = "";
    std::vector<TriangleVertices> mesh;
    MidphaseQueries queries;

    std::vector<MeshBox> meshBoxes() const;
};

/// hills: hulls of 42 points move over a mesh that stays. bumps: a bumpy ball of 1,280 triangles moves through another.
/// cloth: a cloth falls onto hulls of 42 points and is draped over them; springs and spheres around the hulls shape it.
std::vector<std::unique_ptr<MidphaseScene>> makeMidphaseScenes(bool isSmall, std::uint64_t seed);
}  // namespace CULLET_PRECISION
}  // namespace cullet
