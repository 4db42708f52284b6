// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/events/event_scenes.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<EventSceneInfo>& eventScenes()
{
    static const std::vector<EventSceneInfo> scenes = {
        {"create", "bodies created in a row along x", 50000, runCreateBench},
        {"spot", "bodies created at one spot, then moved apart", 3000, runSpotBench},
        {"remove", "a tenth of the bodies of W1 removed in one frame", 100000, runRemoveBench},
        {"queries", "rays, boxes and sweeps on W1, at rest and moving", 100000, runQueryBench},
        {"extremes", "scenes that nothing divides, each against a balanced one of as many pairs", 16000,
         runExtremesBench},
    };
    return scenes;
}

const EventSceneInfo* findEventScene(const std::string& name)
{
    for (const EventSceneInfo& scene : eventScenes())
    {
        if (name == scene.name)
            return &scene;
    }
    return nullptr;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
