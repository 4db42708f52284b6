// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes that are hard for grids, sorted axes and hashes.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
class BackendExtremes : public BackendTest
{
protected:
    void addCluster(std::uint32_t count, float halfSide)
    {
        for (std::uint32_t i = 0; i < count; ++i)
            session.add(randomBox(halfSide));
    }

    Aabb randomBox(float halfSide)
    {
        const float x = random.between(-halfSide, halfSide);
        const float y = random.between(-halfSide, halfSide);
        const float z = random.between(-halfSide, halfSide);
        return boxAt(x, y, z, random.between(0.25f, 1.0f));
    }

    /// Teleports every third ordinary row and checks the update.
    void stirAndStep(std::uint32_t count, float halfSide)
    {
        for (std::uint32_t row = random.below(3); row < count; row += 3)
            session.table.setBox(row, randomBox(halfSide));
        ASSERT_TRUE(session.step());
    }

    BackendSession session{GetParam().make()};
    Random random{21};
};

CULLET_ON_EVERY_BACKEND(BackendExtremes);

/// An unbounded box, of the kinds that Bullet and applications create.
Aabb unboundedBox(std::uint32_t kind)
{
    Aabb box = cube(-1e18f, 1e18f);
    switch (kind % 6)
    {
        case 1:
            box = cube(-1e30f, 1e30f);
            break;
        case 2:
            box = cube(-kInfinity, kInfinity);
            break;
        case 3:
            box.max[1] = 0;  // a plane's half space
            break;
        case 4:
            box.min[2] = -2;
            box.max[2] = kInfinity;
            break;
        case 5:
            box = {{-1, -kInfinity, -std::numeric_limits<float>::max()}, {1, kInfinity, kInfinity}};
            break;
        default:
            break;
    }
    return box;
}

TEST_P(BackendExtremes, ReportsExactPairsWithUpToFiftyMovingUnboundedBoxes)
{
    addCluster(60, 6);
    std::vector<ProxyId> unbounded;
    for (const std::size_t count : {1, 3, 50, 2, 0})
    {
        SCOPED_TRACE(std::to_string(count) + " unbounded boxes");
        while (unbounded.size() > count)
        {
            session.table.destroy(unbounded.back());
            unbounded.pop_back();
        }
        while (unbounded.size() < count)
            unbounded.push_back(session.add(unboundedBox(static_cast<std::uint32_t>(unbounded.size()))));
        for (int step = 0; step < 6; ++step)
        {
            stirAndStep(60, 6);
            for (const ProxyId row : unbounded)
            {
                // Bounded for a step, then unbounded again, of another kind.
                const std::uint32_t kind = random.below(8);
                session.table.setBox(row, kind >= 6 ? randomBox(6) : unboundedBox(kind));
            }
        }
    }
    EXPECT_GT(session.addedTotal(), 1000u);
    EXPECT_GT(session.removedTotal(), 1000u);
}

TEST_P(BackendExtremes, ReportsPairsOfUnboundedBoxesWithEachOther)
{
    session.add(cube(-kInfinity, kInfinity));
    session.add(cube(kInfinity, kInfinity));
    session.add(cube(-kInfinity, -kInfinity));
    session.add(cube(-kInfinity, kInfinity));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {1, 3}, {1, 4}, {2, 4}, {3, 4}}, {}));
}

TEST_P(BackendExtremes, RemovesPairsOfInvalidBoxesAndAddsThemWhenValidAgain)
{
    addCluster(40, 3);
    ASSERT_TRUE(session.step());
    const std::size_t before = session.pairs().size();
    std::vector<Aabb> boxes(session.table.boxes(), session.table.boxes() + 40);
    for (int round = 0; round < 6; ++round)
    {
        for (ProxyId row = 0; row < 40; row += 2)
        {
            Aabb box = boxes[row];
            const std::uint32_t axis = random.below(3);
            if (random.chance(0.5f))
                std::swap(box.min[axis], box.max[axis]);
            else
                (random.chance(0.5f) ? box.min : box.max)[axis] = kNan;
            session.table.setBox(row, box);
        }
        ASSERT_TRUE(session.step());
        EXPECT_LT(session.pairs().size(), before);
        for (ProxyId row = 0; row < 40; ++row)
            session.table.setBox(row, boxes[row]);
        ASSERT_TRUE(session.step());
        EXPECT_EQ(session.pairs().size(), before);
    }
}

