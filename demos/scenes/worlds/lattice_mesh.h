// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Adds two triangles for each cell of a square lattice, which face up.
///
/// @param first,last corners along x and z
/// @param cornerAt   place of a corner, from its x and z
template <class CornerAt>
void addLattice(btTriangleMesh& mesh, int first, int last, const CornerAt& cornerAt)
{
    for (int x = first; x < last; ++x)
    {
        for (int z = first; z < last; ++z)
        {
            mesh.addTriangle(cornerAt(x, z), cornerAt(x, z + 1), cornerAt(x + 1, z));
            mesh.addTriangle(cornerAt(x + 1, z), cornerAt(x, z + 1), cornerAt(x + 1, z + 1));
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
