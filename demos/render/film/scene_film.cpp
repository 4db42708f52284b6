// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/scene_film.h"

#include "cullet/demos/render/film/world_filmer.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
DebugDrawOptions SceneFilmOptions::nothingDrawn()
{
    DebugDrawOptions options;
    options.boxes = options.cells = options.pairs = false;
    return options;
}

Film filmScene(const SceneFilmOptions& options, const std::function<bool(int)>& step)
{
    const auto scene = makeWorldScene(options.scene, options.world);
    scene->setTrace({options.trace, scene->broadphase().name});
    Film film;
    WorldFilmer filmer(film, options.overlay);
    if (options.start == 0)
        filmer.shoot(scene->world(), 0, scene->vehicles());
    for (int number = 1; number <= options.steps && step(number); ++number)
    {
        scene->step();
        if (number >= options.start && (number - options.start) % options.every == 0)
            filmer.shoot(scene->world(), (number - options.start) * static_cast<double>(options.world.dt),
                         scene->vehicles());
    }
    film.source = {scene->broadphase().name, scene->broadphase().threads, scene->pairCount(),
                   scene->stateHash()};
    return film;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
