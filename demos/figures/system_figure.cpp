// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"
#include "cullet/demos/bench/named_backends.h"
#include "cullet/demos/figures/device_system.h"
#include "cullet/demos/figures/figure.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/exact_pairs.h"
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/narrow/gjk/isa_gjk.h"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <iterator>
#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr float kMargin = 0.05f;  // Bullet's default

/// The thesis's bodies: spheres of 80 triangles, randomly rotated.
class Spheres
{
public:
    Spheres(std::size_t count, std::uint64_t seed) : m_hull(hullOf<float>(icoPoints(1)))
    {
        std::mt19937 engine(static_cast<unsigned>(seed));
        for (std::size_t i = 0; i < count; ++i)
            m_bases.push_back(randomRotation(engine).cast<float>());
    }

    const Hull<float>& hull() const { return m_hull; }

    /// Where the spheres are, for a device.
    void place(const std::vector<Aabb>& boxes, std::vector<BodyPose>& poses) const
    {
        poses.resize(boxes.size());
        for (std::size_t row = 0; row < boxes.size(); ++row)
        {
            const Eigen::Quaternionf turn(m_bases[row]);
            BodyPose& pose = poses[row];
            pose.hull = 0;
            for (int axis = 0; axis < 3; ++axis)
                pose.position[axis] = 0.5f * (boxes[row].min[axis] + boxes[row].max[axis]);
            for (int k = 0; k < 4; ++k)
                pose.rotation[k] = turn.coeffs()[k];
        }
    }

    PosedHull<float> posed(std::uint32_t row, const Aabb& box, SupportMethod method) const
    {
        const Eigen::Vector3f low(box.min[0], box.min[1], box.min[2]);
        const Eigen::Vector3f high(box.max[0], box.max[1], box.max[2]);
        return {m_hull, m_bases[row], 0.5f * (low + high), method};
    }

private:
    Hull<float> m_hull;
    std::vector<Eigen::Matrix3f> m_bases;
};

struct Configuration
{
    const char* name;
    const char* broad;
    SupportMethod support;
    bool isWarm;  ///< a pair keeps the state of its last query
};

/// A broad phase with a pair list, and a narrow phase that queries each pair.
class System
{
public:
    System(const Configuration& configuration, TraceFile* trace, std::uint32_t bodies)
        : m_configuration(configuration),
          m_backend(makeBackend(configuration.broad, 1)),
          m_trace(trace, std::string(configuration.name) + ", figure 13 with " + std::to_string(bodies))
    {
    }

    const Configuration& configuration() const { return m_configuration; }
    std::vector<double> broadMs, narrowMs;
    PairDigest touching;
    std::size_t pairCount() const { return m_pairs.size(); }

    void create(const std::vector<Aabb>& boxes)
    {
        for (const Aabb& box : boxes)
            m_table.create(box, m_table.size() + 1, {1, -1});
    }

    void step(const BoxScene& scene, const Spheres& spheres, bool isTimed)
    {
        const auto start = TraceFile::Clock::now();
        const Stopwatch broad;
        for (const std::uint32_t row : scene.moved())
            m_table.setBox(row, scene.boxes()[row]);
        updatePairs();
        // CPU time varies less with one thread; wall time for a GPU.
        const bool isOnGpu = std::string(m_configuration.broad) == "cuda";
        const double broadTime = isOnGpu ? broad.wallMs() : broad.cpuMs();
        const auto middle = TraceFile::Clock::now();
        const Stopwatch narrow;
        queryAll(scene.boxes(), spheres);
        const double narrowTime = narrow.cpuMs();
        m_trace.add("broad", start, middle);
        m_trace.add("narrow", middle, TraceFile::Clock::now());
        if (!isTimed)
            return;
        broadMs.push_back(broadTime);
        narrowMs.push_back(narrowTime);
    }

private:
    void updatePairs()
    {
        const Status status = m_backend->update(m_table.beginUpdate(kMargin, false), m_delta);
        m_table.endUpdate();
        if (status != Status::Ok)
            throw std::runtime_error(std::string("backend ") + m_configuration.broad + " failed");
        m_next.clear();
        std::set_difference(m_pairs.begin(), m_pairs.end(), m_delta.removed.begin(), m_delta.removed.end(),
                            std::back_inserter(m_next));
        const auto middle = static_cast<std::ptrdiff_t>(m_next.size());
        m_next.insert(m_next.end(), m_delta.added.begin(), m_delta.added.end());
        std::inplace_merge(m_next.begin(), m_next.begin() + middle, m_next.end());
        m_pairs.swap(m_next);
    }

