// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/plugin/shapes/separating_axis.h"
#include "cullet/tests/plugin/random_motion.h"

#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
using Wide = long double;

/// The highest product of the cache's axis, or its opposite, with a point of a posed shape, over all points in long
/// double.
Wide heightAlongAxis(const std::vector<btVector3>& points, const btVector3& stretch, const btTransform& place,
                     const std::array<float, 3>& axis, int sign)
{
    Wide highest = -std::numeric_limits<Wide>::infinity();
    for (const btVector3& point : points)
    {
        Wide height = 0;
        for (int row = 0; row < 3; ++row)
        {
            Wide coordinate = 0;
            for (int k = 0; k < 3; ++k)
                coordinate += Wide(place.getBasis()[row][k]) * Wide(stretch[k]) * Wide(point[k]);
            height += Wide(sign) * Wide(axis[std::size_t(row)]) * coordinate;
        }
        highest = std::max(highest, height);
    }
    return highest;
}

/// A Bullet shape, and the points of its core before scaling.
struct AxisShape
{
    std::unique_ptr<btConvexShape> shape;
    std::vector<btVector3> points;
    HullUse use;

    const btVector3& stretch() const
    {
        return points.empty() ? shape->getLocalScaling()
               : shape->getShapeType() == BOX_SHAPE_PROXYTYPE
                   ? static_cast<const btBoxShape&>(*shape).getImplicitShapeDimensions()
                   : static_cast<const btConvexHullShape&>(*shape).getLocalScalingNV();
    }
};

std::vector<AxisShape> axisShapes()
{
    std::vector<AxisShape> shapes;
    const auto addHull = [&](const std::vector<btVector3>& points) {
        shapes.push_back({makeHullShape(points), points, {}});
    };
    // Scanned, climbed, and in between.
    for (const int count : {4, 12, 16, 17, 42, 100, 300})
        addHull(ballPoints(count, 0.5, unsigned(count)));
    addHull(boxPoints(0.5, 0.001, 0.5));
    addHull(boxPoints(0.5, 0.001, 0.001));
    std::vector<btVector3> prism;
    for (int i = 0; i < 2000; ++i)
        prism.push_back(vec(0.5 * std::cos(i / 2 * SIMD_2_PI / 1000), i % 2 == 0 ? 0.3 : -0.3,
                            0.5 * std::sin(i / 2 * SIMD_2_PI / 1000)));
    addHull(prism);
    shapes.push_back({std::make_unique<btBoxShape>(vec(0.5, 0.4, 0.3)), boxPoints(1, 1, 1), {}});
    return shapes;
}

/// Two shapes of any sizes and poses, with the exact gap along an axis.
class AxisScene
{
public:
    AxisScene(AxisShape& a, AxisShape& b, double far, std::mt19937& engine) : m_a(a), m_b(b)
    {
        for (AxisShape* each : {&a, &b})
        {
            const double size = std::pow(10.0, random(engine, -1, 1));
            const auto side = [&]
            {
                const double signedSize = engine() % 2 == 0 ? size : -size;
                return signedSize * random(engine, 0.25, 4);
            };
            const auto sides = [&]
            {
                const double z = side(), y = side(), x = side();
                return vec(x, y, z);
            };
            // Boxes are not mirrored: their half sides have no sign.
            const bool isBox = each->shape->getShapeType() == BOX_SHAPE_PROXYTYPE;
            each->shape->setLocalScaling(isBox ? vec(size, size, size) : sides());
        }
        placeA = btTransform(randomRotation(engine), vec(far, -far, far / 3));
        placeB = btTransform(randomRotation(engine), placeA.getOrigin());
        scale = reachOf(a) + reachOf(b);
    }

    /// Moves B along the axis, until the gap is about this times the size.
    void setGap(double gap, const std::array<float, 3>& axis)
    {
        const btVector3 v = vec(axis[0], axis[1], axis[2]);
        const Wide move = exactGap(axis) - Wide(gap) * scale;
        placeB.setOrigin(placeB.getOrigin() + v * btScalar(move / Wide(v.length())));
    }

