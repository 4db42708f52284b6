// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/debug_containers.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace cullet
{
/// Arcs of great circles on the unit sphere, in boxes sorted along x, to find the arcs of two sets that may cross.
class GaussMapArcs
{
public:
    /// @param from, to ends of an arc of at most half a circle; without unit length its box covers the whole sphere
    void add(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
    {
        Box box;
        box.arc = m_boxes.size();
        box.low = Eigen::Vector3d::Constant(-2.0);
        box.high = Eigen::Vector3d::Constant(2.0);
        if (isUnit(from) && isUnit(to))
        {
            // An arc exceeds the box of its ends by at most its height over the chord c,
            // 1 - sqrt(1 - c^2 / 4) < c^2 / 4.
            const double height = 0.25 * (to - from).squaredNorm() + kRounding;
            box.low = from.cwiseMin(to).array() - height;
            box.high = from.cwiseMax(to).array() + height;
        }
        m_boxes.push_back(box);
    }

    /// To be called once, after the last add(). A total order, since standard libraries sort equal elements differently.
    void sort()
    {
        std::sort(m_boxes.begin(), m_boxes.end(),
                  [](const Box& p, const Box& q)
                  { return std::make_pair(p.low[0], p.arc) < std::make_pair(q.low[0], q.arc); });
    }

    /// Calls found(i, j) for arcs i of a and j of b, numbered in the order of add(), whose boxes overlap: once for each
    /// pair.
    /// Cost: O(n + m) and one comparison for each pair of boxes that overlap along x, which for arcs as short as those
    /// of round hulls are some n^1.5.
    template <class Found>
    static void forEachPair(const GaussMapArcs& a, const GaussMapArcs& b, const Found& found)
    {
        auto i = a.m_boxes.begin(), j = b.m_boxes.begin();
        while (i != a.m_boxes.end() && j != b.m_boxes.end())
        {
            if (i->low[0] <= j->low[0])
            {
                for (auto other = j; other != b.m_boxes.end() && other->low[0] <= i->high[0]; ++other)
                {
                    if (overlapAcross(*i, *other))
                        found(i->arc, other->arc);
                }
                ++i;
            }
            else
            {
                for (auto other = i; other != a.m_boxes.end() && other->low[0] <= j->high[0]; ++other)
                {
                    if (overlapAcross(*other, *j))
                        found(other->arc, j->arc);
                }
                ++j;
            }
        }
    }

private:
    struct Box
    {
        Eigen::Vector3d low, high;
        std::size_t arc;
    };

    /// False for a NaN, which would break the sort.
    static bool isUnit(const Eigen::Vector3d& v)
    {
        const double length2 = v.squaredNorm();
        return length2 > 0.99 && length2 < 1.01;
    }

    static bool overlapAcross(const Box& p, const Box& q)
    {
        return p.low[1] <= q.high[1] && q.low[1] <= p.high[1] && p.low[2] <= q.high[2] &&
               q.low[2] <= p.high[2];
    }

    static constexpr double kRounding = 1e-9;

    std::vector<Box> m_boxes;
};
}  // namespace cullet