    /// Moves the caches of pairs of the last frame to the pairs that persist.
    void followPairs()
    {
        m_nextCaches.assign(m_pairs.size(), {});
        std::size_t old = 0;
        for (std::size_t i = 0; i < m_pairs.size() && m_configuration.isWarm; ++i)
        {
            while (old < m_cachedPairs.size() && m_cachedPairs[old] < m_pairs[i])
                ++old;
            if (old < m_cachedPairs.size() && m_cachedPairs[old] == m_pairs[i])
                m_nextCaches[i] = m_caches[old];
        }
        m_caches.swap(m_nextCaches);
        m_cachedPairs = m_pairs;
    }

    void queryAll(const std::vector<Aabb>& boxes, const Spheres& spheres)
    {
        followPairs();
        touching = {};
        for (std::size_t i = 0; i < m_pairs.size(); ++i)
        {
            const std::uint32_t a = m_pairs[i].first - 1;
            const std::uint32_t b = m_pairs[i].second - 1;
            const auto result =
                isaGjk(spheres.posed(a, boxes[a], m_configuration.support),
                       spheres.posed(b, boxes[b], m_configuration.support), 0.0f, m_caches[i]);
            if (result.state == GjkState::Overlapping)
                touching.add(m_pairs[i]);
        }
    }

    Configuration m_configuration;
    std::unique_ptr<Backend> m_backend;
    TraceLane m_trace;
    ProxyTable m_table;
    PairDelta m_delta;
    Pairs m_pairs, m_next, m_cachedPairs;  ///< unique ids are rows + 1
    std::vector<GjkCache<float>> m_caches, m_nextCaches;
};

/// Both phases on a device, if there is one.
class WholeOnDevice
{
public:
    WholeOnDevice(const Spheres& spheres, TraceFile* trace, std::uint32_t bodies)
        : m_system(makeDeviceSystem(setOf(spheres))),
          m_trace(trace, "device, figure 13 with " + std::to_string(bodies))
    {
    }

    bool isThere() const { return m_system != nullptr; }
    std::vector<double> wholeMs;
    PairDigest touching;
    std::size_t pairCount() const { return m_system->pairCount(); }

    void step(const BoxScene& scene, const Spheres& spheres, bool isTimed)
    {
        spheres.place(scene.boxes(), m_poses);
        const auto start = TraceFile::Clock::now();
        const double ms = m_system->step(m_poses);
        m_trace.add("whole", start, TraceFile::Clock::now());
        touching = {};
        for (const RowPair pair : m_system->overlaps())
            touching.add({pair.a + 1, pair.b + 1});
        if (isTimed)
            wholeMs.push_back(ms);
    }

private:
    static HullSet setOf(const Spheres& spheres)
    {
        HullSet set;
        set.add(spheres.hull());
        return set;
    }

    std::unique_ptr<DeviceSystem> m_system;
    TraceLane m_trace;
    std::vector<BodyPose> m_poses;
};

/// A quaternion rounds a rotation in another way than a matrix, which decides where gaps are below 1e-6.
void requireAlike(const WholeOnDevice& device, const System& system, std::uint32_t bodies)
{
    const std::uint64_t expected = system.touching.count, found = device.touching.count;
    const std::uint64_t difference = expected > found ? expected - found : found - expected;
    if (difference > 1 + system.pairCount() / 100000)
        throw ProgramError(kExitDisagreement, "figure 13 with " + std::to_string(bodies) + " bodies: " +
                                                  system.configuration().name + " and the device differ");
}

void requireSameAnswers(const std::deque<System>& systems, std::uint32_t bodies)
{
    for (const System& system : systems)
    {
        if (system.touching != systems.front().touching || system.pairCount() != systems.front().pairCount())
            throw ProgramError(kExitDisagreement, "figure 13 with " + std::to_string(bodies) +
                                                      " bodies: " + systems.front().configuration().name +
                                                      " and " + system.configuration().name + " differ");
    }
}

