// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// In place of mesh_file.cpp where a program cannot fork().
#include "cullet/demos/scenes/hulls/mesh_file.h"

namespace cullet
{
MeshLimits limitsForMesh(std::uint64_t /*fileBytes*/)
{
    return {0, 0};
}

std::vector<Point> readMeshVertices(const std::string& path, const MeshLimits& /*limits*/)
{
    throw MeshError("mesh '" + path + "': this program reads no mesh files under Windows");
}
}  // namespace cullet
