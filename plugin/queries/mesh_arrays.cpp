// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_arrays.h"

#include "cullet/base/bytes_of.h"

#include <algorithm>
#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
MeshArrays::Part MeshArrays::readPart(const btStridingMeshInterface& mesh, int index)
{
    Part part = {MeshPart::lock(mesh, index)};
    mesh.unLockReadOnlyVertexBase(index);
    part.triangleCount = std::max(part.triangleCount, 0);
    return part;
}

MeshArrays::MeshArrays(const btStridingMeshInterface& mesh) : m_scaling(mesh.getScaling())
{
    for (int index = 0; index < mesh.getNumSubParts(); ++index)
    {
        Part part = readPart(mesh, index);
        part.first = static_cast<std::uint32_t>(triangleCount());
        const bool hasVertices = part.vertexType == PHY_FLOAT || part.vertexType == PHY_DOUBLE;
        const bool hasIndices =
            part.indexType == PHY_INTEGER || part.indexType == PHY_SHORT || part.indexType == PHY_UCHAR;
        m_isReadable = m_isReadable && hasVertices && hasIndices;
        m_parts.push_back(part);
    }
}

bool MeshArrays::areThoseOf(const btStridingMeshInterface& mesh) const
{
    if (!hasSameBits(mesh.getScaling(), m_scaling) ||
        mesh.getNumSubParts() != static_cast<int>(m_parts.size()))
        return false;
    for (std::size_t index = 0; index < m_parts.size(); ++index)
    {
        const Part &known = m_parts[index], part = readPart(mesh, static_cast<int>(index));
        if (part.vertices != known.vertices || part.indices != known.indices ||
            part.vertexCount != known.vertexCount || part.vertexStride != known.vertexStride ||
            part.indexStride != known.indexStride || part.triangleCount != known.triangleCount ||
            part.vertexType != known.vertexType || part.indexType != known.indexType)
            return false;
    }
    return true;
}

bool MeshArrays::has(TriangleName name) const noexcept
{
    return name.part >= 0 && name.part < static_cast<int>(m_parts.size()) && name.index >= 0 &&
           name.index < m_parts[static_cast<std::size_t>(name.part)].triangleCount;
}

std::uint64_t MeshArrays::triangleCount() const noexcept
{
    std::uint64_t count = 0;
    for (const Part& part : m_parts)
        count += static_cast<std::uint64_t>(part.triangleCount);
    return count;
}

void MeshArrays::read(TriangleName name, btVector3* corners) const
{
    m_parts[static_cast<std::size_t>(name.part)].read(name.index, m_scaling, corners);
}

std::uint64_t MeshArrays::bytes() const noexcept
{
    return bytesOf(m_parts);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
