// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The sweep mode of the column grid finds a separating pair in a cell that both boxes touch: at any position, for any
// motion.

#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/motion_histogram.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <map>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr float kStep = 1.0f / 1024;  // of all coordinates, so that sums are exact
constexpr std::uint32_t kSeed = 31;
constexpr std::size_t kPairs = 300;

TEST(MotionHistogram, ComparesTheMeanMotionWithTheLargest)
{
    for (const std::uint32_t octave : {1u, 60u, 126u, 200u})
    {
        SCOPED_TRACE(octave);
        GridMotion motion = {};
        EXPECT_EQ(evenness(motion, 100), 1) << "nothing moves";
        motion.octaves[octave] = 100;
        EXPECT_DOUBLE_EQ(evenness(motion, 100), 1);
        motion.octaves[octave + 2] = 1;
        EXPECT_DOUBLE_EQ(evenness(motion, 101), (100 + 4) / (4.0 * 101));
        EXPECT_EQ(countFrom(motion, octave), 101u);
        EXPECT_EQ(countFrom(motion, octave + 1), 1u);
        EXPECT_EQ(octaveAbove(motion, 0), octave + 3);
        EXPECT_EQ(octaveAbove(motion, 1), octave + 1);
    }
}

/// Two cubes that touch, face to face along an axis.
struct TouchingPair
{
    ProxyId low;
    ProxyId high;
    int axis;
};

struct ReachCase
{
    const char* name;
    float way;                ///< motion of each moving box
    std::uint32_t oneInMany;  ///< one of so many pairs moves that far
};

std::ostream& operator<<(std::ostream& out, const ReachCase& reachCase)
{
    return out << reachCase.name;
}

class MotionBound : public testing::TestWithParam<ReachCase>
{
protected:
    MotionBound()
    {
        for (std::size_t i = 0; i < kPairs; ++i)
        {
            const float z = coordinate(), y = coordinate(), x = coordinate();
            Aabb low = boxAt(x, y, z);
            const int axis = static_cast<int>(i % 3);
            Aabb high = low;
            high.min[axis] = low.max[axis];
            high.max[axis] = low.max[axis] + 1;
            pairs.push_back({session.add(low), session.add(high), axis});
        }
    }

    float coordinate() { return kStep * static_cast<float>(random.below(24 * 1024)); }

    void shift(ProxyId row, int axis, float way)
    {
        Aabb box = session.table.box(row);
        box.min[axis] += way;
        box.max[axis] += way;
        session.table.setBox(row, box);
    }

    /// Separates the boxes of pairs, or moves them back; the other pairs move by the least step.
    void part(float sign)
    {
        for (std::size_t i = 0; i < pairs.size(); ++i)
        {
            const float way = sign * (i % GetParam().oneInMany == 0 ? GetParam().way : kStep);
            shift(pairs[i].low, pairs[i].axis, -way);
            shift(pairs[i].high, pairs[i].axis, way);
        }
    }

    static GridOptions options()
    {
        GridOptions result;
        result.settles = false;
        result.threads = 1;
        result.cellScale =
            1;  // as narrow as the motion bound allows, so that many pairs separate across the edge of a cell
        return result;
    }

    BackendSession session{std::make_unique<ColumnGridBackend>(options())};
    Random random{kSeed};
    std::vector<TouchingPair> pairs;
};

TEST_P(MotionBound, FindsEverySeparatedPairWhenBoxesMoveAsFarAsColumnsReach)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    ASSERT_TRUE(session.step());
    std::map<std::string, int> reasons;
    for (int step = 0; step < 8; ++step)
    {
        part(step % 2 == 0 ? 1.0f : -1.0f);
        ASSERT_TRUE(session.step());
        ++reasons[session.backend().stats().decision.reason];
        EXPECT_GE((step % 2 == 0 ? session.delta().removed : session.delta().added).size(), kPairs);
    }
    EXPECT_EQ(reasons["most boxes jumped"], 0);
    EXPECT_GT(reasons["few boxes came into other cells"], 0);
}

INSTANTIATE_TEST_SUITE_P(Motions, MotionBound,
                         testing::Values(ReachCase{"AlmostAnOctave", 127 * kStep, 1},
                                         ReachCase{"JustAboveAnOctave", 65 * kStep, 1},
                                         ReachCase{"OneInThirty", 127 * kStep, 30},
                                         ReachCase{"OneInThree", 127 * kStep, 3}),
                         [](const auto& test) { return test.param.name; });
}  // namespace
}  // namespace cullet::test
