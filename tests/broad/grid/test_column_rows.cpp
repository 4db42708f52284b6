// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Rows near rays and boxes, from the columns of the grid: RowSource.
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/queries/ray_path.h"
#include "cullet/tests/broad/queries/query_checks.h"
#include "cullet/tests/support/random_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Marks the rows that it receives.
class Marks final : public RowSink
{
public:
    explicit Marks(std::uint32_t rows) : isFound(rows, false) {}
    void take(const std::uint32_t* rows, std::uint32_t count) override
    {
        received += count;
        for (std::uint32_t i = 0; i < count; ++i)
            isFound[rows[i]] = true;
    }
    std::vector<bool> isFound;
    std::uint64_t received = 0;
};

struct RowsCase
{
    const char* name;
    RandomWorldOptions world;
    bool settles;
    float margin = 1.0f;
    float rebuildFraction = -1.0f;  ///< 1: resting mode begins at once
};

std::ostream& operator<<(std::ostream& out, const RowsCase& rowsCase)
{
    return out << rowsCase.name;
}

RandomWorldOptions worldOf(float halfSide, float move, float stride, int sizeHigh)
{
    RandomWorldOptions options;
    options.count = 700;
    options.halfSide = halfSide;
    options.move = move;
    options.stride = stride;
    options.sizeHigh = sizeHigh;
    return options;
}

RandomWorldOptions driftingWorldOfRows()
{
    RandomWorldOptions options = worldOf(12.0f, 0.9f, 0.125f, 1);
    options.teleport = options.resize = options.refilter = options.destroy = options.special = 0;
    return options;
}

RandomWorldOptions restingWorldOfRows()
{
    RandomWorldOptions options = driftingWorldOfRows();
    options.move = 0.008f;
    options.stride = 0.25f;
    options.destroy = 0.002f;
    return options;
}

RandomWorldOptions farWorldOfRows()
{
    RandomWorldOptions options = worldOf(12.0f, 0.5f, 0.25f, 1);
    options.shift[0] = 4096.0f;
    options.shift[1] = -9999.0f;
    options.isSnapped = false;
    return options;
}

class ColumnRows : public testing::TestWithParam<RowsCase>
{
protected:
    ColumnRows() : m_backend(optionsOf(GetParam())), m_world(7, GetParam().world, m_table) {}

    static GridOptions optionsOf(const RowsCase& rowsCase)
    {
        GridOptions options;
        options.threads = 2;
        options.settles = rowsCase.settles;
        options.rebuildFraction = rowsCase.rebuildFraction;
        return options;
    }

    void update()
    {
        PairDelta delta;
        ASSERT_EQ(m_backend.update(m_table.beginUpdate(GetParam().margin, true), delta), Status::Ok);
        m_table.endUpdate();
        m_updatesWithAwake += std::string(m_backend.stats().path) == "incremental" ? 1 : 0;
    }

    float coordinate(int axis)
    {
        const RandomWorldOptions& options = GetParam().world;
        return options.shift[axis] + m_random.uniform(-1.2f, 1.2f) * options.halfSide;
    }

    /// A ray or a swept box, one in three parallel to an axis.
    RaySegment drawRay()
    {
        float origin[3], direction[3];
        for (int axis = 0; axis < 3; ++axis)
        {
            origin[axis] = coordinate(axis);
            direction[axis] = m_random.uniform(-1.0f, 1.0f);
        }
        if (m_random.below(3) == 0)
            direction[m_random.below(3)] = 0.0f;
        if (m_random.below(6) == 0)
            direction[m_random.below(3)] = 0.0f;
        RaySegment ray = rayAlong(origin, direction, m_random.uniform(0.0f, 30.0f));
        if (m_random.below(2) == 0)
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                ray.growMin[axis] = m_random.uniform(-0.5f, 0.25f);
                ray.growMax[axis] = ray.growMin[axis] + m_random.uniform(0.0f, 0.5f);
            }
        }
        return ray;
    }

    void checkRay()
    {
        const RaySegment ray = drawRay();
        RayPath path;
        ASSERT_TRUE(makeRayPath(ray, path));
        Marks marks(m_table.size());
        if (m_backend.findNearRay(path, m_table.boxes(), marks) == 0)
        {
            EXPECT_EQ(marks.received, 0u);
            return;
        }
        ++m_answered;
        m_received += marks.received;
        for (ProxyId row = 0; row < m_table.size(); ++row)
        {
            const Aabb& box = m_table.box(row);
            const bool isHit = isValid(box) && (bulletHits<float>(ray, box) || bulletHits<double>(ray, box));
            ASSERT_TRUE(marks.isFound[row] || !isHit) << "row " << row;
            ASSERT_TRUE(!marks.isFound[row] || isValid(box)) << "row " << row;
            m_hits += isHit ? 1 : 0;
        }
    }

    void checkBox()
    {
        Aabb box;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = coordinate(axis);
            box.max[axis] = box.min[axis] + m_random.uniform(0.0f, 3.0f);
        }
        Marks marks(m_table.size());
        if (m_backend.findNearBox(box, m_table.boxes(), marks) == 0)
            return;
        ++m_answered;
        m_received += marks.received;
        for (const ProxyId row : overlappingByBruteForce(m_table, box))
        {
            ASSERT_TRUE(marks.isFound[row]) << "row " << row;
            ++m_hits;
        }
    }

    ProxyTable m_table;
    ColumnGridBackend m_backend;
    RandomWorld m_world;
    QueryRandom m_random{3};
    int m_updatesWithAwake = 0;
    std::uint64_t m_answered = 0, m_received = 0, m_hits = 0;
};

