// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <array>
#include <cstdint>

class btCollisionShape;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A hash of all that the contacts of a shape depend on beside its pose, with all of its parts and the leaves of its tree.
/// It shows any change of them, and another shape at the address of a deleted one; with 64 bits it is not equal for others
/// by chance.
///
/// @return 0 for a shape whose changes would not be seen: with triangles, or of another class than these: hulls, boxes,
///         spheres, capsules, cylinders, cones, planes, and compounds of these
/// Cost: reads all points and parts
std::uint64_t hashOfContents(const btCollisionShape& shape) noexcept;

/// hashOfContents() while no shape changes: in one dispatch. Many pairs share a shape.
class ContentsMemo
{
public:
    std::uint64_t hashOf(const btCollisionShape& shape) noexcept;

private:
    struct Entry
    {
        const btCollisionShape* shape = nullptr;
        std::uint64_t hash = 0;
    };

    std::array<Entry, 64> m_entries;  ///< by a hash of the address
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
