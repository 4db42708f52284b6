// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/c_interface/call_check.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/hulls/lattice_oracle.h"
#include "cullet/tests/support/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
/// Calls with a few hulls of lattice points and one cache. tests/fuzz/fuzz_hulls.cpp examines the answers more closely.
class HullCalls
{
public:
    explicit HullCalls(CallCheck& check) : m_check(check)
    {
        for (std::uint8_t i = 0; i < kHulls; ++i)
        {
            const std::uint8_t bytes[] = {i, 12, i};  // which hull, points, and their seed
            Choices choices(bytes, sizeof bytes);
            create(choices);
        }
    }
    HullCalls(const HullCalls&) = delete;
    HullCalls& operator=(const HullCalls&) = delete;
    ~HullCalls()
    {
        for (Entry& entry : m_hulls)
            cullet_hull_destroy(entry.hull);
        cullet_hull_cache_destroy(m_cache);
    }

    /// Replaces a hull, or a failed call leaves none.
    void create(Choices& choices)
    {
        Entry& entry = m_hulls[choices.below(kHulls)];
        cullet_hull_destroy(entry.hull);
        entry = {};
        const std::uint32_t count = choices.below(13);
        entry.points = anyPoints(choices, count);
        Faults faults;
        const std::size_t strides[] = {0, 24, 25, 32, 23, 1};
        const std::size_t stride = strides[choices.chance(64) ? choices.below(6) : 0];
        faults.add(stride != 0 && stride < 24, CULLET_ERROR_SIZE);
        std::vector<unsigned char> bytes = bytesOf(entry.points, stride < 24 ? 24 : stride);
        if (count > 0 && choices.chance(24))
        {
            const double strange[] = {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, 1.01e60, -1e300};
            std::memcpy(bytes.data() + 8 * choices.below(3), &strange[choices.below(4)], 8);
            faults.add(true, CULLET_ERROR_NOT_FINITE);
        }
        std::uint32_t asked = count;
        faults.add(count == 0, CULLET_ERROR_ARGUMENT);
        if (faults.add(choices.chance(8), CULLET_ERROR_ARGUMENT))
            asked = (1u << 24) + 1;
        const bool hasPoints = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        const bool hasHull = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        const auto* data = reinterpret_cast<const double*>(bytes.data());
        const cullet_status status =
            cullet_hull_create(hasPoints ? data : nullptr, stride, asked, hasHull ? &entry.hull : nullptr);
        m_check.expect("cullet_hull_create()", status, faults);
        m_check.require((entry.hull != nullptr) == !faults.any(), "cullet_hull_create()",
                        "sets a wrong handle");
        const std::uint32_t vertices = cullet_hull_vertex_count(entry.hull);
        const bool isRight = faults.any() ? vertices == 0 : vertices >= 1 && vertices <= count;
        m_check.require(isRight, "cullet_hull_vertex_count()", "is " + std::to_string(vertices));
    }

    void changeCache(Choices& choices)
    {
        cullet_hull_cache_destroy(m_cache);
        m_cache = nullptr;
        if (choices.chance(64))
            return;
        Faults faults;
        const bool hasOut = !faults.add(choices.chance(32), CULLET_ERROR_NULL);
        m_check.expect("cullet_hull_cache_create()", cullet_hull_cache_create(hasOut ? &m_cache : nullptr),
                       faults);
        m_check.require((m_cache != nullptr) == hasOut, "cullet_hull_cache_create()", "sets a wrong handle");
    }

    void query(Choices& choices)
    {
        Faults faults;
        const std::uint32_t bits = choices.below(27), kind = bits % 3;
        const Entry& a = m_hulls[bits / 3 % kHulls];
        const Entry& b = m_hulls[bits / 9 % kHulls];
        faults.add(a.hull == nullptr || b.hull == nullptr, CULLET_ERROR_NULL);
        const Placed placedA = place(choices, a, faults), placedB = place(choices, b, faults);
        const bool isExact = !faults.any();
        const LatticeTruth truth = isExact ? solveLattice(placedA.points, placedB.points) : LatticeTruth();
        if (kind == 0)
            overlap(choices, a, b, placedA, placedB, faults, truth);
        else
            measure(choices, kind == 1, a, b, placedA, placedB, faults, truth);
    }

private:
    static constexpr std::uint32_t kHulls = 3;
    static constexpr double kStep = 0.125;

