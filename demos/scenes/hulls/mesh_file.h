// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/mesh_hull.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
/// Resource limits for reading a mesh file.
struct MeshLimits
{
    double seconds;
    std::uint64_t bytes;  ///< of address space in addition to that of this process
};

/// Limits that no valid mesh of that size reaches: a corrupt count in a small file makes Assimp loop or allocate for
/// hours.
MeshLimits limitsForMesh(std::uint64_t fileBytes);

/// The vertices of all meshes of a file.
///
/// Assimp runs in a separate process, so that neither a loop nor a crash in it affects this one. Whatever the bytes of
/// the file are, this returns or throws soon after the limit of time, and leaves no process behind. The vertices may have
/// infinities and NaNs; reduceToHull() refuses these.
///
/// @throws MeshError if the file is missing, cannot be read, or exceeds the limits
std::vector<Point> readMeshVertices(const std::string& path, const MeshLimits& limits);
}  // namespace cullet
