// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/uniform_scenes.h"

#include "cullet/demos/scenes/ball.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cullet
{
namespace
{
constexpr float kUniformVolume = 32.0f;
constexpr float kTwoSizesVolume = 20000.0f;

/// Balls in a cube from the origin to `side`, and their motion.
class FieldScene : public BoxScene
{
public:
    FieldScene(const BoxSceneOptions& options, float volumePerBody)
        : m_random(options.seed), m_side(std::cbrt(static_cast<float>(options.bodies) * volumePerBody))
    {
    }

protected:
    template <class HalfEdge>
    void fill(const BoxSceneOptions& options, HalfEdge halfEdge)
    {
        m_balls.resize(options.bodies);
        for (Ball& ball : m_balls)
        {
            place(ball);
            ball.half = halfEdge(m_random);
            setRandomVelocity(ball, m_random.uniform(kSlowest, kFastest) * ball.half, m_random);
        }
        orderBalls(m_balls, options);
        for (const Ball& ball : m_balls)
            m_boxes.push_back(boxOf(ball));
    }

    void place(Ball& ball)
    {
        for (float& coordinate : ball.centre)
            coordinate = m_random.uniform(0.0f, m_side);
    }

    void fly(std::uint32_t row)
    {
        flyAndBounce(m_balls[row], m_side);
        m_boxes[row] = boxOf(m_balls[row]);
    }

    /// `count` different rows, ascending. Partial Fisher-Yates on a persistent permutation: O(count log count).
    std::vector<std::uint32_t> sampleRows(std::size_t count)
    {
        if (m_permutation.empty())
        {
            m_permutation.resize(m_balls.size());
            std::iota(m_permutation.begin(), m_permutation.end(), 0u);
        }
        for (std::size_t i = 0; i < count; ++i)
            std::swap(m_permutation[i], m_permutation[i + m_random.below(m_permutation.size() - i)]);
        std::vector<std::uint32_t> rows(m_permutation.begin(),
                                        m_permutation.begin() + static_cast<std::ptrdiff_t>(count));
        std::sort(rows.begin(), rows.end());
        return rows;
    }

    SplitMix64 m_random;
    float m_side;
    std::vector<Ball> m_balls;
    std::vector<std::uint32_t> m_permutation;
};

/// A fixed set of flying bodies.
class FlyingScene : public FieldScene
{
public:
    template <class HalfEdge>
    FlyingScene(const BoxSceneOptions& options, float volumePerBody, std::size_t movers, HalfEdge halfEdge)
        : FieldScene(options, volumePerBody)
    {
        fill(options, halfEdge);
        m_movers = sampleRows(std::min<std::size_t>(movers, options.bodies));
    }

    void step() override
    {
        m_moved = m_movers;
        for (const std::uint32_t row : m_moved)
            fly(row);
    }

private:
    std::vector<std::uint32_t> m_movers;
};

class FreshMoversScene : public FieldScene
{
public:
    FreshMoversScene(const BoxSceneOptions& options, float volumePerBody, std::size_t movers)
        : FieldScene(options, volumePerBody), m_moverCount(std::min<std::size_t>(movers, options.bodies))
    {
        fill(options, [](SplitMix64&) { return 1.0f; });
    }

    void step() override
    {
        m_moved = sampleRows(m_moverCount);
        for (const std::uint32_t row : m_moved)
            fly(row);
    }

private:
    std::size_t m_moverCount;
};

class TeleportScene : public FieldScene
{
public:
    TeleportScene(const BoxSceneOptions& options, float volumePerBody) : FieldScene(options, volumePerBody)
    {
        fill(options, [](SplitMix64&) { return 1.0f; });
    }

    void step() override
    {
        m_moved.resize(m_balls.size());
        std::iota(m_moved.begin(), m_moved.end(), 0u);
        for (const std::uint32_t row : m_moved)
        {
            place(m_balls[row]);
            m_boxes[row] = boxOf(m_balls[row]);
        }
    }
};

std::size_t fivePercent(const BoxSceneOptions& options)
{
    return std::max<std::size_t>(1, options.bodies / 20);
}

std::unique_ptr<BoxScene> makeFlyingSpheres(const BoxSceneOptions& options, std::size_t movers)
{
    return std::make_unique<FlyingScene>(options, kUniformVolume, movers, [](SplitMix64&) { return 1.0f; });
}
}  // namespace

std::unique_ptr<BoxScene> makeUniformScene(const BoxSceneOptions& options)
{
    return makeFlyingSpheres(options, options.bodies);
}

std::unique_ptr<BoxScene> makeTwoSizesScene(const BoxSceneOptions& options)
{
    const auto halfEdge = [](SplitMix64& random) { return logUniform(0.05, 3.0f, random); };
    return std::make_unique<FlyingScene>(options, kTwoSizesVolume, options.bodies, halfEdge);
}

std::unique_ptr<BoxScene> makeMostlyStaticScene(const BoxSceneOptions& options)
{
    return makeFlyingSpheres(options, fivePercent(options));
}

std::unique_ptr<BoxScene> makeFreshMoversScene(const BoxSceneOptions& options)
{
    return std::make_unique<FreshMoversScene>(options, kUniformVolume, fivePercent(options));
}

std::unique_ptr<BoxScene> makeFreshTenthScene(const BoxSceneOptions& options)
{
    return std::make_unique<FreshMoversScene>(options, kUniformVolume,
                                              std::max<std::size_t>(1, options.bodies / 10));
}

std::unique_ptr<BoxScene> makeTeleportScene(const BoxSceneOptions& options)
{
    return std::make_unique<TeleportScene>(options, kUniformVolume);
}

std::unique_ptr<BoxScene> makeHundredMoversScene(const BoxSceneOptions& options)
{
    return makeFlyingSpheres(options, 100);
}
}  // namespace cullet
