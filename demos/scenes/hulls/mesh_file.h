// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/mesh_hull.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
/// What reading a mesh file may take.
struct MeshLimits
{
    double seconds;
    std::uint64_t bytes;  ///< of address space on top of what this process has
};

/// Limits that no sound mesh of so many bytes reaches: a broken count in a small file makes Assimp loop or allocate for
/// hours.
MeshLimits limitsForMesh(std::uint64_t fileBytes);

/// The vertices of all meshes of a file.
///
/// Assimp runs in a process of its own, so that neither a loop nor a crash in it reaches this one.
///
/// @throws MeshError when the file is missing, cannot be read, or takes more than the limits allow
std::vector<Point> readMeshVertices(const std::string& path, const MeshLimits& limits);
}  // namespace cullet