/// What a row of the figure says beside its times.
struct RowOf
{
    const char* system;
    const char* phase;
    const char* broad;
    std::size_t pairs;
    PairDigest touching;
};

void addRow(const RowOf& row, const std::vector<double>& times, std::uint32_t bodies, ResultFile& file)
{
    const Statistics statistics = summarise(times);
    std::printf("%-8s %-7s %-8s %8u bodies %9zu pairs %8llu touch  median %10.3f ms  %s\n", "system",
                row.system, row.phase, bodies, row.pairs, static_cast<unsigned long long>(row.touching.count),
                statistics.median, toHex(row.touching.hash).c_str());
    file.addRow({{"benchmark", std::string("figure13.") + row.phase},
                 {"scene", "W1"},
                 {"backend", row.broad},
                 {"precision", ownPrecision()},
                 {"threads", 1},
                 {"bodies", bodies},
                 {"pairs", row.pairs},
                 {"median_ms", statistics.median},
                 {"p90_ms", statistics.p90},
                 {"min_ms", statistics.min},
                 {"hash", toHex(row.touching.hash)},
                 {"system", row.system},
                 {"touching_pairs", row.touching.count}});
}

void addSystemRows(const System& system, std::uint32_t bodies, ResultFile& file)
{
    const Configuration& configuration = system.configuration();
    const auto rowOf = [&](const char* phase) -> RowOf {
        return {configuration.name, phase, configuration.broad, system.pairCount(), system.touching};
    };
    addRow(rowOf("broad"), system.broadMs, bodies, file);
    addRow(rowOf("narrow"), system.narrowMs, bodies, file);
}

std::deque<System> makeSystems(std::uint32_t bodies, TraceFile* trace)
{
    constexpr std::uint32_t kMaxByThesis = 216000;
    std::deque<System> systems;
    if (bodies <= kMaxByThesis)
        systems.emplace_back(Configuration{"thesis", "psap-thesis", SupportMethod::Climb, false}, trace,
                             bodies);
    systems.emplace_back(Configuration{"cullet", "grid", SupportMethod::Automatic, true}, trace, bodies);
    if (hasCudaDevice())
        systems.emplace_back(Configuration{"cuda", "cuda", SupportMethod::Automatic, true}, trace, bodies);
    return systems;
}

void measureSize(const FigureOptions& options, std::uint32_t bodies, ResultFile& file)
{
    constexpr int kWarmFrames = 2;
    const int frames = kWarmFrames + (options.quick ? 3 : 7);
    const auto scene = findBoxScene("W1")->make({bodies, false, options.seed});
    const Spheres spheres(bodies, options.seed);
    std::deque<System> systems = makeSystems(bodies, options.trace);
    for (System& system : systems)
        system.create(scene->boxes());
    WholeOnDevice device(spheres, options.trace, bodies);
    Progress progress("figure 13 " + std::to_string(bodies), static_cast<std::uint64_t>(frames),
                      options.quiet);
    for (int frame = 0; frame < frames && !isInterrupted(); ++frame)
    {
        scene->step();
        for (std::size_t i = 0; i < systems.size(); ++i)
            systems[(i + static_cast<std::size_t>(frame)) % systems.size()].step(*scene, spheres,
                                                                                 frame >= kWarmFrames);
        requireSameAnswers(systems, bodies);
        if (device.isThere())
        {
            device.step(*scene, spheres, frame >= kWarmFrames);
            requireAlike(device, systems.back(), bodies);
        }
        progress.show(static_cast<std::uint64_t>(frame + 1));
    }
    for (const System& system : systems)
    {
        if (!system.broadMs.empty())
            addSystemRows(system, bodies, file);
    }
    if (!device.wholeMs.empty())
        addRow({"device", "whole", "cuda", device.pairCount(), device.touching}, device.wholeMs, bodies,
               file);
}
}  // namespace

void measureFigure13(const FigureOptions& options, ResultFile& file)
{
    const std::vector<std::uint32_t> sizes = sizesOf(
        options, {1000, 8000, 27000, 64000, 125000, 216000, 512000, 1000000, 4096000}, 64000, 1000000);
    FigureClock clock(options, "13");
    for (const std::uint32_t bodies : sizes)
    {
        if (!clock.hasTimeFor(bodies))
            return;
        measureSize(options, bodies, file);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
