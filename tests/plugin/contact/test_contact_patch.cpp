// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/cloud_builder.h"
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <string>

namespace cullet::test
{
namespace
{
using Vector = PosedShape::Vector;

constexpr double kLimit = 0.03;

PosedShape turned(const Hull<btScalar>& hull, std::mt19937& engine)
{
    return {hull, randomRotation(engine).cast<btScalar>(), Vector::Zero()};
}

/// Moves B along a random direction, corner to corner, until the support points have the gap.
PosedShape besides(const PosedShape& a, const PosedShape& b, const Eigen::Vector3d& direction, double gap)
{
    const Eigen::Vector3d apart =
        a.support(direction, -1).point - b.support(-direction, -1).point + gap * direction;
    return {b.hull(), b.basis().cast<btScalar>(), apart.cast<btScalar>()};
}
}  // namespace

TEST(ContactPatch, EqualsClipOfFacesWhenTouchIsMarkedAsCorners)
{
    std::mt19937 engine(31);
    std::normal_distribution<double> normal;
    int corners = 0, alone = 0;
    for (const NamedPoints& shape : hullShapes())
    {
        const Hull<btScalar> hull = hullOf<btScalar>(shape.points);
        for (int i = 0; i < 300; ++i)
        {
            const PosedShape a = turned(hull, engine), unmoved = turned(hull, engine);
            const Eigen::Vector3d direction = drawVector(normal, engine).normalized();
            const PosedShape b = besides(a, unmoved, direction, 0.001 + 0.0001 * (i % 200));
            GjkCache<btScalar> cache;
            const GjkResult<btScalar> near = gjkDistance(a, b, btScalar(kLimit), cache);
            if (near.state != GjkState::Near || cache.count != 1)
                continue;
            Touch touch = {near.axis.cast<double>().normalized(), double(near.distance),
                           near.pointB.cast<double>(), cache.startA, cache.startB};
            const ContactPatch clipped = makeContactPatch(a, b, touch, {kLimit, btScalar(0.02)});
            touch.areCorners = true;
            const ContactPatch patch = makeContactPatch(a, b, touch, {kLimit, btScalar(0.02)});
            ++corners;
            ASSERT_EQ(patch.count, clipped.count) << shape.name << i;
            for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k)
            {
                EXPECT_NEAR(patch.points[k].distance, clipped.points[k].distance, 1e-5) << shape.name << i;
                EXPECT_LT(patch.points[k].fromTouch.distance(clipped.points[k].fromTouch), btScalar(1e-5))
                    << shape.name << i;
            }
            alone += patch.count == 1 && patch.points[0].fromTouch.isZero();
        }
    }
    EXPECT_GT(corners, 2000);
    EXPECT_GT(alone, 1000);
}

TEST(ContactPatch, IsTheSameForPointsWithoutAGraphWhenCornersTouch)
{
    constexpr unsigned kSeed = 32;
    std::mt19937 engine(kSeed);
    int alone = 0, more = 0;
    for (int i = 0; i < 400; ++i)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", pair " + std::to_string(i));
        const auto points =
            castPoints<btScalar>(ellipsoidPoints(9 + i % 7, {0.5, 0.4, 0.6}, kSeed + unsigned(i)));
        const Hull<btScalar> hull = makeCornerHull(points), cloud = makeCloud(points);
        const PosedShape unmoved = turned(hull, engine), a = turned(hull, engine);
        // The first point, of which copies follow the last one, touches on either side.
        const Eigen::Vector3d direction = a.point(0).normalized();
        const PosedShape b = besides(a, unmoved, direction, 0.001 + 0.00007 * i);
        GjkCache<btScalar> cache;
        const GjkResult<btScalar> near = gjkDistance(a, b, btScalar(kLimit), cache);
        if (near.state != GjkState::Near || cache.count != 1)
            continue;
        Touch touch = {near.axis.cast<double>().normalized(), double(near.distance),
                       near.pointB.cast<double>(), cache.startA, cache.startB};
        touch.areCorners = true;
        const ContactPatch expected = makeContactPatch(a, b, touch, {kLimit, btScalar(0.02)});
        const PosedShape cloudA(cloud, a.basis().cast<btScalar>(), a.origin().cast<btScalar>());
        const PosedShape cloudB(cloud, b.basis().cast<btScalar>(), b.origin().cast<btScalar>());
        touch.vertexA = hull.sourceIndex(touch.vertexA);
        touch.vertexB = hull.sourceIndex(touch.vertexB);
        const VertexFan<btScalar> fanA(cloud, touch.vertexA, -(a.basis().transpose() * touch.normal));
        const VertexFan<btScalar> fanB(cloud, touch.vertexB, b.basis().transpose() * touch.normal);
        if (!fanA.isKnown() || !fanB.isKnown())
            continue;
        const ContactPatch patch =
            makeContactPatch(cloudA, cloudB, touch, {kLimit, btScalar(0.02)}, {&fanA, &fanB});
        ASSERT_EQ(patch.count, expected.count);
        for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k)
        {
            EXPECT_EQ(patch.points[k].distance, expected.points[k].distance);
            EXPECT_EQ(patch.points[k].fromTouch, expected.points[k].fromTouch);
        }
        (patch.count == 1 && patch.points[0].fromTouch.isZero() ? alone : more) += 1;
    }
    EXPECT_GT(alone, 100);
    RecordProperty("more", more);
}
}  // namespace cullet::test
