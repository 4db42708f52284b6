// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/recording/replay.h"

#include "cullet/demos/program/files/trace_file.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/recording/pair_difference.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct Contender
{
    Player* player = nullptr;
    std::vector<double> apply;
    std::vector<double> find;
    std::vector<double> frame;
    FrameHash hash;
    Pairs pairs;
    TraceLane trace;
};

void playFrame(Contender& contender, const std::vector<BoxEvent>& events, const RecordedBoxes& boxes)
{
    using Clock = TraceFile::Clock;
    const auto milliseconds = [](Clock::duration time)
    { return std::chrono::duration<double, std::milli>(time).count(); };
    const Clock::time_point start = Clock::now();
    contender.player->apply(events);
    const Clock::time_point applied = Clock::now();
    contender.player->findPairs();
    const Clock::time_point done = Clock::now();
    contender.apply.push_back(milliseconds(applied - start));
    contender.find.push_back(milliseconds(done - applied));
    contender.frame.push_back(milliseconds(done - start));
    contender.trace.add("setAabb", start, applied);
    contender.trace.add("calculateOverlappingPairs", applied, done);
    contender.pairs = contender.player->pairs(boxes);
    contender.hash.add(contender.pairs);
}

void addRow(const char* benchmark, const ReplayOptions& options, Contender& contender, std::uint32_t boxes,
            const std::vector<double>& milliseconds, ResultFile& file)
{
    const Statistics times = summarise(milliseconds);
    file.addRow({{"benchmark", benchmark},
                 {"scene", std::filesystem::path(options.path).filename().string()},
                 {"backend", contender.player->name()},
                 {"precision", ownPrecision()},
                 {"threads", contender.player->threads()},
                 {"bodies", boxes},
                 {"pairs", contender.pairs.size()},
                 {"median_ms", times.median},
                 {"p90_ms", times.p90},
                 {"min_ms", times.min},
                 {"hash", toHex(contender.hash.value())},
                 {"mean_ms", times.mean},
                 {"frames", milliseconds.size()},
                 {"held_pairs", contender.player->heldPairs()}});
    std::printf("%-34s %-14s %9u boxes %9zu pairs  median %10.3f  mean %10.3f ms  %s\n", benchmark,
                contender.player->name().c_str(), boxes, contender.pairs.size(), times.median, times.mean,
                toHex(contender.hash.value()).c_str());
}

std::string findDifference(std::uint64_t frame, const std::vector<Contender>& contenders,
                           const RecordedBoxes& boxes)
{
    for (std::size_t i = 1; i < contenders.size(); ++i)
    {
        const std::string found =
            describeDifference(frame, {contenders[0].player->name(), &contenders[0].pairs},
                               {contenders[i].player->name(), &contenders[i].pairs}, boxes);
        if (!found.empty())
            return found;
    }
    return "";
}
}  // namespace

void printSummary(const std::string& path, const RecordingSummary& summary)
{
    std::printf(
        "recording %s: %llu frames, %llu events, at most %u boxes, %s precision%s\n", path.c_str(),
        static_cast<unsigned long long>(summary.info.frames),
        static_cast<unsigned long long>(summary.info.events), summary.mostBoxes,
        summary.info.precision == StreamPrecision::Float ? "float" : "double",
        summary.isRounded ? ", rounded outward to float here (--precision double takes it as it is)" : "");
}

ReplayResult runReplay(const ReplayOptions& options, ResultFile& file, TraceFile* trace)
{
    RecordingFile recording(options.path);
    const RecordingSummary summary = recording.summarise();
    printSummary(options.path, summary);
    const std::vector<std::unique_ptr<Player>> players =
        makePlayers(options.backends, options.threads, summary);
    std::vector<Contender> contenders(players.size());
    for (std::size_t i = 0; i < players.size(); ++i)
    {
        contenders[i].player = players[i].get();
        contenders[i].trace = {trace, players[i]->name()};
    }
    const std::uint64_t wanted = framesToPlay(options, summary);
    ReplayResult result;
    RecordedBoxes boxes;
    {
        Progress progress("replaying", wanted, options.quiet);
        std::vector<BoxEvent> events;
        while (result.frames < wanted && !isInterrupted() && recording.nextFrame(events))
        {
            boxes.apply(events);
            for (std::size_t i = 0; i < contenders.size(); ++i)
                playFrame(contenders[(i + result.frames) % contenders.size()], events, boxes);
            if (result.difference.empty())
                result.difference = findDifference(result.frames, contenders, boxes);
            progress.show(++result.frames);
        }
    }
    for (Contender& contender : contenders)
    {
        addRow("replay.setAabb", options, contender, boxes.aliveCount(), contender.apply, file);
        addRow("replay.calculateOverlappingPairs", options, contender, boxes.aliveCount(), contender.find,
               file);
        addRow("replay.frame", options, contender, boxes.aliveCount(), contender.frame, file);
    }
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
