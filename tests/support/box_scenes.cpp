// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/box_scenes.h"

#include "cullet/tests/support/boxes.h"

#include <cmath>

namespace cullet::test
{
namespace
{
constexpr float kStride = 0.125f;  // longest move per step and axis
constexpr float kJitter = 0.03125f;

/// Side of the cube that holds `count` boxes at the density of the scene, rounded to a whole number: the last bit of
/// cbrt() depends on the C library.
float sideFor(SceneKind kind, std::uint32_t count)
{
    const double volumePerBox = kind == SceneKind::ManySizes ? 4096.0 : kind == SceneKind::Pile ? 8.0 : 32.0;
    return static_cast<float>(std::ceil(std::cbrt(volumePerBox * count)));
}
}  // namespace

const char* sceneName(SceneKind kind)
{
    switch (kind)
    {
        case SceneKind::Uniform:
            return "Uniform";
        case SceneKind::ManySizes:
            return "ManySizes";
        case SceneKind::MostlyStatic:
            return "MostlyStatic";
        case SceneKind::Pile:
            return "Pile";
        case SceneKind::Teleport:
            return "Teleport";
    }
    return "";
}

BoxScene::BoxScene(SceneKind kind, std::uint32_t count, std::uint32_t seed)
    : m_kind(kind), m_random(seed), m_side(sideFor(kind, count))
{
    for (std::uint32_t row = 0; row < count; ++row)
    {
        m_boxes.push_back(randomBox());
        for (int axis = 0; axis < 3; ++axis)
            m_velocities.push_back(m_random.between(-kStride, kStride));
    }
}

Aabb BoxScene::randomBox()
{
    const float half = m_kind == SceneKind::ManySizes ? m_random.logUniform(-4, 6) / 2 : 1.0f;
    const float x = m_random.between(0, m_side);
    const float y = m_random.between(0, m_side);
    const float z = m_random.between(0, m_side);
    return boxAt(x, y, z, half);
}

void BoxScene::drift(Aabb& box, std::uint32_t row)
{
    float* velocity = &m_velocities[3 * row];
    for (int axis = 0; axis < 3; ++axis)
    {
        // Boxes turn back at walls, so that the density is constant.
        if (box.min[axis] < 0)
            velocity[axis] = std::fabs(velocity[axis]);
        if (box.max[axis] > m_side)
            velocity[axis] = -std::fabs(velocity[axis]);
    }
    box = translated(box, velocity[0], velocity[1], velocity[2]);
}

void BoxScene::step()
{
    m_moved.clear();
    for (std::uint32_t row = 0; row < m_boxes.size(); ++row)
    {
        if (m_kind == SceneKind::MostlyStatic && row % 20 != 0)
            continue;
        m_moved.push_back(row);
        if (m_kind == SceneKind::Teleport)
        {
            m_boxes[row] = randomBox();
        }
        else if (m_kind == SceneKind::Pile)
        {
            const float x = m_random.between(-kJitter, kJitter);
            const float y = m_random.between(-kJitter, kJitter);
            const float z = m_random.between(-kJitter, kJitter);
            m_boxes[row] = translated(m_boxes[row], x, y, z);
        }
        else
        {
            drift(m_boxes[row], row);
        }
    }
}
}  // namespace cullet::test
