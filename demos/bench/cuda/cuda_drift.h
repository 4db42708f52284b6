// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstddef>
#include <vector>

namespace cullet
{
/// Constant velocities of boxes: up to 0.05 per step along each axis.
class SteadyDrift
{
public:
    explicit SteadyDrift(std::size_t boxes) : m_steps(boxes)
    {
        SplitMix64 random(8);
        for (Step& step : m_steps)
            for (float& way : step.ways)
                way = random.uniform(-0.05f, 0.05f);
    }

    void move(Aabb& box, std::size_t body) const
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] += m_steps[body].ways[axis];
            box.max[axis] += m_steps[body].ways[axis];
        }
    }

private:
    struct Step
    {
        float ways[3];
    };

    std::vector<Step> m_steps;
};

/// Warm-up frames for drifting boxes: enough for the backend to measure their motion and to begin the second neighbour
/// list.
inline constexpr int kDriftWarmUps = 20;
}  // namespace cullet
