// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace cullet::test
{
/// Bodies in a block of space, close enough to each other that pairs come and go from frame to frame.
class CrowdScene : public ConvexScene
{
public:
    CrowdScene(ConvexKind kind, std::size_t bodies, unsigned seed, double spacing = 1.1)
        : ConvexScene(kind, bodies / 2, seed), m_walk(seed)
    {
        const double side = std::cbrt(static_cast<double>(bodies)) * spacing;
        std::uniform_real_distribution<float> place(0.0f, static_cast<float>(side));
        for (BodyPose& pose : poses)
        {
            for (float& coordinate : pose.position)
                coordinate = place(m_walk);
        }
        pairs.clear();
    }

    /// Turns bodies as ConvexScene does, and lets a part of them jump.
    ///
    /// @param jumping share of the bodies
    void move(double jumping)
    {
        step();
        std::bernoulli_distribution jumps(jumping);
        std::normal_distribution<float> length(0.0f, 0.3f);
        for (BodyPose& pose : poses)
        {
            if (!jumps(m_walk))
                continue;
            for (float& coordinate : pose.position)
                coordinate += length(m_walk);
        }
    }

private:
    std::mt19937 m_walk;
};

/// The pairs of boxes that overlap, the lower row first, in ascending order.
inline std::vector<RowPair> pairsOf(const std::vector<Aabb>& boxes)
{
    std::vector<RowPair> pairs;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            if (isValid(boxes[a]) && isValid(boxes[b]) && overlaps(boxes[a], boxes[b]))
                pairs.push_back({a, b});
        }
    }
    return pairs;
}

inline bool areEqual(const std::vector<RowPair>& a, const std::vector<RowPair>& b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](RowPair one, RowPair other) { return one.a == other.a && one.b == other.b; });
}
}  // namespace cullet::test
