// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/broad_options.h"
#include "cullet/demos/figures/figure.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cmath>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr double kBoxSide = 2.0;
constexpr double kVolumePerBody = 32.0;  // of the scene W1
/// The room's side: that of W1 with 64,000 bodies.
const double kRoomSide = std::cbrt(kVolumePerBody * 64000);
constexpr std::uint32_t kMaxByBruteForce = 8000;
constexpr std::uint32_t kMaxInRoom = 512000;

struct Expectation
{
    double mean;
    double deviation;
};

/// Pairs of `count` boxes of side d whose centres are uniform in a cube of side L >= 2 d.
///
/// Two overlap on an axis with probability q = 1 - (1 - d/L)^2. Pairs with a body in common are not independent near
/// the walls: the square of the chance of a given body has the mean e = 4 (d/L)^2 - 10/3 (d/L)^3 per axis.
Expectation expectPairs(double count, double side)
{
    const double ratio = kBoxSide / side;
    const double chance = std::pow(1.0 - (1.0 - ratio) * (1.0 - ratio), 3);
    const double squares = std::pow(4.0 * ratio * ratio - 10.0 / 3.0 * ratio * ratio * ratio, 3);
    const double pairs = 0.5 * count * (count - 1.0);
    const double variance =
        pairs * chance * (1.0 - chance) + count * (count - 1.0) * (count - 2.0) * (squares - chance * chance);
    return {pairs * chance, std::sqrt(variance)};
}

std::vector<Aabb> boxesInRoom(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const float centre = random.uniform(0.0f, static_cast<float>(kRoomSide));
            box.min[axis] = centre - 0.5f * static_cast<float>(kBoxSide);
            box.max[axis] = centre + 0.5f * static_cast<float>(kBoxSide);
        }
    }
    return boxes;
}

PairDigest findPairs(const std::string& backend, const std::vector<Aabb>& boxes, TraceFile* trace,
                     double& milliseconds)
{
    SubjectRequest request;
    request.name = backend;
    request.threads = 1;
    request.bodies = static_cast<std::uint32_t>(boxes.size());
    request.bounds = boundsOf(boxes);
    const std::unique_ptr<Subject> subject = makeSubject(request);
    TraceLane lane(trace, "figure 12, " + backend + ", " + std::to_string(boxes.size()));
    const auto start = TraceFile::Clock::now();
    const Stopwatch watch;
    subject->create(boxes.data(), boxes.size());
    const auto created = TraceFile::Clock::now();
    subject->findPairs();
    milliseconds = watch.cpuMs();
    lane.add("create", start, created);
    lane.add("findPairs", created, TraceFile::Clock::now());
    subject->settle();
    return subject->digest(boxes);
}

void measureBoxes(const std::string& scene, const std::vector<Aabb>& boxes, double side, TraceFile* trace,
                  ResultFile& file)
{
    const double count = static_cast<double>(boxes.size());
    const Expectation expected = expectPairs(count, side);
    double milliseconds = 0.0;
    for (const char* backend : {"grid", "brute"})
    {
        if (std::string(backend) == "brute" && boxes.size() > kMaxByBruteForce)
            continue;
        const PairDigest digest = findPairs(backend, boxes, trace, milliseconds);
        const double deviations = (static_cast<double>(digest.count) - expected.mean) / expected.deviation;
        std::printf("%-5s %-6s %9zu bodies %9llu pairs, %11.1f expected, off by %5.2f deviations  %s\n",
                    scene.c_str(), backend, boxes.size(), static_cast<unsigned long long>(digest.count),
                    expected.mean, deviations, toHex(digest.hash).c_str());
        file.addRow({{"benchmark", "figure12.pairs"},
                     {"scene", scene},
                     {"backend", backend},
                     {"precision", ownPrecision()},
                     {"threads", 1},
                     {"bodies", boxes.size()},
                     {"pairs", digest.count},
                     {"median_ms", milliseconds},
                     {"p90_ms", milliseconds},
                     {"min_ms", milliseconds},
                     {"hash", toHex(digest.hash)},
                     {"expected_pairs", expected.mean},
                     {"standard_deviation", expected.deviation},
                     {"deviations", deviations}});
    }
}
}  // namespace

void measureFigure12(const FigureOptions& options, ResultFile& file)
{
    const std::vector<std::uint32_t> sizes = sizesOf(
        options, {1000, 8000, 27000, 64000, 125000, 216000, 512000, 1000000, 4096000}, 64000, 1000000);
    Progress progress("figure 12", 2 * sizes.size(), options.quiet);
    std::uint64_t done = 0;
    FigureClock clock(options, "12");
    for (const std::uint32_t bodies : sizes)
    {
        if (!clock.hasTimeFor(bodies))
            return;
        const auto scene = findBoxScene("W1")->make({bodies, false, options.seed});
        measureBoxes("W1", scene->boxes(), std::cbrt(kVolumePerBody * bodies), options.trace, file);
        progress.show(++done);
        if (bodies <= kMaxInRoom)
            measureBoxes("room", boxesInRoom(bodies, options.seed), kRoomSide, options.trace, file);
        progress.show(++done);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
