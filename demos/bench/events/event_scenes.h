// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/broad_options.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A benchmark other than the frames of one scene: of one event, of queries, or of scenes compared with each other.
struct EventSceneInfo
{
    const char* name;
    const char* summary;
    std::uint32_t bodies;  ///< default number
    void (*run)(const BroadCase&, ResultFile&);
};

const std::vector<EventSceneInfo>& eventScenes();

/// The scene of that name, or null.
const EventSceneInfo* findEventScene(const std::string& name);

/// "broad.create": unit boxes in a row along x, each touching the next, created one after the other, then pairs.
///
/// A backend that exceeds the budget is stopped; its row has the bodies that it managed, and finished = false.
void runCreateBench(const BroadCase& benchCase, ResultFile& file);

/// "broad.spot": all bodies are created at one spot, then moved apart, then pairs ("broad.spot.together" finds the
/// pairs before the move as well, all n (n - 1) / 2 of them).
void runSpotBench(const BroadCase& benchCase, ResultFile& file);

/// "broad.remove": a tenth of the bodies of W1 is removed in one frame, then pairs. Has the deadline of "broad.create".
void runRemoveBench(const BroadCase& benchCase, ResultFile& file);

/// "broad.queries.ray", ".aabb" and ".sweep": 1, 100 and 100,000 queries a frame (or --queries) on W1 with no body
/// moving (scene "static") and with all moving ("moving"). median_ms is the time of the queries of a frame alone;
/// update_median_ms that of setting the boxes and finding pairs before them. Always through Bullet's interface. The
/// hash is that of the exact hits of the last frame and has to be the same for all backends.
void runQueryBench(const BroadCase& benchCase, ResultFile& file);

/// "broad.update" on every scene that no partition divides well (cell, line, diagonal, point, cover, decades), in turn
/// with a balanced one of about as many pairs, NAME-balanced: equal cubes, uniform in a cube. Both have
/// benchCase.bodies, except that where nearly all bodies overlap each other the number is reduced, so that the balanced
/// scene has 32 pairs per body. cpu_ratio and wall_ratio are median times of the extreme scene over those of the
/// balanced one. Pairs are checked as in runFramesBench().
void runExtremesBench(const BroadCase& benchCase, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
