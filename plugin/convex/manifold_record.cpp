// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/manifold_record.h"

#include <LinearMath/btPoolAllocator.h>

#include <new>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// What Bullet shows to classes derived from its dispatcher only.
struct Insight : btCollisionDispatcher
{
    static btAlignedObjectArray<btPersistentManifold*>& manifoldsOf(btCollisionDispatcher& dispatcher)
    {
        return dispatcher.*(&Insight::m_manifoldsPtr);
    }
    static btPoolAllocator& manifoldPoolOf(btCollisionDispatcher& dispatcher)
    {
        return *(dispatcher.*(&Insight::m_persistentManifoldPoolAllocator));
    }
    static btPoolAllocator& algorithmPoolOf(btCollisionDispatcher& dispatcher)
    {
        return *(dispatcher.*(&Insight::m_collisionAlgorithmPoolAllocator));
    }
};

void*& nextFreed(void* memory)
{
    return *static_cast<void**>(memory);
}

void* allocateOrThrow(std::size_t size)
{
    void* const memory = btAlignedAlloc(size, 16);
    if (memory == nullptr)
        throw std::bad_alloc();
    return memory;
}

/// The end of btCollisionDispatcher::getNewManifold().
void append(btCollisionDispatcher& dispatcher, btPersistentManifold& manifold)
{
    auto& all = Insight::manifoldsOf(dispatcher);
    all.push_back(&manifold);
    manifold.m_index1a = all.size() - 1;
    manifold.m_companionIdA = manifold.m_companionIdB = 0;
}
}  // namespace

ManifoldRecord::Event ManifoldRecord::next(Event event)
{
    const btPersistentManifold& manifold = manifoldOf(event);
    if ((event & kRelease) != 0)
        return reinterpret_cast<std::uintptr_t>(manifold.getBody0());
    return std::uint64_t(std::uint32_t(manifold.m_companionIdA)) |
           std::uint64_t(std::uint32_t(manifold.m_companionIdB)) << 32;
}

void ManifoldRecord::setNext(Event event, Event next)
{
    btPersistentManifold& manifold = manifoldOf(event);
    if ((event & kRelease) != 0)
        return manifold.setBodies(reinterpret_cast<const btCollisionObject*>(std::uintptr_t(next)), nullptr);
    manifold.m_companionIdA = int(std::uint32_t(next));
    manifold.m_companionIdB = int(std::uint32_t(next >> 32));
}

void ManifoldRecord::add(Event event) noexcept
{
    setNext(event, 0);
    if (m_first == 0)
        m_first = event;
    else
        setNext(m_last, event);
    m_last = event;
}

void ManifoldRecord::addFreed(void* memory) noexcept
{
    nextFreed(memory) = std::exchange(m_freed, memory);
}

void ManifoldRecord::replay(btCollisionDispatcher& dispatcher)
{
    while (m_first != 0)
    {
        btPersistentManifold& manifold = manifoldOf(m_first);
        const Event following = next(m_first);
        if ((m_first & kRelease) != 0)
            dispatcher.btCollisionDispatcher::releaseManifold(&manifold);
        else
            append(dispatcher, manifold);
        m_first = following;
    }
    while (m_freed != nullptr)
        dispatcher.btCollisionDispatcher::freeCollisionAlgorithm(std::exchange(m_freed, nextFreed(m_freed)));
}

btPersistentManifold& Recording::create(const btCollisionObject& a, const btCollisionObject& b,
                                        btScalar breakingThreshold)
{
    void* memory = nullptr;
    if (m_of == Of::Pass)
        memory = Insight::manifoldPoolOf(m_dispatcher).allocate(sizeof(btPersistentManifold));
    if (memory == nullptr)
        memory = allocateOrThrow(sizeof(btPersistentManifold));
    auto* const manifold = new (memory)
        btPersistentManifold(&a, &b, 0, breakingThreshold,
                             btMin(a.getContactProcessingThreshold(), b.getContactProcessingThreshold()));
    m_record.addCreation(*manifold);
    return *manifold;
}

void Recording::release(btPersistentManifold& manifold) noexcept
{
    m_dispatcher.btCollisionDispatcher::clearManifold(&manifold);
    m_record.addRelease(manifold);
}

void* Recording::allocate(std::size_t size)
{
    return allocateOrThrow(size);
}

void Recording::free(void* algorithm) noexcept
{
    if (Insight::algorithmPoolOf(m_dispatcher).validPtr(algorithm))
        m_record.addFreed(algorithm);
    else
        btAlignedFree(algorithm);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
