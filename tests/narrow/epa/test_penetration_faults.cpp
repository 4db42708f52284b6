// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/epa/depth_check.h"
#include "cullet/tests/narrow/faulty_support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

/// Depth queries with supports and coordinates that are not finite, or nearly overflow.
namespace cullet::test
{
namespace
{
/// Expects a documented result without NaNs.
template <class S>
void expectDefined(const PenetrationResult<S>& result)
{
    EXPECT_EQ(result.method == PenetrationMethod::None, result.state != GjkState::Overlapping);
    if (result.state != GjkState::Overlapping)
        return;
    EXPECT_TRUE(std::isfinite(result.depth)) << result.depth;
    EXPECT_GE(result.depth, S(0));
    EXPECT_TRUE(std::isfinite(result.dualGap)) << result.dualGap;
    EXPECT_NEAR(result.axis.norm(), S(1), S(1e-5));
    EXPECT_TRUE(result.pointA.allFinite() && result.pointB.allFinite());
}

/// Queries without and with the cache.
///
/// @return number of depths among the answers
template <class S>
int checkSize(const Hull<S>& hull, double size)
{
    const PosedHull<S> a = at(hull, 0, 0, 0), b = at(hull, 0.3 * size, 0.2 * size, 0.1 * size);
    GjkCache<S> cache;
    EpaCache memory;
    int depths = 0;
    for (int frame = 0; frame < 2; ++frame)
    {
        for (const PenetrationResult<S>& result :
             {rememberedPenetration(a, b, cache, memory), penetration(a, b, cache, &memory)})
        {
            expectDefined(result);
            depths += result.state == GjkState::Overlapping ? 1 : 0;
        }
    }
    return depths;
}

template <class S>
void checkSizes(std::initializer_list<double> sizes)
{
    for (const double size : sizes)
    {
        int hulls = 0, depths = 0;
        for (Points points : {boxPoints(0.5, 0.5, 0.5), icoPoints(1), prismPoints(32, 0.4)})
        {
            SCOPED_TRACE(testing::Message() << size << ", " << points.size() << " points");
            for (Eigen::Vector3d& point : points)
                point *= size;
            const Hull<S> hull = hullOf<S>(points);
            if (hull.vertexCount() == 0)
                continue;
            ++hulls;
            depths += checkSize(hull, size);
        }
        EXPECT_EQ(hulls, size > 1e60 ? 0 : 3) << size;
        EXPECT_TRUE(depths >= 6 || size > 1e50 || size < 1e-50) << size;
    }
}

TEST(Penetration, LeavesAxisUnsettledWhenOppositeAxisIsAsDeep)
{
    // A rectangle in the middle of a box: 2.5 to either side along y.
    const Hull<float> sheet = hullOf<float>({{0, -2.75, 0}, {0, -1.75, 0}, {0, -1.75, 3}, {0, -2.75, 3}});
    Points corners = boxPoints(4, 2, 6);
    for (Eigen::Vector3d& corner : corners)
        corner += Eigen::Vector3d(0, -2.25, 6);
    const Hull<float> box = hullOf<float>(corners);
    const Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
    const Eigen::Vector3f origin = Eigen::Vector3f::Zero();
    GjkCache<float> cache;
    const auto result =
        penetration(PosedHull<float>(sheet, turn, origin), PosedHull<float>(box, turn, origin), cache);
    ASSERT_EQ(result.state, GjkState::Overlapping);
    EXPECT_EQ(result.depth, 2.5f);
    EXPECT_FALSE(result.isSettled);
}
}  // namespace

TEST(PenetrationFaults, LeaveDefinedResultWhenOneSupportPointIsBad)
{
    // Nearly coincident, so that the large polytope is needed, too.
    const Hull<float> ball = hullOf<float>(icoPoints(2));
    const PosedHull<float> hull = at(ball, 0, 0, 0), other = at(ball, 0.02, 0.01, 0.03);
    GjkCache<float> reference;
    const float depth = penetration(hull, other, reference).depth;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    int unanswered = 0;
    for (const double bad : {nan, HUGE_VAL, -HUGE_VAL, 1e300, -1e300, 1e160, 1e153, 1e120, 1e77, 1e-310})
    {
        for (int badCall = 0; badCall < 400; ++badCall)
        {
            SCOPED_TRACE(testing::Message() << bad << " in call " << badCall);
            const FaultySupport faulty(hull, badCall, bad);
            GjkCache<float> cache;
            EpaCache memory;
            const PenetrationResult<float> result = penetration(faulty, other, cache, &memory);
            expectDefined(result);
            EXPECT_LT(faulty.calls(), 2000);
            const bool isMet = faulty.calls() > badCall;
            // A bad point that can be squared is a point of some other shape, whose depth is not known here. Any other
            // one proves nothing.
            const bool isNumber = std::isfinite(bad * bad);
            if (!isMet || (!isNumber && result.state != GjkState::NotConverged))
            {
                EXPECT_EQ(result.state, GjkState::Overlapping);
                EXPECT_NEAR(result.depth, depth, 1e-5f);
            }
            // GJK uses a dozen supports.
            unanswered += badCall > 15 && result.state == GjkState::NotConverged;
        }
    }
    EXPECT_GT(unanswered, 500);
}

TEST(PenetrationFaults, LeaveDefinedResultForExtremeSizes)
{
    checkSizes<float>({3e38, 1e38, 1e30, 1e19, 1e-19, 1e-30, 1e-38, 1e-42, 1e-45});
    checkSizes<double>({1.7e308, 1e200, 1e154, 1e120, 1e90, 1e77, 1e61, 1e60, 1e50, 1e-50, 1e-60, 1e-77,
                        1e-100, 1e-150, 1e-160, 1e-200, 1e-308, 5e-324});
}
}  // namespace cullet::test
