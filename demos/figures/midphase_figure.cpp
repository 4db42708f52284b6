// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/host/host_exec.h"
#include "cullet/demos/figures/figure.h"
#include "cullet/demos/figures/midphase/leaf_tests.h"
#include "cullet/demos/figures/midphase/triangle_sizes.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/mid/linear_bvh.h"

#include <algorithm>
#include <cstdio>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Tree = LinearBvh<psap::HostExec>;

struct FrameTimes
{
    std::vector<double> build, refit, search, searchRefitted;  ///< ms
    std::uint64_t boxTests = 0, boxTestsRefitted = 0, pairs = 0, hash = 0;
};

/// FNV-1a of one more number.
std::uint64_t hashedWith(std::uint64_t hash, std::uint64_t number)
{
    return (hash ^ number) * 0x100000001B3u;
}

/// One leaf test over all frames.
struct LeafTotals
{
    std::vector<double> ms;
    std::uint64_t tests = 0, crossing = 0, disagreeing = 0, hash = 0;
};

/// Least CPU milliseconds of some calls.
template <class Call>
double leastMs(const Call& call)
{
    constexpr int kRepeats = 3;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kRepeats; ++i)
    {
        const Stopwatch watch;
        call();
        least = std::min(least, watch.cpuMs());
    }
    return least;
}

MeshBox boundsOfAll(const std::vector<MeshBox>& boxes)
{
    MeshBox bounds = kEmptyMeshBox;
    for (const MeshBox& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            bounds.min[axis] = std::min(bounds.min[axis], box.min[axis]);
            bounds.max[axis] = std::max(bounds.max[axis], box.max[axis]);
        }
    }
    return bounds;
}

/// A tree that is built anew in each frame, and one that is built in the first frame and refitted.
class Candidates
{
public:
    const std::vector<RowPair>& find(const MidphaseScene& scene, FrameTimes& times)
    {
        const std::vector<MeshBox> boxes = scene.meshBoxes();
        const auto count = static_cast<std::uint32_t>(boxes.size());
        const MeshBox bounds = boundsOfAll(boxes);
        m_queryBoxes.clear();
        for (std::size_t i = 0; i < scene.queries.size(); ++i)
            m_queryBoxes.push_back(scene.queries.boxOf(i));
        times.build.push_back(leastMs([&] { m_built.build(boxes.data(), count, bounds); }));
        if (m_refitted.size() == 0)
            m_refitted.build(boxes.data(), count, bounds);
        times.refit.push_back(leastMs([&] { m_refitted.refit(boxes.data()); }));
        times.searchRefitted.push_back(leastMs([&] { search(m_refitted); }));
        m_exec.collectTestCount();
        search(m_refitted);
        times.boxTestsRefitted += m_exec.collectTestCount();
        times.search.push_back(leastMs([&] { search(m_built); }));
        m_exec.collectTestCount();
        search(m_built);
        times.boxTests += m_exec.collectTestCount();
        m_pairs.resize(m_count);
        std::sort(m_pairs.begin(), m_pairs.end(),
                  [](const RowPair& a, const RowPair& b) { return a.a != b.a ? a.a < b.a : a.b < b.b; });
        times.pairs += m_count;
        for (const RowPair& pair : m_pairs)
            times.hash = hashedWith(times.hash, std::uint64_t(pair.a) << 32 | pair.b);
        return m_pairs;
    }

private:
    void search(Tree& tree)
    {
        for (;;)
        {
            m_pairs.resize(std::max<std::size_t>(m_pairs.size(), 1 << 16));
            m_count = 0;
            tree.findOverlaps(m_queryBoxes.data(), static_cast<std::uint32_t>(m_queryBoxes.size()),
                              psap::PairList{m_pairs.data(), m_pairs.size(), &m_count});
            if (m_count <= m_pairs.size())
                return;
            m_pairs.resize(m_count);
        }
    }

    static PsapOptions options()
    {
        PsapOptions options;
        options.executor = PsapExecutor::InOrder;
        return options;
    }

    psap::HostExec m_exec{options()};
    Tree m_built{m_exec}, m_refitted{m_exec};
    std::vector<MeshBox> m_queryBoxes;
    std::vector<RowPair> m_pairs;
    std::uint64_t m_count = 0;
};

/// Over all frames.
struct Measured
{
    std::vector<double> ms;
    std::uint64_t pairs, tests, hash;

    double perFrame(std::uint64_t sum) const
    {
        return static_cast<double>(sum) / static_cast<double>(ms.size());
    }
};

