// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/world_parts.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/scenes/bodies/mt_world.h"

#include <cstdio>
#include <sstream>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr const char* kMtIsMissing =
    "mt: this program's Bullet library was built without BT_THREADSAFE; configure with "
    "-DCULLET_THREADSAFE_BULLET=PREFIX";

void addPart(const std::string& part, const std::string& backend, WorldParts& parts)
{
    if (part == "broadphase")
        parts.backend = backend;
    else if (part == "dispatcher")
        parts.narrow = "dispatcher";
    else if (part == "world")
        parts.update = "parallel";
    else
        throw ProgramError(kExitUsage, "--parts: unknown part '" + part +
                                           "'; known: stock, broadphase, dispatcher, world, several joined "
                                           "by +, all, mt");
}

WorldParts partsOf(const std::string& name, const std::string& backend)
{
    WorldParts parts;
    parts.name = name;
    parts.isMt = name == "mt";
    if (name == "stock" || name == "mt")
        return parts;
    std::istringstream stream(name == "all" ? "broadphase+dispatcher+world" : name);
    for (std::string part; std::getline(stream, part, '+');)
        addPart(part, backend, parts);
    return parts;
}
}  // namespace

WorldSceneOptions WorldParts::options(const WorldSceneOptions& scene, int threads) const
{
    WorldSceneOptions result = scene;
    result.backend = backend;
    result.narrow = narrow;
    result.update = update;
    result.solver = solver;
    result.reuse = reuse;
    result.isMt = isMt;
    result.threads = threads;
    return result;
}

std::vector<WorldParts> partsNamed(const std::vector<std::string>& names, const std::string& backend)
{
    std::vector<WorldParts> result;
    for (const std::string& name : names)
    {
        WorldParts parts = partsOf(name, backend);
        if (!parts.isMt || isBulletThreadSafe())
            result.push_back(std::move(parts));
    }
    if (result.empty())
        throw ProgramError(kExitUnavailable, kMtIsMissing);
    if (result.size() < names.size())
        std::fprintf(stderr, "left out: %s\n", kMtIsMissing);
    return result;
}

std::vector<WorldParts> withSolvers(const std::vector<WorldParts>& worlds,
                                    const std::vector<std::string>& solvers)
{
    std::vector<WorldParts> result;
    for (const WorldParts& world : worlds)
    {
        for (const std::string& solver : solvers)
        {
            result.push_back(world);
            result.back().solver = solver;
        }
    }
    return result;
}

std::vector<WorldParts> withReuse(const std::vector<WorldParts>& worlds, const std::vector<double>& distances)
{
    std::vector<WorldParts> result;
    for (const WorldParts& world : worlds)
    {
        const bool isBullet = world.narrow == "bullet";
        for (const double distance : isBullet ? std::vector<double>{0} : distances)
        {
            result.push_back(world);
            result.back().reuse = distance;
        }
    }
    return result;
}

std::vector<WorldParts> allCombinations(const std::vector<std::string>& backends,
                                        const std::vector<std::string>& narrow,
                                        const std::vector<std::string>& updates)
{
    std::vector<WorldParts> result;
    for (const std::string& backend : backends)
    {
        for (const std::string& phase : narrow)
        {
            for (const std::string& update : updates)
                result.push_back({"", backend, phase, update});
        }
    }
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
