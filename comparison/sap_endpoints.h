// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Which end of its interval an endpoint is; a start precedes an end of equal value, so that intervals are closed.
enum class EndpointSide : std::uint8_t
{
    Start,
    End
};

/// Effect of a swap of two neighbouring endpoints of different boxes on the two intervals.
enum class EndpointEvent : std::uint8_t
{
    Nothing,
    OverlapBegins,
    OverlapEnds
};

/// The eight swap cases of Lesson 04, "SAP - Incremental Update": `moving` passes over `passed`.
constexpr EndpointEvent endpointEvent(EndpointSide moving, bool movesRight, EndpointSide passed) noexcept
{
    if (moving == passed)
        return EndpointEvent::Nothing;
    return (moving == EndpointSide::End) == movesRight ? EndpointEvent::OverlapBegins
                                                       : EndpointEvent::OverlapEnds;
}

/// The sorted endpoints of all boxes on one axis.
class EndpointList
{
public:
    struct Endpoint
    {
        float value;
        std::uint32_t rowAndSide;  ///< row << 1 | side

        std::uint32_t row() const noexcept { return rowAndSide >> 1; }
        EndpointSide side() const noexcept { return static_cast<EndpointSide>(rowAndSide & 1); }

        bool precedes(const Endpoint& other) const noexcept
        {
            return value != other.value ? value < other.value : side() < other.side();
        }
    };

    explicit EndpointList(int axis) : m_axis(axis) {}

    const std::vector<Endpoint>& endpoints() const noexcept { return m_endpoints; }

    /// Swaps of neighbours ever made.
    std::uint64_t swapsTotal() const noexcept { return m_swapsTotal; }
    std::uint64_t bytes() const noexcept;

    /// Adds boxes: sorts their endpoints and merges them with the others. Reports nothing. O(all + new log new).
    ///
    /// @param rows  none of them in the list, each < 2^31
    /// @param boxes by row; valid for `rows`
    void insert(const std::vector<std::uint32_t>& rows, const std::vector<Aabb>& boxes);

    /// Removes the rows whose flag is set. Reports nothing. O(all).
    void remove(const std::vector<std::uint8_t>& isLeaving);

    void clear();

    /// Moves the endpoints of a box by insertion sort. O(endpoints passed).
    ///
    /// The box grows before it shrinks, so that its own endpoints never meet and each endpoint passes another once at
    /// most: an overlap that ends only to begin again is never reported.
    /// @param onEvent void(other row, EndpointEvent), called for each change but EndpointEvent::Nothing
    template <class OnEvent>
    void move(std::uint32_t row, const Aabb& box, OnEvent onEvent)
    {
        const Endpoint start = {box.min[m_axis], row << 1};
        const Endpoint end = {box.max[m_axis], row << 1 | 1};
        if (start.value < endpointOf(start).value)
            moveLeft(start, onEvent);
        if (end.value > endpointOf(end).value)
            moveRight(end, onEvent);
        if (start.value > endpointOf(start).value)
            moveRight(start, onEvent);
        if (end.value < endpointOf(end).value)
            moveLeft(end, onEvent);
        // Zeros of different signs compare equal and were not moved.
        m_endpoints[m_places[start.rowAndSide]] = start;
        m_endpoints[m_places[end.rowAndSide]] = end;
    }

private:
    const Endpoint& endpointOf(const Endpoint& endpoint) const
    {
        return m_endpoints[m_places[endpoint.rowAndSide]];
    }

    void put(const Endpoint& endpoint, std::uint32_t place)
    {
        m_endpoints[place] = endpoint;
        m_places[endpoint.rowAndSide] = place;
    }

    template <class OnEvent>
    void pass(const Endpoint& moving, bool movesRight, const Endpoint& passed, OnEvent& onEvent)
    {
        ++m_swapsTotal;
        const EndpointEvent event = endpointEvent(moving.side(), movesRight, passed.side());
        if (event != EndpointEvent::Nothing)
            onEvent(passed.row(), event);
    }

    template <class OnEvent>
    void moveLeft(const Endpoint& endpoint, OnEvent& onEvent)
    {
        std::uint32_t place = m_places[endpoint.rowAndSide];
        for (; place > 0 && endpoint.precedes(m_endpoints[place - 1]); --place)
        {
            const Endpoint passed = m_endpoints[place - 1];
            put(passed, place);
            pass(endpoint, false, passed, onEvent);
        }
        put(endpoint, place);
    }

    template <class OnEvent>
    void moveRight(const Endpoint& endpoint, OnEvent& onEvent)
    {
        std::uint32_t place = m_places[endpoint.rowAndSide];
        for (; place + 1 < m_endpoints.size() && m_endpoints[place + 1].precedes(endpoint); ++place)
        {
            const Endpoint passed = m_endpoints[place + 1];
            put(passed, place);
            pass(endpoint, true, passed, onEvent);
        }
        put(endpoint, place);
    }

    void renumber();

    int m_axis;
    std::vector<Endpoint> m_endpoints;     ///< sorted
    std::vector<Endpoint> m_newEndpoints;  ///< scratch of insert()
    std::vector<std::uint32_t> m_places;   ///< index in m_endpoints by rowAndSide
    std::uint64_t m_swapsTotal = 0;
};
}  // namespace cullet
