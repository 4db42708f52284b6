// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/recording_broadphase.h"

#include "cullet/recording/box_stream.h"

#include <exception>
#include <functional>
#include <queue>
#include <unordered_map>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
StreamBox streamBox(const btVector3& low, const btVector3& high)
{
    StreamBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = low[axis];
        box.max[axis] = high[axis];
    }
    return box;
}

/// The last recorded state of a live proxy.
struct RecordedProxy
{
    const btBroadphaseProxy* proxy = nullptr;  ///< null: the id is free
    int group = 0;
    int mask = 0;
};
}  // namespace

struct RecordingBroadphase::Parts
{
    Parts(btBroadphaseInterface& broadphase, const std::string& path)
        : inner(broadphase),
          writer(path, sizeof(btScalar) == sizeof(float) ? StreamPrecision::Float : StreamPrecision::Double)
    {
    }

    /// Calls record(), unless the recording has failed: its tables may then name proxies that no longer exist.
    template <class Record>
    void record(const Record& record) noexcept
    {
        if (!writer.error().empty())
            return;
        try
        {
            record();
        }
        catch (const std::exception&)
        {
            writer.abandon();
        }
    }

    void create(const btBroadphaseProxy* proxy, const StreamBox& box, int group, int mask)
    {
        const std::uint32_t id = allocateId();
        recorded[id] = {proxy, group, mask};
        ids[proxy] = id;
        writer.create(id, box, group, mask);
    }

    void destroy(const btBroadphaseProxy* proxy)
    {
        const auto found = ids.find(proxy);
        if (found == ids.end())
            return;
        writer.destroy(found->second);
        recorded[found->second] = {};
        freeIds.push(found->second);
        ids.erase(found);
    }

    void set(const btBroadphaseProxy* proxy, const StreamBox& box)
    {
        const auto found = ids.find(proxy);
        if (found != ids.end())
            writer.set(found->second, box);
    }

    std::uint32_t allocateId()
    {
        if (freeIds.empty())
        {
            recorded.emplace_back();
            return static_cast<std::uint32_t>(recorded.size() - 1);
        }
        const std::uint32_t id = freeIds.top();
        freeIds.pop();
        return id;
    }

    void recordFilters()
    {
        for (std::uint32_t id = 0; id < recorded.size(); ++id)
        {
            RecordedProxy& one = recorded[id];
            if (one.proxy == nullptr || (one.proxy->m_collisionFilterGroup == one.group &&
                                         one.proxy->m_collisionFilterMask == one.mask))
                continue;
            one.group = one.proxy->m_collisionFilterGroup;
            one.mask = one.proxy->m_collisionFilterMask;
            writer.filter(id, one.group, one.mask);
        }
    }

    btBroadphaseInterface& inner;
    BoxStreamWriter writer;
    std::unordered_map<const btBroadphaseProxy*, std::uint32_t> ids;
    std::vector<RecordedProxy> recorded;  ///< by id
    std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> freeIds;
};

RecordingBroadphase::RecordingBroadphase(btBroadphaseInterface& inner, const std::string& path)
    : m(std::make_unique<Parts>(inner, path))
{
}

RecordingBroadphase::~RecordingBroadphase() = default;

bool RecordingBroadphase::finish()
{
    return m->writer.finish();
}

const std::string& RecordingBroadphase::error() const noexcept
{
    return m->writer.error();
}

std::uint64_t RecordingBroadphase::frames() const noexcept
{
    return m->writer.info().frames;
}

btBroadphaseProxy* RecordingBroadphase::createProxy(const btVector3& aabbMin, const btVector3& aabbMax,
                                                    int shapeType, void* userPtr, int collisionFilterGroup,
                                                    int collisionFilterMask, btDispatcher* dispatcher)
{
    btBroadphaseProxy* proxy = m->inner.createProxy(aabbMin, aabbMax, shapeType, userPtr,
                                                    collisionFilterGroup, collisionFilterMask, dispatcher);
    // btAxisSweep3 returns null when it is full.
    if (proxy == nullptr)
        return nullptr;
    const StreamBox box = streamBox(aabbMin, aabbMax);
    m->record([&] { m->create(proxy, box, collisionFilterGroup, collisionFilterMask); });
    return proxy;
}

void RecordingBroadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    m->record([&] { m->destroy(proxy); });
    m->inner.destroyProxy(proxy, dispatcher);
}

void RecordingBroadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin,
                                  const btVector3& aabbMax, btDispatcher* dispatcher)
{
    m->record([&] { m->set(proxy, streamBox(aabbMin, aabbMax)); });
    m->inner.setAabb(proxy, aabbMin, aabbMax, dispatcher);
}

void RecordingBroadphase::getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const
{
    m->inner.getAabb(proxy, aabbMin, aabbMax);
}

void RecordingBroadphase::rayTest(const btVector3& rayFrom, const btVector3& rayTo,
                                  btBroadphaseRayCallback& rayCallback, const btVector3& aabbMin,
                                  const btVector3& aabbMax)
{
    m->inner.rayTest(rayFrom, rayTo, rayCallback, aabbMin, aabbMax);
}

void RecordingBroadphase::aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                                   btBroadphaseAabbCallback& callback)
{
    m->inner.aabbTest(aabbMin, aabbMax, callback);
}

void RecordingBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher)
{
    m->record(
        [this]
        {
            m->recordFilters();
            m->writer.frame();
        });
    m->inner.calculateOverlappingPairs(dispatcher);
}

btOverlappingPairCache* RecordingBroadphase::getOverlappingPairCache()
{
    return m->inner.getOverlappingPairCache();
}

const btOverlappingPairCache* RecordingBroadphase::getOverlappingPairCache() const
{
    return m->inner.getOverlappingPairCache();
}

void RecordingBroadphase::getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const
{
    m->inner.getBroadphaseAabb(aabbMin, aabbMax);
}

void RecordingBroadphase::resetPool(btDispatcher* dispatcher)
{
    m->inner.resetPool(dispatcher);
}

void RecordingBroadphase::printStats()
{
    m->inner.printStats();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
