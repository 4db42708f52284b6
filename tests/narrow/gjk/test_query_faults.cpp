// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/faulty_support.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

/// Inputs that are not finite prove nothing: no gap, no distance and no overlap.
namespace cullet::test
{
namespace
{
/// All queries of a pair, each without history.
template <class S, class A, class B>
std::array<GjkState, 6> statesOf(const A& a, const B& b)
{
    NoObserver observer;
    const S infinity = std::numeric_limits<S>::infinity();
    std::array<GjkCache<S>, 6> caches;
    return {isaGjk(a, b, S(0.1), caches[0]).state,
            isaGjk(a, b, S(0.1), caches[1], observer, {GjkStart::FourDirections, 0}).state,
            isaGjk(a, b, S(0), caches[2], observer, {GjkStart::Axis, 3}).state,
            gjkDistance(a, b, infinity, caches[3]).state,
            gjkDistance(a, b, S(10), caches[4], observer, GjkStart::FourDirections).state,
            penetration(a, b, caches[5]).state};
}

/// One query of the six, with the calls of the faulty shape counted for it alone.
template <class S>
int countNotConverged(const PosedHull<float>& hull, const PosedHull<float>& other, double bad, int badCall,
                      bool isB)
{
    const auto query = [&](auto ask)
    {
        const FaultySupport faulty(hull, badCall, bad);
        GjkCache<S> cache;
        const GjkState state = isB ? ask(other, faulty, cache) : ask(faulty, other, cache);
        // The search that finds the points of a known depth may meet the bad support too.
        if (faulty.calls() > badCall && badCall < 5)
        {
            EXPECT_EQ(state, GjkState::NotConverged);
        }
        return faulty.calls() > badCall && state == GjkState::NotConverged ? 1 : 0;
    };
    NoObserver observer;
    return query([](const auto& a, const auto& b, auto& cache)
                 { return isaGjk(a, b, S(0.1), cache).state; }) +
           query([](const auto& a, const auto& b, auto& cache)
                 { return gjkDistance(a, b, S(10), cache).state; }) +
           query([](const auto& a, const auto& b, auto& cache) { return penetration(a, b, cache).state; }) +
           query(
               [&](const auto& a, const auto& b, auto& cache) {
                   return isaGjk(a, b, S(0.1), cache, observer, {GjkStart::FourDirections, 0}).state;
               });
}

template <class S>
void checkSupports()
{
    const Hull<float> ball = hullOf<float>(icoPoints(2));
    const auto at = [&](float x)
    { return PosedHull<float>(ball, Eigen::Matrix3f::Identity(), Eigen::Vector3f(x, 0.01f, 0.03f)); };
    int unanswered = 0;
    for (const double bad : {HUGE_VAL, -HUGE_VAL, std::nan(""), 1e300, -1e160})
    {
        // Deep, touching and apart.
        for (const float x : {0.02f, 0.9f, 3.0f})
        {
            for (int badCall = 0; badCall < 12; ++badCall)
            {
                SCOPED_TRACE(testing::Message() << bad << " at " << x << " in call " << badCall);
                unanswered += countNotConverged<S>(at(0), at(x), bad, badCall, false);
                unanswered += countNotConverged<S>(at(0), at(x), bad, badCall, true);
            }
        }
    }
    EXPECT_GT(unanswered, 400);
}

/// Poses with one number that is not finite, in either order.
template <class S>
void checkPoses(const Hull<S>& hull, const Hull<S>& other)
{
    const Eigen::Matrix<S, 3, 3> identity = Eigen::Matrix<S, 3, 3>::Identity();
    const Eigen::Matrix<S, 3, 1> beside(S(0.1), S(0.2), S(0.3));
    const PosedHull<S> valid(other, identity, beside);
    for (const S bad : {std::numeric_limits<S>::infinity(), -std::numeric_limits<S>::infinity(),
                        std::numeric_limits<S>::quiet_NaN()})
    {
        for (int number = 0; number < 12; ++number)
        {
            SCOPED_TRACE(testing::Message() << bad << " as number " << number);
            Eigen::Matrix<S, 3, 3> basis = identity;
            Eigen::Matrix<S, 3, 1> origin = Eigen::Matrix<S, 3, 1>::Zero();
            (number < 3 ? origin[number] : basis(number % 3, number / 3 - 1)) = bad;
            const PosedHull<S> faulty(hull, basis, origin);
            for (const GjkState state : statesOf<S>(faulty, valid))
                EXPECT_EQ(state, GjkState::NotConverged);
            for (const GjkState state : statesOf<S>(valid, faulty))
                EXPECT_EQ(state, GjkState::NotConverged);
        }
    }
}

template <class S>
void checkPosesOfAllHulls()
{
    const Hull<S> ball = hullOf<S>(icoPoints(2)), box = hullOf<S>(boxPoints(0.5, 0.5, 0.5));
    const Hull<S> point = hullOf<S>({{0.2, 0.1, -0.3}}), segment = hullOf<S>({{-1, 1, 0}, {1, 0, 1}});
    for (const Hull<S>* hull : {&ball, &box, &point, &segment})
    {
        for (const Hull<S>* other : {&ball, &box, &point})
            checkPoses(*hull, *other);
    }
}

TEST(QueryFaults, LeaveQueryUnansweredWhenSupportPointCannotBeSquared)
{
    checkSupports<float>();
    checkSupports<double>();
}

TEST(QueryFaults, LeaveQueryUnansweredWhenPoseIsNotFinite)
{
    checkPosesOfAllHulls<float>();
    checkPosesOfAllHulls<double>();
}
}  // namespace
}  // namespace cullet::test
