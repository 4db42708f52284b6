// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"

#include <LinearMath/btScalar.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How far apart the shapes of a benchmark are along their paths; length unit: about the radius of a shape.
struct NarrowRegime
{
    const char* name;
    double low, high;
};

const std::vector<NarrowRegime>& narrowRegimes();

/// Pairs of one hull that move coherently, and the exact answers.
///
/// From frame to frame B turns by 1 to 3 degrees, moves by 1 % of its size, and swings between the regime's gaps.
class NarrowTrajectories
{
public:
    static constexpr int kPairs = 64;
    static constexpr int kFrames = 101;

    NarrowTrajectories(const Hull<btScalar>& hull, const NarrowRegime& regime, unsigned seed);

    const Hull<btScalar>& hull() const { return m_hull; }
    /// Frame-major: query i belongs to pair i % kPairs.
    const std::vector<PairScene<btScalar>>& scenes() const { return m_scenes; }
    /// Proven bounds of the distance, in long double.
    const Bounds& truth(std::size_t query) const { return m_truth[query]; }
    /// Exact depth of an overlapping query. Cost: O(E^2), see exact_penetration.h.
    double depth(std::size_t query) const;

private:
    void addFrame(std::vector<PairScene<btScalar>>& pairs, const NarrowRegime& regime,
                  const std::vector<double>& phases, int frame, std::mt19937& engine);

    const Hull<btScalar>& m_hull;
    std::vector<PairScene<btScalar>> m_scenes;
    std::vector<Bounds> m_truth;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
