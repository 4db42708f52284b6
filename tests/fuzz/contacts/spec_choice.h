// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/contacts/convex_spec.h"
#include "cullet/tests/support/random.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Shapes and transforms as the bytes of an input say.
namespace cullet::test
{
/// How the points of a hull lie.
enum class HullForm : std::uint8_t
{
    Lattice,
    Any,
    Ball,
    Plane,
    Line,
    Bipyramid,  ///< above and below a plane
    Repeated,   ///< few different points
    kCount
};

inline std::array<double, 3> hullPoint(HullForm form, Random& random)
{
    std::array<double, 3> p;
    for (double& coordinate : p)
    {
        coordinate = double(random.between(-1, 1));
        if (form == HullForm::Lattice || form == HullForm::Repeated)
            coordinate = std::round(coordinate * 2) / 2;
    }
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) + 1e-3;
    if (form == HullForm::Ball)
        p = {p[0] / length, p[1] / length, p[2] / length};
    if (form == HullForm::Plane)
        p[1] = 0.5 * p[0] - 0.25 * p[2];
    if (form == HullForm::Line)
        p = {p[0], 0.5 * p[0], -0.25 * p[0]};
    if (form == HullForm::Bipyramid)
        p[2] = p[2] > 0.7 ? 0.5 : p[2] < -0.7 ? -0.5 : 0;
    return p;
}

inline void chooseHull(Choices& choices, ConvexSpec& spec)
{
    const auto form = static_cast<HullForm>(choices.below(static_cast<std::uint32_t>(HullForm::kCount)));
    const std::uint32_t count = 1 + choices.below(ConvexSpec::kMostPoints);
    const bool isBox = choices.chance(48);
    Random random(choices.below(65536) + 1);
    spec.points.clear();
    for (std::uint32_t i = 0; i < count && !isBox; ++i)
        spec.points.push_back(hullPoint(form, random));
    for (int i = 0; i < 8 && isBox; ++i)
        spec.points.push_back({i & 1 ? 0.5 : -0.5, i & 2 ? 0.75 : -0.75, i & 4 ? 1.0 : -1.0});
    spec.scaling = {1, 1, 1};
}

/// From a tenth to some units, mostly a multiple of an eighth.
inline double lengthOf(Choices& choices)
{
    const double eighths = 1 + choices.below(16);
    return choices.chance(64) ? eighths / 7.3 : eighths / 8;
}

inline void chooseShape(Choices& choices, ConvexSpec& spec)
{
    // A hull is half of the shapes.
    const std::uint32_t kind = choices.below(2 * static_cast<std::uint32_t>(SpecKind::kCount));
    spec.kind =
        kind < static_cast<std::uint32_t>(SpecKind::kCount) ? static_cast<SpecKind>(kind) : SpecKind::Hull;
    if (spec.kind == SpecKind::Hull)
        return chooseHull(choices, spec);
    spec.axis = static_cast<int>(choices.below(3));
    for (double& half : spec.half)
        half = lengthOf(choices);
    // Much longer than wide.
    if (choices.chance(24))
        spec.half[0] *= 64;
    const bool isThin = spec.kind == SpecKind::Box && choices.chance(24);
    spec.margin = lengthOf(choices) / 16;
    if (isThin)
        spec.half[1] = -spec.margin / 2;
    Random random(choices.below(65536) + 1);
    spec.points.clear();
    for (int i = 0; i < 3; ++i)
        spec.points.push_back(hullPoint(choices.chance(32) ? HullForm::Line : HullForm::Any, random));
}

inline void chooseMargin(Choices& choices, ConvexSpec& spec)
{
    const double margins[] = {0, 0.03125, 0.04, 0.125, 1e-4, 1, 0.5, 0.001};
    spec.margin = choices.of(margins);
}

inline void chooseScaling(Choices& choices, ConvexSpec& spec)
{
    const double factors[] = {1, 0.5, 2, 1.5, -1, 0.1, 30, 1e-3, 0.7, 1, 1, -0.25};
    for (double& factor : spec.scaling)
        factor = choices.of(factors);
    if (choices.chance(6))
        spec.scaling[1] = 0;
}

/// One of the 24 rotations of a cube, which are exact.
inline btMatrix3x3 quarterTurns(std::uint32_t which)
{
    btMatrix3x3 turn = btMatrix3x3::getIdentity();
    const btMatrix3x3 aboutX(1, 0, 0, 0, 0, -1, 0, 1, 0), aboutY(0, 0, 1, 0, 1, 0, -1, 0, 0);
    for (std::uint32_t i = 0; i < which % 4; ++i)
        turn = aboutX * turn;
    for (std::uint32_t i = 0; i < which / 4 % 6; ++i)
        turn = (i < 4 ? aboutY : aboutX) * turn;
    return turn;
}

inline btMatrix3x3 chooseTurn(Choices& choices)
{
    const std::uint32_t kind = choices.below(8);
    if (kind < 2)
        return quarterTurns(choices.below(24));
    btVector3 axis(0, 0, 0);
    for (int i = 0; i < 3; ++i)
        axis[i] = btScalar(choices.below(17)) - 8;
    if (axis.length2() == 0)
        axis[1] = 1;
    // A tilt from one that rounding hides to one that changes faces, or any angle.
    const double tilt = std::ldexp(1.0, -static_cast<int>(choices.below(30)));
    const double angle = kind < 5 ? tilt : double(choices.below(256)) / 40;
    return btMatrix3x3(btQuaternion(axis.normalized(), btScalar(angle)));
}
}  // namespace cullet::test
