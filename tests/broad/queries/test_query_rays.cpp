// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Rays that graze a face, or end at one, within the rounding of Bullet's own test: a query visits every box that the
// test reports in either precision.

#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeed = 17;
constexpr std::uint32_t kBoxes = 200;

/// Bullet's slab test (btRayAabb2) as numbers: the box is hit where enter < lambdaMax and leave > 0, unless isMissed.
template <class Scalar>
struct Slabs
{
    Slabs(const RaySegment& ray, const Aabb& box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const auto origin = static_cast<Scalar>(ray.origin[axis]);
            const auto inverse = static_cast<Scalar>(ray.inverseDirection[axis]);
            const Scalar low = static_cast<Scalar>(box.min[axis]) - static_cast<Scalar>(ray.growMax[axis]);
            const Scalar high = static_cast<Scalar>(box.max[axis]) - static_cast<Scalar>(ray.growMin[axis]);
            const Scalar first = ((inverse < 0 ? high : low) - origin) * inverse;
            const Scalar last = ((inverse < 0 ? low : high) - origin) * inverse;
            isMissed = isMissed || (axis != 0 && (enter > last || first > leave));
            enter = axis == 0 ? first : std::max(enter, first);
            leave = axis == 0 ? last : std::min(leave, last);
        }
    }

    bool areHit(const RaySegment& ray) const
    {
        return !isMissed && enter < static_cast<Scalar>(ray.lambdaMax) && leave > 0;
    }

    Scalar enter = 0;
    Scalar leave = 0;
    bool isMissed = false;
};

/// Magnitudes of coordinates and of the swept box.
struct RayScale
{
    const char* name;
    float place;
    float growth;
};

std::ostream& operator<<(std::ostream& out, const RayScale& scale)
{
    return out << scale.name;
}

class QueryRays : public testing::TestWithParam<RayScale>
{
protected:
    QueryRays()
    {
        for (std::uint32_t i = 0; i < kBoxes; ++i)
        {
            const float half = random.between(0.1f, 2.0f), z = place(), y = place(), x = place();
            table.create(boxAt(x, y, z, half), i + 1, kEverything);
        }
    }

    float place() { return GetParam().place + random.between(-10, 10); }

    /// A ray that begins before a box on the first axis and runs approximately along it.
    RaySegment rayTo(const Aabb& box)
    {
        RaySegment ray = {};
        for (int axis = 0; axis < 3; ++axis)
        {
            ray.growMin[axis] = random.between(-GetParam().growth, 0);
            ray.growMax[axis] = random.between(0, GetParam().growth);
            const double middle =
                0.5 * (box.min[axis] - ray.growMax[axis] + box.max[axis] - ray.growMin[axis]);
            ray.origin[axis] = static_cast<float>(middle);
            const float tilt = random.chance(0.5f) ? 0.0f : random.between(-0.01f, 0.01f);
            ray.inverseDirection[axis] = tilt == 0.0f ? 1e18f : 1.0f / tilt;
        }
        ray.origin[0] = static_cast<float>(box.min[0] - ray.growMax[0] - 5.0);
        ray.inverseDirection[0] = 1.0f / random.between(0.9f, 1.0f);
        ray.lambdaMax = 100;
        return ray;
    }

    /// A ray to the middle of a box, with a direction that is not exact in float.
    static RaySegment rayFromTheOrigin(const Aabb& box)
    {
        RaySegment ray = {};
        double length = 0;
        for (int axis = 0; axis < 3; ++axis)
            length += std::pow(0.5 * (box.min[axis] + box.max[axis]), 2);
        for (int axis = 0; axis < 3; ++axis)
            ray.inverseDirection[axis] = 2 * std::sqrt(length) / (box.min[axis] + box.max[axis]);
        return ray;
    }

    /// A ray from the origin, in units of any length, that ends behind the face of a box by the last bit of a double.
    RaySegment rayThatJustReaches(const Aabb& box)
    {
        RaySegment ray = rayFromTheOrigin(box);
        const double unit = random.between(1, 2);
        for (double& inverse : ray.inverseDirection)
            inverse *= unit;
        ray.lambdaMax = std::nextafter(Slabs<double>(ray, box).enter, INFINITY);
        return ray;
    }

    /// Moves the origin next to the position where a parallel ray would touch the lower or upper face.
    void graze(RaySegment& ray, const Aabb& box)
    {
        const bool isLow = random.chance(0.5f);
        const double face = isLow ? box.min[1] - ray.growMax[1] : box.max[1] - ray.growMin[1];
        const double unit = std::max(std::abs(face), std::abs(ray.growMax[1] - ray.growMin[1])) * 0x1p-24;
        ray.origin[1] = static_cast<float>(face + unit * random.between(-4, 4));
        ray.inverseDirection[1] = 1e18f;
    }

