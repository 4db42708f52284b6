// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/drop_parts.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
const std::vector<std::string>& dropPartNames()
{
    static const std::vector<std::string> names = {"stock", "broadphase", "dispatcher", "world"};
    return names;
}

const std::string& nameOf(DropPart part)
{
    return dropPartNames()[static_cast<std::size_t>(part)];
}

std::vector<DropPart> dropPartsNamed(const std::vector<std::string>& names)
{
    std::vector<DropPart> parts;
    for (const DropPart part : {DropPart::Stock, DropPart::Broadphase, DropPart::Dispatcher, DropPart::World})
    {
        if (std::find(names.begin(), names.end(), nameOf(part)) != names.end())
            parts.push_back(part);
    }
    return parts;
}

WorldSceneOptions optionsOf(DropPart part, const WorldSceneOptions& scene, bool fixedNarrow)
{
    WorldSceneOptions options = scene;
    if (part == DropPart::Stock)
        options.backend = "dbvt";
    if (!fixedNarrow)
        options.narrow = part >= DropPart::Dispatcher ? "dispatcher" : "bullet";
    options.activeEdges = true;
    options.update = part == DropPart::World ? "parallel" : "bullet";
    return options;
}

std::string titleOf(DropPart part, const NamedBroadphase& broadphase)
{
    switch (part)
    {
        case DropPart::Stock:
            return "stock Bullet";
        case DropPart::Broadphase:
            return "+ " + (broadphase.cullet ? "Broadphase" : broadphase.name);
        case DropPart::Dispatcher:
            return "+ Dispatcher";
        case DropPart::World:
            return "+ World";
    }
    return "";
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