    /// Gap of the cores along the axis, length unit of the world.
    Wide exactGap(const std::array<float, 3>& axis) const
    {
        Wide along = 0, length2 = 0;
        for (int k = 0; k < 3; ++k)
        {
            const Wide component = axis[std::size_t(k)];
            along += component * (Wide(placeA.getOrigin()[k]) - Wide(placeB.getOrigin()[k]));
            length2 += component * component;
        }
        return (along - heightOf(m_a, placeA, axis, -1) - heightOf(m_b, placeB, axis, 1)) /
               std::sqrt(length2);
    }

    bool prove(btScalar limit, GjkCache<btScalar>& cache, AxisSurplus& room, AxisTest<btScalar>& failed)
    {
        StretchedHull a, b;
        EXPECT_TRUE(stretchShape(*m_a.shape, placeA, m_a.use, 0, a));
        EXPECT_TRUE(stretchShape(*m_b.shape, placeB, m_b.use, 0, b));
        return staysSeparated(a, b, limit, cache, &room, &failed);
    }

    btTransform placeA, placeB;
    Wide scale;  ///< sum of the reaches

private:
    static Wide reachOf(const AxisShape& shape)
    {
        Wide reach = 0;
        for (const btVector3& point : shape.points)
            reach = std::max(reach, Wide((point * shape.stretch()).length()));
        return reach;
    }

    static Wide heightOf(const AxisShape& shape, const btTransform& place, const std::array<float, 3>& axis,
                         int sign)
    {
        return heightAlongAxis(shape.points, shape.stretch(), place, axis, sign);
    }

    AxisShape& m_a;
    AxisShape& m_b;
};

std::array<float, 3> anyAxis(std::mt19937& engine)
{
    const btVector3 v = quatRotate(randomRotation(engine), vec(1, 0, 0));
    const btScalar largest = v.absolute()[v.absolute().maxAxis()];
    return {float(v.x() / largest), float(v.y() / largest), float(v.z() / largest)};
}

std::uint16_t anyStart(std::mt19937& engine)
{
    return static_cast<std::uint16_t>(engine() % 3 == 0 ? engine() % 12 : engine());
}
}  // namespace

TEST(AxisTest, ProvesOnlyRealGapsAndMissesNoneBeyondRounding)
{
    std::vector<AxisShape> shapes = axisShapes();
    std::mt19937 engine(271);
    const double gaps[] = {-0.1, -1e-3, -1e-5, 0.0, 1e-5, 1e-3, 0.02, 0.3, 5.0};
    const double limits[] = {0.0, 0.002, 0.02, 0.1};
    constexpr Wide kEps = std::numeric_limits<btScalar>::epsilon();
    int proved = 0, refused = 0, close = 0;
    for (int i = 0; i < 12000; ++i)
    {
        SCOPED_TRACE(i);
        const double far = i % 3 == 0 ? 1e4 : 0.0;
        AxisShape& b = shapes[engine() % shapes.size()];
        AxisShape& a = shapes[engine() % shapes.size()];
        AxisScene scene(a, b, far, engine);
        GjkCache<btScalar> cache;
        cache.axis = anyAxis(engine);
        cache.state = GjkState::Separated;
        cache.startA = anyStart(engine);
        cache.startB = anyStart(engine);
        const double relative = limits[engine() % std::size(limits)];
        const btScalar limit = btScalar(relative * double(scene.scale));
        scene.setGap(relative + gaps[engine() % std::size(gaps)], cache.axis);
        const Wide gap = scene.exactGap(cache.axis);
        AxisSurplus room;
        AxisTest<btScalar> failed;
        const bool isProved = scene.prove(limit, cache, room, failed);
        (isProved ? proved : refused)++;
        close += std::abs(gap - Wide(limit)) < Wide(1e-4) * scene.scale;
        ASSERT_TRUE(!isProved || gap > Wide(limit)) << double(gap) << ' ' << double(limit);
        // A gap that differs from the limit by some roundings of all sizes is proved.
        const Wide distance = (scene.placeA.getOrigin() - scene.placeB.getOrigin()).length();
        const Wide rounding = 200 * kEps * (8 * scene.scale + distance);
        ASSERT_TRUE(isProved || gap <= Wide(limit) + rounding) << double(gap) << ' ' << double(limit);
        const Wide length = std::sqrt(std::pow(Wide(cache.axis[0]), 2) + std::pow(Wide(cache.axis[1]), 2) +
                                      std::pow(Wide(cache.axis[2]), 2));
        if (isProved)
        {
            ASSERT_LE(Wide(room.left), (gap - Wide(limit)) * length);
            ASSERT_GE(Wide(room.left), (gap - Wide(limit) - rounding) * length);
        }
        else if (failed.vertexA >= 0)
        {
            ASSERT_NEAR(double(failed.along), double(gap * length), double(rounding * length));
        }
        // The next query starts from the support vertices.
        const std::uint16_t startA = cache.startA, startB = cache.startB;
        AxisSurplus again;
        ASSERT_EQ(scene.prove(limit, cache, again, failed), isProved);
        ASSERT_EQ(cache.startA, startA);
        ASSERT_EQ(cache.startB, startB);
    }
    EXPECT_GT(proved, 3000);
    EXPECT_GT(refused, 3000);
    EXPECT_GT(close, 1500);
}

