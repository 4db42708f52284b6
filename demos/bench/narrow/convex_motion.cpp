// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_motion.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

namespace cullet
{
namespace
{
constexpr std::uint32_t kHulls = 64;
constexpr double kDegree = 3.14159265358979323846 / 180.0;

double between(double least, double most, std::mt19937& engine)
{
    return std::uniform_real_distribution<double>(least, most)(engine);
}

/// Points on an ellipsoid, in float.
std::vector<Eigen::Vector3f> hullPoints(int vertices, std::mt19937& engine)
{
    const double y = between(0.7, 1.0, engine), z = between(0.5, 1.0, engine);
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < vertices; ++i)
        points.push_back(randomDirection(engine).cwiseProduct(Eigen::Vector3d(1.0, y, z)).cast<float>());
    return points;
}

/// A body that turns about an axis.
struct Spin
{
    explicit Spin(double degrees, std::mt19937& engine)
        : start(randomRotation(engine)),
          axis(randomDirection(engine)),
          angle(between(1.0, 3.0, engine) * degrees * kDegree)
    {
    }

    Eigen::Quaternionf at(int frame) const
    {
        return (Eigen::AngleAxisd(angle * frame, axis) * start).cast<float>().normalized();
    }

    Eigen::Quaterniond start;
    Eigen::Vector3d axis;
    double angle;
};

Eigen::Vector3d roundedToFloat(const Eigen::Vector3d& v)
{
    return v.cast<float>().cast<double>();
}

BodyPose poseOf(std::uint32_t hull, const Eigen::Quaternionf& turn, const Eigen::Vector3d& place)
{
    const Eigen::Vector3f p = place.cast<float>();
    return {{p[0], p[1], p[2]}, hull, {turn.x(), turn.y(), turn.z(), turn.w()}};
}
}  // namespace

ConvexMotion::ConvexMotion(const ConvexMotionOptions& options)
    : m_shares(options.shares),
      m_frames(static_cast<std::size_t>(options.frames),
               std::vector<BodyPose>(std::size_t{2} * options.pairs)),
      m_firstMoving(options.isFirstAtRest ? options.pairs : 0)
{
    std::mt19937 engine(options.seed);
    for (std::uint32_t i = 0; i < kHulls; ++i)
    {
        const std::vector<Eigen::Vector3f> points = hullPoints(options.vertices, engine);
        m_float.push_back(makeHull(points, HullExtra::None));
        m_set.add(m_float.back());
        std::vector<Eigen::Vector3d> wide;
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        for (const Eigen::Vector3f& point : points)
        {
            wide.push_back(point.cast<double>());
            centre += wide.back() / static_cast<double>(points.size());
        }
        m_centres.push_back(centre);
        m_exact.push_back(makeHull(wide, HullExtra::None));
    }
    for (std::uint32_t pair = 0; pair < options.pairs; ++pair)
    {
        m_pairs.push_back(options.isFirstAtRest ? RowPair{pair, options.pairs + pair}
                                                : RowPair{2 * pair, 2 * pair + 1});
        m_overlapping += isPlantedDeep(pair);
    }
    ParallelLoops loops(0);
    const unsigned tasks = loops.tasksFor(options.pairs, 64);
    loops.run(tasks,
              [&](unsigned task)
              {
                  const std::uint64_t count = options.pairs;
                  for (std::uint64_t pair = count * task / tasks; pair < count * (task + 1) / tasks; ++pair)
                      plant(static_cast<std::uint32_t>(pair), options);
              });
}

bool ConvexMotion::isPlantedDeep(std::uint32_t pair) const
{
    return static_cast<int>(pair % 100) >= m_shares.separated + m_shares.near;
}

int ConvexMotion::frameAt(int step) const
{
    const int last = frameCount() - 1;
    if (last == 0)
        return 0;
    const int place = step % (2 * last);
    return place <= last ? place : 2 * last - place;
}

void ConvexMotion::requireOverlapping(std::uint32_t found) const
{
    if (found != m_overlapping)
        throw std::runtime_error(std::to_string(found) + " pairs overlap instead of " +
                                 std::to_string(m_overlapping));
}

void ConvexMotion::plant(std::uint32_t pair, const ConvexMotionOptions& options)
{
    std::mt19937 engine(options.seed + 1 + pair);
    const std::uint32_t hullA = engine() % kHulls, hullB = engine() % kHulls;
    const Spin a(options.degrees, engine), b(options.degrees, engine), around(0.5 * options.degrees, engine);
    const Eigen::Vector3d side = randomDirection(engine);
    const Eigen::Vector3d home(between(-50, 50, engine), between(-50, 50, engine), between(-50, 50, engine));
    const int kind = static_cast<int>(pair % 100);
    GjkCache<double> cache;
    for (int frame = 0; frame < options.frames; ++frame)
    {
        const double gap = kind < options.shares.separated ? between(0.03, 0.08, engine)
                           : kind < options.shares.separated + options.shares.near
                               ? between(0.001, 0.003, engine)
                               : -between(0.01, 0.05, engine);
        const Eigen::Quaternionf turnA = a.at(options.isFirstAtRest ? 0 : frame), turnB = b.at(frame);
        const Eigen::Vector3d away = 2.6 * (Eigen::AngleAxisd(around.angle * frame, around.axis) * side);
        const Eigen::Matrix3d basisA = turnA.cast<double>().normalized().toRotationMatrix();
        const PosedHull<double> posedA(m_exact[hullA], basisA, Eigen::Vector3d::Zero());
        const Eigen::Matrix3d basisB = turnB.cast<double>().normalized().toRotationMatrix();
        const auto search = [&](const Eigen::Vector3d& place)
        {
            return gjkDistance(posedA, PosedHull<double>(m_exact[hullB], basisB, place),
                               std::numeric_limits<double>::infinity(), cache);
        };
        const GjkResult<double> far = search(away);
        Eigen::Vector3d place = away + far.axis * (far.distance - gap);
        // Two slanted corners can pass each other; where the centres meet, the hulls overlap. A bit farther from there
        // they must, too, so that rounding does not decide.
        const Eigen::Vector3d inside = basisA * m_centres[hullA] - basisB * m_centres[hullB];
        const auto overlapsSurely = [&](const Eigen::Vector3d& offset)
        {
            const Eigen::Vector3d rounded = roundedToFloat(home + offset) - roundedToFloat(home);
            return search(rounded + 1e-4 * (rounded - inside)).distance <= 0;
        };
        while (gap < 0 && !overlapsSurely(place))
            place += 0.25 * (inside - place);
        std::vector<BodyPose>& poses = m_frames[static_cast<std::size_t>(frame)];
        poses[m_pairs[pair].a] = poseOf(hullA, turnA, home);
        poses[m_pairs[pair].b] = poseOf(hullB, turnB, home + place);
    }
}

bool isProved(const PairDepth& depth)
{
    // Two hulls of this bench and the way between them are larger.
    constexpr float kLeastSize = 2.0f;
    return depth.depth > 0.0f && depth.gap <= 1e-4f * kLeastSize;
}
}  // namespace cullet
