// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/scenes/fresh_boxes.h"

#include <memory>
#include <vector>

namespace cullet
{
/// The boxes of three frames of a scene. Made once, which takes longer than most of what is measured on them.
class FreshSets
{
public:
    static constexpr int kCount = 3;

    explicit FreshSets(const FreshScene& scene);

    const FreshScene& scene() const { return m_scene; }
    /// Of the first frame, in the CPU's memory.
    const std::vector<Aabb>& first() const { return m_first; }
    /// On the device; the frames come in turn.
    const DeviceBoxes& ofFrame(int frame) const { return *m_onDevice[frame % kCount]; }

private:
    FreshScene m_scene;
    std::vector<Aabb> m_first;
    std::unique_ptr<DeviceBoxes> m_onDevice[kCount];
};
}  // namespace cullet
