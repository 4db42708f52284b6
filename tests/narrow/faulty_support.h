// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>

#include <cstdint>

namespace cullet::test
{
/// A hull given by its support function, one result of which is faulty.
class FaultySupport
{
public:
    FaultySupport(const PosedHull<float>& hull, int badCall, double bad)
        : m_hull(&hull), m_badCall(badCall), m_bad(bad)
    {
    }

    Eigen::Vector3d origin() const { return m_hull->origin(); }
    Eigen::Vector3d centre() const { return m_hull->centre(); }
    std::int32_t vertexCount() const { return 0; }
    Eigen::Vector3d point(std::int32_t) const { return Eigen::Vector3d::Zero(); }
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t) const
    {
        SupportPoint answer = m_hull->support(direction, -1);
        answer.vertex = -1;
        if (m_calls++ == m_badCall)
            answer.point[m_badCall % 3] = m_bad;
        return answer;
    }
    int calls() const { return m_calls; }

private:
    const PosedHull<float>* m_hull;
    int m_badCall;
    double m_bad;
    mutable int m_calls = 0;
};
}  // namespace cullet::test
