// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"

#include <cstring>
#include <deque>
#include <new>

namespace cullet::test
{
/// A body with a proxy whose memory is overwritten on destruction, so that a later read is detected.
class DoomedBody
{
public:
    DoomedBody(btCollisionShape& shape, const btVector3& at) : m_body(new (m_memory) btCollisionObject)
    {
        m_body->setCollisionShape(&shape);
        m_body->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        proxy.m_clientObject = m_body;
    }
    ~DoomedBody() { destroy(); }
    DoomedBody(const DoomedBody&) = delete;
    DoomedBody& operator=(const DoomedBody&) = delete;

    void destroy()
    {
        if (m_body == nullptr)
            return;
        m_body->~btCollisionObject();
        m_body = nullptr;
        std::memset(m_memory, 0xff, sizeof(m_memory));
    }
    btCollisionObject* get() { return m_body; }

    btBroadphaseProxy proxy{vec(0, 0, 0), vec(0, 0, 0), nullptr, 1, -1};

private:
    alignas(btCollisionObject) unsigned char m_memory[sizeof(btCollisionObject)];
    btCollisionObject* m_body;
};

/// ConvexWorld::addIdleRow() without a world.
inline void addDoomedRow(std::deque<DoomedBody>& row, btCollisionShape& cube, btOverlappingPairCache& cache)
{
    for (int i = 0; i < 5; ++i)
    {
        row.emplace_back(cube, vec(1.12 * i, 0, 0)).proxy.m_uniqueId = i + 1;
        if (i > 0)
            cache.addOverlappingPair(&row[std::size_t(i) - 1].proxy, &row[std::size_t(i)].proxy);
    }
}
}  // namespace cullet::test
