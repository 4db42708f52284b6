// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstddef>
#include <vector>

namespace cullet
{
/// Velocities of boxes, one for each, that stay as they are: up to 0.05 a step along each axis.
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

/// Frames before the timed ones, where boxes drift: until then it is found out how far they go, and the second list of near pairs has
/// begun.
inline constexpr int kDriftWarmUps = 20;
}  // namespace cullet
