// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/four_lanes.h"

namespace cullet
{
/// A box in world space. Lengths are those of the world; each fourth lane is unused, and must be finite.
///
/// @tparam Vector FourLanes, here and in all of this folder
template <class Vector>
struct PosedBox
{
    Vector rows[3];  ///< of the rotation, which maps the box's axes to world axes
    Vector centre;
    Vector half;  ///< half extents, not negative
};

/// Two boxes, the second in the frame of the first, whose axes are those of A. All that a contact depends on.
template <class Vector>
struct BoxPair
{
    BoxPair(const PosedBox<Vector>& a, const PosedBox<Vector>& b) : halfA(a.half), halfB(b.half)
    {
        const Vector apart = b.centre - a.centre;
        const Vector first = Vector::template shuffle<0, 1, 2, 4>(b.rows[0], apart);
        const Vector second = Vector::template shuffle<0, 1, 2, 5>(b.rows[1], apart);
        const Vector third = Vector::template shuffle<0, 1, 2, 6>(b.rows[2], apart);
        const auto row = [&](const Vector& x, const Vector& y, const Vector& z)
        { return first * x + second * y + third * z; };
        const Vector &x = a.rows[0], &y = a.rows[1], &z = a.rows[2];
        rows[0] = row(x.template spread<0>(), y.template spread<0>(), z.template spread<0>());
        rows[1] = row(x.template spread<1>(), y.template spread<1>(), z.template spread<1>());
        rows[2] = row(x.template spread<2>(), y.template spread<2>(), z.template spread<2>());
    }

    /// Row i: coordinate i of B's axes (lanes 0 to 2) and of B's centre (lane 3).
    Vector rows[3];
    Vector halfA, halfB;
};

/// Lane i of column j is lane j of row i; the fourth lanes are unused.
template <class Vector>
[[gnu::always_inline]] inline void transposeRows(const Vector (&rows)[3], Vector (&columns)[4])
{
    const Vector low = Vector::template shuffle<0, 4, 1, 5>(rows[0], rows[1]);
    const Vector high = Vector::template shuffle<2, 6, 3, 7>(rows[0], rows[1]);
    columns[0] = Vector::template shuffle<0, 1, 4, 4>(low, rows[2]);
    columns[1] = Vector::template shuffle<2, 3, 5, 5>(low, rows[2]);
    columns[2] = Vector::template shuffle<0, 1, 6, 6>(high, rows[2]);
    columns[3] = Vector::template shuffle<2, 3, 7, 7>(high, rows[2]);
}
}  // namespace cullet
