// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_bench.h"

#include "cullet/demos/bench/narrow/narrow_check.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct NamedQuery
{
    const char* name;
    NarrowQuery query;
};

constexpr NamedQuery kQueries[] = {
    {"boolean", NarrowQuery::Boolean},       {"distance", NarrowQuery::Distance},
    {"contacts", NarrowQuery::Contacts},     {"algorithm", NarrowQuery::Algorithm},
    {"dispatcher", NarrowQuery::Dispatcher}, {"still", NarrowQuery::Still},
    {"simplex", NarrowQuery::Simplex}};

struct NamedSupport
{
    const char* name;
    SupportMethod method;
};

constexpr NamedSupport kSupports[] = {
    {"automatic", SupportMethod::Automatic}, {"linear", SupportMethod::Linear},
    {"climb", SupportMethod::Climb},         {"climb-artificial", SupportMethod::ClimbArtificial},
    {"cubemap", SupportMethod::CubeMap},     {"dobkin-kirkpatrick", SupportMethod::DobkinKirkpatrick}};

const std::vector<NamedPoints>& benchShapes()
{
    static const std::vector<NamedPoints> shapes = []
    {
        std::vector<NamedPoints> all = hullShapes();
        // Sizes around which the choice of the support search changes.
        for (const int count : {16, 24, 32, 64, 80, 100, 128})
            all.push_back({"ell" + std::to_string(count),
                           ellipsoidPoints(count, {1.0, 0.7, 0.5}, static_cast<unsigned>(count))});
        all.push_back({"ico642", icoPoints(3)});
        all.push_back({"ico2562", icoPoints(4)});
        all.push_back({"ico10242", icoPoints(5)});
        return all;
    }();
    return shapes;
}

/// The entry with this name. @pre the command line has checked the name
template <class List>
const auto& named(const List& list, const std::string& name)
{
    return *std::find_if(std::begin(list), std::end(list),
                         [&](const auto& entry) { return entry.name == name; });
}

/// One library in one case, with its measurements.
struct NarrowRunner
{
    std::string algorithm, temperature, support;
    std::unique_ptr<NarrowSubject> subject;
    std::vector<double> milliseconds;
    std::vector<NarrowAnswer> answers;
};

struct Case
{
    const NarrowOptions& options;
    const NamedPoints& shape;
    const NarrowRegime& regime;
    const NamedQuery& query;
    const NarrowTrajectories& trajectories;
};

void addRunners(const Case& c, const NarrowSubjectInfo& info, std::vector<NarrowRunner>& runners)
{
    if (info.isSolver != (c.query.query == NarrowQuery::Simplex))
        return;
    const std::vector<std::string> once = {"none"};
    for (const std::string& temperature : info.canBeWarm ? c.options.temperatures : once)
    {
        for (const std::string& support : info.canBeWarm ? c.options.supports : once)
        {
            NarrowRequest request = {c.trajectories, c.query.query, temperature == "warm"};
            if (info.canBeWarm)
                request.support = named(kSupports, support).method;
            std::unique_ptr<NarrowSubject> subject = info.make(request);
            if (subject != nullptr)
                runners.push_back({info.name, temperature, support, std::move(subject), {}, {}});
        }
    }
}

void measure(const Case& c, std::vector<NarrowRunner>& runners)
{
    const std::size_t count = c.trajectories.scenes().size();
    for (NarrowRunner& runner : runners)
        runner.answers.resize(count);
    for (int repetition = 0; repetition < c.options.repetitions && !isInterrupted(); ++repetition)
    {
        for (std::size_t i = 0; i < runners.size(); ++i)
        {
            NarrowRunner& runner = runners[(i + static_cast<std::size_t>(repetition)) % runners.size()];
            const Stopwatch watch;
            runner.subject->run(runner.answers);
            runner.milliseconds.push_back(watch.cpuMs());
        }
    }
}

/// Median over the repetitions of the ratio of Bullet's time to the runner's; 0 without Bullet.
double ratioToBullet(const std::vector<NarrowRunner>& runners, const NarrowRunner& runner)
{
    const auto bullet = std::find_if(runners.begin(), runners.end(),
                                     [](const NarrowRunner& r) { return r.algorithm == "bullet"; });
    if (bullet == runners.end())
        return 0.0;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < runner.milliseconds.size(); ++i)
        ratios.push_back(bullet->milliseconds[i] / runner.milliseconds[i]);
    return summarise(std::move(ratios)).median;
}

/// FNV-1a of the booleans.
std::uint64_t hashOf(const std::vector<NarrowAnswer>& answers)
{
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const NarrowAnswer& answer : answers)
        hash = (hash ^ (answer.isOverlapping ? 1u : 0u)) * 0x100000001b3u;
    return hash;
}

Json rowHead(const std::string& query, const std::string& scene, const NarrowRunner& runner)
{
    return {{"benchmark", "narrow." + query},
            {"scene", scene},
            {"backend", runner.algorithm},
            {"precision", ownPrecision()},
            {"threads", 1}};
}

Json makeRow(const Case& c, const std::vector<NarrowRunner>& runners, NarrowRunner& runner,
             NarrowCheck& check)
{
    const Statistics times = summarise(runner.milliseconds);
    runner.subject->completeAnswers(runner.answers);
    const NarrowErrors errors = check.check(runner.answers);
    const NarrowWork work = runner.subject->countWork();
    const double queries = static_cast<double>(runner.answers.size());
    const auto known = [](double value) { return value < 0.0 ? Json() : Json(value); };
    Json row = rowHead(c.query.name, c.shape.name, runner);
    row.update({{"bodies", 2 * NarrowTrajectories::kPairs},
                {"pairs", NarrowTrajectories::kPairs},
                {"median_ms", times.median},
                {"p90_ms", times.p90},
                {"min_ms", times.min},
                {"hash", toHex(hashOf(runner.answers))},
                {"regime", c.regime.name},
                {"temperature", runner.temperature},
                {"support", runner.support},
                {"vertices", c.trajectories.hull().vertexCount()},
                {"triangles", 2 * c.trajectories.hull().vertexCount() - 4},
                {"queries", runner.answers.size()},
                {"ns_per_query", times.median * 1e6 / queries},
                {"bullet_over_this", ratioToBullet(runners, runner)},
                {"iterations", known(work.iterations)},
                {"supports", known(work.supports)},
                {"repetitions", runner.milliseconds.size()},
                {"wrong", errors.wrong},
                {"max_error", errors.largest}});
    return row;
}

