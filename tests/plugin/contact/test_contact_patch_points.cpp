// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/plugin/contact/patch_oracle.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace cullet::test
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kWithin = 0.03;
constexpr double kSame = 0.02;
constexpr double kGap = 0.001;
constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// A body over a floor whose top is y = 0.
class OverFloor
{
public:
    /// @param floor moved so that its highest points lie at y = 0
    explicit OverFloor(const Points& body, const Points& floor = boxPoints(20, 1, 20))
        : m_body(hullOf<btScalar>(body)), m_floor(hullOf<btScalar>(floor))
    {
    }

    /// @param turn rotation of the body, which is then lowered to the gap
    ContactPatch patch(const Matrix3d& turn, int most = 4)
    {
        double lowest = 0.0;
        for (std::int32_t v = 0; v < m_body.vertexCount(); ++v)
            lowest = std::min(lowest, (turn * m_body.vertex(v).cast<double>()).y());
        const Vector3d origin(0.2, kGap - lowest, -0.1);
        m_a.emplace(m_body, turn.cast<btScalar>(), origin.cast<btScalar>());
        m_b.emplace(m_floor, Matrix3d::Identity().cast<btScalar>(),
                    PosedShape::Vector(0, -highestOf(m_floor), 0));
        GjkCache<btScalar> cache;
        const GjkResult<btScalar> near = gjkDistance(*m_a, *m_b, btScalar(kWithin), cache);
        EXPECT_EQ(near.state, GjkState::Near);
        m_touch = {near.axis.cast<double>().normalized(), double(near.distance), near.pointB.cast<double>(),
                   cache.startA, cache.startB};
        return makeContactPatch(*m_a, *m_b, m_touch, {kWithin, btScalar(kSame), most});
    }

    bool isLone() const { return isLoneCorner(*m_a, *m_b, m_touch); }
    const Touch& touch() const { return m_touch; }

    /// The least slope with which points of the body rise from its lowest one.
    double leastSlope() const
    {
        Vector3d lowest = m_a->point(0);
        for (std::int32_t v = 1; v < m_a->vertexCount(); ++v)
            lowest = m_a->point(v).y() < lowest.y() ? m_a->point(v) : lowest;
        double least = std::numeric_limits<double>::infinity();
        for (std::int32_t v = 0; v < m_a->vertexCount(); ++v)
        {
            const Vector3d way = m_a->point(v) - lowest;
            if (way.squaredNorm() > 0.0)
                least = std::min(least, way.y() / std::hypot(way.x(), way.z()));
        }
        return least;
    }

    /// The points of a patch on the floor.
    Corners places(const ContactPatch& patch) const
    {
        Corners corners;
        for (std::size_t i = 0; i < static_cast<std::size_t>(patch.count); ++i)
            corners.push_back(m_touch.onB + toEigen(patch.points[i].fromTouch).cast<double>());
        return corners;
    }

private:
    static btScalar highestOf(const Hull<btScalar>& hull)
    {
        btScalar highest = hull.vertex(0).y();
        for (std::int32_t v = 1; v < hull.vertexCount(); ++v)
            highest = std::max(highest, hull.vertex(v).y());
        return highest;
    }

    Hull<btScalar> m_body, m_floor;
    std::optional<PosedShape> m_a, m_b;
    Touch m_touch = {};
};