TEST_P(ColumnRows, HaveEveryBoxThatRayOrBoxMeetsAfterEachUpdate)
{
    std::uint64_t asked = 0;
    for (int step = 0; step < 40; ++step)
    {
        update();
        for (int i = 0; i < 30 && !HasFatalFailure(); ++i, asked += 2)
        {
            checkRay();
            checkBox();
        }
        ASSERT_FALSE(HasFatalFailure()) << "step " << step;
        m_world.step();
    }
    EXPECT_GT(m_answered, asked / 2);
    EXPECT_GT(m_hits, 1000u);
    EXPECT_EQ(m_updatesWithAwake > 10, std::string(GetParam().name) == "Resting");
    // Boxes that are everywhere, and awake ones, are named each time.
    EXPECT_LT(m_received, m_answered * m_table.size() / 4) << "of few boxes each";
}

TEST_P(ColumnRows, AreUnknownBeforeFirstUpdateAndAfterRestart)
{
    Marks marks(m_table.size());
    const Aabb box = m_table.box(m_world.rows().front());
    EXPECT_EQ(m_backend.findNearBox(box, m_table.boxes(), marks), 0u);
    update();
    EXPECT_GT(m_backend.findNearBox(box, m_table.boxes(), marks), 0u);
    EXPECT_GT(marks.received, 0u);
    m_backend.restart({});
    EXPECT_EQ(m_backend.findNearBox(box, m_table.boxes(), marks), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, ColumnRows,
                         testing::Values(RowsCase{"Drifting", driftingWorldOfRows(), false},
                                         RowsCase{"Resting", restingWorldOfRows(), true, 0.125f, 1.0f},
                                         RowsCase{"Mixed", worldOf(15.0f, 0.3f, 0.5f, 2), false},
                                         RowsCase{"MixedSizes", worldOf(40.0f, 0.3f, 0.5f, 4), true},
                                         RowsCase{"Far", farWorldOfRows(), true}),
                         [](const testing::TestParamInfo<RowsCase>& info)
                         { return std::string(info.param.name); });

TEST(ColumnRowsLimits, LeaveRaysThatAreLongOrNoneToOthers)
{
    RayPath path;
    RaySegment ray = {{0, 0, 0}, {1, 1, 1}, 10, {0, 0, 0}, {0, 0, 0}};
    EXPECT_TRUE(makeRayPath(ray, path));
    for (const double length : {double(NAN), double(INFINITY), -1.0, 1e20})
    {
        ray.lambdaMax = length;
        EXPECT_FALSE(makeRayPath(ray, path)) << length;
    }
    ray.lambdaMax = 10;
    ray.origin[1] = NAN;
    EXPECT_FALSE(makeRayPath(ray, path));
    ProxyTable table;
    for (std::uint32_t id = 1; id < 1000; ++id)
        table.create(cube(2.0f * float(id), 0, 0, 0.5f), id, kFilter);
    ColumnGridBackend backend(GridOptions{});
    PairDelta delta;
    ASSERT_EQ(backend.update(table.beginUpdate(0.0f, true), delta), Status::Ok);
    table.endUpdate();
    ray = {{0, 0, 0}, {1.001, 30, 30}, 1e9, {0, 0, 0}, {0, 0, 0}};
    ASSERT_TRUE(makeRayPath(ray, path));
    Marks marks(table.size());
    EXPECT_EQ(backend.findNearRay(path, table.boxes(), marks), 0u)
        << "through more cells than a scan has boxes";
    EXPECT_EQ(backend.findNearBox({{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}}, table.boxes(), marks), 0u);
    EXPECT_EQ(marks.received, 0u);
}
}  // namespace
}  // namespace cullet::test