TEST_P(BackendExtremes, ReportsNoPairOfNanBoxAndExactPairsOfOthers)
{
    addCluster(30, 3);
    const ProxyId row = session.add({{kNan, kNan, kNan}, {kNan, kNan, kNan}});
    for (int step = 0; step < 10; ++step)
        stirAndStep(30, 3);
    EXPECT_GT(session.pairs().size(), 10u);
    for (const Pair pair : session.pairs())
        EXPECT_NE(pair.second, session.table.uniqueId(row));
}

TEST_P(BackendExtremes, ReportsExactPairsWithOneBoxAroundAllOthers)
{
    addCluster(100, 20);
    const ProxyId large = session.add(cube(-25, 25));
    for (int step = 0; step < 10; ++step)
    {
        stirAndStep(100, 20);
        session.table.setBox(large, translated(cube(-25, 25), random.between(-5, 5), 0, 0));
    }
    EXPECT_GT(session.pairs().size(), 90u);
}

TEST_P(BackendExtremes, ReportsExactPairsOfBoxesInOneCellOnOneLineAndAtOnePoint)
{
    const float spreads[][3] = {{0.01f, 0.01f, 0.01f}, {200, 0, 0}, {0, 200, 0}, {0, 0, 200}, {0, 0, 0}};
    for (int i = 0; i < 120; ++i)
        session.add(cube(0, 0));
    for (const auto& spread : spreads)
    {
        SCOPED_TRACE(std::to_string(spread[0]) + " " + std::to_string(spread[1]) + " " +
                     std::to_string(spread[2]));
        for (int step = 0; step < 3; ++step)
        {
            for (ProxyId row = 0; row < 120; ++row)
            {
                const float x = spread[0] * random.unit();
                const float y = spread[1] * random.unit();
                session.table.setBox(row, boxAt(x, y, spread[2] * random.unit(), step == 1 ? 0.0f : 0.5f));
            }
            ASSERT_TRUE(session.step());
        }
    }
    EXPECT_EQ(session.pairs().size(), 120u * 119 / 2);
    EXPECT_GT(session.removedTotal(), 5000u);
}

TEST_P(BackendExtremes, ReportsExactPairsOfBoxesOneKilometreByOneMillimetre)
{
    for (std::uint32_t i = 0; i < 60; ++i)
        session.add(cube(0, 0));
    for (int step = 0; step < 10; ++step)
    {
        for (ProxyId row = 0; row < 60; ++row)
        {
            Aabb box;
            for (std::uint32_t axis = 0; axis < 3; ++axis)
            {
                const float extent =
                    axis == row % 3 || (row % 4 == 0 && axis == (row + 1) % 3) ? 1000.0f : 0.001f;
                const float middle = random.between(-0.25f, 0.25f) * (extent > 1 ? 1000.0f : 0.25f);
                box.min[axis] = middle - extent / 2;
                box.max[axis] = middle + extent / 2;
            }
            session.table.setBox(row, box);
        }
        ASSERT_TRUE(session.step());
    }
    EXPECT_GT(session.addedTotal(), 100u);
    EXPECT_GT(session.removedTotal(), 100u);
}

TEST_P(BackendExtremes, ReportsExactPairsOfSizesFromSmallestToLargestFloat)
{
    const float largest = std::numeric_limits<float>::max();
    for (int exponent = -149; exponent < 128; exponent += 3)
    {
        const float size = std::ldexp(1.0f, exponent);
        session.add({{0, 0, 0}, {size, size, size}});
        session.add({{size, 0, 0}, {size, size, size}});
    }
    session.add(cube(-largest, largest));
    session.add(cube(largest, largest));
    ASSERT_TRUE(session.step());
    EXPECT_GT(session.pairs().size(), 93u * 92 / 2);
    for (ProxyId row = 0; row < 186; row += 2)
    {
        const float size = session.table.box(row).max[0];
        session.table.setBox(row, {{-size, -size, -size}, {-size / 2, 0, 0}});
    }
    ASSERT_TRUE(session.step());
    EXPECT_GT(session.delta().removed.size(), 100u);
}

