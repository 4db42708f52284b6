// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/scenes/fresh_boxes.h"

#include <memory>
#include <vector>

namespace cullet
{
/// The boxes of three frames of a scene. Made once, since that takes longer than most measurements.
class FreshSets
{
public:
    static constexpr int kCount = 3;

    explicit FreshSets(const FreshScene& scene);

    const FreshScene& scene() const { return m_scene; }
    /// The boxes of the first frame, in CPU memory.
    const std::vector<Aabb>& first() const { return m_first; }
    /// The boxes of a frame, on the device; the sets alternate.
    const DeviceBoxes& ofFrame(int frame) const { return *m_onDevice[frame % kCount]; }

private:
    FreshScene m_scene;
    std::vector<Aabb> m_first;
    std::unique_ptr<DeviceBoxes> m_onDevice[kCount];
};
}  // namespace cullet
