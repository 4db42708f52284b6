// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/mesh/face_touch.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

namespace cullet::test
{
namespace
{
constexpr unsigned kSeed = 41;

struct Count
{
    int near = 0, separated = 0, unknown = 0;
};

/// A triangle below a core at the origin, level with it in a third of all cases.
void drawTriangle(std::mt19937& engine, Eigen::Vector3d (&corners)[3])
{
    std::uniform_real_distribution<double> place(-1.5, 1.5), depth(-1.2, -0.3), unit(0, 1);
    const double level = depth(engine);
    const bool isLevel = unit(engine) < 0.35;
    for (Eigen::Vector3d& corner : corners)
    {
        corner[0] = place(engine);
        corner[2] = place(engine);
        corner[1] = isLevel ? level : level + 0.2 * place(engine);
    }
}

double exactDistance(const PosedShape& core, const Eigen::Vector3d (&corners)[3])
{
    const PosedShape triangle = poseTriangle(corners);
    GjkCache<btScalar> cache;
    const auto near = gjkDistance(core, triangle, std::numeric_limits<btScalar>::infinity(), cache);
    return near.state == GjkState::Near ? double(near.distance) : 0.0;
}

double lowestOf(const PosedShape& core, const Eigen::Vector3d& direction)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::int32_t v = 0; v < core.vertexCount(); ++v)
        least = std::min(least, direction.dot(core.point(v) + core.origin()));
    return least;
}

double highestOf(const Eigen::Vector3d (&corners)[3], const Eigen::Vector3d& direction)
{
    return std::max({direction.dot(corners[0]), direction.dot(corners[1]), direction.dot(corners[2])});
}

/// Compares the touches of a core with random triangles with the distances that a search finds.
Count compare(const btConvexShape& shape, unsigned seed)
{
    std::mt19937 engine(seed);
    HullUse use;
    Count count;
    const double tolerance = sizeof(btScalar) == sizeof(float) ? 6e-6 : 1e-11;
    const double limit = 0.4;
    const ConvexKind kind = convexKindOf(shape);
    for (int i = 0; i < 4000; ++i)
    {
        const btTransform at(i % 2 == 0 ? btMatrix3x3::getIdentity() : btMatrix3x3(randomRotation(engine)));
        if (kind == ConvexKind::Hull)
            prepare(static_cast<const btConvexHullShape&>(shape));
        const auto core = poseShape(shape, kind, at, use, 0);
        if (!core)
            return {};
        Eigen::Vector3d corners[3];
        drawTriangle(engine, corners);
        const FaceTouch touch(*core, corners, limit);
        const double exact = exactDistance(*core, corners);
        const testing::Message where = testing::Message() << "seed " << seed << ", triangle " << i;
        switch (touch.state())
        {
            case FaceTouch::State::Near:
                ++count.near;
                EXPECT_NEAR(touch.touch().distance, exact, tolerance) << where;
                EXPECT_NEAR(lowestOf(*core, touch.normal()) - highestOf(corners, touch.normal()),
                            touch.touch().distance, tolerance)
                    << where;
                break;
            case FaceTouch::State::Separated:
                ++count.separated;
                EXPECT_GT(exact, limit - tolerance) << where;
                break;
            default:
                ++count.unknown;
        }
    }
    return count;
}

void expectExact(const btConvexShape& shape)
{
    SCOPED_TRACE(shape.getName());
    const Count count = compare(shape, kSeed);
    EXPECT_GT(count.near, 400);
    EXPECT_GT(count.separated, 100);
    EXPECT_GT(count.unknown, 100);
}

TEST(FaceTouch, HasDistanceOfSearchForBoxesCapsulesAndHulls)
{
    expectExact(btBoxShape(vec(0.4, 0.3, 0.5)));
    expectExact(btCapsuleShapeX(btScalar(0.1), btScalar(0.8)));
    const auto prism = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < 8; ++i)
    {
        const double angle = 0.785398 * i;
        for (const double y : {-0.3, 0.3})
            prism->addPoint(vec(0.5 * std::cos(angle), y, 0.5 * std::sin(angle)));
    }
    expectExact(*prism);
    invalidate(*prism);
    // Fewer points than lanes: what fills the rest is no vertex.
    const auto wedge = std::make_unique<btConvexHullShape>();
    for (const double z : {-0.4, 0.4})
    {
        wedge->addPoint(vec(-0.5, 0.3, z));
        wedge->addPoint(vec(0.1, -0.3, z));
        wedge->addPoint(vec(0.4, 0.2, z));
    }
    expectExact(*wedge);
    invalidate(*wedge);
}

/// Half of the hulls are prisms, with level faces.
std::unique_ptr<btConvexHullShape> makeFewPoints(std::mt19937& engine, bool isPrism)
{
    std::uniform_real_distribution<double> place(-0.5, 0.5);
    auto hull = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < 10; ++i)
    {
        const btVector3 point = drawVec(place, engine);
        hull->addPoint(isPrism ? btVector3(point.x(), btScalar(-0.25), point.z()) : point, false);
        if (isPrism)
            hull->addPoint(btVector3(point.x(), btScalar(0.25), point.z()), false);
    }
    hull->recalcLocalAabb();
    return hull;
}

TEST(FaceTouch, GivesSameBitsWhetherHullHasGraphOrNot)
{
    btTriangleMesh triangles;
    for (int i = -2; i < 2; ++i)
    {
        triangles.addTriangle(vec(i, 0, -2), vec(i, 0, 2), vec(i + 1, 0, -2));
        triangles.addTriangle(vec(i + 1, 0, -2), vec(i, 0, 2), vec(i + 1, 0, 2));
    }
    btBvhTriangleMeshShape mesh(&triangles, true);
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> tilt(-0.05, 0.05);
    int points = 0;
    for (int i = 0; i < 300; ++i)
    {
        const auto hull = makeFewPoints(engine, i % 2 == 0);
        const btVector3 axis = drawVec(tilt, engine);
        const btTransform at(btQuaternion(axis.x(), i % 3 == 0 ? 0 : axis.y(), axis.z()), vec(0.1, 0.3, 0.2));
        // Points that no other shape has: there is no graph yet.
        MeshBench without(Loop::Ours, *hull, mesh);
        const btPersistentManifold first = without.step(at, btTransform::getIdentity());
        prepare(*hull);
        MeshBench with(Loop::Ours, *hull, mesh);
        ASSERT_TRUE(arePointsEqual(first, with.step(at, btTransform::getIdentity())))
            << "seed " << kSeed << ", hull " << i;
        points += first.getNumContacts();
        invalidate(*hull);
    }
    EXPECT_GT(points, 300);
}

TEST(FaceTouch, IsUnknownWhenCoreReachesThroughPlane)
{
    const btBoxShape box(vec(0.4, 0.3, 0.5));
    HullUse use;
    const auto core = poseShape(box, ConvexKind::Box, btTransform::getIdentity(), use, 0);
    ASSERT_TRUE(core);
    const auto stateAt = [&](double y, double limit)
    {
        const Eigen::Vector3d corners[] = {{-2, y, -2}, {2, y, -2}, {0, y, 2}};
        return FaceTouch(*core, corners, limit).state();
    };
    EXPECT_EQ(stateAt(-0.4, 0.5), FaceTouch::State::Near);
    EXPECT_EQ(stateAt(0.4, 0.5), FaceTouch::State::Near);
    EXPECT_EQ(stateAt(-0.4, 0.01), FaceTouch::State::Separated);
    EXPECT_EQ(stateAt(-0.2, 0.5), FaceTouch::State::Unknown);
}
}  // namespace
}  // namespace cullet::test
