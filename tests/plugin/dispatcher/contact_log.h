// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstring>
#include <vector>

namespace cullet::test
{
/// Bullet's contact events in order, and the manifolds after each step, bit by bit.
class ContactLog
{
public:
    ContactLog()
    {
        s_entries.clear();
        s_points = 0;
        gContactStartedCallback = [](btPersistentManifold* const& manifold) { addPair('S', *manifold); };
        gContactEndedCallback = [](btPersistentManifold* const& manifold) { addPair('E', *manifold); };
        gContactProcessedCallback = [](btManifoldPoint& point, void* a, void* b)
        {
            // Non-null user data makes Bullet report the removal of the point.
            if (point.m_userPersistentData == nullptr)
                point.m_userPersistentData = reinterpret_cast<void*>(++s_points);
            s_entries.push_back('P');
            s_entries.push_back(reinterpret_cast<std::uintptr_t>(point.m_userPersistentData));
            addBodies(static_cast<btCollisionObject*>(a), static_cast<btCollisionObject*>(b));
            addPoint(point);
            return true;
        };
        gContactDestroyedCallback = [](void* point)
        {
            s_entries.push_back('D');
            s_entries.push_back(reinterpret_cast<std::uintptr_t>(point));
            return true;
        };
    }
    ~ContactLog()
    {
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
        gContactProcessedCallback = nullptr;
        gContactDestroyedCallback = nullptr;
    }
    ContactLog(const ContactLog&) = delete;
    ContactLog& operator=(const ContactLog&) = delete;

    void addManifolds(btCollisionDispatcher& dispatcher)
    {
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            addPair('M', manifold);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
                addPoint(manifold.getContactPoint(k));
        }
    }
    const std::vector<std::uint64_t>& entries() const { return s_entries; }

private:
    static void addPair(char event, const btPersistentManifold& manifold)
    {
        s_entries.push_back(std::uint64_t(event));
        s_entries.push_back(std::uint64_t(manifold.getNumContacts()));
        addBodies(manifold.getBody0(), manifold.getBody1());
    }
    static void addBodies(const btCollisionObject* a, const btCollisionObject* b)
    {
        s_entries.push_back(std::uint64_t(a->getUserIndex()));
        s_entries.push_back(std::uint64_t(b->getUserIndex()));
    }
    static void addPoint(const btManifoldPoint& point)
    {
        addBits(point.getDistance());
        for (const btVector3* v :
             {&point.getPositionWorldOnA(), &point.getPositionWorldOnB(), &point.m_normalWorldOnB})
        {
            for (int axis = 0; axis < 3; ++axis)
                addBits((*v)[axis]);
        }
    }
    static void addBits(btScalar value)
    {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(value));
        s_entries.push_back(bits);
    }

    inline static std::vector<std::uint64_t> s_entries;
    inline static std::uintptr_t s_points;
};
}  // namespace cullet::test
