// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/mesh_part.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One part of a mesh while its arrays are locked.
class LockedPart
{
public:
    explicit LockedPart(const btStridingMeshInterface& mesh) : m_mesh(mesh) {}
    ~LockedPart() { unlock(); }
    LockedPart(const LockedPart&) = delete;
    LockedPart& operator=(const LockedPart&) = delete;

    void lock(int index)
    {
        if (m_index == index)
            return;
        unlock();
        m_part = MeshPart::lock(m_mesh, index);
        m_index = index;
    }

    void read(int triangle, btVector3* corners) const { m_part.read(triangle, m_mesh.getScaling(), corners); }

private:
    void unlock()
    {
        if (m_index >= 0)
            m_mesh.unLockReadOnlyVertexBase(m_index);
        m_index = -1;
    }

    const btStridingMeshInterface& m_mesh;
    int m_index = -1;  ///< of the locked part; -1: none
    MeshPart m_part;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