TEST_P(BackendExtremes, ReportsExactPairsOfSmallBoxesFarFromOrigin)
{
    for (const float far : {1e9f, -1e15f, 1e30f, -3e38f})
    {
        SCOPED_TRACE(std::to_string(far));
        BackendSession world{GetParam().make()};
        // At this distance the spacing of floats exceeds any sensible cell.
        const float step = std::nextafter(std::fabs(far), 0.0f) - std::fabs(far);
        for (std::uint32_t i = 0; i < 60; ++i)
            world.add(boxAt(0, 0, 0));
        for (int round = 0; round < 5; ++round)
        {
            for (ProxyId row = 0; row < 60; ++row)
            {
                Aabb box;
                for (int axis = 0; axis < 3; ++axis)
                {
                    box.min[axis] = far + step * static_cast<float>(random.below(6));
                    box.max[axis] = box.min[axis] + std::fabs(step) * static_cast<float>(random.below(2));
                }
                world.table.setBox(row, box);
            }
            ASSERT_TRUE(world.step());
        }
        EXPECT_GT(world.addedTotal(), 20u);
        EXPECT_GT(world.removedTotal(), 20u);
    }
}

TEST_P(BackendExtremes, ReportsExactPairsOfBoxesWithFacesOnCellBorders)
{
    // Faces on multiples of powers of two are faces of cells; sizes that are powers of two change level there.
    for (std::uint32_t i = 0; i < 100; ++i)
        session.add(cube(0, 0));
    for (int step = 0; step < 20; ++step)
    {
        for (ProxyId row = 0; row < 100; ++row)
        {
            Aabb box;
            const float size = std::ldexp(1.0f, static_cast<int>(random.below(6)) - 3);
            for (int axis = 0; axis < 3; ++axis)
            {
                box.min[axis] = std::ldexp(static_cast<float>(random.below(32)) - 16, -1);
                box.max[axis] =
                    random.chance(0.1f) ? std::nextafter(box.min[axis] + size, 100.0f) : box.min[axis] + size;
            }
            session.table.setBox(row, box);
        }
        ASSERT_TRUE(session.step());
    }
    EXPECT_GT(session.addedTotal(), 500u);
    EXPECT_GT(session.removedTotal(), 500u);
}

TEST_P(BackendExtremes, FindsNoPairsOfFreeRowsBetweenOldAndNewOnes)
{
    constexpr std::uint32_t kFew = 4, kMany = 10000;
    std::vector<Aabb> boxes(kMany, kEmptyAabb);
    std::vector<std::uint32_t> ids(kMany);
    std::vector<std::uint8_t> changes(kMany);
    std::vector<Filter> filters(kMany, kEverything);
    std::vector<std::uint32_t> dirty;
    const auto create = [&](std::uint32_t row, const Aabb& box)
    {
        boxes[row] = box;
        ids[row] = row + 1;
        changes[row] = kRowCreated;
        dirty.push_back(row);
    };
    const auto backend = GetParam().make();
    const auto update = [&](std::uint32_t size)
    {
        ProxyView view;
        view.size = size;
        view.boxes = boxes.data();
        view.uniqueIds = ids.data();
        view.filters = filters.data();
        view.changes = changes.data();
        view.dirty = dirty.data();
        view.dirtyCount = static_cast<std::uint32_t>(dirty.size());
        PairDelta delta;
        EXPECT_EQ(backend->update(view, delta), Status::Ok);
        EXPECT_TRUE(delta.removed.empty());
        for (const std::uint32_t row : dirty)
            changes[row] = kRowUnchanged;
        dirty.clear();
        return delta.added;
    };
    for (std::uint32_t row = 0; row < kFew; ++row)
        create(row, cube(-1, static_cast<float>(row)));
    EXPECT_EQ(update(kFew).size(), kFew * (kFew - 1) / 2);
    // No update names the rows between, which were never used.
    create(kMany - 1, cube(-0.5f, 0.5f));
    const Pairs expected = {{1, kMany}, {2, kMany}, {3, kMany}, {4, kMany}};
    EXPECT_EQ(update(kMany), expected);
}
}  // namespace
}  // namespace cullet::test