Matrix3d about(const Vector3d& axis, double angle)
{
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// An upright wheel with its axle along z: a prism with edges along the axle, of a radius of 0.3. The middle of a side
/// faces down.
///
/// @param width in units of the diameter
Points wheelPoints(int sides, double width)
{
    Points points = prismPoints(sides, width);
    const Matrix3d turn = about(Vector3d::UnitZ(), 3.14159265358979323846 * (1.0 / sides - 0.5));
    for (Vector3d& p : points)
        p = 0.3 * (turn * p);
    return points;
}

/// Turns a wheel of wheelPoints() to an edge, which then leans.
Matrix3d leaningEdge(int sides, double degrees)
{
    return about(Vector3d::UnitX(), degrees * kDegree) *
           about(Vector3d::UnitZ(), 3.14159265358979323846 / sides);
}

constexpr int kSides = 24;
constexpr double kNarrow = 1.0 / 6.0, kLong = 5.0 / 3.0;

/// A level wedge whose tip points along x, over a level blade.
struct WedgeAndBlade
{
    explicit WedgeAndBlade(Random& random)
    {
        slope = double(random.logUniform(-14, 0));
        width = double(random.logUniform(-16, -8));
        middle = double(random.between(-0.4f, 0.4f));
        turn = about(Vector3d::UnitY(), double(random.between(-4, 4)));
    }

    double end() const { return middle + 0.5; }

    /// How far a point is from the wedge, seen from above.
    double outside(const Vector3d& place) const
    {
        const Vector3d p = turn.transpose() * place;
        const Vector3d along = Vector3d(-1, 0, slope).normalized(), toward(p.x(), 0, std::abs(p.z()));
        if (toward.z() <= -slope * toward.x())
            return 0;
        return (toward - std::max(toward.dot(along), 0.0) * along).norm();
    }

    double slope;   ///< of the sides of the wedge
    double width;   ///< half of the blade's
    double middle;  ///< of the blade's length of 1; the tip is at 0
    Matrix3d turn;
};
}  // namespace

TEST(ContactPatchPoints, NumberFourOnFaceTwoOnEdgeAndOneOnCornerOfBox)
{
    OverFloor box(boxPoints(0.5, 0.5, 0.5));
    const Matrix3d level = Matrix3d::Identity();
    EXPECT_EQ(box.patch(level).count, 4);
    const Vector3d edge = Vector3d::UnitX(), corner(1, 0, 0.7);
    for (const double degrees : {1e-4, 0.01, 0.1, 0.5, 0.9})
    {
        EXPECT_EQ(box.patch(about(edge, degrees * kDegree)).count, 4) << degrees;
        EXPECT_EQ(box.patch(about(corner, degrees * kDegree)).count, 4) << degrees;
    }
    for (const double degrees : {2.0, 5.0, 30.0, 45.0})
    {
        EXPECT_EQ(box.patch(about(edge, degrees * kDegree)).count, 2) << degrees;
        EXPECT_EQ(box.patch(about(corner, degrees * kDegree)).count, 1) << degrees;
    }
}

TEST(ContactPatchPoints, BecomeFewerWhenLegLeansThoughItsFootIsWithinLimit)
{
    OverFloor leg(boxPoints(0.05, 0.5, 0.05));
    EXPECT_EQ(leg.patch(about(Vector3d(1, 0, 0.7), 0.5 * kDegree)).count, 4);
    for (const double degrees : {4.0, 8.0})
    {
        EXPECT_LT(0.2 * std::sin(degrees * kDegree), kWithin);
        EXPECT_EQ(leg.patch(about(Vector3d(1, 0, 0.7), degrees * kDegree)).count, 1) << degrees;
        EXPECT_EQ(leg.patch(about(Vector3d::UnitX(), degrees * kDegree)).count, 2) << degrees;
    }
}

TEST(ContactPatchPoints, NumberOneUnderLeaningEdgeOfWheelAndSpanThatOfRoller)
{
    for (const int sides : {11, kSides})
    {
        OverFloor wheel(wheelPoints(sides, kNarrow)), roller(wheelPoints(sides, kLong));
        const auto lengthUnder = [&](double degrees)
        { return lengthOf(roller.places(roller.patch(leaningEdge(sides, degrees))), Vector3d::UnitY()); };
        for (const double degrees : {0.0, 1e-4, 0.05, -0.05})
        {
            EXPECT_EQ(wheel.patch(leaningEdge(sides, degrees)).count, 2) << degrees;
            EXPECT_GT(lengthUnder(degrees), 0.99) << degrees;
        }
        for (const double degrees : {0.3, 0.6, -0.9})
        {
            EXPECT_EQ(wheel.patch(leaningEdge(sides, degrees)).count, 1) << degrees;
            EXPECT_GT(lengthUnder(degrees), 0.99) << degrees;
            // Bodies come to rest on faces.
            EXPECT_EQ(wheel.patch(about(Vector3d::UnitX(), degrees * kDegree)).count, 4) << degrees;
        }
    }
}

