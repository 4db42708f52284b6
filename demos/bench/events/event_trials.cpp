// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/events/event_trials.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"

#include <cstdio>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kMaxTrials = 5;

struct TrialBackend
{
    SubjectRequest request;
    int threads = 1;
    TraceLane trace;
    Trial last;
    std::vector<double> milliseconds;
};

bool shouldRunAgain(const TrialBackend& backend, int round, double budgetMs)
{
    return round == 0 || (backend.last.finished && backend.last.milliseconds < budgetMs / kMaxTrials);
}

void runTrial(const std::string& benchmark, TrialBackend& backend,
              const std::function<Trial(Subject&, double)>& trial, double budgetMs)
{
    const auto start = TraceFile::Clock::now();
    const auto subject = makeSubject(backend.request);
    backend.threads = subject->threads();
    backend.last = trial(*subject, budgetMs);
    backend.milliseconds.push_back(backend.last.milliseconds);
    backend.trace.add(benchmark.c_str(), start, TraceFile::Clock::now());
}
}  // namespace

void runTrials(const std::string& benchmark, const BroadCase& benchCase, const ExactBox& bounds,
               const std::function<Trial(Subject&, double)>& trial, ResultFile& file)
{
    const double budgetMs = benchCase.options.budget * 1e3;
    std::vector<TrialBackend> backends(benchCase.options.backends.size());
    for (std::size_t i = 0; i < backends.size(); ++i)
    {
        backends[i].request = requestFor(benchCase, benchCase.options.backends[i], bounds);
        backends[i].trace = {benchCase.options.trace, backends[i].request.name};
    }
    std::optional<Progress> progress(std::in_place, benchmark, kMaxTrials * backends.size(),
                                     benchCase.options.quiet);
    for (int round = 0; round < kMaxTrials && !isInterrupted(); ++round)
    {
        for (TrialBackend& backend : backends)
        {
            if (shouldRunAgain(backend, round, budgetMs) && !isInterrupted())
                runTrial(benchmark, backend, trial, budgetMs);
            progress->advance();
        }
    }
    progress.reset();
    std::optional<PairDigest> expected;
    for (const TrialBackend& backend : backends)
    {
        if (backend.milliseconds.empty())
            continue;
        Json row = makeRow(benchmark, benchCase, backend.request, backend.threads);
        addMeasurement(row, backend.last.digest, backend.milliseconds);
        row["frames"] = backend.milliseconds.size();
        row["bodies_done"] = backend.last.bodies;
        row["finished"] = backend.last.finished;
        printRow(row);
        if (!backend.last.finished)
            std::printf("  stopped by the budget after %u bodies: the time is a lower bound\n",
                        backend.last.bodies);
        file.addRow(std::move(row));
        if (!backend.last.finished)
            continue;
        if (!expected)
            expected = backend.last.digest;
        if (*expected != backend.last.digest)
            throw ProgramError(kExitDisagreement,
                               "pairs disagree in " + benchmark + ": " + backend.request.name);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