Json rowOf(const MidphaseScene& scene, const char* benchmark, const std::string& name,
           const Measured& measured)
{
    const Statistics statistics = summarise(measured.ms);
    return {{"benchmark", std::string("midphase.") + benchmark},
            {"scene", scene.name},
            {"backend", name},
            {"precision", ownPrecision()},
            {"threads", 1},
            {"bodies", scene.mesh.size()},
            {"pairs", measured.perFrame(measured.pairs)},
            {"median_ms", statistics.median},
            {"p90_ms", statistics.p90},
            {"min_ms", statistics.min},
            {"hash", toHex(measured.hash)},
            {"frames", measured.ms.size()},
            {"queries", scene.queries.size()},
            {"tests", measured.perFrame(measured.tests)}};
}

void addTreeRow(const MidphaseScene& scene, const char* name, const Measured& measured, ResultFile& file)
{
    std::printf("%-6s %-18s %8.4f ms a frame, %9.0f box tests\n", scene.name, name,
                summarise(measured.ms).median, measured.perFrame(measured.tests));
    file.addRow(rowOf(scene, "tree", name, measured));
}

void addLeafRow(const MidphaseScene& scene, const std::string& name, const LeafTotals& totals,
                std::uint64_t pairs, ResultFile& file)
{
    Json row = rowOf(scene, "leaf", name, {totals.ms, pairs, totals.tests, totals.hash});
    const double all = static_cast<double>(pairs);
    const double nsPerPair = 1e6 * summarise(totals.ms).mean * static_cast<double>(totals.ms.size()) / all;
    row.update({{"ns_per_pair", nsPerPair},
                {"tests_per_pair", static_cast<double>(totals.tests) / all},
                {"crossing_share", static_cast<double>(totals.crossing) / all},
                {"disagreeing", totals.disagreeing}});
    std::printf("%-6s %-18s %8.1f ns a pair, %6.2f tests a pair, %5.1f %% cross, %llu disagree\n", scene.name,
                name.c_str(), nsPerPair, static_cast<double>(totals.tests) / all,
                100.0 * static_cast<double>(totals.crossing) / all,
                static_cast<unsigned long long>(totals.disagreeing));
    file.addRow(std::move(row));
}

/// Answers are compared with those of cullet's GJK, without memory.
void measureLeaves(const MidphaseScene& scene, const std::vector<RowPair>& pairs,
                   std::vector<NamedLeafTest>& tests, std::vector<LeafTotals>& totals)
{
    std::vector<LeafAnswers> answers(tests.size());
    std::size_t reference = 0;
    for (std::size_t i = 0; i < tests.size(); ++i)
    {
        tests[i].test->setFrame(scene, pairs);
        totals[i].ms.push_back(leastMs([&] { tests[i].test->run(answers[i]); }));
        totals[i].tests += answers[i].tests;
        if (tests[i].name == "gjk")
            reference = i;
    }
    for (std::size_t i = 0; i < tests.size(); ++i)
    {
        for (std::size_t k = 0; k < pairs.size(); ++k)
        {
            totals[i].crossing += answers[i].isCrossing[k] != 0 ? 1 : 0;
            totals[i].hash = hashedWith(totals[i].hash, answers[i].isCrossing[k] != 0 ? k : 0);
            totals[i].disagreeing += answers[i].isCrossing[k] != answers[reference].isCrossing[k] ? 1 : 0;
        }
    }
}

void measureScene(MidphaseScene& scene, bool isQuick, Progress& progress, ResultFile& file)
{
    const int settling = isQuick ? 5 : 60, frames = isQuick ? 5 : 40;
    for (int frame = 0; frame < settling; ++frame)
        scene.advance();
    Candidates candidates;
    FrameTimes times;
    std::vector<NamedLeafTest> tests = makeLeafTests(scene.queries.hull != nullptr);
    std::vector<LeafTotals> totals(tests.size());
    for (int frame = 0; frame < frames && !isInterrupted(); ++frame)
    {
        scene.advance();
        measureLeaves(scene, candidates.find(scene, times), tests, totals);
        progress.advance();
    }
    if (times.build.empty() || times.pairs == 0)
        return;
    addTreeRow(scene, "build", {times.build, times.pairs, 0, times.hash}, file);
    addTreeRow(scene, "refit", {times.refit, times.pairs, 0, times.hash}, file);
    addTreeRow(scene, "search", {times.search, times.pairs, times.boxTests, times.hash}, file);
    addTreeRow(scene, "search-refitted",
               {times.searchRefitted, times.pairs, times.boxTestsRefitted, times.hash}, file);
    for (std::size_t i = 0; i < tests.size(); ++i)
        addLeafRow(scene, tests[i].name, totals[i], times.pairs, file);
}
}  // namespace

void measureMidphase(const FigureOptions& options, ResultFile& file)
{
    const auto scenes = makeMidphaseScenes(options.quick, options.seed);
    Progress progress("figure midphase", scenes.size() * (options.quick ? 5 : 40), options.quiet);
    for (const auto& scene : scenes)
    {
        if (!isInterrupted())
            measureScene(*scene, options.quick, progress, file);
    }
    measureTriangleSizes(options, file);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
