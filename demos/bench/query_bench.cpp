// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/aim_ray.h"
#include "cullet/demos/bench/bullet_subject.h"
#include "cullet/demos/bench/events/event_scenes.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"

#include <LinearMath/btAabbUtil2.h>

#include <cmath>
#include <memory>
#include <numeric>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kWarmFrames = 2;
constexpr int kTimedFrames = 7;
constexpr float kReach = 20.0f;  ///< length of a ray or sweep
constexpr float kHalf = 0.5f;    ///< half edge of a swept or queried box

enum class Kind
{
    Ray,
    Box,
    Sweep
};

constexpr Kind kKinds[] = {Kind::Ray, Kind::Box, Kind::Sweep};

const char* kindName(Kind kind)
{
    constexpr const char* kNames[] = {"broad.queries.ray", "broad.queries.aabb", "broad.queries.sweep"};
    return kNames[static_cast<int>(kind)];
}

struct Query
{
    btVector3 from;
    btVector3 to;
};

/// Counts the reported proxies, and on demand digests those whose exact box is hit.
class Hits : public btBroadphaseRayCallback
{
public:
    void aim(std::uint32_t query, const Query& ray, btScalar half)
    {
        m_query = query;
        m_from = ray.from;
        m_half = half;
        aimRay(*this, ray.from, ray.to);
    }

    bool process(const btBroadphaseProxy* proxy) override
    {
        ++reported;
        if (wantsDigest && isHit(*proxy))
            digest.add({m_query, BulletSubject::rowOf(*proxy)});
        return true;
    }

    std::uint64_t reported = 0;
    bool wantsDigest = false;
    PairDigest digest;

private:
    bool isHit(const btBroadphaseProxy& proxy) const
    {
        const btVector3 half(m_half, m_half, m_half);
        const btVector3 bounds[2] = {proxy.m_aabbMin - half, proxy.m_aabbMax + half};
        btScalar parameter = 1;
        return btRayAabb2(m_from, m_rayDirectionInverse, m_signs, bounds, parameter, btScalar(0),
                          m_lambda_max);
    }

    std::uint32_t m_query = 0;
    btVector3 m_from;
    btScalar m_half = 0;
};

class BoxHits : public btBroadphaseAabbCallback
{
public:
    bool process(const btBroadphaseProxy* proxy) override
    {
        ++reported;
        if (wantsDigest && TestAabbAgainstAabb2(proxy->m_aabbMin, proxy->m_aabbMax, low, high))
            digest.add({query, BulletSubject::rowOf(*proxy)});
        return true;
    }

    std::uint64_t reported = 0;
    bool wantsDigest = false;
    PairDigest digest;
    std::uint32_t query = 0;
    btVector3 low;
    btVector3 high;
};

/// Rays of length kReach with a random start in the bounds and a random direction.
std::vector<Query> makeQueries(std::uint32_t count, const ExactBox& bounds, std::uint64_t seed)
{
    SplitMix64 random(seed);
    std::vector<Query> queries(count);
    for (Query& query : queries)
    {
        btVector3 direction;
        for (int axis = 0; axis < 3; ++axis)
        {
            query.from[axis] = btScalar(
                random.uniform(static_cast<float>(bounds.min[axis]), static_cast<float>(bounds.max[axis])));
            direction[axis] = btScalar(random.uniform(-1.0f, 1.0f));
        }
        if (direction.length2() < btScalar(0.01))
            direction = btVector3(1, 0, 0);
        query.to = query.from + direction.normalized() * btScalar(kReach);
    }
    return queries;
}

PairDigest queryRays(btBroadphaseInterface& broadphase, const std::vector<Query>& queries, btScalar half,
                     bool digest)
{
    Hits hits;
    hits.wantsDigest = digest;
    const btVector3 extent(half, half, half);
    for (std::uint32_t i = 0; i < queries.size(); ++i)
    {
        hits.aim(i, queries[i], half);
        broadphase.rayTest(queries[i].from, queries[i].to, hits, -extent, extent);
    }
    if (!digest)
        hits.digest.count = hits.reported;
    return hits.digest;
}

PairDigest queryBoxes(btBroadphaseInterface& broadphase, const std::vector<Query>& queries, bool digest)
{
    BoxHits hits;
    hits.wantsDigest = digest;
    const btVector3 half(kHalf, kHalf, kHalf);
    for (std::uint32_t i = 0; i < queries.size(); ++i)
    {
        hits.query = i;
        hits.low = queries[i].from - half;
        hits.high = queries[i].from + half;
        broadphase.aabbTest(hits.low, hits.high, hits);
    }
    if (!digest)
        hits.digest.count = hits.reported;
    return hits.digest;
}

PairDigest ask(btBroadphaseInterface& broadphase, Kind kind, const std::vector<Query>& queries, bool digest)
{
    if (kind == Kind::Box)
        return queryBoxes(broadphase, queries, digest);
    return queryRays(broadphase, queries, kind == Kind::Sweep ? btScalar(kHalf) : btScalar(0), digest);
}

