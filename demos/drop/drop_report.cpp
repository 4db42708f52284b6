// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/drop_report.h"

#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/speed_sentence.h"
#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Contenders = std::vector<ContenderResult>;

/// Index of the whole step in samplesOf().
constexpr std::size_t kStepSample = kPhaseCount + 1;

std::size_t commonSteps(const Contenders& contenders)
{
    std::size_t steps = contenders.front().steps.size();
    for (const ContenderResult& contender : contenders)
        steps = std::min(steps, contender.steps.size());
    return steps;
}

/// Keeps only the steps that every world has run; in an interrupted run some worlds have more.
Contenders withCommonSteps(Contenders contenders)
{
    const std::size_t steps = commonSteps(contenders);
    for (ContenderResult& contender : contenders)
    {
        if (steps > 0)
            contender.steps.resize(steps);
    }
    return contenders;
}

/// "    3.80x": the speedup of `value` over `first`; blanks in the first column.
std::string ratioOf(double first, double value, bool isFirst)
{
    if (isFirst || !(value > 0.0))
        return std::string(8, ' ');
    char text[32];
    std::snprintf(text, sizeof text, " %6.2fx", first / value);
    return text;
}

double meanOf(const ContenderResult& contender, std::size_t sample)
{
    return summarise(samplesOf(contender.steps)[sample].milliseconds).mean;
}

void printTimes(const Contenders& contenders)
{
    std::printf("%-26s", "ms per step, mean");
    for (const ContenderResult& contender : contenders)
        std::printf("  %-16s", contender.title.c_str());
    std::puts("");
    const std::vector<StepSample> samples = samplesOf(contenders.front().steps);
    for (std::size_t i = 0; i < samples.size(); ++i)
    {
        const double first = meanOf(contenders.front(), i);
        std::printf("%-26s", samples[i].name.c_str());
        for (const ContenderResult& contender : contenders)
        {
            const double mean = meanOf(contender, i);
            std::printf(" %9.3f%s", mean, ratioOf(first, mean, &contender == &contenders.front()).c_str());
        }
        std::puts("");
    }
}

template <class CountOf>
void printCounts(const char* name, const Contenders& contenders, CountOf valueOf)
{
    std::printf("%-26s", name);
    for (const ContenderResult& contender : contenders)
        std::printf(" %9llu%8s", static_cast<unsigned long long>(valueOf(contender)), "");
    std::puts("");
}

void printEnd(const DropResult& result)
{
    const Contenders& contenders = result.contenders;
    printCounts("pairs at the end", contenders, [](const ContenderResult& c) { return c.pairs; });
    printCounts("  of which overlap", contenders,
                [](const ContenderResult& c) { return c.overlappingPairs; });
    printCounts("  of which touch", contenders, [](const ContenderResult& c) { return c.contactPairs; });
    if (result.lockStep.audits > 0)
        printCounts("broad phase, KiB", contenders, [](const ContenderResult& c) { return c.bytes / 1024; });
    std::printf("%-26s", "state hash");
    for (const ContenderResult& contender : contenders)
        std::printf("  %s", toHex(contender.stateHash).c_str());
    std::puts("");
}

std::string fractionOf(const AuditCount& count)
{
    return std::to_string(count.equal) + "/" + std::to_string(count.audits);
}

void printAudits(const DropResult& result)
{
    if (result.lockStep.audits == 0)
    {
        std::puts("pair sets: not compared");
        return;
    }
    std::string line = "pairs that overlap = exact pairs:";
    for (const ContenderResult& contender : result.contenders)
        line += " " + nameOf(contender.part) + " " + fractionOf(contender.exact) + ",";
    line += " same boxes into both " + fractionOf(result.lockStep);
    if (result.update.audits > 0)
        line += std::string(", same states with World: ") + (result.update.agrees() ? "yes" : "no");
    std::printf("%s: %s\n", line.c_str(), result.agrees() ? "agree" : "DISAGREE");
}

/// Prints a one-line summary of the table.
void printSentence(const Contenders& contenders)
{
    const ContenderResult& first = contenders.front();
    const ContenderResult& last = contenders.back();
    const std::string sentence = compareSteps(meanOf(last, kStepSample), meanOf(first, kStepSample));
    if (contenders.size() > 1 && !sentence.empty())
        std::printf("%s (%s against %s, mean)\n", sentence.c_str(), last.title.c_str(), first.title.c_str());
}

void printMeasured(const DropOptions& options, const DropResult& result)
{
    std::printf("%s, %zu of %s%s, %s precision", countOf(result.bodies, "body", "bodies").c_str(),
                commonSteps(result.contenders), countOf(options.steps, "step", "steps").c_str(),
                result.interrupted ? " (interrupted)" : "", ownPrecision().c_str());
    const ContenderResult& last = result.contenders.back();
    if (last.isCullet)
        std::printf("; cullet runs '%s' with %s", last.backend.c_str(),
                    countOf(static_cast<std::uint64_t>(last.threads), "thread", "threads").c_str());
    if (options.fixedNarrow)
        std::printf("; narrow phase of all: %s", options.world.narrow.c_str());
    std::puts("");
}
}  // namespace

void printReport(const DropOptions& options, const DropResult& result)
{
    const Contenders common = withCommonSteps(result.contenders);
    printSentence(common);
    printMeasured(options, result);
    printTimes(common);
    printEnd(result);
    printAudits(result);
}

void addRows(const DropOptions& options, const DropResult& result, ResultFile& file)
{
    for (const ContenderResult& contender : result.contenders)
    {
        for (const StepSample& sample : samplesOf(contender.steps))
        {
            const Statistics times = summarise(sample.milliseconds);
            file.addRow({{"benchmark", "run." + sample.name},
                         {"scene", options.scene},
                         {"backend", contender.backend},
                         {"precision", ownPrecision()},
                         {"threads", contender.threads},
                         {"bodies", result.bodies},
                         {"pairs", contender.pairs},
                         {"median_ms", times.median},
                         {"p90_ms", times.p90},
                         {"min_ms", times.min},
                         {"hash", toHex(contender.stateHash)},
                         {"mean_ms", times.mean},
                         {"steps", contender.steps.size()},
                         {"overlapping_pairs", contender.overlappingPairs},
                         {"contact_pairs", contender.contactPairs},
                         {"bytes", contender.bytes},
                         {"audits", contender.exact.audits},
                         {"audits_agree", result.agrees()},
                         {"part", nameOf(contender.part)},
                         {"narrow", contender.narrow},
                         {"update", contender.update}});
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
