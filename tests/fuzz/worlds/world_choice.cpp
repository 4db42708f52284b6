// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/world_choice.h"

#include "cullet/tests/fuzz/backend_choice.h"

#include <string>
#include <utility>

namespace cullet::test
{
namespace
{
/// Bits of the first two bytes.
struct Flags
{
    bool hasDispatchers, hasStockCache, hasDbvt, hasCrowd, isUnforced;
};

Flags chosenFlags(Choices& choices, WorldChoice& worlds)
{
    const std::uint8_t first = choices.byte(), second = choices.byte();
    const ShapeFamily families[] = {ShapeFamily::All, ShapeFamily::All, ShapeFamily::Boxes,
                                    ShapeFamily::Spheres};
    worlds.settings.family = families[first & 3];
    worlds.settings.hasGhosts = (first & 12) != 12;
    worlds.settings.hasShortLoops = (first & 12) == 8;
    worlds.settings.hasContinuous = (first & 112) == 112;
    using Solvers = SolverChoice;
    const Solvers solvers[] = {Solvers::Bullet, Solvers::Bullet, Solvers::Bullet,  Solvers::Own,
                               Solvers::Own,    Solvers::Own,    Solvers::OwnSoft, Solvers::Bullet};
    worlds.settings.solver = solvers[(first & 112) >> 4];
    worlds.settings.isOrdered = (first & 128) != 0;
    worlds.settings.hasBoxBox = (second & 3) == 3 && worlds.settings.family == ShapeFamily::All;
    Flags flags{};
    flags.hasDispatchers = (second & 4) == 0;
    flags.hasStockCache = (second & 24) == 24;
    flags.hasDbvt = (second & 96) == 96;
    flags.isUnforced = (second & 128) != 0;
    flags.hasCrowd = choices.chance(8);
    worlds.settings.margin = choices.of({btScalar(-1), btScalar(-1), btScalar(0), btScalar(0.25)});
    return flags;
}

/// Twins of a group differ in backend, threads and the class of the world, which change no bit. So does the dispatcher
/// where Bullet's own algorithms answer for all pairs.
std::vector<TwinRecipe> chosenTwins(Choices& choices, const Flags& flags, NarrowPhase narrow,
                                    bool hasOneGroup)
{
    std::vector<TwinRecipe> twins(3);
    twins[0].name = "grid";
    twins[1].name = "chosen backend";
    twins[1].backend = chosenBackend(choices);
    twins[2].name = "parallel world";
    twins[2].hasParallelWorld = true;
    twins[2].isWatched = false;
    twins[2].threads = 2;
    for (TwinRecipe& twin : twins)
        twin.narrow = narrow;
    std::unique_ptr<Backend> backend = chosenBackend(choices);
    if (flags.hasDispatchers)
    {
        TwinRecipe one, two;
        one.name = "dispatcher";
        one.narrow = NarrowPhase::Dispatcher1;
        two.name = "dispatcher on two threads, chosen backend";
        two.narrow = NarrowPhase::Dispatcher2;
        two.backend = std::move(backend);
        two.hasParallelWorld = true;
        two.isWatched = false;
        two.threads = 2;
        one.group = two.group = hasOneGroup ? "" : "dispatcher";
        twins.push_back(std::move(one));
        twins.push_back(std::move(two));
    }
    TwinRecipe stock;
    stock.name = stock.group = "Bullet's cache";
    stock.hasStockCache = true;
    stock.narrow = narrow;
    if (flags.hasStockCache)
        twins.push_back(std::move(stock));
    TwinRecipe dbvt;
    dbvt.name = dbvt.group = "DBVT";
    dbvt.isDbvt = true;
    if (flags.hasDbvt)
        twins.push_back(std::move(dbvt));
    return twins;
}
}  // namespace

WorldChoice chosenWorlds(Choices& choices)
{
    WorldChoice worlds;
    const Flags flags = chosenFlags(choices, worlds);
    const bool hasOneGroup = worlds.settings.family != ShapeFamily::All;
    const NarrowPhase narrow =
        hasOneGroup ? NarrowPhase::Bullet : choices.of({NarrowPhase::Bullet, NarrowPhase::Registered});
    for (TwinRecipe& recipe : chosenTwins(choices, flags, narrow, hasOneGroup))
        worlds.twins.push_back(std::make_unique<WorldTwin>(std::move(recipe), worlds.settings));
    worlds.isTame = flags.hasDbvt;
    worlds.mayCallbacksDestroy = !worlds.settings.hasContinuous && !flags.hasStockCache;
    worlds.bodies = choices.below(16);
    worlds.noise = choices.byte();
    for (const auto& twin : worlds.twins)
    {
        twin->world().setForceUpdateAllAabbs(!flags.isUnforced);
        if (flags.hasCrowd)
            twin->addCrowd();
    }
    return worlds;
}

btVector3 chosenPlace(Choices& choices)
{
    const float x = choices.coordinate(), y = choices.coordinate(), z = choices.coordinate();
    return btVector3(x, y, z) / 4;
}

btQuaternion chosenTurn(Choices& choices)
{
    const std::uint8_t bits = choices.byte();
    if (bits < 64)
        return btQuaternion::getIdentity();
    const btVector3 axes[] = {btVector3(0, 1, 0), btVector3(1, 0, 0), btVector3(0, 0, 1), btVector3(1, 1, 1)};
    return btQuaternion(axes[bits % 4].normalized(), btScalar(bits / 4) * SIMD_PI / 32);
}

BodyRecipe::Kind chosenKind(Choices& choices)
{
    using Kind = BodyRecipe::Kind;
    return choices.of({Kind::Dynamic, Kind::Dynamic, Kind::Dynamic, Kind::Dynamic, Kind::Static,
                       Kind::Kinematic, Kind::Ghost, Kind::PairGhost, Kind::Plain, Kind::Dynamic});
}

int chosenGroup(Choices& choices)
{
    return choices.of({1, 1, 1, 2, 1, 1, 3, 0});
}

int chosenMask(Choices& choices)
{
    return choices.of({-1, -1, -1, 1, -1, 2, -1, 0});
}

ShapeRecipe chosenShape(Choices& choices, ShapeFamily family)
{
    const auto kind = static_cast<ShapeKind>(choices.below(static_cast<std::uint32_t>(ShapeKind::kCount)));
    return {kindWithin(family, kind), choices.byte(), family};
}

BodyRecipe chosenBody(Choices& choices, ShapeFamily family)
{
    BodyRecipe recipe;
    recipe.kind = chosenKind(choices);
    recipe.shape = chosenShape(choices, family);
    const btVector3 place = chosenPlace(choices);
    recipe.pose = btTransform(chosenTurn(choices), place);
    const std::uint8_t words = choices.byte();
    if (words >= 192)
    {
        recipe.group = 1 + words % 3;
        recipe.mask = words / 4 % 4;
    }
    recipe.velocity = btVector3(0, -btScalar(choices.byte()) / 16, 0);
    return recipe;
}
}  // namespace cullet::test
