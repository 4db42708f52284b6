// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/box/box_pairs.h"
#include "cullet/tests/support/number_hash.h"

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
template <class S>
class BoxContacts : public ::testing::Test
{
protected:
    static constexpr Wide kEpsilon = std::numeric_limits<S>::epsilon();

    static WideVector normalOf(const BoxContact<S>& contact)
    {
        return {contact.normal[0], contact.normal[1], contact.normal[2]};
    }
    static WideVector pointOf(const BoxContact<S>& contact, int i)
    {
        return {contact.points[0][i], contact.points[1][i], contact.points[2][i]};
    }
    static Wide sizeOf(const PlainPair<S>& pair) { return Wide(pair.a.half.sum() + pair.b.half.sum()); }
    static Wide distanceOf(const BoxContact<S>& contact)
    {
        return *std::min_element(contact.distances, contact.distances + contact.count);
    }

    struct Tally
    {
        int separated = 0, touching = 0, patches = 0, edges = 0, compared = 0;
    };

    /// @param noise rounding error of an axis of length 1
    static void checkAxes(const PlainPair<S>& pair, const BoxContact<S>& contact, Wide noise, Tally& tally)
    {
        const WideBox a = pair.a.wide(), b = pair.b.wide();
        const WideAxes axes = axesOf(a, b, 2 * noise);
        if (contact.count == 0)
        {
            ++tally.separated;
            EXPECT_GT(axes.separation, -noise);
            return;
        }
        ++tally.touching;
        EXPECT_LE(axes.certain, 0) << "an axis separates the boxes";
        // Not deeper than any axis says, up to rounding, and the depth is that along the normal.
        EXPECT_GE(distanceOf(contact), axes.certain - noise);
        EXPECT_LE(distanceOf(contact), std::max(Wide(0), axes.separation) + noise);
        const WideVector n = normalOf(contact);
        EXPECT_NEAR(double(n.norm()), 1, double(8 * kEpsilon));
        const Wide along = n.dot(a.centre - b.centre) - a.reach(n) - b.reach(n);
        EXPECT_GE(along, axes.certain - 2 * noise);
    }

    static void checkPoints(const PlainPair<S>& pair, const BoxContact<S>& contact, Wide noise, Tally& tally)
    {
        const WideBox a = pair.a.wide(), b = pair.b.wide();
        const WideVector n = normalOf(contact);
        for (int i = 0; i < contact.count; ++i)
        {
            EXPECT_LE(contact.distances[i], 0);
            const WideVector onB = pointOf(contact, i), onA = onB + n * Wide(contact.distances[i]);
            EXPECT_NEAR(double(b.outside(onB)), 0, double(noise)) << i;
            EXPECT_NEAR(double(a.outside(onA)), 0, double(noise)) << i;
            for (int j = 0; j < i; ++j)
                EXPECT_GT((onB - pointOf(contact, j)).norm(), 1e-5L) << i << " and " << j;
        }
        bool isClear;
        const std::vector<WideCorner> corners = cornersOf(a, b, n, isClear);
        if (contact.count == 1 || !isClear || corners.empty())
        {
            tally.edges += contact.count == 1 ? 1 : 0;
            return;
        }
        ++tally.patches;
        // Corners closer than a thousandth of a face's size are one.
        checkCorners(contact, corners, 3e-3L, tally);
    }

    /// Every exact corner is a point, if there are up to four; else the points enclose much of their polygon.
    static void checkCorners(const BoxContact<S>& contact, const std::vector<WideCorner>& corners, Wide noise,
                             Tally& tally)
    {
        const WideVector n = normalOf(contact);
        std::vector<WideVector> exact, points;
        for (const WideCorner& corner : corners)
        {
            exact.push_back(corner.onB);
            if (corners.size() > 4 || corner.distance > -10 * noise)
                continue;
            Wide nearest = 1;
            for (int i = 0; i < contact.count; ++i)
                nearest = std::min(nearest, (corner.onB - pointOf(contact, i)).norm());
            EXPECT_LT(nearest, 2 * noise);
            ++tally.compared;
        }
        for (int i = 0; i < contact.count; ++i)
            points.push_back(pointOf(contact, i));
        sortAround(points, n);
        EXPECT_GT(areaOf(points, n), 0.35L * areaOf(exact, n) - 4 * noise);
    }

