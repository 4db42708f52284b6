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

    /// One to five pairs at once.
    void queryBatch(Choices& choices)
    {
        Faults faults;
        const Batch batch = makeBatch(choices, faults);
        constexpr std::uint32_t kSize = sizeof(cullet_hull_batch);
        const std::uint32_t sizes[] = {kSize, kSize + 16, kSize - 1, 0};
        Sized<cullet_hull_batch> given(sizes[choices.chance(32) ? choices.below(4) : 0]);
        const std::uint32_t size = given.known.size;
        given.known = batch.known;
        given.known.size = size;
        given.known.a = {batch.hulls, batch.poses.data(), kHulls, 0};
        given.known.b = {batch.hulls, batch.poses.data() + kHulls, kHulls, 0};
        given.known.pairs = batch.pairs.data();
        faults.add(size < kSize, CULLET_ERROR_SIZE);
        const bool hasBatch = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        std::vector<std::int32_t> states(batch.pairs.size(), -7);
        std::vector<double> distances(batch.pairs.size(), -7), axes(3 * states.size(), -7);
        std::vector<double> pointsOfA(axes), pointsOfB(axes);
        cullet_hull_results results = {};
        results.size = sizeof results;
        results.states = states.data();
        results.distances = distances.data();
        results.axes = axes.data();
        results.points_a = pointsOfA.data();
        results.points_b = pointsOfB.data();
        const cullet_status status = cullet_hull_query_batch(hasBatch ? &given.known : nullptr, &results);
        if (!m_check.expect(kBatchName, status, faults))
        {
            const bool isUntouched =
                std::count(states.begin(), states.end(), -7) == static_cast<std::ptrdiff_t>(states.size());
            m_check.require(isUntouched, kBatchName, "writes in a failed call");
            return;
        }
        for (std::size_t i = 0; i < states.size(); ++i)
        {
            cullet_hull_result result = {};
            result.state = states[i];
            result.distance = distances[i];
            std::copy_n(&axes[3 * i], 3, result.axis);
            std::copy_n(&pointsOfA[3 * i], 3, result.point_a);
            std::copy_n(&pointsOfB[3 * i], 3, result.point_b);
            checkPair(batch, i, result);
        }
    }

private:
    static constexpr std::uint32_t kHulls = 3;
    static constexpr const char* kBatchName = "cullet_hull_query_batch()";
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

    /// Every hull at a pose for each side, and pairs of them.
    struct Batch
    {
        cullet_hull_batch known = {};
        const cullet_hull* hulls[kHulls] = {};
        std::vector<Placed> placed;  ///< of A, then of B
        std::vector<cullet_pose> poses;
        std::vector<cullet_pair> pairs;
    };

    Batch makeBatch(Choices& choices, Faults& faults)
    {
        Batch batch;
        const double limits[] = {HUGE_VAL, 1, 0, 8, -1, std::numeric_limits<double>::quiet_NaN()};
        const std::int32_t threads[] = {1, 2, -1, 4097};
        batch.known.query = static_cast<std::int32_t>(choices.below(choices.chance(16) ? 5 : 4));
        batch.known.max_distance = limits[choices.below(choices.chance(24) ? 6 : 4)];
        batch.known.threads = threads[choices.below(choices.chance(16) ? 4 : 2)];
        faults.add(batch.known.query == 4, CULLET_ERROR_ARGUMENT);
        faults.add(!(batch.known.max_distance >= 0), CULLET_ERROR_ARGUMENT);
        faults.add(batch.known.threads < 0 || batch.known.threads > 4096, CULLET_ERROR_ARGUMENT);
        Random random(choices.below(65536));
        placeBodies(random, choices.chance(64), batch, faults);
        for (std::uint32_t left = 1 + choices.below(5); left > 0; --left)
        {
            const std::uint32_t first = random.below(kHulls), second = random.below(kHulls);
            batch.pairs.push_back({first, second});
        }
        if (faults.add(choices.chance(16), CULLET_ERROR_ARGUMENT))
            (choices.chance(128) ? batch.pairs[0].first : batch.pairs[0].second) = kHulls;
        batch.known.pair_count = batch.pairs.size();
        return batch;
    }

    /// @param mayBeWrong whether wrong poses are among them
    void placeBodies(Random& random, bool mayBeWrong, Batch& batch, Faults& faults)
    {
        for (std::uint32_t i = 0; i < kHulls; ++i)
        {
            batch.hulls[i] = m_hulls[i].hull;
            faults.add(m_hulls[i].hull == nullptr, CULLET_ERROR_NULL);
        }
        while (batch.placed.size() < 2 * kHulls)
        {
            // What place() reads: a turn, one of the kinds, and an origin.
            std::uint8_t bytes[5];
            for (std::uint8_t& byte : bytes)
                byte = static_cast<std::uint8_t>(random.below(256));
            if (!mayBeWrong)
                bytes[1] = 0;
            Choices choices(bytes, sizeof bytes);
            Placed placed = place(choices, m_hulls[batch.placed.size() % kHulls], faults);
            if (placed.isIdentity)
                placed.pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}};
            batch.placed.push_back(placed);
            batch.poses.push_back(placed.pose);
        }
    }

    /// Against what the pair is in integers.
    void checkPair(const Batch& batch, std::size_t index, const cullet_hull_result& result)
    {
        const Placed& a = batch.placed[batch.pairs[index].first];
        const Placed& b = batch.placed[kHulls + batch.pairs[index].second];
        const LatticeTruth truth = solveLattice(a.points, b.points);
        const std::int32_t query = batch.known.query;
        if (query != CULLET_QUERY_OVERLAP)
        {
            const bool hasLimit = query != CULLET_QUERY_PENETRATION;
            checkResult(kBatchName, result, hasLimit ? batch.known.max_distance : 0,
                        query == CULLET_QUERY_DISTANCE, truth);
            return;
        }
        const std::int32_t state = truth.isSeparated ? CULLET_SEPARATED : CULLET_OVERLAPPING;
        m_check.require(result.state == state || (isUndecided(truth) && result.state != CULLET_NEAR),
                        kBatchName, "has state " + std::to_string(result.state));
        const Vector3<long double> along = {result.axis[0], result.axis[1], result.axis[2]};
        if (result.state == CULLET_SEPARATED)
            m_check.require(!isZero(along) && gapAlong(a, b, along) > -1e-12L * truth.size, kBatchName,
                            "has an axis that does not separate");
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
