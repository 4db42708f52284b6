// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "preload/settings.h"

#include "preload/message.h"
#include <cstdlib>
#include <cstring>

namespace cullet::preload
{
namespace
{
bool isGiven(const char* name)
{
    const char* value = std::getenv(name);
    return value != nullptr && value[0] != '\0';
}

bool isSet(const char* name, bool otherwise)
{
    return isGiven(name) ? std::strcmp(std::getenv(name), "0") != 0 : otherwise;
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
        say("CULLET_BACKEND=%s: no such backend; auto is used. There are: auto grid cuda brute dbvt", name);
}

Settings read()
{
    Settings result;
    result.replacesNarrowPhase = isSet("CULLET_NARROW", true);
    if (isGiven("CULLET_TREES"))
        result.fillsTrees = isSet("CULLET_TREES", false);
    result.hasSummary = isSet("CULLET_STATS", false);
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
