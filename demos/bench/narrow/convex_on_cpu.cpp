// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_on_cpu.h"

#include "cullet/demos/bench/narrow/quantile.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
namespace
{
constexpr int kFirstFrames = 2;

struct Place
{
    Eigen::Matrix3f basis;
    Eigen::Vector3f origin;
    std::uint32_t hull;
};

std::vector<Place> placesOf(const std::vector<BodyPose>& poses)
{
    std::vector<Place> places;
    places.reserve(poses.size());
    for (const BodyPose& pose : poses)
    {
        const float(&turn)[4] = pose.rotation;
        const Eigen::Quaterniond rotation =
            Eigen::Quaternionf(turn[3], turn[0], turn[1], turn[2]).cast<double>().normalized();
        places.push_back({rotation.toRotationMatrix().cast<float>(),
                          {pose.position[0], pose.position[1], pose.position[2]},
                          pose.hull});
    }
    return places;
}

/// The pairs of a motion, each with what it remembers.
class WarmPairs
{
public:
    explicit WarmPairs(const ConvexMotion& motion) : m_motion(motion), m_caches(motion.pairs().size()) {}

    /// Milliseconds of a frame.
    double time(int frame)
    {
        const std::vector<Place> places = placesOf(m_motion.frame(frame));
        std::uint32_t overlapping = 0;
        const Stopwatch watch;
        for (std::size_t k = 0; k < m_caches.size(); ++k)
        {
            const RowPair pair = m_motion.pairs()[k];
            const GjkResult<float> found =
                isaGjk(posed(places[pair.a]), posed(places[pair.b]), 0.0f, m_caches[k]);
            overlapping += found.state == GjkState::Overlapping;
        }
        const double passed = watch.wallMs();
        m_motion.requireOverlapping(overlapping);
        return passed;
    }

private:
    PosedHull<float> posed(const Place& place) const
    {
        return {m_motion.floatHulls()[place.hull], place.basis, place.origin};
    }

    const ConvexMotion& m_motion;
    std::vector<GjkCache<float>> m_caches;
};
}  // namespace

double timeOnOneThread(const ConvexMotion& motion, int frames)
{
    WarmPairs pairs(motion);
    std::vector<double> times;
    for (int step = 0; step < kFirstFrames + frames; ++step)
    {
        const double passed = pairs.time(motion.frameAt(step));
        if (step >= kFirstFrames)
            times.push_back(passed);
    }
    return quantile(times, 0.5);
}
}  // namespace cullet