TEST(ContactPatchPoints, NumberOneUnderLeaningEdgeOfWheelOnThinFloorAndOnTriangle)
{
    const Points triangle = {{0, 0, 0}, {0.6, 0, 0}, {0.3, 0, -0.6}};
    for (const Points& floor : {boxPoints(20, 0.01, 20), triangle})
    {
        OverFloor wheel(wheelPoints(kSides, kNarrow), floor);
        EXPECT_EQ(wheel.patch(leaningEdge(kSides, 0.05)).count, 2);
        EXPECT_EQ(wheel.patch(leaningEdge(kSides, 0.3)).count, 1);
    }
    // A slab of the wheel's size may rock itself.
    OverFloor onSlab(wheelPoints(kSides, kNarrow), boxPoints(0.35, 0.02, 0.2));
    EXPECT_EQ(onSlab.patch(leaningEdge(kSides, 0.3)).count, 2);
}

TEST(ContactPatchPoints, LieAtEndsOfLineUnderWheelOfManySides)
{
    OverFloor wheel(wheelPoints(kSides, 0.15));
    int lines = 0;
    constexpr int kSteps = 48;
    for (int i = 0; i <= kSteps; ++i)
    {
        // From one side to the next one.
        const double angle = 2.0 * 3.14159265358979323846 / kSides * i / kSteps;
        const ContactPatch patch = wheel.patch(about(Vector3d::UnitZ(), angle));
        const Corners places = wheel.places(patch);
        EXPECT_GE(patch.count, 2) << i;
        EXPECT_NEAR(lengthOf(places, Vector3d::UnitX()), 0.09, 1e-4) << i;
        lines += patch.count == 2;
    }
    EXPECT_GT(lines, kSteps * 3 / 4);
    EXPECT_EQ(wheel.patch(about(Vector3d::UnitZ(), 0.0)).count, 4) << "on one of its sides it rests";
}

TEST(ContactPatchPoints, NumberOneOnCornerAndThreeOnFaceOfBall)
{
    const Points ico = icoPoints(2);
    OverFloor ball(ico);
    const Matrix3d corner = Eigen::Quaterniond::FromTwoVectors(ico[5], Vector3d(0, -1, 0)).toRotationMatrix();
    EXPECT_EQ(ball.patch(corner).count, 1);
    EXPECT_EQ(ball.patch(about(Vector3d(1, 0, 2), 0.02) * corner).count, 1);
    const Hull<double> hull = hullOf<double>(ico);
    const Matrix3d face =
        Eigen::Quaterniond::FromTwoVectors(hull.faces()[0].normal, Vector3d(0, -1, 0)).toRotationMatrix();
    EXPECT_EQ(ball.patch(face).count, 3);
}

