// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <LinearMath/btPoolAllocator.h>
#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstring>

namespace cullet::test
{
/// The places of manifolds and algorithms in Bullet's pools.
enum class Places
{
    Logged,
    Ignored  ///< parts of compounds, which threads create, have none
};

/// A hash of all manifolds in their order, with everything that a solver or an application may read, and of their places.
/// No callback is set, unlike in ContactLog.
class ManifoldLog
{
public:
    explicit ManifoldLog(Places places = Places::Logged) : m_places(places) {}

    void add(btCollisionDispatcher& dispatcher, btOverlappingPairCache& pairs)
    {
        const btPoolAllocator& pool = *dispatcher.getInternalManifoldPool();
        add(dispatcher.getNumManifolds());
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            addPlace(pool, &manifold);
            add(manifold);
        }
        const btPoolAllocator& algorithms =
            *dispatcher.getCollisionConfiguration()->getCollisionAlgorithmPool();
        for (int i = 0; i < pairs.getNumOverlappingPairs(); ++i)
            addPlace(algorithms, pairs.getOverlappingPairArray()[i].m_algorithm);
        if (m_places == Places::Logged)
            add(algorithms.getFreeCount());
    }
    std::uint64_t hash() const { return m_hash; }
    int points() const { return m_points; }

private:
    void add(const btPersistentManifold& manifold)
    {
        add(manifold.m_index1a);
        add(manifold.getBody0()->getUserIndex());
        add(manifold.getBody1()->getUserIndex());
        add(manifold.getContactBreakingThreshold());
        add(manifold.getContactProcessingThreshold());
        add(manifold.getNumContacts());
        m_points += manifold.getNumContacts();
        for (int i = 0; i < manifold.getNumContacts(); ++i)
            add(manifold.getContactPoint(i));
    }
    void add(const btManifoldPoint& point)
    {
        for (const btVector3* v : {&point.m_localPointA, &point.m_localPointB, &point.m_positionWorldOnA,
                                   &point.m_positionWorldOnB, &point.m_normalWorldOnB})
        {
            for (int axis = 0; axis < 3; ++axis)
                add((*v)[axis]);
        }
        for (const btScalar value :
             {point.m_distance1, point.m_combinedFriction, point.m_combinedRestitution,
              point.m_combinedRollingFriction, point.m_appliedImpulse, point.m_appliedImpulseLateral1})
            add(value);
        for (const int value :
             {point.m_partId0, point.m_partId1, point.m_index0, point.m_index1, point.m_lifeTime})
            add(value);
    }
    void addPlace(const btPoolAllocator& pool, const void* memory)
    {
        if (m_places == Places::Ignored)
            return;
        auto& mutablePool = const_cast<btPoolAllocator&>(pool);
        const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(mutablePool.getPoolAddress());
        add(mutablePool.validPtr(const_cast<void*>(memory)) ? reinterpret_cast<std::uintptr_t>(memory) - first
                                                            : ~std::uintptr_t(0));
    }
    template <class Value>
    void add(const Value& value)
    {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(value));
        m_hash = (m_hash ^ bits) * 1099511628211ull;
    }

    Places m_places;
    std::uint64_t m_hash = 14695981039346656037ull;
    int m_points = 0;
};
}  // namespace cullet::test
