// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_sets.h"

#include <cstdint>
#include <future>
#include <utility>

namespace cullet
{
namespace
{
constexpr std::uint64_t kFirstSeed = 12345;
}  // namespace

FreshSets::FreshSets(const FreshScene& scene) : m_scene(scene)
{
    std::future<std::vector<Aabb>> sets[kCount];
    for (int set = 0; set < kCount; ++set)
        sets[set] = std::async(std::launch::async, scene.make, scene.bodies, kFirstSeed + set);
    for (int set = 0; set < kCount; ++set)
    {
        std::vector<Aabb> boxes = sets[set].get();
        m_onDevice[set] = std::make_unique<DeviceBoxes>(boxes);
        if (set == 0)
            m_first = std::move(boxes);
    }
}
}  // namespace cullet