TEST(ContactPatchPoints, NumberOneOnCornerFromWhichAllOfAHullLeadsAwaySteeply)
{
    constexpr std::uint32_t kSeed = 11;
    Random random(kSeed);
    int lone = 0, others = 0, wide = 0;
    for (int hull = 0; hull < 60; ++hull)
    {
        Points points;
        for (int i = 0; i < 8 + hull; ++i)
        {
            const auto [x, y, z] = random.point(-1, 1);
            points.push_back(0.5 * Vector3d(x, y, z).normalized());
        }
        OverFloor ball(points);
        for (int i = 0; i < 20; ++i)
        {
            const auto [x, y, z] = random.point(-1, 1);
            const Matrix3d turn = about({x, y, z}, double(random.between(-3, 3)));
            const Vector3d scale(1, double(random.logUniform(-2, 1)), 1);
            const ContactPatch patch = ball.patch(turn * scale.asDiagonal());
            const double slope = ball.leastSlope();
            SCOPED_TRACE(testing::Message() << "hull " << hull << ", pose " << i << ", seed " << kSeed);
            EXPECT_FALSE(ball.isLone() && slope < 0.0999) << slope;
            EXPECT_FALSE(!ball.isLone() && slope > 0.1001) << slope;
            wide += patch.count > 1;
            (ball.isLone() ? lone : others)++;
            if (!ball.isLone())
                continue;
            ASSERT_EQ(patch.count, 1);
            EXPECT_EQ(patch.points[0].fromTouch, btVector3(0, 0, 0));
            EXPECT_EQ(patch.points[0].distance, btScalar(ball.touch().distance));
        }
    }
    EXPECT_GT(lone, 200);
    EXPECT_GT(others, 200);
    EXPECT_GT(wide, 20);
}

TEST(ContactPatchPoints, StayWithinLimitAndIncludeDeepestPoint)
{
    for (const int sides : {4, 5, 16})
    {
        OverFloor prism(prismPoints(sides, 0.5));
        const Matrix3d turn =
            about(Vector3d(1, 0, 0.3), 0.4 * kDegree) * about(Vector3d::UnitX(), 90.0 * kDegree);
        double lastArea = 0.0;
        for (int most = 1; most <= 4; ++most)
        {
            const ContactPatch patch = prism.patch(turn, most);
            EXPECT_EQ(patch.count, most) << sides;
            double deepest = kWithin;
            for (std::size_t i = 0; i < static_cast<std::size_t>(patch.count); ++i)
                deepest = std::min(deepest, double(patch.points[i].distance));
            EXPECT_NEAR(deepest, kGap, 4e-5) << sides;
            const Corners places = prism.places(patch);
            const double area = areaOf(places, Vector3d::UnitY());
            EXPECT_GE(area, lastArea) << sides << ' ' << most;
            lastArea = area;
            if (most > 1)
            {
                EXPECT_GT(lengthOf(places, Vector3d::UnitY()), 1.6) << sides << ' ' << most;
            }
        }
        EXPECT_GT(lastArea, 1.7) << sides;
    }
}

TEST(ContactPatchPoints, IncludeFourthBeyondTriangleWhenAllLieOnOneSide)
{
    // Half of a disc: the deepest point and the farthest from it are the ends of its straight side.
    Points points;
    constexpr int kArc = 12;
    for (int i = 0; i <= kArc; ++i)
    {
        const double angle = 3.14159265358979323846 * i / kArc;
        for (const double y : {0.0, 1.0})
            points.push_back({std::cos(angle), y, std::sin(angle)});
    }
    OverFloor half(points);
    // Tilted so that an end of the straight side is the lowest point.
    const ContactPatch patch = half.patch(about(Vector3d(-0.2, 0, -1), 0.3 * kDegree));
    EXPECT_EQ(patch.count, 4);
    const Corners places = half.places(patch);
    EXPECT_NEAR(lengthOf(places, Vector3d::UnitY()), 2.0, 1e-3);
    // The largest triangle has an area of 1.
    EXPECT_GT(areaOf(places, Vector3d::UnitY()), 1.15);
}

/// How much a triangle grows by a point, twice the area seen from above: the point is outside of one of the two sides at
/// the last corner.
double growth(const Corners& triangle, const Vector3d& p)
{
    const auto twice = [](const Vector3d& a, const Vector3d& b, const Vector3d& c)
    { return (b - a).cross(c - a).y(); };
    const double turn = twice(triangle[0], triangle[1], triangle[2]) > 0.0 ? -1.0 : 1.0;
    return std::max(turn * twice(triangle[1], triangle[2], p), turn * twice(triangle[2], triangle[0], p));
}

