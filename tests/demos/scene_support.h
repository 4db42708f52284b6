// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>
#include <string>

namespace cullet
{
inline WorldSceneOptions makeOptions(std::uint32_t bodies, const std::string& backend = "grid")
{
    WorldSceneOptions options;
    options.bodies = bodies;
    options.backend = backend;
    options.threads = 1;
    return options;
}

inline std::unique_ptr<WorldScene> make(const std::string& name, std::uint32_t bodies)
{
    return makeWorldScene(name, makeOptions(bodies));
}

inline void stepMany(WorldScene& scene, int steps)
{
    for (int i = 0; i < steps; ++i)
        scene.step();
}

inline const btCollisionObject& object(WorldScene& scene, int index)
{
    return *scene.world().getCollisionObjectArray()[index];
}

inline btVector3 origin(WorldScene& scene, int index)
{
    return object(scene, index).getWorldTransform().getOrigin();
}

inline int countObjects(WorldScene& scene, bool (*isCounted)(const btCollisionObject&))
{
    int count = 0;
    for (int i = 0; i < scene.world().getNumCollisionObjects(); ++i)
        count += isCounted(object(scene, i)) ? 1 : 0;
    return count;
}

inline bool moves(const btCollisionObject& one)
{
    return !one.isStaticObject();
}
}  // namespace cullet