    static void sortAround(std::vector<WideVector>& points, const WideVector& n)
    {
        WideVector middle = WideVector::Zero();
        for (const WideVector& p : points)
            middle += p / Wide(points.size());
        const WideVector u = n.unitOrthogonal(), v = n.cross(u);
        std::sort(points.begin(), points.end(),
                  [&](const WideVector& p, const WideVector& q)
                  {
                      return std::atan2(v.dot(p - middle), u.dot(p - middle)) <
                             std::atan2(v.dot(q - middle), u.dot(q - middle));
                  });
    }
};

/// All numbers of a contact; equal vectors have the same bits, but for the sign of a zero.
template <class S>
std::vector<S> numbersOf(const BoxContact<S>& contact)
{
    std::vector<S> numbers(contact.normal, contact.normal + 3);
    for (int i = 0; i < contact.count; ++i)
    {
        numbers.push_back(contact.distances[i]);
        for (int axis = 0; axis < 3; ++axis)
            numbers.push_back(contact.points[axis][i]);
    }
    return numbers;
}

using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BoxContacts, Scalars);
}  // namespace

TYPED_TEST(BoxContacts, MatchExactAxesAndFacesOfRandomPairs)
{
    using S = TypeParam;
    constexpr std::uint32_t kSeed = 20;
    BoxPairs pairs(kSeed);
    typename TestFixture::Tally tally;
    for (int k = 0; k < 8000 && !this->HasFailure(); ++k)
    {
        const auto kind = static_cast<BoxKind>(k % static_cast<int>(BoxKind::Count));
        const PlainPair<S> pair = pairs.template draw<S>(kind);
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", pair " + std::to_string(k));
        const BoxContact<S> contact = contactOf(pair);
        // Centres are up to nine metres from the origin.
        const Wide noise = 32 * TestFixture::kEpsilon * (this->sizeOf(pair) + 9);
        this->checkAxes(pair, contact, noise, tally);
        if (contact.count > 0)
            this->checkPoints(pair, contact, noise, tally);
    }
    EXPECT_GT(tally.separated, 500);
    EXPECT_GT(tally.touching, 4000);
    EXPECT_GT(tally.patches, 2000);
    EXPECT_GT(tally.edges, 200);
    EXPECT_GT(tally.compared, 3000);
}

TYPED_TEST(BoxContacts, DependOnNoEarlierPose)
{
    using S = TypeParam;
    BoxPairs pairs(21);
    int separated = 0;
    for (int k = 0; k < 2000; ++k)
    {
        const PlainPair<S> pair = pairs.template draw<S>(static_cast<BoxKind>(k % 4));
        BoxContact<S> expected = contactOf(pair);
        separated += expected.count == 0 ? 1 : 0;
        for (int group = 0; group <= static_cast<int>(BoxAxisGroup::ThirdEdgeOfA); ++group)
        {
            auto start = static_cast<BoxAxisGroup>(group);
            const BoxContact<S> contact = contactOf(pair, start);
            ASSERT_EQ(contact.count, expected.count) << k;
            if (contact.count == 0)
                continue;
            ASSERT_EQ(numbersOf(contact), numbersOf(expected)) << k;
        }
    }
    EXPECT_GT(separated, 200);
    EXPECT_LT(separated, 1800);
}

TYPED_TEST(BoxContacts, AreTheSameForSwappedBoxesUpToRounding)
{
    using S = TypeParam;
    BoxPairs pairs(22);
    int compared = 0;
    for (int k = 0; k < 4000; ++k)
    {
        const PlainPair<S> pair = pairs.template draw<S>(static_cast<BoxKind>(k % 4));
        const BoxContact<S> contact = contactOf(pair), swapped = contactOf(PlainPair<S>{pair.b, pair.a});
        const Wide noise = 64 * TestFixture::kEpsilon * (this->sizeOf(pair) + 9);
        if (contact.count == 0 || swapped.count == 0)
        {
            const BoxContact<S>& other = contact.count > 0 ? contact : swapped;
            EXPECT_TRUE(other.count == 0 || this->distanceOf(other) > -1e-3L) << k;
            continue;
        }
        const Wide apart = this->distanceOf(contact) - this->distanceOf(swapped);
        // An axis of nearly parallel edges may win in one order only, by less than its rounding error.
        EXPECT_LT(std::abs(apart), std::sqrt(noise)) << k;
        const WideVector n = this->normalOf(contact), m = this->normalOf(swapped);
        if ((n + m).norm() > 1e-4L || contact.count != swapped.count || contact.count != 1)
            continue;
        const WideVector onB = this->pointOf(contact, 0), onA = this->pointOf(swapped, 0);
        EXPECT_LT((onB + n * Wide(contact.distances[0]) - onA).norm(), 1e-3L) << k;
        ++compared;
    }
    EXPECT_GT(compared, 200);
}