TEST(ContactPatchPoints, IncludeTheCornerByWhichTheirTriangleGrowsMost)
{
    constexpr unsigned kSeed = 71;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> depths(0.3, 1.0), shifts(-0.4, 0.4);
    int besideFirst = 0, besideSecond = 0;
    for (int i = 0; i < 200; ++i)
    {
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", body " << i);
        // A part of an ellipse on one side of the line through the deepest corner and the farthest from it.
        const double side = i % 2 == 0 ? 1.0 : -1.0, depth = side * depths(engine);
        const int arc = 4 + i % 3;
        Points bottom, points;
        for (int k = 0; k <= arc; ++k)
        {
            const double shift = k % arc == 0 ? 0.0 : shifts(engine);
            const double angle = 3.14159265358979323846 * (k + shift) / arc;
            bottom.push_back({std::cos(angle), 0.0, depth * std::sin(angle)});
            points.insert(points.end(), {bottom.back(), bottom.back() + Vector3d::UnitY()});
        }
        OverFloor body(points);
        const Matrix3d turn = about(Vector3d(-0.2 * side, 0, -1), 0.03 * kDegree);
        const ContactPatch patch = body.patch(turn);
        ASSERT_EQ(patch.count, 4);
        const Corners places = body.places(patch);
        const Corners triangle(places.begin(), places.begin() + 3);
        double most = 0.0;
        for (const Vector3d& corner : bottom)
            most = std::max(most, growth(triangle, turn * corner));
        // Twice the margin that a later corner must be better by.
        EXPECT_GE(growth(triangle, places[3]), most - 8e-3);
        const bool isBesideFirst = (places[3] - triangle[0]).norm() < (places[3] - triangle[1]).norm();
        ++(isBesideFirst ? besideFirst : besideSecond);
    }
    EXPECT_GT(besideFirst, 20);
    EXPECT_GT(besideSecond, 20);
}

// The face of the larger hull, cut at the sides of the other one, would have corners with the rounding of its own size.
TEST(ContactPatchPoints, LieAtCornersOfSmallFaceOnMuchLargerOneInBothOrders)
{
    const Hull<btScalar> small = hullOf<btScalar>(boxPoints(0.0625, 0.0625, 0.0625));
    const Hull<btScalar> large = hullOf<btScalar>(boxPoints(100.0, 100.0, 1.0));
    const Eigen::Matrix<btScalar, 3, 3> turn =
        Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix().cast<btScalar>();
    const PosedShape::Vector place(btScalar(41.37), btScalar(-63.91), btScalar(1.0725));
    const PosedShape upper(small, turn, place);
    const PosedShape floor(large, Eigen::Matrix<btScalar, 3, 3>::Identity(), PosedShape::Vector::Zero());
    for (const bool isSwapped : {false, true})
    {
        const PosedShape &a = isSwapped ? floor : upper, &b = isSwapped ? upper : floor;
        // Under the first corner of the small box's lower face.
        const Eigen::Vector3d corner = upper.support(-Eigen::Vector3d::UnitZ(), -1).point;
        Touch touch;
        touch.normal = isSwapped ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ()) : Eigen::Vector3d::UnitZ();
        touch.distance = 0.01;
        touch.onB = isSwapped ? Eigen::Vector3d(corner + upper.origin())
                              : Eigen::Vector3d(corner - 0.01 * touch.normal);
        const ContactPatch patch = makeContactPatch(a, b, touch, {0.03, btScalar(0.002)});
        ASSERT_EQ(patch.count, 4);
        int edges = 0;
        for (std::size_t i = 0; i < 4; ++i)
        {
            for (std::size_t k = 0; k < i; ++k)
            {
                const double apart = double(patch.points[i].fromTouch.distance(patch.points[k].fromTouch));
                const double edge = 0.125, error = std::min(std::abs(apart - edge),
                                                            std::abs(apart - edge * std::sqrt(2.0)));
                EXPECT_LT(error, 4 * double(SIMD_EPSILON));
                edges += std::abs(apart - edge) < 1e-3 ? 1 : 0;
            }
        }
        EXPECT_EQ(edges, 4);
    }
}

