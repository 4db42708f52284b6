// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/verlet/skin.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The few rows of a world that move, each with a neighbour list: the links of a robot that moves by small steps among obstacles.
///
/// A *moving* row is one that has changed since begin(). The boxes of all others are those for which the lists were made. While a
/// moving row is inside its skin, only the rows of its list and the other moving rows can overlap it.
///
/// Skins follow the steps of a row: they last for some steps, and a row that teleports has none. Memory: 72 bytes a moving row, 4 a
/// neighbour, and one each of all rows; nothing in worlds of fewer than kFewestRows.
class MovingRows
{
public:
    struct Row
    {
        std::uint32_t row = 0;
        Aabb box = kEmptyAabb;        ///< of the last update; empty before the first one
        Aabb reference = kEmptyAabb;  ///< of the list
        Skin skin = kNoList;
        std::uint32_t pause = 0;          ///< updates until the next list
        std::vector<std::uint32_t> near;  ///< the list
    };

    /// Fewer rows are tested sooner than a list.
    static constexpr std::uint32_t kFewestRows = 256;
    /// A list may be so long.
    static constexpr std::uint32_t kMostNear = 64;

    void clear() noexcept;

    /// Adds the rows that change in an update to the moving ones; forgets all if they are too many to be tested with each other.
    ///
    /// @return whether the rows of the update are moving rows now
    bool add(const ProxyView& view);

    /// @pre add() has returned true for this update, which changes the row
    Row& of(std::uint32_t row) noexcept { return m_rows[m_places[row]]; }
    const std::vector<Row>& rows() const noexcept { return m_rows; }

    /// Whether the list of the row holds for its box.
    static bool isInsideSkin(const ProxyView& view, const Row& moving) noexcept
    {
        return moving.skin.thickness >= 0 && view.changes[moving.row] == kRowMoved &&
               moving.skin.contains(view.boxes[moving.row], moving.reference);
    }

    /// Begins a new list if one would hold for some steps, and returns whether it did: its rows are those within Skin::growth().
    static bool beginList(const ProxyView& view, Row& moving);
    /// Ends the list, which would be longer than kMostNear, for some updates.
    static void endLongList(Row& moving) noexcept;

    std::uint64_t bytes() const noexcept;

private:
    static constexpr Skin kNoList = {-1.0f};
    static constexpr std::uint8_t kNone = 255;
    /// One moving row at most in so many, since all of them are tested with each other.
    static constexpr std::uint32_t kMovingShare = 16;

    std::vector<Row> m_rows;
    std::vector<std::uint8_t> m_places;  ///< [rows] index into m_rows, or kNone
};
}  // namespace cullet
