// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/extreme_scenes.h"
#include "cullet/demos/scenes/heap_scenes.h"
#include "cullet/demos/scenes/uniform_scenes.h"

namespace cullet
{
const std::vector<BoxSceneInfo>& boxScenes()
{
    static const std::vector<BoxSceneInfo> scenes = {
        {"W1", "uniform spheres of radius 1, about one pair per body, all move", makeUniformScene},
        {"W2", "edges log-uniform from 0.1 to 100, under 10 pairs per body, all move", makeTwoSizesScene},
        {"W3", "W1 of which the same 5 % move in every frame", makeMostlyStaticScene},
        {"W3b", "W1 of which a fresh 5 % move in each frame", makeFreshMoversScene},
        {"W3fresh", "W1 of which a fresh tenth moves in each frame", makeFreshTenthScene},
        {"W4", "settled heap of unit boxes, all jitter by 0.01", makeSettledHeapScene},
        {"settle", "the heap of W4 as it comes down along y, all at rest after 128 frames",
         makeSettlingHeapScene},
        {"W5", "W1 in which every body teleports in each frame", makeTeleportScene},
        {"pile", "dense heap of turned boxes, 7.6 pairs per body, all drift", makeDriftingHeapScene},
        {"static", "W1 at rest, but for 100 movers", makeHundredMoversScene},
        {"cell", "all in one cell of a grid, 7 of 10 pairs of bodies overlap", makeOneCellScene},
        {"line", "all on the x axis, 4 pairs per body", makeLineScene},
        {"diagonal", "all on a line oblique to the axes, 4 pairs per body", makeDiagonalScene},
        {"point", "all at one point, every pair of bodies overlaps", makeOnePointScene},
        {"cover", "W1 and one box over everything", makeCoverScene},
        {"decades", "edges log-uniform from 0.001 to 1000, about 4 pairs per body", makeSixDecadesScene},
    };
    return scenes;
}

const BoxSceneInfo* findBoxScene(std::string_view name)
{
    for (const BoxSceneInfo& scene : boxScenes())
    {
        if (name == scene.name)
            return &scene;
    }
    return nullptr;
}
}  // namespace cullet