struct QueryRunner
{
    SubjectRequest request;
    std::unique_ptr<BulletSubject> subject;
    std::vector<double> queryMs;
    std::vector<double> updateMs;
    std::uint64_t reported = 0;
    PairDigest digest;
    TraceLane trace;
};

/// One kind of query at one number per frame, on a resting or moving scene.
class QueryBench
{
public:
    QueryBench(const BroadCase& benchCase, bool moving)
        : m_case{benchCase.options, moving ? "moving" : "static", benchCase.bodies, benchCase.sortedIds},
          m_moving(moving),
          m_scene(findBoxScene("W1")->make({benchCase.bodies, benchCase.sortedIds, benchCase.options.seed})),
          m_rows(benchCase.bodies)
    {
        std::iota(m_rows.begin(), m_rows.end(), 0u);
        for (const std::string& backend : benchCase.options.backends)
        {
            QueryRunner runner;
            runner.request = requestFor(benchCase, backend, boundsOf(m_scene->boxes()));
            runner.request.through = Through::Bullet;
            runner.subject = std::make_unique<BulletSubject>(runner.request);
            runner.subject->create(m_scene->boxes().data(), m_scene->boxes().size());
            runner.subject->findPairs();
            runner.trace = {benchCase.options.trace, backend + ", queries, " + m_case.scene};
            m_runners.push_back(std::move(runner));
        }
    }

    void run(Kind kind, std::uint32_t count, ResultFile& file)
    {
        for (QueryRunner& runner : m_runners)
        {
            runner.queryMs.clear();
            runner.updateMs.clear();
        }
        measure(kind, count);
        report(kind, count, file);
    }

private:
    void measure(Kind kind, std::uint32_t count)
    {
        Progress progress(kindName(kind), kWarmFrames + kTimedFrames, m_case.options.quiet);
        for (int frame = 0; frame < kWarmFrames + kTimedFrames && !isInterrupted(); ++frame)
        {
            if (m_moving)
                m_scene->step();
            const std::vector<Query> queries = makeQueries(
                count, boundsOf(m_scene->boxes()), m_case.options.seed + static_cast<std::uint64_t>(frame));
            for (std::size_t i = 0; i < m_runners.size(); ++i)
                runFrame(m_runners[(i + static_cast<std::size_t>(frame)) % m_runners.size()], kind, queries,
                         frame >= kWarmFrames);
            progress.advance();
        }
    }

    void runFrame(QueryRunner& runner, Kind kind, const std::vector<Query>& queries, bool timed)
    {
        const auto start = TraceFile::Clock::now();
        const Stopwatch updateWatch;
        if (m_moving)
            runner.subject->setBoxes(m_scene->boxes(), m_rows);
        runner.subject->findPairs();
        const double updateMs = updateWatch.wallMs();
        const auto updated = TraceFile::Clock::now();
        const Stopwatch queryWatch;
        runner.reported = ask(runner.subject->broadphase(), kind, queries, false).count;
        const double queryMs = queryWatch.wallMs();
        runner.trace.add("update", start, updated);
        runner.trace.add(kindName(kind), updated, TraceFile::Clock::now());
        if (!timed)
            return;
        runner.updateMs.push_back(updateMs);
        runner.queryMs.push_back(queryMs);
        runner.digest = ask(runner.subject->broadphase(), kind, queries, true);
    }

    void report(Kind kind, std::uint32_t count, ResultFile& file)
    {
        for (QueryRunner& runner : m_runners)
        {
            if (runner.queryMs.empty())
                continue;
            Json row = makeRow(kindName(kind), m_case, runner.request, runner.subject->threads());
            addMeasurement(row, runner.digest, runner.queryMs);
            row["pairs"] = runner.subject->heldPairs();
            row["queries"] = count;
            row["hits"] = runner.digest.count;
            row["reported"] = runner.reported;
            row["update_median_ms"] = summarise(runner.updateMs).median;
            row["frames"] = runner.queryMs.size();
            printRow(row);
            file.addRow(std::move(row));
            if (runner.digest != m_runners.front().digest && !isInterrupted())
                throw ProgramError(kExitDisagreement, std::string("hits disagree in ") + kindName(kind) +
                                                          ": " + runner.request.name + " against " +
                                                          m_runners.front().request.name);
        }
    }

    BroadCase m_case;
    bool m_moving;
    std::unique_ptr<BoxScene> m_scene;
    std::vector<std::uint32_t> m_rows;
    std::vector<QueryRunner> m_runners;
};
}  // namespace

void runQueryBench(const BroadCase& benchCase, ResultFile& file)
{
    std::vector<std::uint32_t> counts = {1, 100, 100000};
    if (benchCase.options.queries > 0)
        counts = {benchCase.options.queries};
    for (const bool moving : {false, true})
    {
        QueryBench bench(benchCase, moving);
        for (const Kind kind : kKinds)
        {
            for (const std::uint32_t count : counts)
                bench.run(kind, count, file);
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
