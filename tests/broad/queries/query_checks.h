// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

/// Boxes, rays and brute force for the tests of queries.
namespace cullet::test
{
inline constexpr float kInf = std::numeric_limits<float>::infinity();
inline constexpr Filter kFilter = {1, -1};

inline const QueryOptions kAllOptions[] = {{QueryMode::Automatic, false}, {QueryMode::Scan, false},
                                           {QueryMode::Tree, false},      {QueryMode::Automatic, true},
                                           {QueryMode::Scan, true},       {QueryMode::Tree, true}};

inline Aabb cube(float x, float y, float z, float half)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

class QueryRandom
{
public:
    explicit QueryRandom(unsigned seed) : m_engine(seed) {}
    float uniform(float low, float high)
    {
        return low + (high - low) * static_cast<float>(m_engine() * 0x1p-32);
    }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(m_engine() % n); }

private:
    std::mt19937 m_engine;
};

/// The coordinates are drawn in the order in which GCC evaluates arguments, which recorded counts rely on.
inline Aabb anyCube(QueryRandom& random, float low, float high, float half)
{
    const float z = random.uniform(low, high), y = random.uniform(low, high), x = random.uniform(low, high);
    return cube(x, y, z, half);
}

/// Runs a query and fails on a row that is reported twice.
template <class Query>
std::vector<ProxyId> collect(const ProxyTable& table, Query query)
{
    std::vector<ProxyId> rows;
    std::vector<bool> seen(table.size(), false);
    query(
        [&](ProxyId row)
        {
            EXPECT_FALSE(seen[row]) << "row " << row << " twice";
            seen[row] = true;
            rows.push_back(row);
        });
    std::sort(rows.begin(), rows.end());
    return rows;
}

/// The candidates that pass the caller's exact test.
inline std::vector<ProxyId> overlapping(const ProxyTable& table, const QueryIndex& index, const Aabb& box)
{
    std::vector<ProxyId> rows = collect(table, [&](auto visit) { index.forEachOverlap(box, visit); });
    rows.erase(
        std::remove_if(rows.begin(), rows.end(), [&](ProxyId row) { return !overlaps(table.box(row), box); }),
        rows.end());
    return rows;
}

inline std::vector<ProxyId> onRay(const ProxyTable& table, const QueryIndex& index, const RaySegment& ray)
{
    return collect(table, [&](auto visit) { index.forEachOnRay(ray, visit); });
}

inline std::vector<ProxyId> overlappingByBruteForce(const ProxyTable& table, const Aabb& box)
{
    std::vector<ProxyId> rows;
    for (ProxyId row = 0; row < table.size(); ++row)
    {
        if (isValid(box) && isValid(table.box(row)) && overlaps(table.box(row), box))
            rows.push_back(row);
    }
    return rows;
}

/// The box test of Bullet's tree, in its order of comparisons and in the precision of either Bullet build.
template <class Scalar>
bool bulletHits(const RaySegment& ray, const Aabb& box)
{
    Scalar enter[3];
    Scalar leave[3];
    for (int axis = 0; axis < 3; ++axis)
    {
        const Scalar origin = static_cast<Scalar>(ray.origin[axis]);
        const Scalar inverse = static_cast<Scalar>(ray.inverseDirection[axis]);
        const Scalar low = static_cast<Scalar>(box.min[axis]) - static_cast<Scalar>(ray.growMax[axis]);
        const Scalar high = static_cast<Scalar>(box.max[axis]) - static_cast<Scalar>(ray.growMin[axis]);
        enter[axis] = ((inverse < 0 ? high : low) - origin) * inverse;
        leave[axis] = ((inverse < 0 ? low : high) - origin) * inverse;
    }
    Scalar first = enter[0];
    Scalar last = leave[0];
    for (int axis = 1; axis < 3; ++axis)
    {
        if (first > leave[axis] || enter[axis] > last)
            return false;
        if (enter[axis] > first)
            first = enter[axis];
        if (leave[axis] < last)
            last = leave[axis];
    }
    return first < static_cast<Scalar>(ray.lambdaMax) && last > 0;
}