TEST(AxisTest, ProvesNothingWhenPoseIsNotFinite)
{
    std::vector<AxisShape> shapes = axisShapes();
    std::mt19937 engine(272);
    for (const btScalar bad :
         {std::numeric_limits<btScalar>::quiet_NaN(), std::numeric_limits<btScalar>::infinity(),
          -std::numeric_limits<btScalar>::infinity()})
    {
        for (AxisShape& shape : shapes)
        {
            for (int place = 0; place < 12; ++place)
            {
                SCOPED_TRACE(testing::Message() << double(bad) << ' ' << place);
                AxisScene scene(shape, shapes[0], 0.0, engine);
                GjkCache<btScalar> cache;
                cache.axis = anyAxis(engine);
                scene.setGap(1.0, cache.axis);
                if (place < 3)
                    scene.placeA.getOrigin()[place] = bad;
                else
                    scene.placeB.getBasis()[(place - 3) / 3][(place - 3) % 3] = bad;
                AxisSurplus room;
                AxisTest<btScalar> failed;
                EXPECT_FALSE(scene.prove(0, cache, room, failed));
                EXPECT_EQ(failed.vertexA, -1);
            }
        }
    }
}

TEST(TurnRates, AreSlightlyMoreThanTheGrowthOfTheirOwnCore)
{
    std::mt19937 engine(51);
    std::uniform_real_distribution<float> part(-1, 1), length(0.2f, 1.7f);
    const auto exact = [](float cosine, float length2)
    { return std::sqrt(std::max(0.0f, length2 - cosine * cosine)); };
    for (int i = 0; i < 1000; ++i)
    {
        const float v = length(engine), length2 = v * v, reachA = 0.5f + std::abs(part(engine));
        const float reachB = 0.5f + std::abs(part(engine)), a = v * part(engine), b = v * part(engine);
        const TurnRates rates(reachA, a * reachA, reachB, b * reachB, length2);
        // Below the middle of the ball, its whole radius turns.
        const float ofA = exact(std::max(a, 0.0f), length2), ofB = exact(std::max(b, 0.0f), length2);
        EXPECT_GE(rates.a(), std::max(ofA, TurnRates::kLeast)) << "seed 51, case " << i;
        EXPECT_GE(rates.b(), std::max(ofB, TurnRates::kLeast)) << "seed 51, case " << i;
        EXPECT_LE(rates.a(), std::max(ofA, TurnRates::kLeast) + 0.03f) << "seed 51, case " << i;
        EXPECT_LE(rates.b(), std::max(ofB, TurnRates::kLeast) + 0.03f) << "seed 51, case " << i;
    }
}

TEST(ConvexKinds, LeaveACylinderOutOnlyWhenItIsThinnerThanItsMargin)
{
    btCylinderShape cylinder(vec(0.5, 0.5, 0.5));
    EXPECT_EQ(convexKindOf(cylinder), ConvexKind::Support);
    for (const int axis : {0, 1, 2})
    {
        btVector3 core(1, 1, 1);
        for (const btScalar half : {btScalar(0.25), btScalar(0), btScalar(-1e-6)})
        {
            core[axis] = half;
            cylinder.setImplicitShapeDimensions(core);
            EXPECT_EQ(convexKindOf(cylinder), half < 0 ? ConvexKind::Unsupported : ConvexKind::Support)
                << half;
        }
    }
}
}  // namespace cullet::test
