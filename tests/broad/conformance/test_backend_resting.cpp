// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The contract of every backend while most boxes rest, where some backends keep lists of the pairs that can change.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
namespace
{
constexpr float kRestingMargin = 0.1f;

/// Forty boxes far from each other and from the origin, of which the first one jitters in every step.
class BackendResting : public BackendTest
{
protected:
    BackendResting()
    {
        session.margin = kRestingMargin;
        for (int i = 0; i < 40; ++i)
            session.add(boxAt(3.0f * static_cast<float>(i), 50, 0));
    }

    testing::AssertionResult step()
    {
        m_tremble = -m_tremble;
        session.table.setBox(0, boxAt(m_tremble, 50, 0));
        return session.step();
    }

    /// Enough updates for backends to treat the other boxes as resting.
    testing::AssertionResult rest()
    {
        for (int update = 0; update < 4; ++update)
        {
            if (auto result = step(); !result)
                return result;
        }
        return step();
    }

    /// Moves a box along an axis, and updates.
    testing::AssertionResult move(ProxyId row, int axis, float way)
    {
        Aabb box = session.table.box(row);
        box.min[axis] += way;
        box.max[axis] += way;
        session.table.setBox(row, box);
        return step();
    }

    BackendSession session{GetParam().make()};

private:
    float m_tremble = 1.0f / 1024;
};

CULLET_ON_EVERY_BACKEND(BackendResting);

TEST_P(BackendResting, RemovesPairsWhenMarginShrinksAndAddsNoneWhenItGrows)
{
    // Pairs kept by the margin only, with gaps of up to twice the margin.
    std::vector<ProxyId> parting;
    for (int i = 0; i < 12; ++i)
    {
        session.add(boxAt(3.0f * static_cast<float>(i), 0, 0));
        parting.push_back(session.add(boxAt(3.0f * static_cast<float>(i), 1, 0)));
    }
    ASSERT_TRUE(step());
    for (std::size_t i = 0; i < parting.size(); ++i)
        session.table.setBox(parting[i], translated(session.table.box(parting[i]), 0,
                                                    2 * kRestingMargin * static_cast<float>(i) / 11.5f, 0));
    ASSERT_TRUE(rest());
    ASSERT_EQ(session.pairs().size(), 12u);
    for (const float margin : {0.6f * kRestingMargin, 0.3f * kRestingMargin})
    {
        session.margin = margin;
        ASSERT_TRUE(step());
        EXPECT_GE(session.delta().removed.size(), 3u);
        ASSERT_TRUE(rest());
    }
    // A larger margin adds no pair, and keeps existing pairs longer.
    session.margin = 2 * kRestingMargin;
    ASSERT_TRUE(step());
    EXPECT_TRUE(session.reported({}, {}));
    for (int update = 0; update < 10; ++update)
        ASSERT_TRUE(move(parting[1], 1, 0.4f * kRestingMargin));
    EXPECT_EQ(session.removedTotal(), 9u);
}

TEST_P(BackendResting, AddsReturningPairOnlyWhenFilterAcceptsItAgain)
{
    session.add(boxAt(0, 0, 0));
    const ProxyId other = session.add(boxAt(0, 0.95f, 0));
    ASSERT_TRUE(rest());
    ASSERT_EQ(session.pairs().size(), 1u);
    session.table.setFilter(other, {1, 0});
    ASSERT_TRUE(rest());
    ASSERT_EQ(session.pairs().size(), 1u);
    ASSERT_TRUE(move(other, 1, 0.04f));
    ASSERT_TRUE(move(other, 1, 0.008f));
    EXPECT_EQ(session.removedTotal(), 0u);
    ASSERT_TRUE(move(other, 1, 0.25f));
    EXPECT_EQ(session.removedTotal(), 1u);
    ASSERT_TRUE(move(other, 1, -0.26f));
    EXPECT_TRUE(session.reported({}, {}));
    // The pair enters as soon as the filter words allow it.
    session.table.setFilter(other, kEverything);
    ASSERT_TRUE(step());
    EXPECT_EQ(session.delta().added.size(), 1u);
}

TEST_P(BackendResting, RemovesPairOfDestroyedBoxWhenMarginIsInfinite)
{
    session.margin = kInfinity;
    session.add(boxAt(0, 0, 0));
    const ProxyId other = session.add(boxAt(0, 0.5f, 0));
    ASSERT_TRUE(rest());
    ASSERT_TRUE(move(other, 1, 4));
    EXPECT_EQ(session.removedTotal(), 0u);
    session.table.destroy(other);
    ASSERT_TRUE(step());
    EXPECT_EQ(session.delta().removed.size(), 1u);
}

TEST_P(BackendResting, RemovesPairOfEmptiedBoxWhenMarginIsInfinite)
{
    session.margin = kInfinity;
    session.add(boxAt(0, 0, 0));
    const ProxyId other = session.add(boxAt(0, 0.5f, 0));
    ASSERT_TRUE(rest());
    session.table.setBox(other, kEmptyAabb);
    ASSERT_TRUE(step());
    EXPECT_EQ(session.delta().removed.size(), 1u);
    ASSERT_TRUE(rest());
    session.table.setBox(other, boxAt(0, 0.5f, 0));
    ASSERT_TRUE(step());
    EXPECT_EQ(session.delta().added.size(), 1u);
}

TEST_P(BackendResting, AddsAndRemovesPairOfMovingBoxAndRestingHalfSpace)
{
    session.add({{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, 0, kInfinity}});
    const ProxyId box = session.add(boxAt(0, 0.9f, 0));
    ASSERT_TRUE(rest());
    ASSERT_TRUE(move(box, 1, -0.1f));
    ASSERT_TRUE(move(box, 1, -0.01f));
    EXPECT_EQ(session.addedTotal(), 0u);
    ASSERT_TRUE(move(box, 1, -0.29f));
    EXPECT_EQ(session.delta().added.size(), 1u);
    ASSERT_TRUE(move(box, 1, 0.19f));
    EXPECT_EQ(session.removedTotal(), 0u) << "within the margin";
    ASSERT_TRUE(move(box, 1, 0.05f));
    EXPECT_EQ(session.delta().removed.size(), 1u);
}
}  // namespace
}  // namespace cullet::test
