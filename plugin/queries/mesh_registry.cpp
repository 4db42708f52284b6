// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_registry.h"

#include "cullet/base/held_while_forking.h"
#include "cullet/plugin/queries/mesh_queries.h"

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
template <class Visit>
void MeshRegistry::Table::probe(const btBvhTriangleMeshShape* shape, const Visit& visit) const
{
    // The high bits of the product depend on all bits of the address.
    const std::uint64_t hash =
        static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(shape)) * 0x9E3779B97F4A7C15u;
    const auto first = static_cast<std::size_t>(hash >> 32);
    for (std::size_t i = 0; i <= mask; ++i)
    {
        if (visit(slots[(first + i) & mask]))
            return;
    }
}

/// @pre a slot is free
void MeshRegistry::Table::insert(const MeshQueries& mesh) noexcept
{
    probe(&mesh.shape(),
          [&](Slot& slot)
          {
              if (slot.shape.load(std::memory_order_relaxed) != nullptr)
                  return false;
              slot.mesh.store(&mesh, std::memory_order_relaxed);
              slot.shape.store(&mesh.shape(), std::memory_order_release);
              return true;
          });
}

MeshRegistry::MeshRegistry()
{
    holdWhileForking(m_mutex);
}

MeshRegistry& MeshRegistry::shared()
{
    // Never destroyed: a static variable of the program may hold a PreparedMesh.
    static MeshRegistry& registry = *new MeshRegistry;
    return registry;
}

void MeshRegistry::add(const MeshQueries& mesh)
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    const std::size_t size = m_tables.empty() ? 0 : m_tables.back()->mask + 1;
    if (2 * (m_count + 1) > size)
    {
        auto larger = std::make_unique<Table>(size == 0 ? 16 : 2 * size);
        for (std::size_t i = 0; i < size; ++i)
        {
            if (const MeshQueries* known = m_tables.back()->slots[i].mesh.load(std::memory_order_relaxed))
                larger->insert(*known);
        }
        m_tables.push_back(std::move(larger));
        m_table.store(m_tables.back().get(), std::memory_order_release);
    }
    m_tables.back()->insert(mesh);
    ++m_count;
}

void MeshRegistry::remove(const MeshQueries& mesh) noexcept
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    m_tables.back()->probe(&mesh.shape(),
                           [&](Slot& slot)
                           {
                               if (slot.mesh.load(std::memory_order_relaxed) != &mesh)
                                   return false;
                               slot.shape.store(nullptr, std::memory_order_relaxed);
                               slot.mesh.store(nullptr, std::memory_order_relaxed);
                               return true;
                           });
    --m_count;
}

const MeshQueries* MeshRegistry::find(const btBvhTriangleMeshShape& shape) const noexcept
{
    const Table* const table = m_table.load(std::memory_order_acquire);
    const MeshQueries* found = nullptr;
    if (table == nullptr)
        return nullptr;
    table->probe(&shape,
                 [&](Slot& slot)
                 {
                     if (slot.shape.load(std::memory_order_acquire) != &shape)
                         return false;
                     const MeshQueries* const mesh = slot.mesh.load(std::memory_order_relaxed);
                     if (mesh != nullptr && mesh->isCurrent())
                         found = mesh;
                     return found != nullptr;
                 });
    return found;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
