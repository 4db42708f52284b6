// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/sap_endpoints.h"

#include <algorithm>

namespace cullet
{
namespace
{
bool isBefore(const EndpointList::Endpoint& a, const EndpointList::Endpoint& b)
{
    return a.precedes(b);
}
}  // namespace

void EndpointList::insert(const std::vector<std::uint32_t>& rows, const std::vector<Aabb>& boxes)
{
    m_newEndpoints.clear();
    for (const std::uint32_t row : rows)
    {
        m_newEndpoints.push_back({boxes[row].min[m_axis], row << 1});
        m_newEndpoints.push_back({boxes[row].max[m_axis], row << 1 | 1});
    }
    std::sort(m_newEndpoints.begin(), m_newEndpoints.end(), isBefore);
    const auto middle = static_cast<std::ptrdiff_t>(m_endpoints.size());
    m_endpoints.insert(m_endpoints.end(), m_newEndpoints.begin(), m_newEndpoints.end());
    std::inplace_merge(m_endpoints.begin(), m_endpoints.begin() + middle, m_endpoints.end(), isBefore);
    m_places.resize(2 * boxes.size());
    renumber();
}

void EndpointList::remove(const std::vector<std::uint8_t>& isLeaving)
{
    const auto leaves = [&](const Endpoint& endpoint) { return isLeaving[endpoint.row()] != 0; };
    m_endpoints.erase(std::remove_if(m_endpoints.begin(), m_endpoints.end(), leaves), m_endpoints.end());
    renumber();
}

void EndpointList::renumber()
{
    for (std::size_t place = 0; place < m_endpoints.size(); ++place)
        m_places[m_endpoints[place].rowAndSide] = static_cast<std::uint32_t>(place);
}

void EndpointList::clear()
{
    m_endpoints.clear();
    m_places.clear();
}

std::uint64_t EndpointList::bytes() const noexcept
{
    return (m_endpoints.capacity() + m_newEndpoints.capacity()) * sizeof(Endpoint) +
           m_places.capacity() * sizeof(std::uint32_t);
}
}  // namespace cullet
