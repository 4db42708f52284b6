// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <cstddef>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Creations and releases of manifolds in their order, and algorithms whose memory is free, for a dispatcher that repeats
/// them later.
///
/// The list runs through the manifolds, so that recording needs no memory: destructors release manifolds, and must not
/// fail. No code reads the companion ids of a manifold before its creation is repeated, nor its bodies after its release.
class ManifoldRecord
{
public:
    void addCreation(btPersistentManifold& manifold) noexcept { add(reinterpret_cast<Event>(&manifold)); }
    /// @param manifold has been cleared
    void addRelease(btPersistentManifold& manifold) noexcept
    {
        add(reinterpret_cast<Event>(&manifold) | kRelease);
    }
    /// @param memory of a destroyed algorithm, in the pool
    void addFreed(void* memory) noexcept;

    bool isEmpty() const { return m_first == 0 && m_freed == nullptr; }

    /// Does to the dispatcher what was recorded, as Bullet does it, and forgets it.
    /// Errors: what an allocator of the application throws; the rest of the record remains.
    void replay(btCollisionDispatcher& dispatcher);

private:
    using Event = std::uint64_t;  ///< the address of a manifold, with kRelease or without
    static constexpr Event kRelease = 1;

    static btPersistentManifold& manifoldOf(Event event)
    {
        return *reinterpret_cast<btPersistentManifold*>(std::uintptr_t(event & ~kRelease));
    }
    static Event next(Event event);
    static void setNext(Event event, Event next);
    void add(Event event) noexcept;

    Event m_first = 0, m_last = 0;
    void* m_freed = nullptr;  ///< each points to the next
};

/// Scope in which the manifolds that a thread creates and releases in a dispatcher are recorded.
class Recording
{
public:
    enum class Of : std::uint8_t
    {
        Pass,  ///< on the thread of the dispatch: memory comes from Bullet's pools
        Job    ///< on any thread: memory comes from the heap, and memory of the pools is freed later
    };

    /// @param dispatcher, record must outlive this object
    Recording(btCollisionDispatcher& dispatcher, ManifoldRecord& record, Of of)
        : m_dispatcher(dispatcher), m_record(record), m_of(of), m_outer(t_current)
    {
        t_current = this;
    }
    ~Recording() { t_current = m_outer; }
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// The recording of the calling thread in a dispatcher; null: none.
    static Recording* ofThisThread(const btDispatcher* dispatcher)
    {
        Recording* recording = t_current;
        while (recording != nullptr && &recording->m_dispatcher != dispatcher)
            recording = recording->m_outer;
        return recording;
    }
    static bool isInJob(const btDispatcher* dispatcher)
    {
        const Recording* const recording = ofThisThread(dispatcher);
        return recording != nullptr && recording->m_of == Of::Job;
    }

    /// A manifold that is not yet in the dispatcher's array. Errors: std::bad_alloc.
    btPersistentManifold& create(const btCollisionObject& a, const btCollisionObject& b,
                                 btScalar breakingThreshold);
    void release(btPersistentManifold& manifold) noexcept;
    /// Memory for an algorithm, in a job. Errors: std::bad_alloc.
    static void* allocate(std::size_t size);
    /// Frees the memory of an algorithm in a job.
    void free(void* algorithm) noexcept;

private:
    static inline thread_local Recording* t_current = nullptr;

    btCollisionDispatcher& m_dispatcher;
    ManifoldRecord& m_record;
    Of m_of;
    Recording* m_outer;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
