// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class MeshQueries;

/// The prepared meshes of the process. Any thread may use it.
///
/// Readers take no lock. A full table is replaced by one of twice the size, and kept, since a reader may still be in it:
/// together they are no larger than the last one.
class MeshRegistry
{
public:
    static MeshRegistry& shared();

    /// Errors: std::bad_alloc, nothing is added then.
    void add(const MeshQueries& mesh);
    void remove(const MeshQueries& mesh) noexcept;

    bool isEmpty() const noexcept { return m_count.load(std::memory_order_relaxed) == 0; }

    /// What is prepared for a shape that still is as it was then; else null.
    const MeshQueries* find(const btBvhTriangleMeshShape& shape) const noexcept;

private:
    struct Slot
    {
        std::atomic<const btBvhTriangleMeshShape*> shape{nullptr};  ///< null: free
        std::atomic<const MeshQueries*> mesh{nullptr};
    };

    struct Table
    {
        explicit Table(std::size_t size) : mask(size - 1), slots(new Slot[size]) {}

        /// Calls visit(slot), until it returns true, for each slot from the one on where the shape belongs.
        template <class Visit>
        void probe(const btBvhTriangleMeshShape* shape, const Visit& visit) const;
        void insert(const MeshQueries& mesh) noexcept;

        std::size_t mask;
        std::unique_ptr<Slot[]> slots;  ///< [mask + 1], at least half of them free
    };

    MeshRegistry();

    std::mutex m_mutex;  ///< of changes
    std::atomic<std::size_t> m_count{0};
    std::atomic<const Table*> m_table{nullptr};
    std::vector<std::unique_ptr<Table>> m_tables;  ///< the last one is in use
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