    struct Entry
    {
        cullet_hull* hull = nullptr;
        LatticePoints points;  ///< in steps
    };

    struct Placed
    {
        cullet_pose pose;
        bool isIdentity;
        LatticePoints points;
        const cullet_pose* pointer() const { return isIdentity ? nullptr : &pose; }
    };

    static LatticePoints anyPoints(Choices& choices, std::uint32_t count)
    {
        LatticePoints points;
        Random random(choices.below(65536));
        const std::uint32_t span = 2 + random.below(7);
        for (std::uint32_t i = 0; i < count; ++i)
        {
            Lattice& point = points.emplace_back();
            for (std::int64_t& component : point)
                component = 8 * static_cast<std::int64_t>(random.below(span));
        }
        return points;
    }

    static std::vector<unsigned char> bytesOf(const LatticePoints& points, std::size_t stride)
    {
        std::vector<unsigned char> bytes(stride * (points.size() + 1), 0xee);
        for (std::size_t i = 0; i < points.size(); ++i)
        {
            for (std::size_t axis = 0; axis < 3; ++axis)
            {
                const double value = static_cast<double>(points[i][axis]) * kStep;
                std::memcpy(bytes.data() + i * stride + axis * sizeof value, &value, sizeof value);
            }
        }
        return bytes;
    }

    /// A pose whose basis permutes axes, or none, or a wrong one.
    static Placed place(Choices& choices, const Entry& entry, Faults& faults)
    {
        Placed placed = {};
        const std::uint32_t bits = choices.below(24), turn = bits / 8, sign = bits % 8;
        const std::uint32_t kind = choices.below(32);
        placed.isIdentity = kind == 30;
        Lattice origin = {};
        for (std::size_t row = 0; row < 3; ++row)
        {
            origin[row] = static_cast<std::int64_t>(choices.byte() ^ 0x80u) - 128;
            placed.pose.origin[row] = static_cast<double>(origin[row]) * kStep;
            placed.pose.basis[3 * row + (row + turn) % 3] = (sign >> row & 1u) != 0 ? -1 : 1;
        }
        for (const Lattice& point : entry.points)
        {
            Lattice moved = point;
            for (std::size_t row = 0; row < 3 && !placed.isIdentity; ++row)
                moved[row] = origin[row] + ((sign >> row & 1u) != 0 ? -1 : 1) * point[(row + turn) % 3];
            placed.points.push_back(moved);
        }
        if (kind == 31)
        {
            placed.pose.origin[turn] = std::numeric_limits<double>::quiet_NaN();
            faults.add(true, CULLET_ERROR_NOT_FINITE);
        }
        else if (kind == 29)
        {
            std::fill(placed.pose.basis + 3, placed.pose.basis + 6, 0.0);
            faults.add(true, CULLET_ERROR_ARGUMENT);
        }
        return placed;
    }

    /// Whether the state may be either, since the shapes nearly touch.
    static bool isUndecided(const LatticeTruth& truth)
    {
        return truth.isSeparated ? truth.distance < 1e-6L * truth.size : truth.depth < 1e-6L * truth.size;
    }

    void overlap(Choices& choices, const Entry& a, const Entry& b, const Placed& placedA,
                 const Placed& placedB, Faults& faults, const LatticeTruth& truth)
    {
        std::int32_t overlaps = -7;
        double axis[3] = {7, 7, 7};
        const bool hasAxis = !choices.chance(32);
        const bool hasOut = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        const cullet_status status =
            cullet_hull_overlap(a.hull, placedA.pointer(), b.hull, placedB.pointer(), m_cache,
                                hasOut ? &overlaps : nullptr, hasAxis ? axis : nullptr);
        if (!m_check.expect("cullet_hull_overlap()", status, faults))
        {
            m_check.require(overlaps == -7 && axis[0] == 7, "cullet_hull_overlap()",
                            "writes in a failed call");
            return;
        }
        m_check.require(isUndecided(truth) ? overlaps == 0 || overlaps == 1 : overlaps == !truth.isSeparated,
                        "cullet_hull_overlap()", "says " + std::to_string(overlaps));
        const Vector3<long double> along = {axis[0], axis[1], axis[2]};
        if (hasAxis && overlaps == 1)
            m_check.require(isZero(along), "cullet_hull_overlap()", "has an axis for an overlap");
        else if (hasAxis)
            m_check.require(!isZero(along) && gapAlong(placedA, placedB, along) > -1e-12L * truth.size,
                            "cullet_hull_overlap()", "has an axis that does not separate");
    }

