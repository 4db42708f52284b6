// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/body_world.h"
#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/demos/scenes/worlds/actor_worlds.h"
#include "cullet/demos/scenes/worlds/compound_worlds.h"
#include "cullet/demos/scenes/worlds/convex_mesh_world.h"
#include "cullet/demos/scenes/worlds/file_world.h"
#include "cullet/demos/scenes/worlds/flying_world.h"
#include "cullet/demos/scenes/worlds/heap_worlds.h"
#include "cullet/demos/scenes/worlds/hull_worlds.h"
#include "cullet/demos/scenes/worlds/mesh_worlds.h"
#include "cullet/demos/scenes/worlds/ragdolls_world.h"
#include "cullet/demos/scenes/worlds/soft_world.h"
#include "cullet/demos/scenes/worlds/space_worlds.h"
#include "cullet/demos/scenes/worlds/structure_worlds.h"

#include <stdexcept>

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<WorldSceneInfo>& worldScenes()
{
    static const std::vector<WorldSceneInfo> scenes = {
        {"drop", "hulls of meshes, boxes and spheres fall from a column into a walled square", 4000, 1e3,
         makeDropScene, true},
        {"boxes", "cubes of 1 m fall from a column into a walled square", 4000, 1e3, makeBoxesScene},
        {"hulls", "random hulls of 20 points fall from a column into a walled square", 4000, 1e3,
         makeHullsScene},
        {"barrels", "barrels of 44 points stand in columns", 960, 1e3, makeBarrelsScene},
        {"hills", "random hulls of 20 points fall onto a mesh of triangles", 1000, 1e3, makeHillsScene},
        {"terrain", "random hulls of 20 points fall onto 25 triangles each", 4000, 1e3, makeTerrainScene},
        {"free-hulls", "hulls of 64 points spin side by side, without gravity", 10000, 1e3,
         makeFreeHullsScene},
        {"convex-mesh", "boxes, spheres, capsules and hulls fall onto a mesh; Jolt's ConvexVsMesh", 1764, 1e3,
         makeConvexMeshScene},
        {"city", "boxes, spheres, capsules and hulls fall onto a mesh of small and huge triangles", 1000, 1e3,
         makeCityScene},
        {"needles", "boxes, spheres, capsules and hulls fall onto triangles of 2 cm by 8 m", 1000, 1e3,
         makeNeedlesScene},
        {"slide", "bodies slide over a flat mesh without friction, at 1 to 15 m/s", 24, 1e3, makeSlideScene},
        {"compounds", "compounds of five hulls fall into a walled square", 216, 1e3, makeCompoundsScene},
        {"robots", "multibodies with four driven wheels each, on a walled floor", 25, 1e3, makeRobotsScene},
        {"thesis", "spheres of 80 triangles, uniform, random velocities; no response", 4000, 1e4,
         makeThesisScene},
        {"W1", "boxes of uniform spheres of radius 1, all move; no response", 4000, 1e4, makeFlyingScene},
        {"W2", "boxes with edges log-uniform from 0.1 to 100, all move; no response", 4000, 1e4,
         makeFlyingScene},
        {"W3", "W1 of which the same 5 % move in every step", 4000, 1e4, makeFlyingScene},
        {"W4", "settled heap of unit boxes, all jitter by 0.01; no response", 4000, 1e4, makeFlyingScene},
        {"W5", "W1 in which every body teleports in each step", 4000, 1e4, makeFlyingScene},
        {"pour", "boxes and spheres are poured into a walled square, the oldest leave", 2000, 1e3,
         makePourScene},
        {"pile", "cubes in a dense heap on an open floor", 4000, 1e3, makePileScene},
        {"wall", "a ball flies into a wall of bricks", 1000, 1e3, makeWallScene},
        {"pyramid", "cubes in rows, each on two others", 990, 1e3, makePyramidScene},
        {"domino", "dominoes along a spiral, the first one falls", 500, 1e3, makeDominoScene},
        {"cards", "houses of cards, four storeys each", 260, 1e3, makeCardsScene},
        {"static", "a million static cubes and 100 that fly among them", 1000000, 1e4, makeStaticScene},
        {"statics", "cubes fall onto a floor of 64 static cubes for each", 1000, 1e3, makeStaticsScene},
        {"planet", "boxes over six decades of size go round a planet", 10000, 1e7, makePlanetScene},
        {"stampede", "ray-cast vehicles over bumps, each with a ghost around it", 400, 1e4,
         makeStampedeScene},
        {"soft", "soft balls and rigid cubes fall into a walled square", 64, 1e3, makeSoftScene},
        {"crowd", "kinematic characters walk through each other's ways", 400, 1e3, makeCrowdScene},
        {"ragdolls", "dolls of eleven capsules and ten joints fall", 3300, 1e3, makeRagdollsScene},
        {"file", "rigid bodies and constraints of a .bullet file (--file)", 100000, 1e5, makeFileScene},
    };
    return scenes;
}

const WorldSceneInfo* findWorldScene(std::string_view name)
{
    for (const WorldSceneInfo& scene : worldScenes())
    {
        if (name == scene.name)
            return &scene;
    }
    return nullptr;
}

const WorldSceneInfo& requireWorldScene(std::string_view name)
{
    if (const WorldSceneInfo* scene = findWorldScene(name))
        return *scene;
    std::string known;
    for (const WorldSceneInfo& scene : worldScenes())
        known += std::string(known.empty() ? "" : ", ") + scene.name;
    throw std::invalid_argument("unknown scene '" + std::string(name) + "'; known: " + known);
}
BroadphaseRequest requestForScene(std::string_view name, const WorldSceneOptions& options)
{
    const WorldSceneInfo& scene = requireWorldScene(name);
    const double extent = scene.halfExtent;
    BroadphaseRequest request;
    request.name = options.backend;
    request.threads = options.threads;
    request.worldBounds = {{-extent, -extent, -extent}, {extent, extent, extent}};
    // Includes ground, sensors and other objects that a scene adds to its bodies.
    request.mostProxies = 2 * (options.bodies != 0 ? options.bodies : scene.bodies) + 1024;
    return request;
}

std::unique_ptr<WorldScene> makeWorldScene(std::string_view name, const WorldSceneOptions& options)
{
    return makeWorldScene(name, options, makeNamedBroadphase(requestForScene(name, options)));
}

std::unique_ptr<WorldScene> makeWorldScene(std::string_view name, const WorldSceneOptions& options,
                                           NamedBroadphase broadphase)
{
    const WorldSceneInfo& scene = requireWorldScene(name);
    WorldSceneOptions own = options;
    if (own.bodies == 0)
        own.bodies = scene.bodies;
    return scene.make(scene.name, std::move(broadphase), own);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