void printHeader()
{
    std::printf("%-10s %-12s %-10s %-14s %-5s %-18s %9s %8s %6s %9s %6s %10s  %s\n", "shape", "regime",
                "query", "library", "cache", "support", "ns/query", "x Bullet", "iter", "supports", "wrong",
                "max error", "hash");
}

void printNarrowRow(const Json& row)
{
    const auto number = [&row](const char* key)
    { return row[key].is_null() ? -1.0 : row[key].get<double>(); };
    const auto text = [&row](const char* key) { return row[key].get<std::string>(); };
    std::printf("%-10s %-12s %-10s %-14s %-5s %-18s %9.1f %8.1f %6.2f %9.2f %6.0f %10.1e  %s\n",
                text("scene").c_str(), text("regime").c_str(), text("benchmark").substr(7).c_str(),
                text("backend").c_str(), text("temperature").c_str(), text("support").c_str(),
                number("ns_per_query"), number("bullet_over_this"), number("iterations"), number("supports"),
                number("wrong"), number("max_error"), row["hash"].is_null() ? "" : text("hash").c_str());
    std::fflush(stdout);
}

void runCase(const Case& c, ResultFile& file)
{
    std::vector<NarrowRunner> runners;
    for (const std::string& name : c.options.algorithms)
        addRunners(c, named(narrowSubjects(), name), runners);
    measure(c, runners);
    // Interrupted before the first repetition.
    if (runners.empty() || runners.front().milliseconds.empty())
        return;
    NarrowCheck check(c.trajectories, c.query.query);
    for (NarrowRunner& runner : runners)
    {
        Json row = makeRow(c, runners, runner, check);
        printNarrowRow(row);
        file.addRow(std::move(row));
    }
}

struct Mean
{
    Json row;
    double logNanoseconds = 0.0, logRatio = 0.0, milliseconds = 0.0;
    std::int64_t wrong = 0;
    int shapes = 0;
};

/// Sums of the rows of regular shapes, by everything but the shape, in the order of the rows.
std::vector<Mean> collectMeans(const std::vector<Json>& rows)
{
    std::vector<Mean> means;
    std::map<std::string, std::size_t> places;
    for (const Json& row : rows)
    {
        if (named(benchShapes(), row["scene"].get<std::string>()).isThin)
            continue;
        std::string key;
        for (const char* column : {"benchmark", "regime", "backend", "temperature", "support"})
            key += row[column].get<std::string>() + '/';
        const auto [place, isNew] = places.try_emplace(key, means.size());
        if (isNew)
            means.push_back({row});
        Mean& mean = means[place->second];
        mean.logNanoseconds += std::log(row["ns_per_query"].get<double>());
        mean.logRatio += std::log(row["bullet_over_this"].get<double>());
        mean.wrong += row["wrong"].get<std::int64_t>();
        ++mean.shapes;
    }
    return means;
}

/// Rows with the scene "regular": geometric means of ns_per_query and bullet_over_this; wrong answers are added up.
void addMeans(ResultFile& file)
{
    for (Mean& mean : collectMeans(file.rows()))
    {
        if (mean.shapes < 2)
            continue;
        Json row = mean.row;
        const double nanoseconds = std::exp(mean.logNanoseconds / mean.shapes);
        row["scene"] = "regular";
        row["ns_per_query"] = nanoseconds;
        row["bullet_over_this"] = std::exp(mean.logRatio / mean.shapes);
        row["wrong"] = mean.wrong;
        for (const char* column : {"median_ms", "p90_ms", "min_ms", "hash", "vertices", "triangles",
                                   "iterations", "supports", "max_error"})
            row[column] = nullptr;
        row["shapes"] = mean.shapes;
        printNarrowRow(row);
        file.addRow(std::move(row));
    }
}

void runShape(const NarrowOptions& options, const NamedPoints& shape, Progress& progress, ResultFile& file)
{
    const Hull<btScalar> hull = hullOf<btScalar>(shape.points, HullExtra::Hierarchy);
    for (const std::string& regimeName : options.regimes)
    {
        const NarrowRegime& regime = named(narrowRegimes(), regimeName);
        const NarrowTrajectories trajectories(hull, regime, options.seed);
        for (const std::string& queryName : options.queries)
        {
            if (isInterrupted())
                return;
            runCase({options, shape, regime, named(kQueries, queryName), trajectories}, file);
            progress.advance();
        }
    }
}
}  // namespace

std::vector<std::string> narrowShapeNames()
{
    return namesOf(benchShapes());
}

std::vector<std::string> narrowSupportNames()
{
    return namesOf(kSupports);
}

std::vector<std::string> narrowQueryNames()
{
    return namesOf(kQueries);
}

void runNarrowBench(const NarrowOptions& options, ResultFile& file)
{
    printHeader();
    {
        Progress progress("narrow", options.shapes.size() * options.regimes.size() * options.queries.size(),
                          options.quiet);
        for (const std::string& name : options.shapes)
            runShape(options, named(benchShapes(), name), progress, file);
    }
    addMeans(file);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
