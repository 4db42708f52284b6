// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet::test
{
/// What a proxy table should hold, and by brute force which pairs of it a backend should hold.
///
/// Knows only what was done to the table, not the table.
class BoxModel
{
public:
    struct Proxy
    {
        std::uint32_t id = 0;  ///< 0 for rows without a proxy
        Aabb box{};
        Filter filter{};
        bool isChanged = false;      ///< since the last update
        bool isUncollected = false;  ///< since the last collection of changes for queries
    };

    Proxy& at(std::uint32_t row) { return m_rows[row]; }
    const Proxy& at(std::uint32_t row) const { return m_rows[row]; }
    std::uint32_t size() const { return static_cast<std::uint32_t>(m_rows.size()); }
    const std::vector<std::uint32_t>& live() const { return m_live; }
    const Pairs& held() const { return m_held; }
    void hold(const Pairs& pairs) { m_held = pairs; }

    void create(std::uint32_t row, std::uint32_t id, const Aabb& box, Filter filter)
    {
        if (row >= m_rows.size())
            m_rows.resize(row + 1);
        m_rows[row] = {id, box, filter, true, true};
        m_live.push_back(row);
    }

    void setBox(std::uint32_t row, const Aabb& box)
    {
        m_rows[row].box = box;
        m_rows[row].isChanged = m_rows[row].isUncollected = true;
    }

    void setFilter(std::uint32_t row, Filter filter)
    {
        Filter& old = m_rows[row].filter;
        m_rows[row].isChanged |= old.group != filter.group || old.mask != filter.mask;
        old = filter;
    }

    /// @param index in live()
    void destroy(std::size_t index)
    {
        const std::uint32_t row = m_live[index];
        m_live.erase(m_live.begin() + static_cast<std::ptrdiff_t>(index));
        m_rows[row] = {0, {}, {}, true, true};
    }

    void clear()
    {
        m_rows.clear();
        m_live.clear();
    }

    /// Moves to the current boxes.
    PairDelta update(float margin, bool useFilter)
    {
        std::vector<std::uint32_t> order;
        for (const std::uint32_t row : m_live)
            if (isSolid(m_rows[row].box))
                order.push_back(row);
        const auto isBefore = [this](std::uint32_t a, std::uint32_t b)
        { return m_rows[a].id < m_rows[b].id; };
        std::sort(order.begin(), order.end(), isBefore);

        PairDelta delta;
        Pairs now;
        std::size_t next = 0;  // pair of m_held
        for (std::size_t i = 0; i < order.size(); ++i)
        {
            for (std::size_t j = i + 1; j < order.size(); ++j)
            {
                const Proxy& a = m_rows[order[i]];
                const Proxy& b = m_rows[order[j]];
                const Pair pair{a.id, b.id};
                for (; next < m_held.size() && m_held[next] < pair; ++next)
                    delta.removed.push_back(m_held[next]);
                const bool isHeld = next < m_held.size() && m_held[next] == pair;
                const bool stays = isHeld && isNear(a.box, b.box, margin);
                const bool enters = !isHeld && isTouching(a.box, b.box) && (!useFilter || isWanted(a, b));
                if (stays || enters)
                    now.push_back(pair);
                if (enters)
                    delta.added.push_back(pair);
                else if (isHeld && !stays)
                    delta.removed.push_back(pair);
                next += isHeld;
            }
        }
        for (; next < m_held.size(); ++next)
            delta.removed.push_back(m_held[next]);
        m_held = now;
        return delta;
    }

private:
    static bool isSolid(const Aabb& box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            if (std::isnan(box.min[axis]) || std::isnan(box.max[axis]) || box.min[axis] > box.max[axis])
                return false;
        }
        return true;
    }

    static bool isTouching(const Aabb& a, const Aabb& b)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            if (std::max(a.min[axis], b.min[axis]) > std::min(a.max[axis], b.max[axis]))
                return false;
        }
        return true;
    }

    /// Whether the gap, rounded to float once, is at most twice the margin on each axis; infinities have none between them.
    static bool isNear(const Aabb& a, const Aabb& b, float margin)
    {
        const float limit = margin + margin;
        for (int axis = 0; axis < 3; ++axis)
        {
            const double above = static_cast<double>(b.min[axis]) - static_cast<double>(a.max[axis]);
            const double below = static_cast<double>(a.min[axis]) - static_cast<double>(b.max[axis]);
            if (static_cast<float>(above) > limit || static_cast<float>(below) > limit)
                return false;
        }
        return true;
    }

    static bool isWanted(const Proxy& a, const Proxy& b)
    {
        return (b.filter.group & a.filter.mask) != 0 && (a.filter.group & b.filter.mask) != 0;
    }

    std::vector<Proxy> m_rows;
    std::vector<std::uint32_t> m_live;  ///< rows with a proxy, in order of creation
    Pairs m_held;                       ///< in order
};
}  // namespace cullet::test
