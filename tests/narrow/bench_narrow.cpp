// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "narrow/epa.h"
#include "narrow/gjk.h"
#include "narrow/isa_gjk.h"
#include "tests/narrow/pair_scenes.h"
#include "tests/narrow/shapes.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

/// bench_narrow [shape]: nanoseconds per query on trajectories of 64 pairs over 101 frames, thread CPU time, best
/// quarter of interleaved repetitions, against Bullet's btGjkPairDetector (and its EPA where the shapes overlap).
///
/// Columns: shape,regime,query,ns_per_query,bullet_over_this,iterations,wrong. `wrong` counts booleans that differ from
/// a gap's sign with |gap| >= 1e-6 by the double distance query.
namespace cullet::test
{
namespace
{
constexpr int kPairs = 64;
constexpr int kFrames = 101;
constexpr int kRepetitions = 9;

struct Regime
{
    const char* name;
    double low, high;  ///< gap along the trajectory, times the size
};

constexpr Regime kRegimes[] = {{"separated", 0.02, 0.08},
                               {"near", 1e-3, 3e-3},
                               {"crossing", -0.03, 0.03},
                               {"overlapping", -0.05, -0.01}};

struct Trajectories
{
    std::vector<PairScene<float>> scenes;  ///< frame-major: [frame][pair]
    std::vector<char> overlaps;
};

/// B turns a little each frame and swings between the regime's gaps along the axis of the distance.
Trajectories makeTrajectories(const Hull<float>& hull, const Regime& regime)
{
    std::mt19937 engine(12345);
    Trajectories out;
    std::vector<PairScene<float>> now;
    std::uniform_real_distribution<double> phase(0.0, 6.28);
    std::vector<double> phases;
    for (int pair = 0; pair < kPairs; ++pair)
    {
        now.push_back(randomPair(hull, hull, 0.05, 0.0, engine));
        phases.push_back(phase(engine));
    }
    for (int frame = 0; frame < kFrames; ++frame)
    {
        for (int pair = 0; pair < kPairs; ++pair)
        {
            PairScene<float>& scene = now[pair];
            moveALittle(scene, 0.01, engine);
            const double swing = 0.5 + 0.5 * std::sin(phases[pair] + 0.15 * frame);
            const double gap = regime.low + swing * (regime.high - regime.low);
            // Back off to a known distance first, then go to the wanted gap along its axis.
            const Eigen::Vector3f away = (scene.b.origin - scene.a.origin).normalized();
            PairScene<float> apart = scene;
            apart.b.origin += 0.3f * away;
            GjkCache<double> cache;
            const auto far = gjkDistance(apart.posedA(), apart.posedB(), 1e30, cache);
            scene.b.origin = apart.b.origin + ((far.distance - gap) * far.axis).cast<float>();
            out.scenes.push_back(scene);
            cache = {};
            out.overlaps.push_back(gjkDistance(scene.posedA(), scene.posedB(), 1e30, cache).state ==
                                   GjkState::Overlapping);
        }
    }
    return out;
}

double threadSeconds()
{
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Row
{
    const char* query;
    std::function<bool(std::size_t pair, const PairScene<float>& scene)> run;  ///< true: overlaps
    std::function<void()> reset;
    std::vector<double> seconds;
    std::int64_t wrong = 0;
};

btTransform transformOf(const Pose<float>& pose)
{
    const auto& m = pose.basis;
    return btTransform(
        btMatrix3x3(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)),
        btVector3(pose.origin.x(), pose.origin.y(), pose.origin.z()));
}

/// Bullet's detector as its convex algorithm calls it, with margin 0.
class BulletDetector
{
public:
    explicit BulletDetector(const Hull<float>& hull)
    {
        for (int v = 0; v < hull.vertexCount(); ++v)
            m_shape.addPoint(btVector3(hull.vertex(v).x(), hull.vertex(v).y(), hull.vertex(v).z()), false);
        m_shape.recalcLocalAabb();
        m_shape.setMargin(0.0f);
    }

