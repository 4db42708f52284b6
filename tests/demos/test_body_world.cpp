// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/pair_audit.h"
#include "cullet/demos/program/heap_usage.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/bodies/body_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace cullet
{
namespace
{
BodyShapes makeShapes()
{
    BodyShapes shapes;
    for (const HullPoints& hull : makeRandomHulls(2, 20, 5))
        shapes.addHull(hull);
    shapes.addBox(btScalar(0.7));
    shapes.addSphere(btScalar(0.4));
    return shapes;
}

WorldSceneOptions makeOptions(std::uint32_t bodies)
{
    WorldSceneOptions options;
    options.bodies = bodies;
    return options;
}

NamedBroadphase byName(const std::string& name, int threads = 1)
{
    BroadphaseRequest request;
    request.name = name;
    request.threads = threads;
    return makeNamedBroadphase(request);
}

TEST(BodyWorld, StepsToSameBitsWithGridAndBruteForce)
{
    BodyWorld grid("test", byName("grid", 2), makeShapes(), makeOptions(150));
    BodyWorld brute("test", byName("brute"), makeShapes(), makeOptions(150));
    const std::uint64_t start = grid.stateHash();
    for (int step = 0; step < 90; ++step)
    {
        grid.step();
        brute.step();
        ASSERT_EQ(grid.stateHash(), brute.stateHash()) << "step " << step;
    }
    EXPECT_NE(grid.stateHash(), start);
    EXPECT_GT(grid.contactPairCount(), 100u);
    EXPECT_EQ(grid.pairCount(), brute.pairCount());
}

TEST(BodyWorld, KeepsItsBodiesWithinTheWalls)
{
    BodyWorld world("test", byName("grid"), makeShapes(), makeOptions(100));
    for (int step = 0; step < 180; ++step)
        world.step();
    EXPECT_GT(world.lowestHeight(), btScalar(0.1));
}

TEST(BodyWorld, MeasuresPhasesThatMakeUpMostOfStep)
{
    BodyWorld world("test", byName("dbvt"), makeShapes(), makeOptions(200));
    double largestShare = 0.0;
    for (int step = 0; step < 30; ++step)
    {
        const Stopwatch watch;
        const PhaseTimes times = world.step();
        const double wall = watch.wallMs();
        double sum = 0.0;
        for (std::size_t phase = 0; phase < kPhaseCount; ++phase)
        {
            EXPECT_GT(times[phase], 0.0) << phaseName(static_cast<Phase>(phase));
            sum += times[phase];
        }
        EXPECT_LE(sum, wall);
        largestShare = std::max(largestShare, sum / wall);
    }
    // The remaining share is two clock readings and the counter of the margin; the best of many steps counts, since
    // another process may run between the two readings.
    EXPECT_GT(largestShare, 0.5);
}

TEST(PairAudit, ConfirmsEqualPairsAndDetectsMissingOne)
{
    BodyWorld world("test", byName("grid"), makeShapes(), makeOptions(120));
    ShadowBroadphase shadow(byName("dbvt"), collectProxies(world.world()));
    for (int step = 0; step < 40; ++step)
        world.step();
    const std::vector<AuditedProxy> proxies = collectProxies(world.world());
    const PairDigest exact = digestExact(proxies);
    ASSERT_GT(exact.count, 100u);
    EXPECT_EQ(digestCache(world.world()), exact);
    EXPECT_EQ(shadow.update(proxies), exact);

    btOverlappingPairCache& cache = *world.world().getPairCache();
    const btBroadphasePair first = cache.getOverlappingPairArray()[0];
    cache.removeOverlappingPair(first.m_pProxy0, first.m_pProxy1, world.world().getDispatcher());
    EXPECT_NE(digestCache(world.world()), exact);
}

TEST(PairAudit, LeavesOutPairsThatTheFilterForbids)
{
    const ExactBox box = {{0, 0, 0}, {1, 1, 1}};
    const std::vector<AuditedProxy> proxies = {{box, 2, ~2}, {box, 2, ~2}, {box, 1, -1}};
    EXPECT_EQ(digestExact(proxies).count, 2u);
    ShadowBroadphase shadow(byName("grid"), proxies);
    EXPECT_EQ(shadow.update(proxies), digestExact(proxies));
}

TEST(PairAudit, MeasuresTheMemoryOfABroadPhase)
{
    if (heapBytesInUse() == 0)
        GTEST_SKIP() << "this malloc, of a sanitizer, tells nothing";
    const ExactBox box = {{0, 0, 0}, {1, 1, 1}};
    for (const char* name : {"grid", "dbvt"})
    {
        ShadowBroadphase shadow(byName(name), std::vector<AuditedProxy>(500, AuditedProxy{box, 1, -1}));
        shadow.update(std::vector<AuditedProxy>(500, AuditedProxy{box, 1, -1}));
        // 124,750 pairs of 32 bytes are the minimum of Bullet's pair array.
        EXPECT_GT(shadow.releaseAndMeasure(), 124750u * 32u) << name;
    }
}

TEST(BroadphaseFactory, AnswersAnUnknownNameWithTheKnownOnes)
{
    try
    {
        byName("octree");
        FAIL() << "no exception";
    }
    catch (const std::invalid_argument& error)
    {
        const std::string text = error.what();
        for (const BroadphaseInfo& info : broadphaseNames())
            EXPECT_NE(text.find(info.name), std::string::npos);
    }
}

TEST(BroadphaseFactory, RestoresDbvtMarginAfterStep)
{
    const btScalar before = gDbvtMargin;
    BodyWorld world("test", byName("dbvt-m0"), makeShapes(), makeOptions(20));
    world.step();
    EXPECT_EQ(gDbvtMargin, before);
    EXPECT_EQ(world.broadphase().margin, btScalar(0));
}
}  // namespace
}  // namespace cullet
