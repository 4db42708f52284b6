// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/subject.h"

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
        if (name == info.name)
            return info;
        known += std::string(known.empty() ? "" : ", ") + info.name;
    }
    throw std::invalid_argument("unknown backend '" + name + "'; known: " + known);
}
}  // namespace

const std::vector<SubjectInfo>& subjectNames()
{
    static const std::vector<SubjectInfo> names = {
        {"grid", "cullet: the hierarchical grid on the CPU, rows", true},
        {"grid-cells", "cullet: the same with the lecture's cells", true},
        {"brute", "cullet: every box against every other", true},
        {"cuda", "cullet on an NVIDIA GPU", true},
        {"auto", "cullet's own choice", false},
        {"dbvt", "Bullet's btDbvtBroadphase as shipped", false},
        {"dbvt-deferred", "btDbvtBroadphase with m_deferedcollide", false},
        {"dbvt-m0", "btDbvtBroadphase with gDbvtMargin = 0", false},
        {"axissweep", "Bullet's bt32BitAxisSweep3 without ray accelerator", false},
    };
    return names;
}

bool isThroughBullet(const SubjectRequest& request)
{
    return request.through == Through::Bullet || !findSubject(request.name).hasBackend;
}

std::unique_ptr<Subject> makeSubject(const SubjectRequest& request)
{
    return isThroughBullet(request) ? makeBulletSubject(request) : makeBackendSubject(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
