// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/subject.h"

#include "cullet/demos/bench/named_backends.h"
#include "cullet/demos/rivals/rival.h"

#include <stdexcept>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
const SubjectInfo& findSubject(const std::string& name)
{
    std::string known;
    for (const SubjectInfo& info : subjectNames())
    {
        if (listedName(name) == info.name)
            return info;
        known += std::string(known.empty() ? "" : ", ") + info.name;
    }
    throw std::invalid_argument("unknown backend '" + name + "'; known: " + known);
}
}  // namespace

const std::vector<SubjectInfo>& subjectNames()
{
    static const std::vector<SubjectInfo> names = []
    {
        std::vector<SubjectInfo> all;
        for (const NamedBackend& backend : namedBackends())
            all.push_back({backend.name, backend.summary, true});
        for (const NumberedBackend& backend : numberedBackends())
            all.push_back({backend.name, backend.summary, true});
        all.push_back({"auto", "cullet's own choice", false});
        all.push_back({"dbvt", "Bullet's btDbvtBroadphase as shipped", false});
        all.push_back({"dbvt-deferred", "btDbvtBroadphase with m_deferedcollide", false});
        all.push_back({"dbvt-m0", "btDbvtBroadphase with gDbvtMargin = 0", false});
        all.push_back({"axissweep", "Bullet's bt32BitAxisSweep3 without ray accelerator", false});
        for (const RivalInfo& rival : rivals())
            all.push_back({rival.name, rival.summary, false, rival.package, rival.make != nullptr});
        return all;
    }();
    return names;
}

bool isRival(const std::string& name)
{
    return findSubject(name).package != nullptr;
}

bool isThroughBullet(const SubjectRequest& request)
{
    const SubjectInfo& info = findSubject(request.name);
    return info.package == nullptr && (request.through == Through::Bullet || !info.hasBackend);
}

std::unique_ptr<Subject> makeSubject(const SubjectRequest& request)
{
    if (isRival(request.name))
        return makeRivalSubject(request);
    return isThroughBullet(request) ? makeBulletSubject(request) : makeBackendSubject(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
