// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/extreme_scenes.h"

#include "cullet/demos/scenes/ball.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace cullet
{
namespace
{
/// Balls that fly in a cube from the origin to `side`.
class RoomScene : public BoxScene
{
public:
    RoomScene(std::vector<Ball> balls, float side, const BoxSceneOptions& options)
        : m_balls(std::move(balls)), m_side(side)
    {
        orderBalls(m_balls, options);
        for (const Ball& ball : m_balls)
            m_boxes.push_back(boxOf(ball));
    }

    void step() override
    {
        m_moved.resize(m_balls.size());
        std::iota(m_moved.begin(), m_moved.end(), 0u);
        for (const std::uint32_t row : m_moved)
        {
            flyAndBounce(m_balls[row], m_side);
            m_boxes[row] = boxOf(m_balls[row]);
        }
    }

private:
    std::vector<Ball> m_balls;
    float m_side;
};

float sideFor(const BoxSceneOptions& options, float volumePerBody)
{
    return std::cbrt(static_cast<float>(options.bodies) * volumePerBody);
}

/// Balls of radius 1 anywhere in the room.
std::vector<Ball> uniformBalls(const BoxSceneOptions& options, float side)
{
    SplitMix64 random(options.seed);
    std::vector<Ball> balls(options.bodies);
    for (Ball& ball : balls)
    {
        for (float& coordinate : ball.centre)
            coordinate = random.uniform(0.0f, side);
        ball.half = 1.0f;
        setRandomVelocity(ball, random.uniform(kSlowest, kFastest), random);
    }
    return balls;
}

std::unique_ptr<BoxScene> makeUniformRoom(const BoxSceneOptions& options, float side)
{
    return std::make_unique<RoomScene>(uniformBalls(options, side), side, options);
}

/// Balls along the first axis, or along the diagonal of all three.
std::unique_ptr<BoxScene> makeLine(const BoxSceneOptions& options, int axes)
{
    constexpr float kBodiesPerUnit = 2.0f;
    const float side = static_cast<float>(options.bodies) / kBodiesPerUnit;
    SplitMix64 random(options.seed);
    std::vector<Ball> balls(options.bodies);
    for (Ball& ball : balls)
    {
        const float place = random.uniform(0.0f, side);
        const float speed = random.uniform(kSlowest, kFastest);
        std::fill_n(ball.centre, axes, place);
        std::fill_n(ball.velocity, axes, random.below(2) == 0 ? speed : -speed);
        ball.half = 1.0f;
    }
    return std::make_unique<RoomScene>(std::move(balls), side, options);
}
}  // namespace

std::unique_ptr<BoxScene> makeOneCellScene(const BoxSceneOptions& options)
{
    return makeUniformRoom(options, 3.0f);
}

std::unique_ptr<BoxScene> makeLineScene(const BoxSceneOptions& options)
{
    return makeLine(options, 1);
}

std::unique_ptr<BoxScene> makeDiagonalScene(const BoxSceneOptions& options)
{
    return makeLine(options, 3);
}

std::unique_ptr<BoxScene> makeOnePointScene(const BoxSceneOptions& options)
{
    SplitMix64 random(options.seed);
    Ball ball = {{1.0f, 1.0f, 1.0f}, 1.0f, {}};
    setRandomVelocity(ball, kFastest, random);
    return std::make_unique<RoomScene>(std::vector<Ball>(options.bodies, ball), 2.0f, options);
}

std::unique_ptr<BoxScene> makeCoverScene(const BoxSceneOptions& options)
{
    const float side = sideFor(options, 32.0f);
    std::vector<Ball> balls = uniformBalls(options, side);
    balls.front().half = side + 2.0f;  // covers the room from any centre in it
    return std::make_unique<RoomScene>(std::move(balls), side, options);
}

std::unique_ptr<BoxScene> makeSixDecadesScene(const BoxSceneOptions& options)
{
    const float side = sideFor(options, 8e6f);
    std::vector<Ball> balls = uniformBalls(options, side);
    SplitMix64 random(options.seed + 1);
    for (Ball& ball : balls)
    {
        ball.half = logUniform(0.0005, 6.0f, random);
        const float speed = std::max(random.uniform(kSlowest, kFastest) * ball.half, 1e-6f * side);
        setRandomVelocity(ball, speed, random);
    }
    return std::make_unique<RoomScene>(std::move(balls), side, options);
}

std::unique_ptr<BoxScene> makeBalancedScene(const BoxSceneOptions& options, double pairs)
{
    // Two positions, uniform in a room of side s, are within an edge e of each other along one axis with the
    // probability 1 - (1 - e / s)^2.
    constexpr double kEdge = 2.0;
    const double bodies = options.bodies;
    const double share = std::min(pairs / std::max(0.5 * bodies * (bodies - 1.0), 1.0), 1.0);
    const double apart = std::sqrt(1.0 - std::cbrt(share));
    return makeUniformRoom(options, static_cast<float>(kEdge / (1.0 - std::min(apart, 0.999999))));
}
}  // namespace cullet
