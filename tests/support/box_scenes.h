// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/random.h"

#include <cstdint>
#include <vector>

namespace cullet::test
{
/// The five workloads that broad phases are usually compared on, small.
enum class SceneKind
{
    Uniform,       ///< W1: equal cubes, constant density, about one overlap each, all drift
    ManySizes,     ///< W2: sizes over three decades, all drift
    MostlyStatic,  ///< W3: a fixed 5 % move
    Pile,          ///< W4: a dense heap that jitters
    Teleport       ///< W5: every box teleports in every step
};

const char* sceneName(SceneKind kind);

/// A workload: the same bits on every machine, for golden tests.
class BoxScene
{
public:
    BoxScene(SceneKind kind, std::uint32_t count, std::uint32_t seed);

    /// Moves the boxes by one step.
    void step();

    const std::vector<Aabb>& boxes() const { return m_boxes; }

    /// Rows that the last step moved, ascending.
    const std::vector<std::uint32_t>& moved() const { return m_moved; }

private:
    Aabb randomBox();
    void drift(Aabb& box, std::uint32_t row);

    SceneKind m_kind;
    Random m_random;
    float m_side;
    std::vector<Aabb> m_boxes;
    std::vector<float> m_velocities;  ///< three per box
    std::vector<std::uint32_t> m_moved;
};
}  // namespace cullet::test
