// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/loss_bench.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/program/stopwatch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct Contestant
{
    std::string name;
    std::unique_ptr<LossSide> side;
    std::vector<double> milliseconds;
    PairDigest answer;
    std::uint64_t bytes = 0;
};

/// `numerator` / `denominator`; infinite instead of a division by zero.
double ratioOf(double numerator, double denominator)
{
    return denominator > 0 ? numerator / denominator : std::numeric_limits<double>::infinity();
}

/// The median over the rounds: a disturbance of the machine that lasts for a round is in both times.
double ratioOfRounds(const std::vector<double>& own, const std::vector<double>& other)
{
    std::vector<double> ratios;
    for (std::size_t round = 0; round < std::min(own.size(), other.size()); ++round)
        ratios.push_back(ratioOf(own[round], other[round]));
    return summarise(ratios).median;
}

class LossRun
{
public:
    LossRun(const LossCase& lossCase, const LossOptions& options) : m_case(lossCase), m_options(options)
    {
        const double scaled = std::round(lossCase.bodies * options.scale);
        m_bodies =
            std::max(std::min(lossCase.bodies, lossCase.leastBodies), static_cast<std::uint32_t>(scaled));
        for (const std::string& name : lossCase.sides)
        {
            Contestant contestant;
            contestant.name = name;
            contestant.side = lossCase.make({name, m_bodies, options.threads, options.seed});
            m_contestants.push_back(std::move(contestant));
        }
    }

    void measure()
    {
        const Stopwatch watch;
        Progress progress(m_case.name, m_options.rounds, m_options.quiet);
        for (std::uint32_t round = 0; round < m_options.rounds && !isInterrupted(); ++round)
        {
            if (round >= LossOptions::kLeastRounds && watch.wallMs() > 1e3 * m_options.budget)
                break;
            for (std::size_t i = 0; i < m_contestants.size(); ++i)
                runOnce(m_contestants[(i + round) % m_contestants.size()]);
            progress.advance();
        }
        for (Contestant& contestant : m_contestants)
            contestant.bytes = contestant.side->releaseAndMeasure();
    }

    /// Null if the user interrupted before the end of a round.
    Json row() const
    {
        if (m_contestants.back().milliseconds.empty())
            return nullptr;
        const Contestant& own = m_contestants.front();
        const Statistics times = summarise(own.milliseconds);
        Json row = {{"benchmark", "losses"},       {"scene", m_case.name},          {"backend", own.name},
                    {"precision", ownPrecision()}, {"threads", m_options.threads},  {"bodies", m_bodies},
                    {"pairs", own.answer.count},   {"median_ms", times.median},     {"p90_ms", times.p90},
                    {"min_ms", times.min},         {"hash", toHex(own.answer.hash)}};
        for (std::size_t i = 1; i < m_contestants.size(); ++i)
        {
            const Contestant& other = m_contestants[i];
            const Statistics otherTimes = summarise(other.milliseconds);
            row[other.name + "_ms"] = otherTimes.median;
            row[other.name + "_min_ms"] = otherTimes.min;
            row[other.name + "_ratio"] = ratioOfRounds(own.milliseconds, other.milliseconds);
        }
        addMemory(row);
        addVerdict(row);
        return row;
    }

private:
    void runOnce(Contestant& contestant)
    {
        contestant.milliseconds.push_back(contestant.side->run());
        contestant.answer = contestant.side->answer();
        ++m_checks;
        if (contestant.answer != contestant.side->exactAnswer())
            throw ProgramError(kExitDisagreement, std::string("losses: ") + m_case.name + ": the answer of " +
                                                      contestant.name +
                                                      " is not that of brute force in round " +
                                                      std::to_string(contestant.milliseconds.size()));
    }

    void addMemory(Json& row) const
    {
        if (m_contestants[1].bytes == 0)
            return;
        row["bytes"] = m_contestants.front().bytes;
        for (std::size_t i = 1; i < m_contestants.size(); ++i)
            row[m_contestants[i].name + "_bytes"] = m_contestants[i].bytes;
        row["memory_ratio"] = ratioOf(double(m_contestants.front().bytes), double(m_contestants[1].bytes));
    }

    void addVerdict(Json& row) const
    {
        const bool isMemory = m_case.measure == LossMeasure::Memory;
        const double ratio =
            row[isMemory ? std::string("memory_ratio") : m_contestants[1].name + "_ratio"].get<double>();
        row["measure"] = isMemory ? "memory" : "time";
        row["target"] = m_case.target;
        row["met"] = ratio <= m_case.target;
        row["rounds"] = m_contestants.back().milliseconds.size();
        row["checks"] = m_checks;
    }

    const LossCase& m_case;
    const LossOptions& m_options;
    std::uint32_t m_bodies;
    std::vector<Contestant> m_contestants;
    std::uint32_t m_checks = 0;
};

std::string numberOrDash(const Json& row, const std::string& column)
{
    if (!row.contains(column))
        return "-";
    char text[32];
    std::snprintf(text, sizeof(text), "%.3f", row[column].get<double>());
    return text;
}

void printTableHead()
{
    std::printf("%-19s %8s %10s %10s %10s %8s %8s %8s %7s %6s %s\n", "case", "bodies", "cullet ms",
                "other ms", "deferred", "ratio", "deferred", "memory", "target", "checks", "met");
}

void printTableRow(const Json& row, const std::string& other)
{
    std::printf("%-19s %8u %10.3f %10s %10s %8s %8s %8s %7.2f %6u %s\n",
                row["scene"].get<std::string>().c_str(), row["bodies"].get<unsigned>(),
                row["median_ms"].get<double>(), numberOrDash(row, other + "_ms").c_str(),
                numberOrDash(row, "dbvt-deferred_ms").c_str(), numberOrDash(row, other + "_ratio").c_str(),
                numberOrDash(row, "dbvt-deferred_ratio").c_str(), numberOrDash(row, "memory_ratio").c_str(),
                row["target"].get<double>(), row["checks"].get<unsigned>(),
                row["met"].get<bool>() ? "yes" : "NO");
    std::fflush(stdout);
}

const LossCase& requireLossCase(const std::string& name)
{
    std::string known;
    for (const LossCase& lossCase : lossCases())
    {
        if (name == lossCase.name)
            return lossCase;
        known += std::string(known.empty() ? "" : ", ") + lossCase.name;
    }
    throw ProgramError(kExitUsage, "unknown case '" + name + "'; known: " + known);
}

std::vector<const LossCase*> chosenCases(const LossOptions& options)
{
    std::vector<const LossCase*> chosen;
    for (const std::string& name : options.cases)
        chosen.push_back(&requireLossCase(name));
    if (options.cases.empty())
    {
        for (const LossCase& lossCase : lossCases())
            chosen.push_back(&lossCase);
    }
    return chosen;
}
}  // namespace

void runLossBench(const LossOptions& options, ResultFile& file)
{
    const std::vector<const LossCase*> cases = chosenCases(options);
    printTableHead();
    for (const LossCase* lossCase : cases)
    {
        if (isInterrupted())
            return;
        if (lossCase->needsDouble && ownPrecision() != "double")
        {
            std::fprintf(stderr, "left out: %s needs --precision double\n", lossCase->name);
            continue;
        }
        LossRun run(*lossCase, options);
        run.measure();
        Json row = run.row();
        if (row.is_null())
            return;
        printTableRow(row, lossCase->sides[1]);
        file.addRow(std::move(row));
        file.save();
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
