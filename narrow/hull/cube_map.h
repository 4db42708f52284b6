// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>

/// Maps directions to the cells of a cube around the origin, the index of Hull::startTable().
namespace cullet
{
/// The cell of a cube's sides that a direction hits, row-major, sides ordered +x -x +y -y +z -z.
///
/// @param cells along an edge of the cube
template <class S>
[[gnu::always_inline]] inline int cubeCell(const Eigen::Matrix<S, 3, 1>& d, int cells)
{
    const S ax = std::abs(d[0]), ay = std::abs(d[1]), az = std::abs(d[2]);
    const int axis = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2);
    const S largest = std::abs(d[axis]);
    if (!(largest > S(0)))
        return 0;
    const S half = S(cells) / S(2);
    const S scale = half / largest;
    const auto cell = [&](S value)
    {
        // A NaN fails the comparison and lands in the first cell.
        const S place = value * scale + half;
        return place > S(0) ? static_cast<int>(place < S(cells) ? place : S(cells - 1)) : 0;
    };
    const int side = 2 * axis + (d[axis] < S(0) ? 1 : 0);
    return (side * cells + cell(d[(axis + 1) % 3])) * cells + cell(d[(axis + 2) % 3]);
}

/// The direction in the middle of a cell of cubeCell().
template <class S>
Eigen::Matrix<S, 3, 1> cellCentre(int cell, int cells)
{
    const auto middle = [cells](int place) { return (S(2) * S(place) + S(1)) / S(cells) - S(1); };
    const int side = cell / (cells * cells), axis = side / 2;
    Eigen::Matrix<S, 3, 1> d;
    d[axis] = side % 2 == 0 ? S(1) : S(-1);
    d[(axis + 1) % 3] = middle(cell / cells % cells);
    d[(axis + 2) % 3] = middle(cell % cells);
    return d;
}

/// Start vertex for a direction from the hull's table.
template <class S>
std::int32_t cubeMapStart(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    return hull.startTable()[static_cast<std::size_t>(cubeCell(d, Hull<S>::kCubeCells))];
}
}  // namespace cullet
