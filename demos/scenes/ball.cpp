// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/ball.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cullet
{
namespace
{
/// Spreads the low ten bits so that two zeros stand between any two of them.
std::uint32_t spreadBits(std::uint32_t value) noexcept
{
    value = (value | value << 16) & 0x030000ffu;
    value = (value | value << 8) & 0x0300f00fu;
    value = (value | value << 4) & 0x030c30c3u;
    return (value | value << 2) & 0x09249249u;
}

std::uint32_t mortonCode(const Ball& ball, const Aabb& bounds) noexcept
{
    std::uint32_t code = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float extent = bounds.max[axis] - bounds.min[axis];
        const float unit = extent > 0.0f ? (ball.centre[axis] - bounds.min[axis]) / extent : 0.0f;
        code |= spreadBits(static_cast<std::uint32_t>(std::min(unit * 1024.0f, 1023.0f))) << axis;
    }
    return code;
}

void sortAlongCurve(std::vector<Ball>& balls)
{
    Aabb bounds = kEmptyAabb;
    for (const Ball& ball : balls)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            bounds.min[axis] = std::min(bounds.min[axis], ball.centre[axis]);
            bounds.max[axis] = std::max(bounds.max[axis], ball.centre[axis]);
        }
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
    order.reserve(balls.size());
    for (std::uint32_t row = 0; row < balls.size(); ++row)
        order.emplace_back(mortonCode(balls[row], bounds), row);
    std::sort(order.begin(), order.end());
    std::vector<Ball> sorted;
    sorted.reserve(balls.size());
    for (const auto& [code, row] : order)
        sorted.push_back(balls[row]);
    balls.swap(sorted);
}
}  // namespace

Aabb boxOf(const Ball& ball) noexcept
{
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = ball.centre[axis] - ball.half;
        box.max[axis] = ball.centre[axis] + ball.half;
    }
    return box;
}

void flyAndBounce(Ball& ball, float side) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        ball.centre[axis] += ball.velocity[axis];
        if (ball.centre[axis] < 0.0f)
            ball.velocity[axis] = std::fabs(ball.velocity[axis]);
        if (ball.centre[axis] > side)
            ball.velocity[axis] = -std::fabs(ball.velocity[axis]);
    }
}

float logUniform(double least, float decades, SplitMix64& random) noexcept
{
    const double power = static_cast<double>(random.uniform(0.0f, decades));
    return static_cast<float>(least * std::exp(power * 2.302585092994046));
}

void setRandomVelocity(Ball& ball, float speed, SplitMix64& random) noexcept
{
    float squared = 0.0f;
    do
    {
        for (float& component : ball.velocity)
            component = random.uniform(-1.0f, 1.0f);
        squared = ball.velocity[0] * ball.velocity[0] + ball.velocity[1] * ball.velocity[1] +
                  ball.velocity[2] * ball.velocity[2];
    } while (squared > 1.0f || squared < 0.01f);
    const float scale = speed / std::sqrt(squared);
    for (float& component : ball.velocity)
        component *= scale;
}

void orderBalls(std::vector<Ball>& balls, const BoxSceneOptions& options)
{
    if (options.sortedIds)
    {
        sortAlongCurve(balls);
        return;
    }
    SplitMix64 random(options.seed ^ 0x5eedull);
    for (std::size_t i = balls.size(); i > 1; --i)
        std::swap(balls[i - 1], balls[random.below(i)]);
}
}  // namespace cullet
