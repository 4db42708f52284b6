// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/settings.h"

#include "cullet/preload/message.h"

#include <cstdlib>
#include <cstring>

namespace cullet::preload
{
namespace
{
/// The value of a variable, if it is 0 or 1.
std::optional<bool> readFlag(const char* name)
{
    const char* value = std::getenv(name);
    if (value == nullptr || value[0] == '\0')
        return std::nullopt;
    const bool isOne = std::strcmp(value, "1") == 0;
    if (isOne || std::strcmp(value, "0") == 0)
        return isOne;
    printLine("%s=%s: 0 or 1 expected; it is ignored", name, value);
    return std::nullopt;
}

void readPatchPoints(int& points)
{
    const char* value = std::getenv("CULLET_PATCH_POINTS");
    if (value == nullptr || value[0] == '\0')
        return;
    if (value[0] >= '1' && value[0] <= '4' && value[1] == '\0')
        points = value[0] - '0';
    else
        printLine("CULLET_PATCH_POINTS=%s: 1 to 4 expected; it is ignored", value);
}

/// A length in metres.
void readReuse(ReusePose& reuse)
{
    const char* value = std::getenv("CULLET_REUSE_POSE");
    if (value == nullptr || value[0] == '\0')
        return;
    char* end = nullptr;
    const double distance = std::strtod(value, &end);
    if (*end == '\0' && distance >= 0 && distance <= 1)
        reuse.distance = static_cast<btScalar>(distance);
    else
        printLine("CULLET_REUSE_POSE=%s: 0 to 1 expected; it is ignored", value);
}

std::optional<SolverModel> readSolver()
{
    const char* value = std::getenv("CULLET_SOLVER");
    if (value == nullptr || value[0] == '\0' || std::strcmp(value, "0") == 0)
        return std::nullopt;
    if (std::strcmp(value, "1") == 0)
        return SolverModel::Bullet;
    if (std::strcmp(value, "soft") == 0)
        return SolverModel::Soft;
    printLine("CULLET_SOLVER=%s: 0, 1 or soft expected; it is ignored", value);
    return std::nullopt;
}

void readBackend(Settings& result)
{
    static constexpr struct
    {
        const char* name;
        BackendChoice choice;
    } kBackends[] = {{"auto", BackendChoice::Auto},
                     {"grid", BackendChoice::Grid},
                     {"cuda", BackendChoice::Cuda},
                     {"brute", BackendChoice::Brute}};
    const char* name = std::getenv("CULLET_BACKEND");
    if (name == nullptr || name[0] == '\0')
        return;
    for (const auto& backend : kBackends)
    {
        if (std::strcmp(name, backend.name) == 0)
        {
            result.broadphase.backend = backend.choice;
            return;
        }
    }
    if (std::strcmp(name, "dbvt") == 0)
        result.replacesBroadphase = false;
    else
        printLine("CULLET_BACKEND=%s: no such backend; auto is used. There are: auto grid cuda brute dbvt",
                  name);
}

Settings read()
{
    Settings result;
    result.replacesNarrowPhase = readFlag("CULLET_NARROW").value_or(true);
    result.replacesWorld = readFlag("CULLET_WORLD").value_or(false);
    result.solver = readSolver();
    result.fillsTrees = readFlag("CULLET_TREES");
    result.hasSummary = readFlag("CULLET_STATS").value_or(false);
    if (!readFlag("CULLET_BOXES").value_or(true))
        result.narrowPhase.boxPairs = BoxPairs::Bullet;
    result.narrowPhase.meshes = readFlag("CULLET_MESHES").value_or(true);
    result.narrowPhase.activeEdges = readFlag("CULLET_ACTIVE_EDGES").value_or(false);
    readPatchPoints(result.narrowPhase.patchPoints);
    readReuse(result.narrowPhase.reusePose);
    readBackend(result);
    return result;
}
}  // namespace

const Settings& settings()
{
    static const Settings result = read();
    return result;
}
}  // namespace cullet::preload
