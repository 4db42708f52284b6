// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Which end of its interval an endpoint is; a start precedes an end of equal value, so that intervals are closed.
enum class LimitSide : std::uint8_t
{
    Start,
    End
};

/// Effect of a swap of two neighbouring endpoints of different boxes on the two intervals.
enum class LimitEvent : std::uint8_t
{
    Nothing,
    OverlapBegins,
    OverlapEnds
};

/// The eight swap cases of Lesson 04, "SAP - Incremental Update": `moving` passes over `passed`.
constexpr LimitEvent limitEvent(LimitSide moving, bool movesRight, LimitSide passed) noexcept
{
    if (moving == passed)
        return LimitEvent::Nothing;
    return (moving == LimitSide::End) == movesRight ? LimitEvent::OverlapBegins : LimitEvent::OverlapEnds;
}

/// The sorted endpoints of all boxes on one axis.
class LimitList
{
public:
    struct Limit
    {
        float value;
        std::uint32_t rowAndSide;  ///< row << 1 | side

        std::uint32_t row() const noexcept { return rowAndSide >> 1; }
        LimitSide side() const noexcept { return static_cast<LimitSide>(rowAndSide & 1); }

        bool precedes(const Limit& other) const noexcept
        {
            return value != other.value ? value < other.value : side() < other.side();
        }
    };

    explicit LimitList(int axis) : m_axis(axis) {}

    const std::vector<Limit>& limits() const noexcept { return m_limits; }

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
    /// @param onEvent void(other row, LimitEvent), called for each change but LimitEvent::Nothing
    template <class OnEvent>
    void move(std::uint32_t row, const Aabb& box, OnEvent onEvent)
    {
        const Limit start = {box.min[m_axis], row << 1};
        const Limit end = {box.max[m_axis], row << 1 | 1};
        if (start.value < limitOf(start).value)
            moveLeft(start, onEvent);
        if (end.value > limitOf(end).value)
            moveRight(end, onEvent);
        if (start.value > limitOf(start).value)
            moveRight(start, onEvent);
        if (end.value < limitOf(end).value)
            moveLeft(end, onEvent);
        // Zeros of different signs compare equal and were not moved.
        m_limits[m_places[start.rowAndSide]] = start;
        m_limits[m_places[end.rowAndSide]] = end;
    }

private:
    const Limit& limitOf(const Limit& limit) const { return m_limits[m_places[limit.rowAndSide]]; }

    void put(const Limit& limit, std::uint32_t place)
    {
        m_limits[place] = limit;
        m_places[limit.rowAndSide] = place;
    }

    template <class OnEvent>
    void pass(const Limit& moving, bool movesRight, const Limit& passed, OnEvent& onEvent)
    {
        ++m_swapsTotal;
        const LimitEvent event = limitEvent(moving.side(), movesRight, passed.side());
        if (event != LimitEvent::Nothing)
            onEvent(passed.row(), event);
    }

    template <class OnEvent>
    void moveLeft(const Limit& limit, OnEvent& onEvent)
    {
        std::uint32_t place = m_places[limit.rowAndSide];
        for (; place > 0 && limit.precedes(m_limits[place - 1]); --place)
        {
            const Limit passed = m_limits[place - 1];
            put(passed, place);
            pass(limit, false, passed, onEvent);
        }
        put(limit, place);
    }

    template <class OnEvent>
    void moveRight(const Limit& limit, OnEvent& onEvent)
    {
        std::uint32_t place = m_places[limit.rowAndSide];
        for (; place + 1 < m_limits.size() && m_limits[place + 1].precedes(limit); ++place)
        {
            const Limit passed = m_limits[place + 1];
            put(passed, place);
            pass(limit, true, passed, onEvent);
        }
        put(limit, place);
    }

    void renumber();

    int m_axis;
    std::vector<Limit> m_limits;          ///< sorted
    std::vector<Limit> m_fresh;           ///< scratch of insert()
    std::vector<std::uint32_t> m_places;  ///< index in m_limits by rowAndSide
    std::uint64_t m_swapsTotal = 0;
};
}  // namespace cullet
