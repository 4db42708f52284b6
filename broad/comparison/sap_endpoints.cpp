// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/comparison/sap_endpoints.h"

#include <algorithm>

namespace cullet
{
namespace
{
bool isBefore(const LimitList::Limit& a, const LimitList::Limit& b)
{
    return a.precedes(b);
}
}  // namespace

void LimitList::insert(const std::vector<std::uint32_t>& rows, const std::vector<Aabb>& boxes)
{
    m_fresh.clear();
    for (const std::uint32_t row : rows)
    {
        m_fresh.push_back({boxes[row].min[m_axis], row << 1});
        m_fresh.push_back({boxes[row].max[m_axis], row << 1 | 1});
    }
    std::sort(m_fresh.begin(), m_fresh.end(), isBefore);
    const auto middle = static_cast<std::ptrdiff_t>(m_limits.size());
    m_limits.insert(m_limits.end(), m_fresh.begin(), m_fresh.end());
    std::inplace_merge(m_limits.begin(), m_limits.begin() + middle, m_limits.end(), isBefore);
    m_places.resize(2 * boxes.size());
    renumber();
}

void LimitList::remove(const std::vector<std::uint8_t>& isLeaving)
{
    const auto leaves = [&](const Limit& limit) { return isLeaving[limit.row()] != 0; };
    m_limits.erase(std::remove_if(m_limits.begin(), m_limits.end(), leaves), m_limits.end());
    renumber();
}

void LimitList::renumber()
{
    for (std::size_t place = 0; place < m_limits.size(); ++place)
        m_places[m_limits[place].rowAndSide] = static_cast<std::uint32_t>(place);
}

void LimitList::clear()
{
    m_limits.clear();
    m_places.clear();
}

std::uint64_t LimitList::bytes() const noexcept
{
    return (m_limits.capacity() + m_fresh.capacity()) * sizeof(Limit) +
           m_places.capacity() * sizeof(std::uint32_t);
}
}  // namespace cullet