TYPED_TEST(BoxContacts, MoveWithTheBoxes)
{
    using S = TypeParam;
    BoxPairs pairs(23);
    int compared = 0;
    for (int k = 0; k < 4000; ++k)
    {
        const PlainPair<S> pair = pairs.template draw<S>(static_cast<BoxKind>(k % 4));
        const Eigen::Matrix<S, 3, 3> turn = pairs.rotation().template cast<S>();
        const Eigen::Matrix<S, 3, 1> shift(3, -2, 1);
        const auto moved = [&](const PlainBox<S>& box) {
            return PlainBox<S>{turn * box.axes, turn * box.centre + shift, box.half};
        };
        const BoxContact<S> contact = contactOf(pair),
                            after = contactOf(PlainPair<S>{moved(pair.a), moved(pair.b)});
        if (contact.count == 0 || after.count == 0)
            continue;
        const Wide noise = 64 * TestFixture::kEpsilon * (this->sizeOf(pair) + 16);
        EXPECT_LT(std::abs(this->distanceOf(contact) - this->distanceOf(after)), std::sqrt(noise)) << k;
        const WideMatrix wide = turn.template cast<Wide>();
        if ((wide * this->normalOf(contact) - this->normalOf(after)).norm() < 1e-4L)
            ++compared;
    }
    EXPECT_GT(compared, 2000);
}

/// Red with one compiler or flag: see tests/narrow/test_narrow_golden.cpp.
TYPED_TEST(BoxContacts, HaveTheSameBitsForAllCompilersAndInstructionSets)
{
    using S = TypeParam;
    BoxPairs pairs(25);
    NumberHash hash;
    for (int k = 0; k < 2000; ++k)
    {
        const BoxContact<S> contact = contactOf(pairs.template draw<S>(static_cast<BoxKind>(k % 4)));
        hash.add(contact.count);
        if (contact.count == 0)
            continue;
        for (const S number : numbersOf(contact))
            hash.add(number);
    }
    EXPECT_EQ(hash.value(), sizeof(S) == 4 ? 0xabe58e93c0d63bfdu : 0xb31cdc050524992au)
        << std::hex << hash.value();
}

/// One and two corners have functions of their own.
TYPED_TEST(BoxContacts, OfFewCornersAreThoseOfSelectionBitByBit)
{
    using S = TypeParam;
    using Vector = TestLanes<S>;
    BoxPairs pairs(26);
    int ones = 0, twos = 0, close = 0;
    for (int k = 0; k < 300000; ++k)
    {
        const PlainPair<S> pair = pairs.template draw<S>(static_cast<BoxKind>(k % 4));
        const BoxPair<Vector> boxes(pair.a.template posed<Vector>(), pair.b.template posed<Vector>());
        BoxAxes<Vector> axes(boxes);
        BoxAxisGroup group = BoxAxisGroup::None;
        BoxAxis<S> axis;
        if (axes.areSeparated(group) || !axes.findLeastDepth(axis))
            continue;
        const BoxFaces<Vector> faces(boxes, axis);
        BoxCorners<Vector> corners(faces);
        if (faces.areEdgesOnly() || corners.findOther() || !corners.findAll())
            continue;
        const int there = __builtin_popcount(corners.there());
        BoxPatch<Vector> own, selected;
        makeBoxPatch(faces, axis.distance, own);
        BoxSelection<Vector>(corners).write(selected);
        ones += there == 1;
        twos += there == 2 && selected.count == 2;
        close += there == 2 && selected.count == 1;
        ASSERT_EQ(own.count, selected.count) << k;
        for (int i = 0; i < 4; ++i)
        {
            ASSERT_EQ(own.x[i], selected.x[i]) << k;
            ASSERT_EQ(own.y[i], selected.y[i]) << k;
            ASSERT_EQ(own.distances[i], selected.distances[i]) << k;
        }
    }
    EXPECT_GT(ones, 500);
    EXPECT_GT(twos, 500);
    // One in some hundred thousand.
    if (sizeof(S) == sizeof(float))
    {
        EXPECT_GT(close, 0);
    }
}