    void expectAllHits(const QueryIndex& index, const RaySegment& ray)
    {
        std::vector<bool> isVisited(table.size(), false);
        index.forEachOnRay(ray, [&](ProxyId row) { isVisited[row] = true; });
        for (ProxyId row = 0; row < table.size(); ++row)
        {
            const Aabb& box = table.box(row);
            const bool isHit = Slabs<float>(ray, box).areHit(ray) || Slabs<double>(ray, box).areHit(ray);
            EXPECT_TRUE(isVisited[row] || !isHit) << "row " << row << " is missed";
        }
    }

    const Aabb& anyBox() { return table.box(random.below(table.size())); }

    ProxyTable table;
    Random random{kSeed};
};

constexpr QueryMode kModes[] = {QueryMode::Scan, QueryMode::Tree};

TEST_P(QueryRays, VisitBoxesThatRayGrazes)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::uint32_t grazed = 0;
    std::uint32_t doubtful = 0;
    for (const QueryMode mode : kModes)
    {
        const QueryIndex index(table, {mode, false});
        for (int i = 0; i < 2000 && !HasFailure(); ++i)
        {
            const Aabb& box = anyBox();
            RaySegment ray = rayTo(box);
            graze(ray, box);
            const bool isFloatHit = Slabs<float>(ray, box).areHit(ray);
            const bool isDoubleHit = Slabs<double>(ray, box).areHit(ray);
            grazed += isFloatHit || isDoubleHit ? 1 : 0;
            doubtful += isFloatHit != isDoubleHit ? 1 : 0;
            expectAllHits(index, ray);
        }
    }
    EXPECT_GT(grazed, 500u);
    EXPECT_GT(doubtful, 20u) << "no ray came so near to a face that rounding decides";
}

TEST_P(QueryRays, VisitBoxesAtWhichRayEnds)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::uint32_t reached = 0;
    std::uint32_t doubtful = 0;
    for (const QueryMode mode : kModes)
    {
        const QueryIndex index(table, {mode, false});
        for (int i = 0; i < 4000 && !HasFailure(); ++i)
        {
            const Aabb& box = anyBox();
            RaySegment ray = i % 2 == 0 ? rayTo(box) : rayFromTheOrigin(box);
            ray.lambdaMax = Slabs<double>(ray, box).enter * (1.0 + 0x1p-23 * random.between(-1, 1));
            const bool isFloatHit = Slabs<float>(ray, box).areHit(ray);
            const bool isDoubleHit = Slabs<double>(ray, box).areHit(ray);
            reached += isFloatHit || isDoubleHit ? 1 : 0;
            doubtful += isFloatHit != isDoubleHit ? 1 : 0;
            expectAllHits(index, ray);
        }
    }
    EXPECT_GT(reached, 500u);
    EXPECT_GT(doubtful, 20u) << "no ray ended so near to a face that rounding decides";
}

// For a ray from the origin the index widens no slab. Its inverse direction and the product with it, rounded to float,
// may put a face behind the end; only the tolerance of the length covers that.
TEST_P(QueryRays, VisitBoxesThatRayReachesByLessThanFloatPrecision)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    for (const QueryMode mode : kModes)
    {
        std::uint32_t reached = 0;
        const QueryIndex index(table, {mode, false});
        for (int i = 0; i < 20000 && !HasFailure(); ++i)
        {
            const Aabb& box = anyBox();
            const RaySegment ray = rayThatJustReaches(box);
            const bool isReached = Slabs<double>(ray, box).areHit(ray);
            if (!isReached || Slabs<float>(ray, box).enter <= roundUpToFloat(ray.lambdaMax))
                continue;
            ++reached;
            expectAllHits(index, ray);
        }
        EXPECT_GT(reached, 10u) << "no float is behind the end of a ray that reaches a box";
    }
}

INSTANTIATE_TEST_SUITE_P(Scales, QueryRays,
                         testing::Values(RayScale{"Near", 0, 0.3f}, RayScale{"LargeSweep", 0, 1000},
                                         RayScale{"FarAway", 3e5f, 0.3f},
                                         RayScale{"LargeSweepFarAway", 1e4f, 2e4f}),
                         [](const auto& test) { return test.param.name; });
}  // namespace
}  // namespace cullet::test
