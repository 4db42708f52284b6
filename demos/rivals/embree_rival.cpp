// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/rival.h"

#include <embree3/rtcore.h>
#include <mutex>
#include <stdexcept>

namespace cullet
{
namespace
{
/// One geometry whose primitives are the boxes, in a scene that is collided with itself.
class EmbreeRival : public Rival
{
public:
    explicit EmbreeRival(int threads) : m_device(rtcNewDevice(("threads=" + std::to_string(threads)).c_str()))
    {
        if (m_device == nullptr)
            throw std::runtime_error("embree: no device");
        m_scene = rtcNewScene(m_device);
        rtcSetSceneFlags(m_scene, RTC_SCENE_FLAG_DYNAMIC);
        // The fast builder, for trees that are rebuilt in each frame.
        rtcSetSceneBuildQuality(m_scene, RTC_BUILD_QUALITY_LOW);
        m_geometry = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryBuildQuality(m_geometry, RTC_BUILD_QUALITY_LOW);
        rtcSetGeometryUserData(m_geometry, this);
        rtcSetGeometryBoundsFunction(m_geometry, boundsOf, nullptr);
        rtcAttachGeometry(m_scene, m_geometry);
    }

    ~EmbreeRival() override
    {
        rtcReleaseGeometry(m_geometry);
        rtcReleaseScene(m_scene);
        rtcReleaseDevice(m_device);
    }
    EmbreeRival(const EmbreeRival&) = delete;
    EmbreeRival& operator=(const EmbreeRival&) = delete;

    void create(const Aabb* boxes, std::size_t count) override
    {
        m_boxes.insert(m_boxes.end(), boxes, boxes + count);
        rtcSetGeometryUserPrimitiveCount(m_geometry, static_cast<unsigned>(m_boxes.size()));
    }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        for (const std::uint32_t row : rows)
            m_boxes[row] = boxes[row];
    }

    void remove(std::uint32_t row) override { m_boxes[row] = kEmptyAabb; }

    void findPairs(Pairs& pairs) override
    {
        rtcCommitGeometry(m_geometry);
        rtcCommitScene(m_scene);
        m_pairs = &pairs;
        rtcCollide(m_scene, m_scene, collect, this);
        if (rtcGetDeviceError(m_device) != RTC_ERROR_NONE)
            throw std::runtime_error("embree: rtcCollide failed");
    }

private:
    static void boundsOf(const RTCBoundsFunctionArguments* arguments)
    {
        const Aabb& box =
            static_cast<const EmbreeRival*>(arguments->geometryUserPtr)->m_boxes[arguments->primID];
        RTCBounds& bounds = *arguments->bounds_o;
        bounds.lower_x = box.min[0];
        bounds.lower_y = box.min[1];
        bounds.lower_z = box.min[2];
        bounds.upper_x = box.max[0];
        bounds.upper_y = box.max[1];
        bounds.upper_z = box.max[2];
    }

    /// Called from all threads with candidates: each pair in both orders, and each box with itself.
    static void collect(void* self, RTCCollision* candidates, unsigned count)
    {
        EmbreeRival& rival = *static_cast<EmbreeRival*>(self);
        const std::lock_guard<std::mutex> lock(rival.m_mutex);
        for (unsigned i = 0; i < count; ++i)
        {
            const Pair pair = {candidates[i].primID0, candidates[i].primID1};
            if (pair.first < pair.second && overlaps(rival.m_boxes[pair.first], rival.m_boxes[pair.second]))
                rival.m_pairs->push_back(pair);
        }
    }

    RTCDevice m_device;
    RTCScene m_scene = nullptr;
    RTCGeometry m_geometry = nullptr;
    std::vector<Aabb> m_boxes;
    std::mutex m_mutex;
    Pairs* m_pairs = nullptr;
};
}  // namespace

std::unique_ptr<Rival> makeEmbreeRival(const RivalRequest& request)
{
    return std::make_unique<EmbreeRival>(request.threads);
}
}  // namespace cullet
