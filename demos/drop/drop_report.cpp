// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/drop/drop_report.h"

#include "demos/program/precision.h"
#include "demos/program/statistics.h"

#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
double ratio(double cullet, double dbvt)
{
    return cullet > 0.0 ? dbvt / cullet : 0.0;
}

void printTimes(const DropResult& result)
{
    std::printf("%-26s %21s   %21s   %8s\n", "", "cullet", "dbvt", "dbvt /");
    std::printf("%-26s %10s %10s   %10s %10s   %8s\n", "ms per step", "median", "mean", "median", "mean",
                "cullet");
    const std::vector<StepSample> cullet = samplesOf(result.cullet.steps);
    const std::vector<StepSample> dbvt = samplesOf(result.dbvt.steps);
    for (std::size_t i = 0; i < cullet.size(); ++i)
    {
        const Statistics ours = summarise(cullet[i].milliseconds);
        const Statistics theirs = summarise(dbvt[i].milliseconds);
        std::printf("%-26s %10.3f %10.3f   %10.3f %10.3f   %7.2fx\n", cullet[i].name.c_str(), ours.median,
                    ours.mean, theirs.median, theirs.mean, ratio(ours.median, theirs.median));
    }
}

void printCount(const char* name, std::uint64_t cullet, std::uint64_t dbvt)
{
    std::printf("%-26s %10llu %10s   %10llu %10s   %7.2fx\n", name, static_cast<unsigned long long>(cullet),
                "", static_cast<unsigned long long>(dbvt), "",
                ratio(static_cast<double>(cullet), static_cast<double>(dbvt)));
}

void printAudits(const AuditCounts& audits)
{
    if (audits.audits == 0)
    {
        std::puts("pair sets: not compared");
        return;
    }
    std::printf(
        "pair sets equal: cullet = exact %u/%u, dbvt (overlapping now) = exact %u/%u, "
        "same boxes into both %u/%u: %s\n",
        audits.culletExact, audits.audits, audits.dbvtExact, audits.audits, audits.lockStep, audits.audits,
        audits.agrees() ? "agree" : "DISAGREE");
}
}  // namespace

void printReport(const DropOptions& options, const DropResult& result)
{
    const std::size_t steps = std::min(result.cullet.steps.size(), result.dbvt.steps.size());
    std::printf("%u bodies, %zu of %u steps%s, %s precision; cullet runs '%s' with %d threads\n",
                result.bodies, steps, options.steps, result.interrupted ? " (interrupted)" : "",
                ownPrecision().c_str(), result.cullet.backend.c_str(), result.cullet.threads);
    printTimes(result);
    printCount("pairs at the end", result.cullet.pairs, result.dbvt.pairs);
    printCount("  of which overlap", result.cullet.overlappingPairs, result.dbvt.overlappingPairs);
    printCount("  of which touch", result.cullet.contactPairs, result.dbvt.contactPairs);
    if (result.audits.audits > 0)
        printCount("broad phase, KiB", result.cullet.bytes / 1024, result.dbvt.bytes / 1024);
    std::printf("%-26s %21s   %21s\n", "state hash", toHex(result.cullet.stateHash).c_str(),
                toHex(result.dbvt.stateHash).c_str());
    printAudits(result.audits);
}

void addRows(const DropOptions& options, const DropResult& result, ResultFile& file)
{
    for (const ContenderResult* contender : {&result.cullet, &result.dbvt})
    {
        for (const StepSample& sample : samplesOf(contender->steps))
        {
            const Statistics times = summarise(sample.milliseconds);
            file.addRow({{"benchmark", "run." + sample.name},
                         {"scene", options.scene},
                         {"backend", contender->backend},
                         {"precision", ownPrecision()},
                         {"threads", contender->threads},
                         {"bodies", result.bodies},
                         {"pairs", contender->pairs},
                         {"median_ms", times.median},
                         {"p90_ms", times.p90},
                         {"min_ms", times.min},
                         {"hash", toHex(contender->stateHash)},
                         {"mean_ms", times.mean},
                         {"steps", contender->steps.size()},
                         {"overlapping_pairs", contender->overlappingPairs},
                         {"contact_pairs", contender->contactPairs},
                         {"bytes", contender->bytes},
                         {"audits", result.audits.audits},
                         {"audits_agree", result.audits.agrees()}});
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
