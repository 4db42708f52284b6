// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>

#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class MeshQueries;

/// Keeps what prepare() has built for a mesh. Queries use it as long as this lives.
class CULLET_API PreparedMesh
{
public:
    /// Of no mesh.
    PreparedMesh() noexcept;
    explicit PreparedMesh(std::unique_ptr<MeshQueries> queries) noexcept;
    ~PreparedMesh();
    PreparedMesh(PreparedMesh&&) noexcept;
    PreparedMesh& operator=(PreparedMesh&&) noexcept;

    /// False where prepare() has left the shape to Bullet.
    bool isPrepared() const noexcept { return m != nullptr; }

    /// Bytes beside the application's arrays; 0 if nothing is prepared.
    std::uint64_t bytes() const noexcept;

private:
    std::unique_ptr<MeshQueries> m;
};

/// Declares the triangles of a mesh constant and builds a tree for rays and sweeps, 36 bytes a triangle: World::rayTest()
/// and the functions of world_queries.h then use it in place of Bullet's nodes. So they do for each
/// btScaledBvhTriangleMeshShape whose child the shape is.
///
/// While the result lives, the application keeps the shape, its mesh interface and the arrays as they are: to change or
/// delete any of them, it destroys the result first. Vertices are read from the application's arrays in each query, so
/// that no hit is reported where no triangle is. Queries also compare the shape with what it was when it was prepared:
/// class, mesh interface, Bullet's tree, scaling, bounds, addresses and sizes of all arrays, and the corners of a few
/// triangles. If anything differs, as with another shape at the address of a deleted one, they use Bullet's nodes.
///
/// With IsaGjkOptions::reusePose, bodies that rest on the mesh keep their contacts without reading its triangles.
///
/// Prepared are shapes of exactly the classes btBvhTriangleMeshShape and btMultimaterialTriangleMeshShape, with Bullet's
/// tree, whose mesh interface is of one of Bullet's classes. For others the result isPrepared() is false, and queries are Bullet's.
///
/// @param threads for building the tree, which is the same for any number of them; 0: as many as the machine has
/// Threads: any; another thread may query other shapes meanwhile.
/// Errors: std::bad_alloc.
[[nodiscard]] CULLET_API PreparedMesh prepare(const btBvhTriangleMeshShape& shape, int threads = 1);
}  // namespace CULLET_PRECISION
}  // namespace cullet
