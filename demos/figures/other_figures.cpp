// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/narrow_bench.h"
#include "cullet/demos/bench/world_bench.h"
#include "cullet/demos/figures/figure.h"

// The figures from `bench narrow` and `bench world`.
namespace cullet
{
inline namespace CULLET_PRECISION
{
void measureFigure11(const FigureOptions& options, ResultFile& file)
{
    NarrowOptions narrow;
    narrow.shapes = {"ico12", "ico42", "ico162", "ico642"};
    if (!options.quick)
        narrow.shapes.emplace_back("ico2562");
    narrow.regimes = {"separated", "overlapping"};
    narrow.algorithms = {"cullet"};
    narrow.temperatures = {"cold"};
    narrow.supports = {"linear", "climb", "climb-artificial", "cubemap", "automatic"};
    narrow.repetitions = options.quick ? 2 : 5;
    narrow.seed = static_cast<unsigned>(options.seed);
    narrow.quiet = options.quiet;
    runNarrowBench(narrow, file);
}

void measurePhases(const FigureOptions& options, ResultFile& file)
{
    WorldOptions world;
    world.parts = allCombinations({"dbvt", "grid"}, {"bullet", "dispatcher"}, {"bullet"});
    world.threads = {1};
    world.world.seed = options.seed;
    world.trace = options.trace;
    world.quiet = options.quiet;
    world.windows = {{"falling", 20, 30}, {"settled", 180, 200}};
    if (options.quick)
        world.windows = {{"falling", 5, 10}, {"settled", 50, 60}};
    // Keeps the largest worlds that fit the budget; the smaller ones predict their times.
    std::vector<Json> rows;
    FigureClock clock(options, "phases", 2.5);
    for (const std::uint32_t bodies : sizesOf(options, {1000, 8000}, 1000, 8000))
    {
        if (!clock.hasTimeFor(bodies))
            break;
        world.world.bodies = bodies;
        ResultFile measured({}, "", "");
        for (const char* scene : {"boxes", "hulls"})
        {
            world.scene = scene;
            runWorldBench(world, measured);
        }
        rows = measured.rows();
    }
    for (Json& row : rows)
        file.addRow(std::move(row));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
