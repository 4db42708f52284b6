// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/rivals/rival.h"

#include <stdexcept>

namespace cullet
{
namespace
{
using Maker = std::unique_ptr<Rival> (*)(const RivalRequest&);

#ifdef CULLET_RIVAL_CGAL
constexpr Maker kCgal = makeCgalRival;
#else
constexpr Maker kCgal = nullptr;
#endif
#ifdef CULLET_RIVAL_COAL
constexpr Maker kCoal = makeCoalRival;
#else
constexpr Maker kCoal = nullptr;
#endif
#ifdef CULLET_RIVAL_EMBREE
constexpr Maker kEmbree = makeEmbreeRival;
#else
constexpr Maker kEmbree = nullptr;
#endif
#ifdef CULLET_RIVAL_FCL
constexpr Maker kFcl = makeFclRival;
#else
constexpr Maker kFcl = nullptr;
#endif
#ifdef CULLET_RIVAL_ODE
constexpr Maker kOde = makeOdeRival;
#else
constexpr Maker kOde = nullptr;
#endif

constexpr const char* kCoalPackage = "coal with pip, give cmake -DCOAL_ROOT=<site-packages>/cmeel.prefix,";
}  // namespace

const std::vector<RivalInfo>& rivals()
{
    static const std::vector<RivalInfo> all = {
        {"fcl-tree", "FCL's DynamicAABBTreeCollisionManager", "libfcl-dev", false, kFcl},
        {"fcl-tree-array", "FCL's DynamicAABBTreeCollisionManager_Array", "libfcl-dev", false, kFcl},
        {"fcl-ssap", "FCL's SSaPCollisionManager (sorts, then sweeps)", "libfcl-dev", false, kFcl},
        {"fcl-sap", "FCL's SaPCollisionManager (keeps its order)", "libfcl-dev", false, kFcl},
        {"fcl-interval", "FCL's IntervalTreeCollisionManager", "libfcl-dev", false, kFcl},
        {"fcl-spatialhash", "FCL's SpatialHashingCollisionManager", "libfcl-dev", false, kFcl},
        {"coal-tree", "Coal's DynamicAABBTreeCollisionManager", kCoalPackage, false, kCoal},
        {"ode-hash", "ODE's hash space", "libode-dev", false, kOde},
        {"ode-sap", "ODE's sweep-and-prune space", "libode-dev", false, kOde},
        {"cgal", "CGAL's box_self_intersection_d", "libcgal-dev", false, kCgal},
        {"embree", "Embree's rtcCollide", "libembree-dev", true, kEmbree},
    };
    return all;
}

const RivalInfo* findRival(const std::string& name)
{
    for (const RivalInfo& rival : rivals())
    {
        if (name == rival.name)
            return &rival;
    }
    return nullptr;
}

std::vector<std::string> builtRivals()
{
    std::vector<std::string> names;
    for (const RivalInfo& rival : rivals())
    {
        if (rival.make != nullptr)
            names.emplace_back(rival.name);
    }
    return names;
}

std::unique_ptr<Rival> makeRival(const RivalRequest& request)
{
    const RivalInfo* rival = findRival(request.name);
    if (rival->make == nullptr)
        throw std::runtime_error(request.name + ": this program was built without it; install " +
                                 rival->package + " and build again");
    return rival->make(request);
}
}  // namespace cullet
