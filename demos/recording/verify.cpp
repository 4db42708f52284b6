// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/program/interrupt.h"
#include "demos/program/precision.h"
#include "demos/program/progress.h"
#include "demos/recording/pair_difference.h"
#include "demos/recording/replay.h"

#include <filesystem>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
void addRows(const ReplayOptions& options, const ReplayResult& result, std::uint32_t boxes,
             std::uint64_t pairs, const std::vector<std::unique_ptr<Player>>& players,
             const std::vector<FrameHash>& hashes, ResultFile& file)
{
    for (std::size_t i = 0; i < players.size(); ++i)
        file.addRow({{"benchmark", "verify"},
                     {"scene", std::filesystem::path(options.path).filename().string()},
                     {"backend", players[i]->name()},
                     {"precision", ownPrecision()},
                     {"threads", players[i]->threads()},
                     {"bodies", boxes},
                     {"pairs", pairs},
                     {"hash", toHex(hashes[i].value())},
                     {"frames", result.frames},
                     {"difference", result.difference}});
}
}  // namespace

ReplayResult runVerify(const ReplayOptions& options, RecordingFile& recording,
                       const std::vector<std::unique_ptr<Player>>& players, ResultFile& file)
{
    const RecordingSummary summary = recording.summarise();
    const std::uint64_t wanted = framesToPlay(options, summary);
    Progress progress("verifying", wanted, options.quiet);
    ReplayResult result;
    RecordedBoxes boxes;
    std::vector<FrameHash> hashes(players.size());
    std::vector<Pair> first;
    std::uint64_t pairs = 0;
    std::vector<BoxEvent> events;
    while (result.frames < wanted && result.difference.empty() && !isInterrupted() &&
           recording.nextFrame(events))
    {
        boxes.apply(events);
        for (std::size_t i = 0; i < players.size() && result.difference.empty(); ++i)
        {
            players[i]->apply(events);
            players[i]->findPairs();
            const std::vector<Pair> own = players[i]->pairs(boxes);
            hashes[i].add(own);
            if (i == 0)
                first = own;
            result.difference = describeDifference(result.frames, {players[0]->name(), &first},
                                                   {players[i]->name(), &own}, boxes);
        }
        pairs += first.size();
        progress.show(++result.frames);
    }
    addRows(options, result, boxes.aliveCount(), pairs, players, hashes, file);
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
