// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/files/trace_file.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/recording/pair_difference.h"
#include "cullet/demos/recording/replay.h"

#include <cstdio>
#include <filesystem>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// All players on one recording.
struct Comparison
{
    const std::vector<std::unique_ptr<Player>>& players;
    std::vector<TraceLane> lanes;
    std::vector<FrameHash> hashes;
    Pairs first;  ///< the pairs of the first player in the last frame
    RecordedBoxes boxes;
    std::uint64_t pairs = 0;  ///< of all frames
    ReplayResult result;
};

void findPairs(Player& player, const std::vector<BoxEvent>& events, TraceLane& lane)
{
    const auto start = TraceFile::Clock::now();
    player.apply(events);
    const auto applied = TraceFile::Clock::now();
    player.findPairs();
    lane.add("setAabb", start, applied);
    lane.add("calculateOverlappingPairs", applied, TraceFile::Clock::now());
}

void compareFrame(Comparison& all, const std::vector<BoxEvent>& events)
{
    ReplayResult& result = all.result;
    all.boxes.apply(events);
    for (std::size_t i = 0; i < all.players.size() && result.difference.empty(); ++i)
    {
        Player& player = *all.players[i];
        findPairs(player, events, all.lanes[i]);
        const Pairs own = player.pairs(all.boxes);
        all.hashes[i].add(own);
        if (i == 0)
            all.first = own;
        result.difference = describeDifference(result.frames, {all.players[0]->name(), &all.first},
                                               {player.name(), &own}, all.boxes);
    }
    all.pairs += all.first.size();
    ++result.frames;
}

void addRows(const ReplayOptions& options, const Comparison& all, ResultFile& file)
{
    for (std::size_t i = 0; i < all.players.size(); ++i)
    {
        const Player& player = *all.players[i];
        const std::string hash = toHex(all.hashes[i].value());
        std::printf("%-8s %-14s %9u boxes %6llu frames %12llu pairs in all  %s\n", "verify",
                    player.name().c_str(), all.boxes.aliveCount(),
                    static_cast<unsigned long long>(all.result.frames),
                    static_cast<unsigned long long>(all.pairs), hash.c_str());
        file.addRow({{"benchmark", "verify"},
                     {"scene", std::filesystem::path(options.path).filename().string()},
                     {"backend", player.name()},
                     {"precision", ownPrecision()},
                     {"threads", player.threads()},
                     {"bodies", all.boxes.aliveCount()},
                     {"pairs", all.pairs},
                     {"hash", hash},
                     {"frames", all.result.frames},
                     {"difference", all.result.difference}});
    }
}
}  // namespace

ReplayResult runVerify(const ReplayOptions& options, RecordingFile& recording,
                       const std::vector<std::unique_ptr<Player>>& players, ResultFile& file,
                       TraceFile* trace)
{
    const std::uint64_t wanted = framesToPlay(options, recording.summarise());
    Comparison all = {players, {}, std::vector<FrameHash>(players.size()), {}, {}, 0, {}};
    for (const auto& player : players)
        all.lanes.emplace_back(trace, player->name());
    {
        Progress progress("verifying", wanted, options.quiet);
        std::vector<BoxEvent> events;
        while (all.result.frames < wanted && all.result.difference.empty() && !isInterrupted() &&
               recording.nextFrame(events))
        {
            compareFrame(all, events);
            progress.show(all.result.frames);
        }
    }
    addRows(options, all, file);
    return all.result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
