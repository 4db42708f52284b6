// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/world/step_scene.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

namespace cullet::test
{
inline std::vector<NamedScene> allScenes()
{
    std::vector<NamedScene> scenes = structureScenes();
    for (const auto& more : {jointScenes(), actorScenes()})
        scenes.insert(scenes.end(), more.begin(), more.end());
    return scenes;
}

template <class W>
struct Stage
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, &broadphase, &solver, &configuration};
};

/// Hashes after each step, and what World says about them.
struct History
{
    std::vector<std::uint64_t> hashes;
    int events = 0;
    std::uint32_t mostTasks = 0;
    std::uint32_t mostSharing = 0;
    std::uint64_t swept = 0;
};

const int kFewBodies = WorldBodies::fewBodies;

template <class W>
History run(const NamedScene& named, int steps, int threads)
{
    Stage<W> stage;
    constexpr bool kIsOurs = !std::is_same_v<W, btDiscreteDynamicsWorld>;
    if constexpr (kIsOurs)
    {
        stage.world.setUpdateThreads(threads);
        // Small scenes have both kinds of loops over bodies: Base's with an even number of threads.
        WorldBodies::fewBodies = threads % 2 == 0 ? kFewBodies : 0;
    }
    const std::unique_ptr<StepScene> scene = named.make(stage.world);
    History history;
    for (int step = 0; step < steps; ++step)
    {
        scene->step(step);
        history.hashes.push_back(scene->hash());
        if constexpr (kIsOurs)
        {
            history.mostTasks = std::max(history.mostTasks, stage.world.islandStats().tasks);
            history.mostSharing = std::max(history.mostSharing, stage.world.islandStats().sharingGroups);
            history.swept += stage.world.bodyStats().sweptBodies;
        }
    }
    history.events = scene->events();
    return history;
}
}  // namespace cullet::test