TEST(ContactPatchPoints, LieOnFaceWithSharpCornerUpToTolerance)
{
    constexpr std::uint32_t kSeed = 7;
    constexpr double kTolerance = 0.05 * kSame;
    const Hull<btScalar> wedge =
        hullOf<btScalar>({{0, 0, 0}, {-1, 0, 1}, {-1, 0, -1}, {0, 1, 0}, {-1, 1, 1}, {-1, 1, -1}});
    const Hull<btScalar> blade = hullOf<btScalar>(boxPoints(0.5, 0.5, 1));
    Random random(kSeed);
    int left = 0, clipped = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const WedgeAndBlade pose(random);
        const Matrix3d ofA = pose.turn * Vector3d(1, 1, pose.slope).asDiagonal();
        const Matrix3d ofB = pose.turn * Vector3d(1, 1, pose.width).asDiagonal();
        const Vector3d middle = pose.turn * Vector3d(pose.middle, -0.5 - kGap, 0);
        const PosedShape a(wedge, ofA.cast<btScalar>(), PosedShape::Vector::Zero());
        const PosedShape b(blade, ofB.cast<btScalar>(), middle.cast<btScalar>());
        const Vector3d onB = pose.turn * Vector3d(pose.middle - 0.4, -kGap, 0);
        const Touch touch = {Vector3d::UnitY(), kGap, onB, -1, -1};
        const ContactPatch patch = makeContactPatch(a, b, touch, {kWithin, btScalar(kSame)});
        ASSERT_GE(patch.count, 1) << "pose " << i << " of seed " << kSeed;
        for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k)
        {
            const Vector3d place = onB + toEigen(patch.points[k].fromTouch).cast<double>();
            EXPECT_LE(pose.outside(place), std::sqrt(2.0) * kTolerance + 1e-6)
                << "pose " << i << " of seed " << kSeed;
        }
        // The blade is nowhere outside of a side by more than the tolerance, and reaches far beyond the tip.
        const bool isLeft = pose.slope * std::max(pose.end(), 0.0) + pose.width < kTolerance;
        left += isLeft && pose.end() > 10 * kTolerance;
        clipped += !isLeft;
    }
    EXPECT_GT(left, 200);
    EXPECT_GT(clipped, 200);
}

TEST(ContactPatchPoints, LieAtCornersOfCongruentFacesDespiteSmallTurn)
{
    constexpr int kCorners = 8;
    const Hull<btScalar> hull = hullOf<btScalar>(prismPoints(kCorners, 0.5));
    const Matrix3d level = about(Vector3d::UnitX(), 90.0 * kDegree);
    const PosedShape a(hull, level.cast<btScalar>(), PosedShape::Vector(0, btScalar(1 + kGap), 0));
    for (const double turn : {0.0, 1e-5, -1e-5, 3e-4, -3e-4})
    {
        const Matrix3d turned = about(Vector3d::UnitY(), turn) * level;
        const PosedShape b(hull, turned.cast<btScalar>(), PosedShape::Vector::Zero());
        const Touch touch = {Vector3d::UnitY(), kGap, Vector3d(0, 0.5, 0) - a.origin(), -1, -1};
        const ContactPatch patch = makeContactPatch(a, b, touch, {kWithin, btScalar(kSame)});
        ASSERT_EQ(patch.count, 4) << turn;
        for (const ContactPoint& point : patch.points)
        {
            const Vector3d place = toEigen(point.fromTouch).cast<double>();
            EXPECT_NEAR(std::hypot(place.x(), place.z()), 1.0, 1e-4) << "not on an edge, " << turn;
            const double corners =
                std::atan2(place.z(), place.x()) / (2.0 * 3.14159265358979323846) * kCorners;
            EXPECT_NEAR(corners, std::round(corners), 1e-3) << turn;
        }
    }
}
}  // namespace cullet::test
