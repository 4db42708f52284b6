// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A copy that is read coordinate by coordinate, as the caller has usually written it a moment ago. A wider load would
/// wait until those stores, and all that precede them, are in the cache: in a large world a miss of the cache or two.
inline btVector3 readByParts(const btVector3& vector)
{
    const volatile btScalar* const parts = vector.m_floats;  // volatile: the compiler joins no loads
    btVector3 copy;
    for (int i = 0; i < 4; ++i)
        copy.m_floats[i] = parts[i];
    return copy;
}

/// Whether x, y and z have the same bits, so that a NaN equals itself. -0 and 0 differ, which only costs an update.
inline bool isSamePoint(const btVector3& a, const btVector3& b)
{
    // Not memcmp(), whose wide loads would move the vectors into memory.
    using Bits = std::conditional_t<sizeof(btScalar) == sizeof(float), std::uint32_t, std::uint64_t>;
    const auto bits = [](btScalar value)
    {
        Bits result;
        std::memcpy(&result, &value, sizeof result);
        return result;
    };
    return bits(a.x()) == bits(b.x()) && bits(a.y()) == bits(b.y()) && bits(a.z()) == bits(b.z());
}

inline bool isSameBox(const btVector3& min0, const btVector3& max0, const btVector3& min1,
                      const btVector3& max1)
{
    return isSamePoint(min0, min1) && isSamePoint(max0, max1);
}

/// False for a box with min > max or with a NaN.
inline bool isValidBox(const btVector3& min, const btVector3& max)
{
    return min.x() <= max.x() && min.y() <= max.y() && min.z() <= max.z();
}

/// Overlap of closed intervals; false if a NaN is compared.
///
/// Bullet's TestAabbAgainstAabb2 treats a NaN as overlapping; its tree (btDbvt) does not.
inline bool overlapsExactly(const btVector3& min0, const btVector3& max0, const btVector3& min1,
                            const btVector3& max1)
{
    return min0.x() <= max1.x() && min1.x() <= max0.x() && min0.y() <= max1.y() && min1.y() <= max0.y() &&
           min0.z() <= max1.z() && min1.z() <= max0.z();
}

inline bool overlapsExactly(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
{
    return overlapsExactly(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax);
}

/// Whether the exact boxes, grown by a margin, are separated: the negation of overlapsWithMargin() on the float boxes.
inline bool areSeparatedBy(const btBroadphaseProxy& a, const btBroadphaseProxy& b, btScalar margin)
{
    const btScalar limit = 2 * margin;
    for (int axis = 0; axis < 3; ++axis)
    {
        if (b.m_aabbMin[axis] - a.m_aabbMax[axis] > limit || a.m_aabbMin[axis] - b.m_aabbMax[axis] > limit)
            return true;
    }
    return false;
}

/// Whether a margin is below a few roundings of a box's coordinates to float. Always false in float builds.
inline bool isCoarse(const Aabb& box, float margin)
{
    if constexpr (sizeof(btScalar) == sizeof(float))
        return false;
    float most = 0;
    for (int axis = 0; axis < 3; ++axis)
        most = std::max({most, std::abs(box.min[axis]), std::abs(box.max[axis])});
    return most * (4 * std::numeric_limits<float>::epsilon()) > margin;
}

/// The smallest float box around a box; a copy in float builds. An empty box may become a valid one.
inline Aabb toFloatBox(const btVector3& min, const btVector3& max)
{
    if constexpr (sizeof(btScalar) == sizeof(float))
        return {{float(min.x()), float(min.y()), float(min.z())},
                {float(max.x()), float(max.y()), float(max.z())}};
    Aabb box;
    roundThreeToFloat<false>(min.x(), min.y(), min.z(), box.min);
    roundThreeToFloat<true>(max.x(), max.y(), max.z(), box.max);
    return box;
}

/// Where the boxes of a table have their origin: far from that of the world, a float is coarser than the bodies.
///
/// Rounded differences keep the order of coordinates, so that boxes that overlap do so in the table, too. Float builds
/// have the world's own origin.
class TableOrigin
{
public:
    /// The smallest float box around a box, relative to this origin; see toFloatBox().
    Aabb toTable(const btVector3& min, const btVector3& max) const
    {
        if constexpr (sizeof(btScalar) == sizeof(float))
            return toFloatBox(min, max);
        return toFloatBox(min - m_place, max - m_place);
    }

    /// toTable() of a valid box, otherwise kEmptyAabb: rounding could make an invalid box valid.
    Aabb toTableOrEmpty(const btVector3& min, const btVector3& max) const
    {
        return isValidBox(min, max) ? toTable(min, max) : kEmptyAabb;
    }

    const btVector3& place() const { return m_place; }
    void setPlace(const btVector3& place) { m_place = place; }

private:
    btVector3 m_place = btVector3(0, 0, 0);
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
