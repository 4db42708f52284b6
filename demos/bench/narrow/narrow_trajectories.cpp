// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_trajectories.h"

#include "cullet/narrow/epa/exact_penetration.h"

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<NarrowRegime>& narrowRegimes()
{
    static const std::vector<NarrowRegime> regimes = {{"separated", 0.02, 0.08},
                                                      {"near", 1e-3, 3e-3},
                                                      {"crossing", -0.03, 0.03},
                                                      {"overlapping", -0.05, -0.01}};
    return regimes;
}

NarrowTrajectories::NarrowTrajectories(const Hull<btScalar>& hull, const NarrowRegime& regime, unsigned seed)
    : m_hull(hull)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> phase(0.0, 6.28);
    std::vector<PairScene<btScalar>> pairs;
    std::vector<double> phases;
    for (int pair = 0; pair < kPairs; ++pair)
    {
        pairs.push_back(randomPair(hull, hull, 0.05, 0.0, engine));
        phases.push_back(phase(engine));
    }
    for (int frame = 0; frame < kFrames; ++frame)
        addFrame(pairs, regime, phases, frame, engine);
    for (const PairScene<btScalar>& scene : m_scenes)
        m_truth.push_back(DistanceOracle(scene.posedA(), scene.posedB()).solve());
}

void NarrowTrajectories::addFrame(std::vector<PairScene<btScalar>>& pairs, const NarrowRegime& regime,
                                  const std::vector<double>& phases, int frame, std::mt19937& engine)
{
    for (int pair = 0; pair < kPairs; ++pair)
    {
        perturb(pairs[pair], 0.01, engine);
        const double swing = 0.5 + 0.5 * std::sin(phases[pair] + 0.15 * frame);
        setGapOutwards(pairs[pair], regime.low + swing * (regime.high - regime.low));
        m_scenes.push_back(pairs[pair]);
    }
}

double NarrowTrajectories::depth(std::size_t query) const
{
    Eigen::Vector3d normal;
    double depth = 0.0;
    exactPenetration(m_scenes[query].posedA(), m_scenes[query].posedB(), normal, depth);
    return depth;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
