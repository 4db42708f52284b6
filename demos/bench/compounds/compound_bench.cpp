// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/compounds/compound_bench.h"

#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Poses = std::vector<std::vector<btTransform>>;

/// One narrow phase in one case.
struct CompoundRunner
{
    std::string narrow;
    std::unique_ptr<CompoundStand> stand;
    std::vector<double> least;  ///< microseconds at each pose
    double contacts = 0, manifolds = 0;
};

int bodiesOf(int children)
{
    return children >= 1000 ? 2 : children >= 64 ? 6 : 25;
}

Poses makePoses(const CompoundCase& compoundCase)
{
    CompoundStand stand(compoundCase, "bullet");
    const bool isFalling = compoundCase.motion == "falling";
    const int settling = isFalling ? 0 : compoundCase.motion == "rest" ? 60 : 20;
    Poses poses;
    for (int step = 0; step < settling + (isFalling ? 40 : 20); ++step)
    {
        stand.step();
        if (step >= settling)
            poses.push_back(stand.poses());
    }
    return poses;
}

void measureRound(int round, const Poses& poses, std::vector<CompoundRunner>& runners)
{
    for (std::size_t pose = 0; pose < poses.size() && !isInterrupted(); ++pose)
    {
        for (std::size_t i = 0; i < runners.size(); ++i)
        {
            CompoundRunner& runner = runners[(i + pose + std::size_t(round)) % runners.size()];
            const double time = runner.stand->dispatchAt(poses[pose]);
            // The first round follows a jump from the last pose to the first.
            if (round == 0)
                continue;
            runner.least[pose] = std::min(runner.least[pose], time);
            runner.contacts += runner.stand->contactCount();
            runner.manifolds += runner.stand->world().getDispatcher()->getNumManifolds();
        }
    }
}

double sumOf(const CompoundRunner& runner)
{
    return std::accumulate(runner.least.begin(), runner.least.end(), 0.0);
}

Json makeCompoundRow(const CompoundCase& c, int rounds, const CompoundRunner& first,
                     const CompoundRunner& runner)
{
    const double steps = double(runner.least.size()) * c.bodies;
    return {{"benchmark", "compounds." + c.motion},
            {"scene", c.other},
            {"backend", runner.narrow},
            {"precision", ownPrecision()},
            {"threads", 1},
            {"shape", c.child},
            {"children", c.children},
            {"bodies", c.bodies},
            {"us_per_body", sumOf(runner) / steps},
            {"first_over_this", sumOf(first) / sumOf(runner)},
            {"contacts_per_body", runner.contacts / (steps * rounds)},
            {"manifolds_per_body", runner.manifolds / (steps * rounds)}};
}

void printCompoundRow(const Json& row)
{
    std::printf("%-7s %-9s %-18s %5d %-11s %10.2f %8.2f %9.2f %9.1f\n",
                row["shape"].get<std::string>().c_str(), row["scene"].get<std::string>().c_str(),
                row["benchmark"].get<std::string>().c_str(), row["children"].get<int>(),
                row["backend"].get<std::string>().c_str(), row["us_per_body"].get<double>(),
                row["first_over_this"].get<double>(), row["contacts_per_body"].get<double>(),
                row["manifolds_per_body"].get<double>());
    std::fflush(stdout);
}

void runCompoundCase(const CompoundBenchOptions& options, const CompoundCase& compoundCase, ResultFile& file)
{
    const Poses poses = makePoses(compoundCase);
    std::vector<CompoundRunner> runners;
    for (const std::string& narrow : options.narrow)
        runners.push_back({narrow, std::make_unique<CompoundStand>(compoundCase, narrow),
                           std::vector<double>(poses.size(), std::numeric_limits<double>::max())});
    for (int round = 0; round <= options.rounds; ++round)
        measureRound(round, poses, runners);
    if (isInterrupted())
        return;
    for (const CompoundRunner& runner : runners)
    {
        Json row = makeCompoundRow(compoundCase, options.rounds, runners.front(), runner);
        printCompoundRow(row);
        file.addRow(std::move(row));
    }
}
}  // namespace

void runCompoundBench(const CompoundBenchOptions& options, ResultFile& file)
{
    std::printf("%-7s %-9s %-18s %5s %-11s %10s %8s %9s %9s\n", "child", "other", "motion", "n", "narrow",
                "us/body", "x first", "contacts", "manifolds");
    Progress progress(
        "compounds",
        options.children.size() * options.others.size() * options.motions.size() * options.counts.size(),
        options.quiet);
    for (const std::string& child : options.children)
    {
        for (const std::string& other : options.others)
        {
            for (const std::string& motion : options.motions)
            {
                for (const int count : options.counts)
                {
                    if (isInterrupted())
                        return;
                    runCompoundCase(options, {child, other, motion, count, bodiesOf(count), options.seed},
                                    file);
                    progress.advance();
                }
            }
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
