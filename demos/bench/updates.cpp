// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Updates of a grid only, for profilers: `cullet_updates SCENE BODIES WARMUP FRAMES`. The function to
// profile is measuredUpdate(). This file uses only interfaces that every version of the broad phase has, so that it
// compiles with old versions, too (demos/results/profiles).

#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/demos/scenes/box_scene.h"

#include <cstdio>
#include <cstdlib>

namespace
{
constexpr float kMargin = 0.05f;  // Bullet's default

struct Run
{
    std::unique_ptr<cullet::Backend> backend;
    cullet::ProxyTable table;
    cullet::PairDelta delta;
};

void update(Run& run)
{
    if (run.backend->update(run.table.beginUpdate(kMargin, false), run.delta) != cullet::Status::Ok)
        std::abort();
    run.table.endUpdate();
}

/// One update after the warm-up. Not inlined and with a C name, so that profilers find it.
extern "C" __attribute__((noinline)) void measuredUpdate(Run& run)
{
    update(run);
}

void runFrames(Run& run, cullet::BoxScene& scene, int warmup, int frames)
{
    for (const cullet::Aabb& box : scene.boxes())
        run.table.create(box, run.table.size() + 1, {1, -1});
    update(run);
    for (int frame = 0; frame < warmup + frames; ++frame)
    {
        scene.step();
        for (const std::uint32_t row : scene.moved())
            run.table.setBox(row, scene.boxes()[row]);
        if (frame < warmup)
            update(run);
        else
            measuredUpdate(run);
    }
}
}  // namespace

int main(int argc, char** argv)
{
    const cullet::BoxSceneInfo* info = argc == 5 ? cullet::findBoxScene(argv[1]) : nullptr;
    if (info == nullptr)
    {
        std::fprintf(stderr, "usage: cullet_updates SCENE BODIES WARMUP FRAMES\n");
        return 2;
    }
    cullet::BoxSceneOptions sceneOptions;
    sceneOptions.bodies = static_cast<std::uint32_t>(std::atoi(argv[2]));
    cullet::GridOptions options;
    options.threads = 1;
    Run run;
    run.backend = cullet::makeGridBackend(options);
    const auto scene = info->make(sceneOptions);
    runFrames(run, *scene, std::atoi(argv[3]), std::atoi(argv[4]));
    std::printf("%s, %u bodies: last update %s, %llu pairs\n", info->name, sceneOptions.bodies,
                run.backend->stats().path, static_cast<unsigned long long>(run.backend->stats().pairs));
    return 0;
}