TYPED_TEST(BoxContacts, HaveFourCornersOfBoxThatLiesOnItsFace)
{
    using S = TypeParam;
    PlainPair<S> pair;
    pair.a = pair.b = {Eigen::Matrix<S, 3, 3>::Identity(), {0, 0, 0}, {S(0.5), S(0.5), S(0.5)}};
    for (const S side : {S(0.5), S(0.2), S(3)})
    {
        pair.b.half = {side, S(0.5), side};
        pair.b.centre = {0, S(-0.99), 0};
        const BoxContact<S> contact = contactOf(pair);
        ASSERT_EQ(contact.count, 4) << side;
        const S expected = std::min(side, S(0.5));
        for (int i = 0; i < 4; ++i)
        {
            EXPECT_EQ(contact.normal[1], 1);
            EXPECT_NEAR(contact.distances[i], -0.01, 1e-6);
            EXPECT_NEAR(contact.points[1][i], -0.49, 1e-6);
            EXPECT_NEAR(std::abs(contact.points[0][i]), expected, 1e-6);
            EXPECT_NEAR(std::abs(contact.points[2][i]), expected, 1e-6);
        }
    }
}

TYPED_TEST(BoxContacts, OfEdgesThatCrossAreOnePoint)
{
    using S = TypeParam;
    PlainPair<S> pair;
    const double quarter = 0.78539816339744831;
    pair.a = {Eigen::AngleAxisd(quarter, Eigen::Vector3d::UnitX()).toRotationMatrix().cast<S>(),
              {0, 0, 0},
              {2, 1, 1}};
    pair.b = {Eigen::AngleAxisd(quarter, Eigen::Vector3d::UnitY()).toRotationMatrix().cast<S>(),
              {S(0.3), S(0.1), S(2 * std::sqrt(2.0) - 0.05)},
              {1, 2, 1}};
    const BoxContact<S> contact = contactOf(pair);
    ASSERT_EQ(contact.count, 1);
    EXPECT_NEAR(contact.distances[0], -0.05, 1e-5);
    EXPECT_NEAR(contact.normal[2], -1, 1e-6);
    EXPECT_NEAR(contact.points[0][0], 0.3, 1e-5);
    EXPECT_NEAR(contact.points[1][0], 0, 1e-5);
    EXPECT_NEAR(contact.points[2][0], std::sqrt(2.0) - 0.05, 1e-5);
}

TYPED_TEST(BoxContacts, AreDefinedForBoxesWithoutVolumeAndEqualPoses)
{
    using S = TypeParam;
    const Eigen::Matrix<S, 3, 1> halves[] = {{0, 0, 0},
                                             {1, 0, 0},
                                             {1, 1, 0},
                                             {1, 1, 1},
                                             {S(1e-12), 1, 1},
                                             {S(1e-12), S(1e-12), S(1e-12)},
                                             {S(1e10), S(1e10), S(1e10)}};
    BoxPairs pairs(24);
    for (const auto& a : halves)
    {
        for (const auto& b : halves)
        {
            for (int k = 0; k < 20; ++k)
            {
                PlainPair<S> pair;
                pair.a = {pairs.rotation().template cast<S>(), {1, 2, 3}, a};
                pair.b = {k < 5 ? pair.a.axes : pairs.rotation().template cast<S>(), pair.a.centre, b};
                const BoxContact<S> contact = contactOf(pair);
                ASSERT_GE(contact.count, 1) << a.transpose() << " | " << b.transpose();
                for (int i = 0; i < contact.count; ++i)
                {
                    EXPECT_LE(contact.distances[i], 0);
                    EXPECT_TRUE(this->pointOf(contact, i).allFinite());
                }
                EXPECT_NEAR(double(this->normalOf(contact).norm()), 1, 1e-5);
            }
        }
    }
}

TYPED_TEST(BoxContacts, DoNotExistForNumbersThatAreNotFinite)
{
    using S = TypeParam;
    const S bad[] = {std::numeric_limits<S>::quiet_NaN(), std::numeric_limits<S>::infinity(),
                     -std::numeric_limits<S>::infinity()};
    PlainPair<S> good;
    good.a = good.b = {Eigen::Matrix<S, 3, 3>::Identity(), {0, 0, 0}, {1, 1, 1}};
    ASSERT_GT(contactOf(good).count, 0);
    for (const S value : bad)
    {
        for (int i = 0; i < 15; ++i)
        {
            for (const bool isOfB : {false, true})
            {
                PlainPair<S> pair = good;
                PlainBox<S>& box = isOfB ? pair.b : pair.a;
                S& number = i < 9 ? box.axes(i / 3, i % 3) : i < 12 ? box.centre[i - 9] : box.half[i - 12];
                number = value;
                EXPECT_EQ(contactOf(pair).count, 0) << value << " at " << i;
            }
        }
    }
}
}  // namespace cullet::test