inline RaySegment rayAlong(const float* origin, const float* direction, double lambdaMax)
{
    RaySegment ray = {};
    for (int axis = 0; axis < 3; ++axis)
    {
        ray.origin[axis] = origin[axis];
        // Prepared as in Bullet's float build; a direction of -0 is parallel with a positive sign.
        ray.inverseDirection[axis] = direction[axis] == 0.0f ? 1e18f : 1.0f / direction[axis];
    }
    ray.lambdaMax = lambdaMax;
    return ray;
}

/// Boxes on a coarse lattice, so that rays along faces and corners are frequent, including all special kinds.
inline Aabb randomBox(QueryRandom& random)
{
    const std::uint32_t kind = random.below(40);
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float corner = static_cast<float>(random.below(24)) - 12.0f;
        const float size = kind < 20 ? static_cast<float>(random.below(3)) : random.uniform(0.0f, 2.0f);
        box.min[axis] = kind < 20 ? corner : random.uniform(-12.0f, 12.0f);
        box.max[axis] = box.min[axis] + size;
    }
    if (kind == 30)
        box.min[random.below(3)] = kNan;
    if (kind == 31)
        std::swap(box.min[1], box.max[1]), box.min[1] += 1.0f;
    if (kind == 32)
        box.min[0] = -1e18f, box.max[0] = 1e18f, box.min[2] = -1e18f, box.max[2] = 1e18f;
    if (kind == 33)
        box.max[random.below(3)] = kInf;
    if (kind == 34)
        box.min[1] = -1e30f;
    if (kind == 35)
        box.max[0] += 50.0f;
    return box;
}

inline RaySegment randomRay(QueryRandom& random)
{
    float origin[3];
    float direction[3];
    const std::uint32_t kind = random.below(16);
    for (int axis = 0; axis < 3; ++axis)
    {
        const bool onLattice = kind < 8;
        origin[axis] =
            onLattice ? static_cast<float>(random.below(28)) - 14.0f : random.uniform(-14.0f, 14.0f);
        direction[axis] =
            kind % 4 == 0 ? static_cast<float>(random.below(3)) - 1.0f : random.uniform(-1.0f, 1.0f);
        if (kind == 1 && random.below(2) == 0)
            direction[axis] = -0.0f;
    }
    const float length =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (float& d : direction)
        d = length == 0.0f ? 0.0f : d / length;
    RaySegment ray = rayAlong(origin, direction, random.below(4) == 0 ? random.uniform(0.0f, 5.0f) : 40.0);
    if (kind == 2 || length == 0.0f)  // a sweep of length 0
    {
        ray.lambdaMax = 0.0;
        for (double& inverse : ray.inverseDirection)
            inverse = 1e18;
    }
    if (kind == 3)
        ray.origin[random.below(3)] = random.below(2) == 0 ? 1e18 : -1e18;
    if (kind == 5)
    {
        for (double& inverse : ray.inverseDirection)
        {
            if (std::abs(inverse) > 1e17)
                inverse = random.below(2) == 0 ? 1e30 : -1e30;
        }
    }
    if (random.below(2) == 0)  // a sweep of a box whose origin is not in its middle
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            ray.growMin[axis] = -0.5 * random.below(4);
            ray.growMax[axis] = 0.25 * random.below(8);
        }
    }
    return ray;
}
/// Counts over all rays of a test; the lower and upper bounds ensure a representative sample.
struct RayCount
{
    std::uint64_t checks = 0;
    std::uint64_t hits = 0;
    std::uint64_t extras = 0;  // candidates that neither precision of Bullet reports
};

inline void checkRay(const ProxyTable& table, const QueryIndex& index, const RaySegment& ray, RayCount& count)
{
    const std::vector<ProxyId> rows = onRay(table, index, ray);
    auto row = rows.begin();
    for (ProxyId i = 0; i < table.size(); ++i)
    {
        const bool isVisited = row != rows.end() && *row == i;
        if (isVisited)
            ++row;
        const bool isHit = isValid(table.box(i)) &&
                           (bulletHits<float>(ray, table.box(i)) || bulletHits<double>(ray, table.box(i)));
        ASSERT_TRUE(isVisited || !isHit) << "row " << i << " is missed";
        ASSERT_TRUE(!isVisited || isValid(table.box(i))) << "row " << i << " is empty";
        count.hits += isHit ? 1 : 0;
        count.extras += isVisited && !isHit ? 1 : 0;
        ++count.checks;
    }
}
}  // namespace cullet::test
