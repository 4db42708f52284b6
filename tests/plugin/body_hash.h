// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace cullet::test
{
/// Fingerprint of the transforms of all bodies, bit by bit.
inline std::uint64_t hashOfBodies(const std::vector<std::unique_ptr<btRigidBody>>& bodies)
{
    std::uint64_t hash = 14695981039346656037ull;
    for (const auto& body : bodies)
    {
        const btTransform& transform = body->getWorldTransform();
        for (int axis = 0; axis < 3; ++axis)
        {
            for (const btScalar value : {transform.getOrigin()[axis], transform.getBasis()[axis][0],
                                         transform.getBasis()[axis][1], transform.getBasis()[axis][2]})
            {
                std::uint64_t bits = 0;
                std::memcpy(&bits, &value, sizeof(value));
                hash = (hash ^ bits) * 1099511628211ull;
            }
        }
    }
    return hash;
}
}  // namespace cullet::test
