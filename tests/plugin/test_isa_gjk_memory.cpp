// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/hull_points.h"
#include "tests/plugin/convex_contacts.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <new>
#include <stdexcept>

namespace
{
/// Of this program: every call of operator new, and those until one fails.
std::size_t newTotal = 0;
std::size_t newUntilFailure = std::numeric_limits<std::size_t>::max();
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size)
{
    ++newTotal;
    if (newUntilFailure-- == 0)
        throw std::bad_alloc();
    if (void* memory = std::malloc(size > 0 ? size : 1))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept
{
    ++newTotal;
    return newUntilFailure-- == 0 ? nullptr : std::malloc(size > 0 ? size : 1);
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}

namespace cullet::test
{
namespace
{
/// One operator new fails in the life of this object, that after so many others.
class OneFailure
{
public:
    explicit OneFailure(std::size_t after) { newUntilFailure = after; }
    ~OneFailure() { newUntilFailure = std::numeric_limits<std::size_t>::max(); }
    OneFailure(const OneFailure&) = delete;
    OneFailure& operator=(const OneFailure&) = delete;
    bool hasHappened() const { return newUntilFailure > std::numeric_limits<std::size_t>::max() / 2; }
};

std::unique_ptr<btConvexHullShape> roundHull()
{
    std::vector<btVector3> points;
    for (const Eigen::Vector3d& p : icoPoints(3))
        points.push_back(vec(p.x(), p.y(), p.z()));
    return makeHullShape(points);
}

/// A cube by its support function, one call of which throws.
class ThrowingCube final : public btConvexInternalShape
{
public:
    explicit ThrowingCube(int badCall) : m_badCall(badCall) { m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE; }

    btVector3 localGetSupportingVertexWithoutMargin(const btVector3& d) const override
    {
        if (m_calls++ == m_badCall)
            throw std::runtime_error("no support");
        return vec(d.x() < 0 ? -0.5 : 0.5, d.y() < 0 ? -0.5 : 0.5, d.z() < 0 ? -0.5 : 0.5);
    }
    void getAabb(const btTransform&, btVector3& low, btVector3& high) const override
    {
        low = vec(-1, -1, -1);
        high = vec(1, 1, 1);
    }
    void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3*, btVector3*, int) const override
    {
    }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "ThrowingCube"; }

private:
    int m_badCall;
    mutable int m_calls = 0;
};
}  // namespace

TEST(IsaGjkMemory, NeitherConstructorNorDestructorNorAWarmStepTakesAny)
{
    const auto hull = makeHullShape(ballPoints(40, 0.5, 1));
    const auto other = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexBench bench;
    {
        ConvexPairProbe first(bench.dispatcher, *hull, *other);
        first.place(vec(0, 0.9, 0), vec(0, 0, 0));
        first.step();
    }
    const std::size_t before = newTotal;
    {
        ConvexPairProbe probe(bench.dispatcher, *hull, *other);
        for (const double height : {3.0, 1.03, 0.9, 3.0})
        {
            probe.place(vec(0.1, height, 0), vec(0, 0, 0));
            probe.step();
        }
    }
    EXPECT_EQ(newTotal, before);
    EXPECT_EQ(bench.registration->stats().depthsTotal, 2u);
}

TEST(IsaGjkFallback, APairWhoseGraphsFindNoMemoryIsCountedAndAnsweredByBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::uint64_t failed = 0;
    bool isReached = true;
    for (std::size_t after = 0; isReached; ++after)
    {
        SCOPED_TRACE(after);
        ConvexBench bench;
        // A new set of points, of which there is no graph yet, at an address that may be known.
        const auto hull = makeHullShape(ballPoints(12, 0.5, unsigned(1000 + after)));
        ConvexPairProbe probe(bench.dispatcher, *hull, *cube);
        probe.place(vec(0, 0.5, 0), vec(0, 0, 0));
        {
            const OneFailure failure(after);
            EXPECT_GT(probe.step()->getNumContacts(), 0);
            isReached = failure.hasHappened();
        }
        const IsaGjkStats stats = bench.registration->stats();
        EXPECT_EQ(stats.notConvergedTotal + stats.touchingTotal, 1u);
        failed += stats.notConvergedTotal;
        // Of a shape whose record found no memory, too.
        invalidate(*hull);
        probe.step();
        EXPECT_EQ(bench.registration->stats().touchingTotal, stats.touchingTotal + 1);
    }
    EXPECT_GT(failed, 10u);
}

TEST(IsaGjkFallback, ADepthThatFindsNoMemoryForTheExactSearchIsCountedAndAnsweredByBullet)
{
    const auto hull = roundHull();
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *hull, *hull);
    // Coincident: all faces of the difference are equally close, and the polytope has no room for them.
    probe.place(vec(0, 0, 0), vec(0, 0, 0));
    probe.step();
    IsaGjkStats stats = bench.registration->stats();
    EXPECT_EQ(stats.exactTotal, 1u);
    EXPECT_EQ(stats.depthsTotal, 1u);
    EXPECT_EQ(stats.notConvergedTotal, 0u);
    for (const std::size_t after : {0, 1, 5})
    {
        const OneFailure failure(after);
        EXPECT_GT(probe.step()->getNumContacts(), 0);
        EXPECT_TRUE(failure.hasHappened());
    }
    stats = bench.registration->stats();
    EXPECT_EQ(stats.notConvergedTotal, 3u);
    EXPECT_EQ(stats.exactTotal, 1u);
}

TEST(IsaGjkFallback, AShapeThatThrowsIsCountedAndAnsweredByBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    for (const int badCall : {0, 1})
    {
        ConvexBench bench;
        ThrowingCube faulty(badCall);
        ConvexPairProbe probe(bench.dispatcher, faulty, *cube);
        probe.place(btTransform(btQuaternion(vec(1, 2, 3).normalized(), btScalar(0.3)), vec(0.1, 0.5, 0.05)),
                    btTransform::getIdentity());
        EXPECT_GT(probe.step()->getNumContacts(), 0);
        EXPECT_EQ(bench.registration->stats().notConvergedTotal, 1u);
    }
}
}  // namespace cullet::test
