// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/heap_scenes.h"

#include "cullet/demos/scenes/ball.h"

#include <cmath>
#include <numeric>

namespace cullet
{
namespace
{
constexpr float kSlope = 0.6f;
constexpr float kPi = 3.14159265f;

struct HeapShape
{
    float spacing;      ///< between neighbours of a layer
    float layerHeight;  ///< between layers; below 1, so that unit boxes overlap the layer below
    float disorder;     ///< largest horizontal distance of a body from its lattice point
};

/// Adds the bodies of one layer, a disc of radius `radius`, up to `count` bodies in total.
void addLayer(std::vector<Ball>& balls, const HeapShape& shape, float radius, float height, std::size_t count,
              SplitMix64& random)
{
    const float shift[2] = {random.uniform(0.0f, shape.spacing), random.uniform(0.0f, shape.spacing)};
    const int reach = static_cast<int>(radius / shape.spacing) + 1;
    for (int i = -reach; i <= reach; ++i)
    {
        for (int j = -reach; j <= reach && balls.size() < count; ++j)
        {
            Ball ball = {};
            ball.centre[0] = static_cast<float>(i) * shape.spacing + shift[0];
            ball.centre[1] = height;
            ball.centre[2] = static_cast<float>(j) * shape.spacing + shift[1];
            if (std::hypot(ball.centre[0], ball.centre[2]) > radius)
                continue;
            ball.centre[0] += random.uniform(-shape.disorder, shape.disorder);
            ball.centre[2] += random.uniform(-shape.disorder, shape.disorder);
            balls.push_back(ball);
        }
    }
}

std::vector<Ball> makeHeap(const BoxSceneOptions& options, const HeapShape& shape, SplitMix64& random)
{
    const float volume =
        static_cast<float>(options.bodies) * shape.spacing * shape.spacing * shape.layerHeight;
    const float base = std::cbrt(3.0f * volume / (kPi * kSlope)) + shape.spacing;
    std::vector<Ball> balls;
    balls.reserve(options.bodies);
    for (int layer = 0; balls.size() < options.bodies; ++layer)
    {
        const float height = static_cast<float>(layer) * shape.layerHeight;
        // The cone may be a few bodies short; they form a column on top.
        const float radius = std::fmax(base - height / kSlope, shape.spacing);
        addLayer(balls, shape, radius, height + 0.5f, options.bodies, random);
    }
    return balls;
}

/// Bodies that fall vertically onto their places in a heap and jitter there.
class SettlingScene : public BoxScene
{
public:
    /// @param balls initial positions, at most kHighest above their places
    SettlingScene(std::vector<Ball> balls, SplitMix64 random) : m_rest(std::move(balls)), m_random(random)
    {
        for (Ball& ball : m_rest)
        {
            m_boxes.push_back(boxOf(ball));
            m_heights.push_back(startHeight(ball));
            ball.centre[1] -= m_heights.back();
        }
    }

    /// Initial height of a body above its place, drawn from the place, so that the order of ids has no effect.
    static float startHeight(const Ball& ball)
    {
        const std::uint64_t place = static_cast<std::uint64_t>(bitsOf(ball.centre[0])) << 32;
        return SplitMix64(place | bitsOf(ball.centre[2])).uniform(0.0f, kHighest);
    }

    void step() override
    {
        m_moved.resize(m_rest.size());
        std::iota(m_moved.begin(), m_moved.end(), 0u);
        for (float& height : m_heights)
            height = std::fmax(height - kSpeed, 0.0f);
        for (std::size_t row = 0; row < m_rest.size(); ++row)
            m_boxes[row] = boxOf(jittered(row));
    }

private:
    static constexpr float kHighest = 32.0f;
    static constexpr float kSpeed = 0.25f;
    static constexpr float kJitter = 0.01f;

    Ball jittered(std::size_t row)
    {
        Ball ball = m_rest[row];
        for (float& coordinate : ball.centre)
            coordinate += m_random.uniform(-kJitter, kJitter);
        ball.centre[1] += m_heights[row];
        return ball;
    }

    std::vector<Ball> m_rest;
    std::vector<float> m_heights;  ///< above the places
    SplitMix64 m_random;
};

/// Bodies around fixed places: offset <- keep * offset + uniform(-push, push), per axis and frame.
class HeapScene : public BoxScene
{
public:
    HeapScene(std::vector<Ball> balls, float keep, float push, SplitMix64 random)
        : m_rest(std::move(balls)),
          m_offsets(m_rest.size() * 3, 0.0f),
          m_random(random),
          m_keep(keep),
          m_push(push)
    {
        for (const Ball& ball : m_rest)
            m_boxes.push_back(boxOf(ball));
    }

    void step() override
    {
        m_moved.resize(m_rest.size());
        std::iota(m_moved.begin(), m_moved.end(), 0u);
        for (std::size_t row = 0; row < m_rest.size(); ++row)
        {
            Ball ball = m_rest[row];
            for (int axis = 0; axis < 3; ++axis)
            {
                float& offset = m_offsets[row * 3 + axis];
                offset = m_keep * offset + m_random.uniform(-m_push, m_push);
                ball.centre[axis] += offset;
            }
            m_boxes[row] = boxOf(ball);
        }
    }

private:
    std::vector<Ball> m_rest;
    std::vector<float> m_offsets;
    SplitMix64 m_random;
    float m_keep;
    float m_push;
};
}  // namespace

std::unique_ptr<BoxScene> makeSettledHeapScene(const BoxSceneOptions& options)
{
    SplitMix64 random(options.seed);
    std::vector<Ball> balls = makeHeap(options, {1.1f, 0.98f, 0.04f}, random);
    for (Ball& ball : balls)
        ball.half = 0.5f;
    orderBalls(balls, options);
    return std::make_unique<HeapScene>(std::move(balls), 0.0f, 0.01f, random);
}

std::unique_ptr<BoxScene> makeSettlingHeapScene(const BoxSceneOptions& options)
{
    SplitMix64 random(options.seed);
    std::vector<Ball> balls = makeHeap(options, {1.1f, 0.98f, 0.04f}, random);
    for (Ball& ball : balls)
    {
        ball.half = 0.5f;
        ball.centre[1] += SettlingScene::startHeight(ball);
    }
    orderBalls(balls, options);
    return std::make_unique<SettlingScene>(std::move(balls), random);
}

std::unique_ptr<BoxScene> makeDriftingHeapScene(const BoxSceneOptions& options)
{
    SplitMix64 random(options.seed);
    std::vector<Ball> balls = makeHeap(options, {1.1f, 0.95f, 0.1f}, random);
    for (Ball& ball : balls)
        ball.half = random.uniform(0.5f, 0.76f);
    orderBalls(balls, options);
    return std::make_unique<HeapScene>(std::move(balls), 0.95f, 0.02f, random);
}
}  // namespace cullet
