// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// A contact callback of the application, called for bodies with the flag.
class AddedCallback
{
public:
    explicit AddedCallback(std::function<void()> function)
    {
        s_function = std::move(function);
        gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                                   const btCollisionObjectWrapper*, int, int)
        {
            s_function();
            return false;
        };
    }
    ~AddedCallback() { gContactAddedCallback = nullptr; }
    AddedCallback(const AddedCallback&) = delete;
    AddedCallback& operator=(const AddedCallback&) = delete;

private:
    inline static std::function<void()> s_function;
};

/// The least reported distance of a query; infinite: none.
struct Deepest : btCollisionWorld::ContactResultCallback
{
    Deepest() { m_closestDistanceThreshold = 1; }
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override
    {
        distance = std::min(distance, double(point.getDistance()));
        return 0;
    }
    double distance = std::numeric_limits<double>::infinity();
};

double distanceOf(btCollisionWorld& world, btCollisionObject& a, btCollisionObject& b)
{
    Deepest deepest;
    world.contactPairTest(&a, &b, deepest);
    return deepest.distance;
}

double leastDistanceOf(btCollisionWorld& world, btCollisionObject& body)
{
    Deepest deepest;
    world.contactTest(&body, deepest);
    return deepest.distance;
}

/// Two cubes of edges 1 that overlap by 0.05, with margins of 0.04, and a callback for their contacts.
struct TouchingCubes
{
    explicit TouchingCubes(Narrow narrow) : world(narrow)
    {
        world.world.setGravity(vec(0, 0, 0));
        a = &world.add(shapeA.get(), 1, vec(0, 0, 0));
        b = &world.add(shapeB.get(), 1, vec(0.95, 0, 0));
        a->setCollisionFlags(a->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    }
    /// Scales the points to half the size.
    static void shrink(btConvexHullShape& shape)
    {
        for (int i = 0; i < shape.getNumPoints(); ++i)
            shape.getUnscaledPoints()[i] *= btScalar(0.5);
        shape.recalcLocalAabb();
    }

    std::unique_ptr<btConvexHullShape> shapeA = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::unique_ptr<btConvexHullShape> shapeB = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world;
    btRigidBody *a, *b;
};

constexpr Narrow kNarrows[] = {Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher};
}  // namespace

TEST(IsaGjkCallbacks, PassExceptionOfContactCallbackToApplication)
{
    for (const Narrow narrow : kNarrows)
    {
        SCOPED_TRACE(int(narrow));
        TouchingCubes cubes(narrow);
        int calls = 0;
        {
            const AddedCallback callback(
                [&calls]
                {
                    ++calls;
                    throw std::runtime_error("the application's");
                });
            EXPECT_THROW(cubes.world.world.performDiscreteCollisionDetection(), std::runtime_error);
        }
        EXPECT_EQ(calls, 1);
        if (narrow != Narrow::Stock)
        {
            EXPECT_EQ(cubes.world.stats().notConvergedTotal, 0u);
            EXPECT_EQ(cubes.world.stats().touchingTotal, 1u);
        }
        // The next step is unaffected, and remains of the interrupted step are undone.
        cubes.world.world.performDiscreteCollisionDetection();
        EXPECT_EQ(cubes.world.contactsOf(*cubes.a, *cubes.b), narrow == Narrow::Stock ? 1 : 4);
        cubes.b->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(1.15, 0, 0)));
        cubes.world.world.performDiscreteCollisionDetection();
        EXPECT_EQ(cubes.world.contactsOf(*cubes.a, *cubes.b), 0);
    }
}

TEST(IsaGjkCallbacks, LeaveLaterShapeEditsVisibleAfterException)
{
    for (const Narrow narrow : kNarrows)
    {
        SCOPED_TRACE(int(narrow));
        TouchingCubes cubes(narrow);
        {
            const AddedCallback callback([] { throw 1; });
            EXPECT_THROW(cubes.world.world.performDiscreteCollisionDetection(), int);
        }
        EXPECT_NEAR(distanceOf(cubes.world.world, *cubes.a, *cubes.b), -0.05 - 0.08, 1e-4);
        TouchingCubes::shrink(*cubes.shapeB);
        EXPECT_NEAR(distanceOf(cubes.world.world, *cubes.a, *cubes.b), 0.2 - 0.08, 1e-3);
        EXPECT_GT(leastDistanceOf(cubes.world.world, *cubes.a), 0.1) << "no contact, or none that is old";
    }
}

TEST(IsaGjkCallbacks, DistinguishShapeRebuiltInSameMemoryDuringDispatch)
{
    for (const Narrow narrow : kNarrows)
    {
        SCOPED_TRACE(int(narrow));
        TouchingCubes cubes(narrow);
        btCollisionWorld& world = cubes.world.world;
        btCollisionObject probe, debris;
        probe.setCollisionShape(cubes.shapeA.get());
        debris.setWorldTransform(cubes.b->getWorldTransform());
        std::vector<double> distances;
        std::optional<btConvexHullShape> shape;
        {
            const AddedCallback callback(
                [&]
                {
                    if (!distances.empty())
                        return;
                    for (const double size : {0.5, 0.25, 0.125})
                    {
                        shape.emplace();
                        for (const btVector3& point : boxPoints(size, size, size))
                            shape->addPoint(point);
                        debris.setCollisionShape(&*shape);
                        distances.push_back(distanceOf(world, probe, debris));
                    }
                    // Another shape is edited.
                    TouchingCubes::shrink(*shape);
                    distances.push_back(distanceOf(world, probe, debris));
                });
            world.performDiscreteCollisionDetection();
        }
        ASSERT_EQ(distances.size(), 4u);
        const double expected[] = {-0.05 - 0.08, 0.2 - 0.08, 0.325 - 0.08, 0.3875 - 0.08};
        for (std::size_t i = 0; i < 4; ++i)
            EXPECT_NEAR(distances[i], expected[i], 1e-3) << i;
    }
}
}  // namespace cullet::test
