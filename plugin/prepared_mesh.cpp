// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/prepared_mesh.h"

#include "cullet/plugin/queries/mesh_queries.h"
#include "cullet/plugin/queries/mesh_registry.h"

#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
PreparedMesh::PreparedMesh() noexcept = default;
PreparedMesh::PreparedMesh(std::unique_ptr<MeshQueries> queries) noexcept : m(std::move(queries)) {}
PreparedMesh::PreparedMesh(PreparedMesh&&) noexcept = default;

PreparedMesh::~PreparedMesh()
{
    if (m)
        MeshRegistry::shared().remove(*m);
}

PreparedMesh& PreparedMesh::operator=(PreparedMesh&& other) noexcept
{
    PreparedMesh ended(std::exchange(m, std::move(other.m)));
    return *this;
}

std::uint64_t PreparedMesh::bytes() const noexcept
{
    return m ? m->bytes() : 0;
}

PreparedMesh prepare(const btBvhTriangleMeshShape& shape, int threads)
{
    std::unique_ptr<MeshQueries> queries = MeshQueries::make(shape, threads);
    if (queries)
        MeshRegistry::shared().add(*queries);
    return PreparedMesh(std::move(queries));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
