// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/frames_bench.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/heap_usage.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::uint32_t kManyBodies = 200000;
constexpr std::uint32_t kMaxExactlyChecked = 150000;
constexpr int kMinTimedFrames = 3;

/// A backend under measurement and its results so far.
struct Runner
{
    SubjectRequest request;
    std::unique_ptr<Subject> subject;
    double createMs = 0.0;
    double spentMs = 0.0;
    int warmFrames = 0;
    std::vector<double> wall;
    std::vector<double> cpu;
    PairDigest digest;
    int digestFrame = 0;  ///< of the scene, counted from its start
    int checks = 0;
    int wrongChecks = 0;  ///< of a rival; wrong pairs of Bullet's or cullet's broad phase end the run
    std::string path;
    BackendStats counters;  ///< of the last timed frame
    ComparisonStats comparisonCounters;
    std::vector<Json> frameRows;
    TraceLane trace;
};

/// The reference pairs of one frame.
class ReferencePairs
{
public:
    explicit ReferencePairs(const BroadCase& benchCase) : m_case(benchCase) {}

    void startFrame(int frame)
    {
        m_frame = frame;
        m_expected.reset();
    }

    void check(Runner& runner, const std::vector<Aabb>& boxes)
    {
        runner.digest = runner.subject->digest(boxes);
        runner.digestFrame = m_frame;
        ++runner.checks;
        if (!m_expected)
        {
            m_referenceName = isExact() ? "exact" : runner.request.name;
            m_expected = isExact() ? exactDigest(boxes) : runner.digest;
        }
        if (*m_expected == runner.digest)
            return;
        if (isRival(runner.request.name))
        {
            ++runner.wrongChecks;
            return;
        }
        throw ProgramError(kExitDisagreement,
                           "pairs disagree in frame " + std::to_string(m_frame) + " of " + m_case.scene +
                               " with " + std::to_string(m_case.bodies) + " bodies: " + m_referenceName +
                               " has " + std::to_string(m_expected->count) + ", " + runner.request.name +
                               " has " + std::to_string(runner.digest.count));
    }

    bool isExact() const { return m_case.bodies <= kMaxExactlyChecked; }

private:
    static PairDigest exactDigest(const std::vector<Aabb>& boxes)
    {
        std::vector<ExactBox> exact;
        exact.reserve(boxes.size());
        for (const Aabb& box : boxes)
            exact.push_back(toExactBox(box));
        PairDigest digest;
        for (const Pair pair : findExactPairs(exact))
            digest.add(pair);
        return digest;
    }

    const BroadCase& m_case;
    int m_frame = 0;
    std::string m_referenceName;
    std::optional<PairDigest> m_expected;
};

/// All frames of one case.
class FramesBench
{
public:
    FramesBench(const BroadCase& benchCase, BoxScene& scene)
        : m_case(benchCase), m_options(benchCase.options), m_scene(scene), m_reference(benchCase)
    {
        const bool many = benchCase.bodies >= kManyBodies;
        m_timedFrames = m_options.frames > 0 ? m_options.frames : (many ? 10 : 12);
        m_warmFrames = m_options.warmup >= 0 ? m_options.warmup : (many ? 4 : 12);
        m_allRows.resize(benchCase.bodies);
        std::iota(m_allRows.begin(), m_allRows.end(), 0u);
    }

    void add(const std::string& backend)
    {
        Runner runner;
        runner.request = requestFor(m_case, backend, boundsOf(m_scene.boxes()));
        runner.subject = makeSubject(runner.request);
        const Stopwatch watch;
        runner.subject->create(m_scene.boxes().data(), m_scene.boxes().size());
        runner.subject->findPairs();
        runner.createMs = watch.wallMs();
        runner.subject->settle();
        runner.spentMs = runner.createMs;
        runner.trace = {m_options.trace, backend + ", " + m_case.scene + " of " +
                                             std::to_string(m_case.bodies) +
                                             (m_case.sortedIds ? ", sorted ids" : "")};
        m_runners.push_back(std::move(runner));
    }

    /// Advances the scene by a frame, if any backend still has frames to run.
    void runFrame()
    {
        if (isFinished())
            return;
        ++m_frame;
        m_scene.step();
        m_reference.startFrame(m_frame);
        for (std::size_t i = 0; i < m_runners.size(); ++i)
        {
            Runner& runner = m_runners[(i + static_cast<std::size_t>(m_frame)) % m_runners.size()];
            if (!isDone(runner) && !isInterrupted())
                runFrame(runner);
        }
    }

    bool isFinished() const
    {
        return std::all_of(m_runners.begin(), m_runners.end(), [this](const Runner& r) { return isDone(r); });
    }

    int framesPlanned() const { return m_timedFrames + m_warmFrames; }

    /// The rows of all timed backends, which are unusable afterwards.
    std::vector<Json> report()
    {
        std::vector<Json> rows;
        for (Runner& runner : m_runners)
        {
            if (runner.wall.empty())
                continue;
            rows.push_back(rowOf(runner));
            for (Json& frameRow : runner.frameRows)
                rows.push_back(std::move(frameRow));
        }
        return rows;
    }

private:
    bool isDone(const Runner& runner) const
    {
        const int timed = static_cast<int>(runner.wall.size());
        if (timed >= m_timedFrames)
            return true;
        return timed >= kMinTimedFrames && runner.spentMs > m_options.budget * 1e3;
    }

