// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_lists.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

namespace cullet::test
{
/// The result of a delta search for one set of boxes.
struct FoundDeltas
{
    std::vector<RowPair> kept, added, removed;
};

/// Checks a delta search from one set of boxes to the next against brute force.
class DeltaOracle
{
public:
    /// @param before initial pairs
    explicit DeltaOracle(Pairs before = {}) : m_before(std::move(before)) {}

    void expect(const std::vector<Aabb>& boxes, const FoundDeltas& found)
    {
        const Pairs now = everyPair(boxes);
        EXPECT_EQ(inOrder(found.kept), both(m_before, now));
        EXPECT_EQ(inOrder(found.added), butFor(now, m_before));
        EXPECT_EQ(inOrder(found.removed), butFor(m_before, now));
        m_kept += found.kept.size();
        m_added += found.added.size();
        m_removed += found.removed.size();
        m_before = now;
    }
    /// The next set is compared with an empty one.
    void forget() { m_before.clear(); }

    std::uint64_t kept() const { return m_kept; }
    std::uint64_t added() const { return m_added; }
    std::uint64_t removed() const { return m_removed; }

private:
    static Pairs both(const Pairs& a, const Pairs& b)
    {
        Pairs pairs;
        std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(pairs));
        return pairs;
    }
    static Pairs butFor(const Pairs& a, const Pairs& b)
    {
        Pairs pairs;
        std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(pairs));
        return pairs;
    }

    Pairs m_before;
    std::uint64_t m_kept = 0, m_added = 0, m_removed = 0;
};

/// Adds boxes that move so little that most pairs stay for many sets, and stop at times.
inline void creep(std::vector<Aabb> boxes, int steps, std::uint32_t seed,
                  std::vector<std::vector<Aabb>>& sets)
{
    Random random(seed);
    for (int step = 0; step < steps; ++step)
    {
        const float farthest = step % 5 == 4 ? 0.0f : step % 2 == 0 ? 0.02f : 1e-4f;
        for (Aabb& box : boxes)
            for (int axis = 0; axis < 3; ++axis)
            {
                const float way = random.between(-farthest, farthest);
                box.min[axis] += way;
                box.max[axis] += way;
            }
        sets.push_back(boxes);
    }
}

/// Boxes that drift, teleport, are created, destroyed, creep, are empty, unbounded or NaN, and for a while all empty.
inline std::vector<std::vector<Aabb>> changingBoxes(std::uint32_t count, std::uint32_t seed)
{
    std::vector<std::vector<Aabb>> sets;
    BoxScene drifting(SceneKind::Uniform, count, seed);
    BoxScene jumping(SceneKind::Teleport, count, seed + 1);
    const auto drift = [&](int steps)
    {
        for (int step = 0; step < steps; ++step, drifting.step())
            sets.push_back(drifting.boxes());
    };
    drift(8);
    for (int step = 0; step < 4; ++step, jumping.step())
        sets.push_back(jumping.boxes());
    drift(4);
    std::vector<Aabb> strange = drifting.boxes();
    strange[1] = {{-kInfinity, -kInfinity, -1}, {kInfinity, kInfinity, 1}};
    strange[2] = {{kNan, 0, 0}, {1, 1, 1}};
    strange[3] = cube(1, -1);
    strange[4] = cube(-1e6f, 1e6f);
    sets.push_back(strange);
    strange[3] = cube(-1, 2);
    std::swap(strange[1], strange[2]);
    sets.push_back(strange);
    for (const std::uint32_t fewer : {count * 9 / 10, count / 3, count, 0u, 0u, count / 2})
    {
        drifting.step();
        sets.emplace_back(drifting.boxes().begin(), drifting.boxes().begin() + fewer);
    }
    drift(4);
    sets.emplace_back(count / 4, cube(0, 1));
    drift(6);
    creep(strange, 30, seed, sets);
    return sets;
}

/// Runs a delta search on one set after the other.
///
/// @param search search(boxes) returns FoundDeltas
template <class Search>
void expectChanges(const std::vector<std::vector<Aabb>>& sets, const Search& search)
{
    DeltaOracle oracle;
    for (std::size_t set = 0; set < sets.size(); ++set)
    {
        SCOPED_TRACE("set " + std::to_string(set));
        oracle.expect(sets[set], search(sets[set]));
        if (testing::Test::HasFatalFailure() || testing::Test::HasNonfatalFailure())
            return;
    }
    EXPECT_GT(oracle.kept(), 5 * sets.front().size());
    EXPECT_GT(oracle.added(), 2 * sets.front().size());
    EXPECT_GT(oracle.removed(), 2 * sets.front().size());
}
}  // namespace cullet::test
