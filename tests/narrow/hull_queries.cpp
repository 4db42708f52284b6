// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Builds hulls and asks for distances and depths, with nothing but vectors of the standard library: the rest of it, and
// gtest, is not compiled for MemorySanitizer. What the answers are is for other tests to say.

#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"

#include <cstdio>
#include <random>
#include <vector>

namespace cullet
{
namespace
{
template <class S>
bool hasBothAnswers()
{
    std::mt19937 engine(1);
    std::vector<Hull<S>> hulls;
    for (const Points& points : {boxPoints(0.5, 0.6, 0.7), prismPoints(12, 0.4), gridBoxPoints(4),
                                 ellipsoidPoints(60, {1.0, 0.7, 0.5}, 2), boxPoints(1.0, 1.0, 0.0)})
        hulls.push_back(hullOf<S>(points));
    int near = 0, overlapping = 0;
    for (int i = 0; i < 200; ++i)
    {
        const std::size_t first = engine() % hulls.size(), second = engine() % hulls.size();
        PairScene<S> scene = randomPair(hulls[first], hulls[second], i % 2 == 0 ? 0.05 : -0.05, 2.0, engine);
        GjkCache<S> cache;
        EpaCache memory;
        for (int step = 0; step < 3; ++step)
        {
            const auto a = scene.posedA(), b = scene.posedB();
            const GjkResult<S> result = gjkDistance(a, b, S(0.2), cache);
            near += result.state == GjkState::Near && result.distance > S(0) ? 1 : 0;
            if (result.state == GjkState::Overlapping)
                overlapping += penetration(a, b, cache, &memory).depth > S(0) ? 1 : 0;
            perturb(scene, 0.02, engine);
        }
    }
    std::printf("%d near, %d overlapping\n", near, overlapping);
    return near > 100 && overlapping > 100;
}
}  // namespace
}  // namespace cullet

int main()
{
    return cullet::hasBothAnswers<float>() && cullet::hasBothAnswers<double>() ? 0 : 1;
}
