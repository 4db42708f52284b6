// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"

#include <random>

namespace cullet::test
{
inline double random(std::mt19937& engine, double low, double high)
{
    return std::uniform_real_distribution<double>(low, high)(engine);
}

/// A transform rotated about a point that may be far away, and shifted.
inline btTransform moved(const btTransform& from, double angle, double away, double shift,
                         std::mt19937& engine)
{
    const auto direction = [&engine] { return quatRotate(randomRotation(engine), vec(1, 0, 0)); };
    const btVector3 about = from.getOrigin() + btScalar(away) * direction();
    const btTransform turn(btQuaternion(direction(), btScalar(angle)));
    btTransform to = turn * btTransform(from.getBasis(), from.getOrigin() - about);
    to.setOrigin(to.getOrigin() + about + btScalar(shift) * direction());
    return to;
}
}  // namespace cullet::test