    bool overlaps(const PairScene<float>& scene)
    {
        btVoronoiSimplexSolver simplex;
        btGjkEpaPenetrationDepthSolver depth;
        btGjkPairDetector detector(&m_shape, &m_shape, &simplex, &depth);
        btGjkPairDetector::ClosestPointInput input;
        input.m_transformA = transformOf(scene.a);
        input.m_transformB = transformOf(scene.b);
        btPointCollector out;
        detector.getClosestPoints(input, out, nullptr);
        return out.m_hasResult && out.m_distance <= 0.0f;
    }

private:
    btConvexHullShape m_shape;
};

void measure(Row& row, const Trajectories& trajectories)
{
    row.reset();
    std::int64_t wrong = 0;
    const double start = threadSeconds();
    for (std::size_t i = 0; i < trajectories.scenes.size(); ++i)
        wrong += row.run(i % kPairs, trajectories.scenes[i]) != (trajectories.overlaps[i] != 0);
    row.seconds.push_back(threadSeconds() - start);
    row.wrong = wrong;
}

void runRegime(const char* shape, const Hull<float>& hull, const Regime& regime)
{
    const Trajectories trajectories = makeTrajectories(hull, regime);
    std::vector<GjkCache<float>> caches(kPairs);
    const auto reset = [&caches] { caches.assign(kPairs, {}); };
    BulletDetector bullet(hull);
    std::int64_t iterations = 0;
    std::vector<Row> rows;
    rows.push_back({"bullet", [&](std::size_t, const auto& s) { return bullet.overlaps(s); }, [] {}, {}});
    rows.push_back({"boolean warm",
                    [&](std::size_t pair, const auto& s)
                    {
                        const auto result = isaGjk(s.posedA(), s.posedB(), 0.0f, caches[pair]);
                        iterations += result.iterations;
                        return result.state == GjkState::Overlapping;
                    },
                    reset,
                    {}});
    rows.push_back({"boolean cold",
                    [&](std::size_t, const auto& s)
                    {
                        GjkCache<float> cache;
                        const auto result = isaGjk(s.posedA(), s.posedB(), 0.0f, cache);
                        iterations += result.iterations;
                        return result.state == GjkState::Overlapping;
                    },
                    reset,
                    {}});
    rows.push_back({"distance warm",
                    [&](std::size_t pair, const auto& s)
                    {
                        const auto result = gjkDistance(s.posedA(), s.posedB(), 1e30f, caches[pair]);
                        iterations += result.iterations;
                        return result.state == GjkState::Overlapping;
                    },
                    reset,
                    {}});
    rows.push_back({"depth warm",
                    [&](std::size_t pair, const auto& s)
                    {
                        const auto result = isaGjk(s.posedA(), s.posedB(), 0.0f, caches[pair]);
                        if (result.state != GjkState::Overlapping)
                            return false;
                        const auto depth = penetration(s.posedA(), s.posedB(), caches[pair]);
                        iterations += depth.iterations;
                        return depth.state == GjkState::Overlapping;
                    },
                    reset,
                    {}});
    std::vector<double> iterationsOf(rows.size());
    for (int repetition = 0; repetition < kRepetitions; ++repetition)
    {
        for (std::size_t i = 0; i < rows.size(); ++i)
        {
            iterations = 0;
            measure(rows[i], trajectories);
            iterationsOf[i] = static_cast<double>(iterations) / (kPairs * kFrames);
        }
    }
    double bulletTime = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i)
    {
        std::sort(rows[i].seconds.begin(), rows[i].seconds.end());
        const double time = rows[i].seconds[kRepetitions / 4] / (kPairs * kFrames) * 1e9;
        bulletTime = i == 0 ? time : bulletTime;
        std::printf("%s,%s,%s,%.1f,%.1f,%.2f,%lld\n", shape, regime.name, rows[i].query, time,
                    bulletTime / time, iterationsOf[i], static_cast<long long>(rows[i].wrong));
    }
    std::fflush(stdout);
}
}  // namespace
}  // namespace cullet::test

int main(int argc, char** argv)
{
    using namespace cullet;
    using namespace cullet::test;
    std::printf("shape,regime,query,ns_per_query,bullet_over_this,iterations,wrong\n");
    for (const NamedPoints& shape : queryShapes())
    {
        if (argc > 1 ? shape.name != argv[1]
                     : (shape.name != "ico42" && shape.name != "box8" && shape.name != "ell200"))
            continue;
        const Hull<float> hull = hullOf<float>(shape.points);
        for (const auto& regime : kRegimes)
            runRegime(shape.name.c_str(), hull, regime);
    }
    return 0;
}
