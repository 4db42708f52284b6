// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The first and the last corner of a lattice along an axis.
struct LatticeRange
{
    int first, last;
};

/// Adds two triangles for each cell of a lattice, which face up.
///
/// @param cornerAt place of a corner, from its x and z
template <class CornerAt>
void addLattice(btTriangleMesh& mesh, const LatticeRange& alongX, const LatticeRange& alongZ,
                const CornerAt& cornerAt)
{
    for (int x = alongX.first; x < alongX.last; ++x)
    {
        for (int z = alongZ.first; z < alongZ.last; ++z)
        {
            mesh.addTriangle(cornerAt(x, z), cornerAt(x, z + 1), cornerAt(x + 1, z));
            mesh.addTriangle(cornerAt(x + 1, z), cornerAt(x, z + 1), cornerAt(x + 1, z + 1));
        }
    }
}

/// addLattice() with the same corners along x and z.
template <class CornerAt>
void addLattice(btTriangleMesh& mesh, int first, int last, const CornerAt& cornerAt)
{
    addLattice(mesh, {first, last}, {first, last}, cornerAt);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
