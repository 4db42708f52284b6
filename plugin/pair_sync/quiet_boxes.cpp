// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/quiet_boxes.h"

#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/plugin/core/box_convert.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Two boxes share the gap between them. A little less than half of it: the differences of coordinates are rounded.
constexpr float kShareOfGap = 0.49f;

/// Finite, so that an empty box that becomes a valid one, or an infinite box, leaves its room.
constexpr float kMostRoom = 1e30f;

constexpr float kNoRoom = -1;
}  // namespace

bool QuietBoxes::absorb(ProxyTable& table, float margin) noexcept
{
    if (m_rows == 0 || table.size() != m_rows || margin != m_margin)
        return false;
    std::uint64_t moved = 0;
    if (table.hasChanges())
    {
        for (std::uint32_t row = 0; row < m_rows; ++row)
        {
            const std::uint8_t changes = table.changes(row);
            if (changes == kRowUnchanged)
                continue;
            // In double the box may be another one with the same rounding.
            if (changes != kRowMoved || m_rooms[row] < 0 ||
                !isInsideSkin(table.box(row), m_boxes[row], m_rooms[row]))
                return false;
            moved |= std::uint64_t{1} << row;
        }
        table.forgetMoves();
    }
    m_moved |= moved;
    ++m_absorbedUpdates;
    return true;
}

void QuietBoxes::release(ProxyTable& table, bool backendRestarts) noexcept
{
    if (m_rows == 0)
        return;
    for (std::uint64_t left = backendRestarts ? 0 : m_moved; left != 0; left &= left - 1)
    {
        const auto row = static_cast<ProxyId>(__builtin_ctzll(left));
        table.setValidBox(row, table.box(row));
    }
    // A measurement costs as much as some updates.
    const bool hasPaid = m_absorbedUpdates >= 2 + m_rows / 4;
    m_pause = hasPaid ? 0 : std::min(2 * m_pause + 4, kLongestPause);
    m_wait = m_pause;
    m_rows = 0;
    m_moved = 0;
    m_absorbedUpdates = 0;
}

bool QuietBoxes::isWorthMeasuring(std::uint32_t rows) noexcept
{
    if (rows == 0 || rows > kMostRows)
        return false;
    if (m_wait == 0)
        return true;
    --m_wait;
    return false;
}

void QuietBoxes::measure(const ProxyTable& table, const Held& held, float margin) noexcept
{
    m_rows = table.size();
    m_margin = margin;
    for (std::uint32_t row = 0; row < m_rows; ++row)
    {
        m_boxes[row] = table.box(row);
        const bool isEmpty = !isValidBranchless(m_boxes[row]);
        m_rooms[row] = isEmpty || isCoarse(m_boxes[row], margin) ? kNoRoom : kMostRoom;
    }
    for (std::uint32_t a = 0; a < m_rows; ++a)
    {
        for (std::uint32_t b = a + 1; b < m_rows; ++b)
        {
            const float room = roomBetween(table, a, b, (held[a] >> b & 1) != 0);
            m_rooms[a] = std::min(m_rooms[a], room);
            m_rooms[b] = std::min(m_rooms[b], room);
        }
    }
}

/// How far each of two boxes may move before their pair changes.
float QuietBoxes::roomBetween(const ProxyTable& table, std::uint32_t a, std::uint32_t b,
                              bool isHeld) const noexcept
{
    if (!isHeld && !passesFilter(table.filter(a), table.filter(b)))
        return kMostRoom;
    const float gap = gapOf(m_boxes[a], m_boxes[b]);
    // A pair leaves when the boxes grown by the margin separate.
    const float left = isHeld ? 2 * m_margin - gap : gap;
    const float least = isHeld ? 1e-3f * m_margin : 0.0f;
    return left > least ? kShareOfGap * left : kNoRoom;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