    /// In steps.
    static long double gapAlong(const Placed& a, const Placed& b, const Vector3<long double>& axis)
    {
        const auto toLong = [](const LatticePoints& points)
        {
            std::vector<Vector3<long double>> converted;
            for (const Lattice& p : points)
                converted.push_back({static_cast<long double>(p[0]), static_cast<long double>(p[1]),
                                     static_cast<long double>(p[2])});
            return converted;
        };
        return (lowest(toLong(a.points), axis) - highest(toLong(b.points), axis)) / lengthOf(axis);
    }

    void measure(Choices& choices, bool isDistance, const Entry& a, const Entry& b, const Placed& placedA,
                 const Placed& placedB, Faults& faults, const LatticeTruth& truth)
    {
        const char* const name = isDistance ? "cullet_hull_distance()" : "cullet_hull_penetration()";
        constexpr std::uint32_t kSize = sizeof(cullet_hull_result);
        const std::uint32_t sizes[] = {kSize, kSize + 16, kSize - 1, 0};
        Sized<cullet_hull_result> result(sizes[choices.chance(32) ? choices.below(4) : 0], 0xcd);
        const double limits[] = {HUGE_VAL, 1, 0, 8, -1, std::numeric_limits<double>::quiet_NaN()};
        const double limit = limits[choices.below(choices.chance(24) ? 6 : 4)];
        const bool hasOut = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        faults.add(hasOut && result.known.size < kSize, CULLET_ERROR_SIZE);
        faults.add(isDistance && !(limit >= 0), CULLET_ERROR_ARGUMENT);
        const Sized<cullet_hull_result> before = result;
        cullet_hull_result* const out = hasOut ? &result.known : nullptr;
        const cullet_status status = isDistance ? cullet_hull_distance(a.hull, placedA.pointer(), b.hull,
                                                                       placedB.pointer(), limit, m_cache, out)
                                                : cullet_hull_penetration(a.hull, placedA.pointer(), b.hull,
                                                                          placedB.pointer(), m_cache, out);
        if (!m_check.expect(name, status, faults))
        {
            m_check.require(result == before, name, "writes in a failed call");
            return;
        }
        m_check.require(std::memcmp(result.later, before.later, sizeof result.later) == 0 &&
                            result.known.size == before.known.size,
                        name, "writes members that it does not know");
        checkResult(name, result.known, isDistance ? limit : 0, isDistance, truth);
    }

    void checkResult(const char* name, const cullet_hull_result& result, double limit, bool isDistance,
                     const LatticeTruth& truth)
    {
        const auto distance = static_cast<double>(truth.distance) * kStep,
                   depth = static_cast<double>(truth.depth) * kStep;
        const double tolerance = 1e-6 * static_cast<double>(truth.size) * kStep;
        const bool isOpen = isUndecided(truth) || std::abs(distance - limit) < tolerance;
        const std::int32_t state = !truth.isSeparated  ? CULLET_OVERLAPPING
                                   : distance <= limit ? CULLET_NEAR
                                                       : CULLET_SEPARATED;
        m_check.require(isOpen ? result.state >= 0 && result.state <= 2 : result.state == state, name,
                        "has state " + std::to_string(result.state) + ", not " + std::to_string(state));
        double expected = 0;
        if (result.state == CULLET_NEAR)
            expected = distance;
        else if (result.state == CULLET_OVERLAPPING && !isDistance)
            expected = -depth;
        m_check.require(std::abs(result.distance - expected) <= tolerance, name,
                        "is " + std::to_string(result.distance) + ", not " + std::to_string(expected));
        const bool hasPoints =
            result.state == CULLET_NEAR || (result.state == CULLET_OVERLAPPING && !isDistance);
        for (std::size_t i = 0; i < 3; ++i)
        {
            const double between = result.point_a[i] - result.point_b[i];
            m_check.require(std::abs(between - result.distance * result.axis[i]) <= tolerance, name,
                            "has points that differ from distance and axis");
            m_check.require(hasPoints || (result.point_a[i] == 0 && result.point_b[i] == 0), name,
                            "has points of no meaning");
        }
    }

    CallCheck& m_check;
    Entry m_hulls[kHulls];
    cullet_hull_cache* m_cache = nullptr;
};
}  // namespace cullet::test