    bool isWarm(const Runner& runner) const
    {
        if (runner.warmFrames >= m_warmFrames)
            return true;
        return runner.warmFrames >= 1 && runner.spentMs > m_options.budget * 1e3 / 3.0;
    }

    void runFrame(Runner& runner)
    {
        const bool timed = isWarm(runner);
        const Stopwatch watch;
        const auto start = TraceFile::Clock::now();
        runner.subject->setBoxes(m_scene.boxes(), m_options.resend ? m_allRows : m_scene.moved());
        const auto handedOver = TraceFile::Clock::now();
        runner.subject->findPairs();
        const double wall = watch.wallMs();
        const double cpu = watch.cpuMs();
        runner.trace.add("setBoxes", start, handedOver);
        runner.trace.add("findPairs", handedOver, TraceFile::Clock::now());
        runner.subject->settle();
        runner.spentMs += wall;
        if (!timed)
        {
            ++runner.warmFrames;
            return;
        }
        runner.wall.push_back(wall);
        runner.cpu.push_back(cpu);
        runner.path = runner.subject->path();
        runner.counters = runner.subject->counters();
        runner.comparisonCounters = runner.subject->comparisonCounters();
        if (m_options.perFrame)
            addFrameRow(runner, wall, cpu);
        const int frame = static_cast<int>(runner.wall.size());
        if (frame == 1 || frame == (m_timedFrames + 1) / 2 || isDone(runner))
            m_reference.check(runner, m_scene.boxes());
    }

    Json rowOf(Runner& runner) const
    {
        Json row = makeRow("broad.update", m_case, runner.request, runner.subject->threads());
        addMeasurement(row, runner.digest, runner.wall);
        row["cpu_median_ms"] = summarise(runner.cpu).median;
        row["frames"] = runner.wall.size();
        row["warmup_frames"] = runner.warmFrames;
        row["hash_frame"] = runner.digestFrame;
        row["path"] = runner.path;
        row["resend"] = m_options.resend;
        row["held_pairs"] = runner.subject->heldPairs();
        row["create_ms"] = runner.createMs;
        row["checks"] = runner.checks;
        row["wrong_checks"] = runner.wrongChecks;
        row["checked_against"] = m_reference.isExact() ? "exact" : "each other";
        addCounters(row, runner.counters, runner.comparisonCounters);
        row["bytes_per_body"] = releaseAndMeasure(runner) / m_case.bodies;
        return row;
    }

    void addFrameRow(Runner& runner, double wall, double cpu) const
    {
        Json row = makeRow("broad.frame", m_case, runner.request, runner.subject->threads());
        row["pairs"] = runner.counters.pairs;
        for (const char* column : {"median_ms", "p90_ms", "min_ms", "mean_ms"})
            row[column] = wall;
        row["cpu_median_ms"] = cpu;
        row["frame"] = runner.wall.size();
        row["path"] = runner.path;
        addCounters(row, runner.counters, runner.comparisonCounters);
        runner.frameRows.push_back(std::move(row));
    }

    /// Bytes that the subject returns to malloc when it is destroyed.
    static std::uint64_t releaseAndMeasure(Runner& runner)
    {
        runner.subject->releaseBookkeeping();
        const std::uint64_t before = heapBytesInUse();
        runner.subject.reset();
        const std::uint64_t after = heapBytesInUse();
        return before > after ? before - after : 0;
    }

    const BroadCase& m_case;
    const BroadOptions& m_options;
    BoxScene& m_scene;
    ReferencePairs m_reference;
    int m_frame = 0;
    int m_timedFrames;
    int m_warmFrames;
    std::vector<std::uint32_t> m_allRows;
    std::vector<Runner> m_runners;
};
}  // namespace

void runFramesBench(const BroadCase& benchCase, ResultFile& file)
{
    const BoxSceneInfo* info = findBoxScene(benchCase.scene);
    std::vector<FramesCase> cases;
    cases.push_back({benchCase, info->make({benchCase.bodies, benchCase.sortedIds, benchCase.options.seed})});
    std::vector<std::vector<Json>> rows = measureInTurn(cases);
    for (Json& row : rows.front())
    {
        if (row["benchmark"] == "broad.update")
            printRow(row);
        file.addRow(std::move(row));
    }
}

std::vector<std::vector<Json>> measureInTurn(std::vector<FramesCase>& cases)
{
    std::vector<std::unique_ptr<FramesBench>> benches;
    for (FramesCase& each : cases)
    {
        benches.push_back(std::make_unique<FramesBench>(each.benchCase, *each.scene));
        for (const std::string& backend : each.benchCase.options.backends)
            benches.back()->add(backend);
    }
    const BroadCase& first = cases.front().benchCase;
    Progress progress(first.scene + " " + std::to_string(first.bodies), benches.front()->framesPlanned(),
                      first.options.quiet);
    const auto isFinished = [](const auto& bench) { return bench->isFinished(); };
    while (!std::all_of(benches.begin(), benches.end(), isFinished) && !isInterrupted())
    {
        for (const auto& bench : benches)
            bench->runFrame();
        progress.advance();
    }
    std::vector<std::vector<Json>> rows;
    for (const auto& bench : benches)
        rows.push_back(bench->report());
    return rows;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
