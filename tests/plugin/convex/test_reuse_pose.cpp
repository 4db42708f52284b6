// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

/// IsaGjkOptions::reusePose for pairs of convex shapes.
namespace cullet::test
{
namespace
{
IsaGjkOptions keeping(double distance, double angle = 0.035)
{
    IsaGjkOptions options;
    options.reusePose = {btScalar(distance), btScalar(angle)};
    return options;
}

btTransform at(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
}

bool areSameBits(const btVector3& a, const btVector3& b)
{
    return std::memcmp(a.m_floats, b.m_floats, 3 * sizeof(btScalar)) == 0;
}

/// Places of all points on both bodies.
std::vector<btVector3> placesOf(const btPersistentManifold& manifold)
{
    std::vector<btVector3> places;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        places.push_back(manifold.getContactPoint(i).m_localPointA);
        places.push_back(manifold.getContactPoint(i).m_localPointB);
    }
    return places;
}

bool areSamePlaces(const std::vector<btVector3>& a, const std::vector<btVector3>& b)
{
    bool areSame = a.size() == b.size();
    for (std::size_t i = 0; areSame && i < a.size(); ++i)
        areSame = areSameBits(a[i], b[i]);
    return areSame;
}

/// A brick of some class of shape, with half extents 0.5, 0.4, 0.5, margin included, lying on a plate whose top is y = 0.
struct PairCase
{
    const char* name;
    std::function<std::unique_ptr<btConvexInternalShape>()> makePlate, makeBrick;
};

std::unique_ptr<btConvexInternalShape> makeBox(double x, double y, double z)
{
    return std::make_unique<btBoxShape>(vec(x, y, z));
}

std::unique_ptr<btConvexInternalShape> makeHull(double x, double y, double z)
{
    auto hull = makeHullShape(boxPoints(x - 0.04, y - 0.04, z - 0.04));
    hull->setMargin(btScalar(0.04));
    return hull;
}

std::vector<PairCase> pairCases()
{
    const auto boxPlate = [] { return makeBox(2, 0.5, 2); };
    const auto hullPlate = [] { return makeHull(2, 0.5, 2); };
    return {{"boxes", boxPlate, [] { return makeBox(0.5, 0.4, 0.5); }},
            {"hulls", hullPlate, [] { return makeHull(0.5, 0.4, 0.5); }},
            {"hull on box", boxPlate, [] { return makeHull(0.5, 0.4, 0.5); }},
            {"box on hull", hullPlate, [] { return makeBox(0.5, 0.4, 0.5); }},
            {"capsule", hullPlate, []() -> std::unique_ptr<btConvexInternalShape> {
                 return std::make_unique<btCapsuleShapeX>(btScalar(0.4), btScalar(0.6));
             }}};
}

/// The pair of a case, step by step.
struct KeptPair
{
    explicit KeptPair(const PairCase& one, const IsaGjkOptions& options = keeping(1e-3))
        : bench(false, options),
          plate(one.makePlate()),
          brick(one.makeBrick()),
          probe(bench.dispatcher, *plate, *brick)
    {
    }

    btPersistentManifold& step(const btTransform& brickAt, const btTransform& plateAt = at(0, -0.5, 0))
    {
        probe.place(plateAt, brickAt);
        return *probe.step();
    }
    std::uint64_t reused() const { return bench.registration->stats().reusedTotal; }

    /// What a pair of the same shapes without memory has.
    std::vector<btVector3> freshPlaces(const btTransform& brickAt)
    {
        ConvexPairProbe fresh(bench.dispatcher, *probe.bodyA.getCollisionShape(),
                              *probe.bodyB.getCollisionShape());
        fresh.place(at(0, -0.5, 0), brickAt);
        return placesOf(*fresh.step());
    }

    ConvexBench bench;
    std::unique_ptr<btConvexInternalShape> plate, brick;
    ConvexPairProbe probe;
};

const btTransform kResting = at(0.1, 0.399, 0.2);

TEST(ReusePose, KeepsPointsWhileThePairStaysWithinTheDistance)
{
    for (const PairCase& one : pairCases())
    {
        SCOPED_TRACE(one.name);
        KeptPair pair(one);
        const std::vector<btVector3> places = placesOf(pair.step(kResting));
        ASSERT_GE(places.size(), 4u);
        EXPECT_EQ(pair.reused(), 0u);
        for (int i = 1; i <= 3; ++i)
        {
            const btTransform moved = at(0.1 + 2e-4 * i, 0.399 - 1e-4 * i, 0.2);
            btPersistentManifold& manifold = pair.step(moved);
            EXPECT_EQ(pair.reused(), std::uint64_t(i));
            EXPECT_TRUE(areSamePlaces(placesOf(manifold), places));
            for (int k = 0; k < manifold.getNumContacts(); ++k)
            {
                const btManifoldPoint& point = manifold.getContactPoint(k);
                EXPECT_TRUE(areSameBits(point.m_positionWorldOnB, moved * point.m_localPointB));
                EXPECT_NEAR(double(point.getDistance()), -1e-3 - 1e-4 * i, 2e-5);
                EXPECT_EQ(point.getLifeTime(), i + 1);
            }
        }
    }
}

TEST(ReusePose, ComputesContactsAgainWhenThePairHasLeftThePoseOfItsContacts)
{
    for (const PairCase& one : pairCases())
    {
        SCOPED_TRACE(one.name);
        KeptPair pair(one);
        pair.step(kResting);
        pair.step(at(0.1006, 0.399, 0.2));
        EXPECT_EQ(pair.reused(), 1u);
        // A millimetre and a half from where the contacts were computed, though less than one from the last step.
        const btTransform away = at(0.1015, 0.399, 0.2);
        EXPECT_TRUE(areSamePlaces(placesOf(pair.step(away)), pair.freshPlaces(away)));
        EXPECT_EQ(pair.reused(), 1u);
        pair.step(at(0.1021, 0.399, 0.2));
        EXPECT_EQ(pair.reused(), 2u);
    }
}

TEST(ReusePose, CountsTheMotionOfTheFarthestPointAndTheAngle)
{
    const struct
    {
        double distance, angle, turn;
        bool isKept;
    } cases[] = {{1e-3, 0.035, 1e-3, true},   // the brick's corners are within 0.81 of its origin
                 {1e-3, 0.035, 2e-3, false},  // 1.6 mm
                 {1e-1, 0.035, 0.034, true}, {1e-1, 0.035, 0.036, false}, {1e-1, 0.001, 0.002, false},
                 {1, 0.4, 0.398, true},  // where a chord is shorter than its angle
                 {1, 0.4, 0.403, false}};
    for (const PairCase& one : pairCases())
    {
        for (const auto& turned : cases)
        {
            SCOPED_TRACE(std::string(one.name) + ", " + std::to_string(turned.turn));
            KeptPair pair(one, keeping(turned.distance, turned.angle));
            pair.step(kResting);
            pair.step(btTransform(btQuaternion(vec(0, 1, 0), btScalar(turned.turn)), kResting.getOrigin()));
            EXPECT_EQ(pair.reused() == 1, turned.isKept);
        }
    }
}

TEST(ReusePose, TurnsNormalsWithThePair)
{
    for (const PairCase& one : pairCases())
    {
        SCOPED_TRACE(one.name);
        KeptPair pair(one);
        const std::vector<btVector3> places = placesOf(pair.step(kResting));
        const btTransform turn(btQuaternion(vec(1, 0, 0), btScalar(1.2)), vec(3, 4, 5));
        btPersistentManifold& manifold = pair.step(turn * kResting, turn * at(0, -0.5, 0));
        EXPECT_EQ(pair.reused(), 1u);
        EXPECT_TRUE(areSamePlaces(placesOf(manifold), places));
        // From the brick, which is the second body, to the plate.
        const btVector3 down = turn.getBasis() * vec(0, -1, 0);
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            EXPECT_NEAR(double((manifold.getContactPoint(i).m_normalWorldOnB - down).length()), 0, 1e-5);
            EXPECT_NEAR(double(manifold.getContactPoint(i).getDistance()), -1e-3, 2e-5);
        }
    }
}

TEST(ReusePose, IsOffByDefaultAndForQueries)
{
    for (const PairCase& one : pairCases())
    {
        KeptPair off(one, {});
        off.step(kResting);
        off.step(kResting);
        EXPECT_EQ(off.reused(), 0u);
        KeptPair on(one);
        on.step(kResting);
        EXPECT_FALSE(on.probe.query().empty());
        EXPECT_EQ(on.reused(), 0u);
    }
}

TEST(ReusePose, SeesEveryChangeOfAShape)
{
    for (const PairCase& one : pairCases())
    {
        SCOPED_TRACE(one.name);
        const std::unique_ptr<btConvexInternalShape> other = makeHull(0.3, 0.41, 0.3);
        const std::pair<const char*, std::function<void(KeptPair&)>> changes[] = {
            {"margin", [](KeptPair& pair) { pair.brick->setMargin(btScalar(0.06)); }},
            {"scale", [](KeptPair& pair) { pair.brick->setLocalScaling(vec(1.01, 1.01, 1.01)); }},
            {"scale of plate", [](KeptPair& pair) { pair.plate->setLocalScaling(vec(0.2, 1, 0.2)); }},
            {"other shape", [&](KeptPair& pair) { pair.probe.bodyB.setCollisionShape(other.get()); }},
        };
        for (const auto& change : changes)
        {
            SCOPED_TRACE(change.first);
            // The margin of a capsule is its radius, which setMargin() leaves alone.
            if (one.name == std::string("capsule") && change.first == std::string("margin"))
                continue;
            KeptPair pair(one);
            pair.step(kResting);
            change.second(pair);
            pair.probe.step();
            EXPECT_EQ(pair.reused(), 0u);
        }
    }
}

TEST(ReusePose, SeesPointsOfAHullThatWereEditedInPlace)
{
    KeptPair pair(pairCases()[1]);
    pair.step(kResting);
    auto& hull = static_cast<btConvexHullShape&>(*pair.brick);
    for (int i = 0; i < hull.getNumPoints(); ++i)
        hull.getUnscaledPoints()[i] *= vec(0.5, 1, 0.5);
    EXPECT_TRUE(areSamePlaces(placesOf(pair.step(kResting)), pair.freshPlaces(kResting)));
    EXPECT_EQ(pair.reused(), 0u);
}

TEST(ReusePose, SeesThatAHullIsSaidToDeform)
{
    KeptPair pair(pairCases()[1]);
    const auto& hull = static_cast<btConvexHullShape&>(*pair.brick);
    ASSERT_GT(pair.step(kResting).getNumContacts(), 1);
    setDeforming(hull);
    EXPECT_TRUE(areSamePlaces(placesOf(pair.step(kResting)), pair.freshPlaces(kResting)));
    EXPECT_EQ(pair.reused(), 0u);
    // Said once more, it changes nothing.
    setDeforming(hull);
    pair.step(kResting);
    EXPECT_EQ(pair.reused(), 1u);
    invalidate(hull);
}

TEST(ReusePose, SeesAnotherShapeAtTheAddressOfADeletedOne)
{
    ConvexBench bench(false, keeping(1e-3));
    btBoxShape plate(vec(2, 0.5, 2));
    alignas(16) unsigned char memory[sizeof(btCapsuleShape)];
    auto* first = new (memory) btCapsuleShapeX(btScalar(0.4), btScalar(0.8));
    ConvexPairProbe probe(bench.dispatcher, plate, *first);
    probe.place(at(0, -0.5, 0), kResting);
    const std::vector<btVector3> alongX = placesOf(*probe.step());
    first->~btCapsuleShapeX();
    auto* second = new (memory) btCapsuleShapeZ(btScalar(0.4), btScalar(0.8));
    const std::vector<btVector3> alongZ = placesOf(*probe.step());
    EXPECT_EQ(bench.registration->stats().reusedTotal, 0u);
    EXPECT_FALSE(areSamePlaces(alongX, alongZ));
    second->~btCapsuleShapeZ();
}

TEST(ReusePose, ReadsFrictionAndRestitutionInEachStep)
{
    for (const PairCase& one : pairCases())
    {
        KeptPair pair(one);
        pair.step(kResting);
        pair.probe.bodyB.setFriction(btScalar(0.75));
        pair.probe.bodyA.setFriction(1);
        pair.probe.bodyA.setRestitution(btScalar(0.5));
        pair.probe.bodyB.setRestitution(btScalar(0.5));
        const btPersistentManifold& manifold = pair.step(kResting);
        EXPECT_EQ(pair.reused(), 1u);
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            EXPECT_EQ(manifold.getContactPoint(i).m_combinedFriction, btScalar(0.75));
            EXPECT_EQ(manifold.getContactPoint(i).m_combinedRestitution, btScalar(0.25));
        }
    }
}

TEST(ReusePose, ComputesContactsAgainWhenTheManifoldWasChanged)
{
    const std::pair<const char*, std::function<void(ConvexBench&, btPersistentManifold&)>> changes[] = {
        {"cleared", [](ConvexBench& bench, btPersistentManifold& manifold)
         { bench.dispatcher.clearManifold(&manifold); }},
        {"point removed",
         [](ConvexBench&, btPersistentManifold& manifold) { manifold.removeContactPoint(0); }},
        {"point moved", [](ConvexBench&, btPersistentManifold& manifold)
         { manifold.getContactPoint(0).m_localPointA.setX(btScalar(0.111)); }},
        {"threshold", [](ConvexBench&, btPersistentManifold& manifold)
         { manifold.setContactBreakingThreshold(btScalar(0.03)); }}};
    for (const PairCase& one : pairCases())
    {
        for (const auto& change : changes)
        {
            SCOPED_TRACE(std::string(one.name) + ", " + change.first);
            KeptPair pair(one);
            btPersistentManifold& manifold = pair.step(kResting);
            const int count = manifold.getNumContacts();
            change.second(pair.bench, manifold);
            pair.step(kResting);
            EXPECT_EQ(pair.reused(), 0u);
            EXPECT_GE(manifold.getNumContacts(), count);
        }
    }
}

int addedPoints = 0, processedPoints = 0;

TEST(ReusePose, CallsCallbacksOfPointsAsDocumented)
{
    for (const PairCase& one : pairCases())
    {
        KeptPair pair(one);
        addedPoints = processedPoints = 0;
        gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                                   const btCollisionObjectWrapper*, int, int) { return ++addedPoints > 0; };
        gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return ++processedPoints > 0; };
        const int count = pair.step(kResting).getNumContacts();
        pair.step(kResting);
        EXPECT_EQ(pair.reused(), 1u) << one.name;
        EXPECT_EQ(processedPoints, 2 * count);
        EXPECT_EQ(addedPoints, 0);
        pair.probe.bodyA.setCollisionFlags(pair.probe.bodyA.getCollisionFlags() |
                                           btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        pair.step(kResting);
        pair.step(kResting);
        EXPECT_EQ(pair.reused(), 1u) << one.name;
        EXPECT_EQ(addedPoints, 2 * count);
        gContactAddedCallback = nullptr;
        gContactProcessedCallback = nullptr;
    }
}

TEST(ReusePose, FollowsOptionsOfALaterRegistration)
{
    for (const PairCase& one : pairCases())
    {
        KeptPair pair(one);
        EXPECT_GT(pair.step(kResting).getNumContacts(), 1);
        IsaGjkOptions options = keeping(1e-3);
        options.activeEdges = true;
        registerIsaGjk(pair.bench.dispatcher, options);
        pair.step(kResting);
        EXPECT_EQ(pair.reused(), 0u) << one.name;
        pair.step(kResting);
        EXPECT_EQ(pair.reused(), 1u) << one.name;
        registerIsaGjk(pair.bench.dispatcher, {});
        pair.step(kResting);
        EXPECT_EQ(pair.reused(), 0u) << one.name;
    }
}

TEST(ReusePose, KeepsNoContactsOfShapesWhosePointsAreBullets)
{
    ConvexBench bench(false, keeping(1e-3));
    btBoxShape plate(vec(2, 0.5, 2));
    btCylinderShape cylinder(vec(0.4, 0.4, 0.4));
    ConvexPairProbe probe(bench.dispatcher, plate, cylinder);
    probe.place(at(0, -0.5, 0), kResting);
    // Bullet's algorithm finds one point in a step.
    for (int i = 0; i < 4; ++i)
        probe.step();
    EXPECT_EQ(bench.registration->stats().reusedTotal, 0u);
}

/// A pile of boxes, hulls and compounds of both.
class KeepingHeap
{
public:
    explicit KeepingHeap(int threads, const IsaGjkOptions& options)
        : m_hull(makeHull(0.4, 0.4, 0.4)), m_world(Narrow::Dispatcher, threads, options)
    {
        m_compound.addChildShape(at(-0.3, 0, 0), &m_box);
        m_compound.addChildShape(at(0.3, 0, 0), m_hull.get());
        m_world.add(&m_floor, 0, vec(0, -1, 0));
        btCollisionShape* const shapes[] = {&m_box, m_hull.get(), &m_compound};
        for (int i = 0; i < 96; ++i)
        {
            const double x = i % 4 - 1.5 + 0.02 * (i % 5), y = 0.5 + i / 16, z = i / 4 % 4 - 1.5;
            m_world.add(shapes[i % 3], 1, vec(1.5 * x, y, 1.5 * z)).setActivationState(DISABLE_DEACTIVATION);
        }
    }

    ConvexWorld& world() { return m_world; }

private:
    btBoxShape m_floor{vec(20, 1, 20)}, m_box{vec(0.3, 0.4, 0.4)};
    std::unique_ptr<btConvexInternalShape> m_hull;
    btCompoundShape m_compound;
    ConvexWorld m_world;
};

TEST(ReusePose, GivesTheSameBitsForAnyNumberOfThreads)
{
    std::uint64_t first = 0;
    for (const int threads : {1, 2, 4})
    {
        KeepingHeap heap(threads, keeping(2e-3));
        heap.world().step(240);
        EXPECT_GT(heap.world().stats().reusedTotal, heap.world().stats().touchingTotal / 2);
        if (threads == 1)
            first = heap.world().hash();
        EXPECT_EQ(heap.world().hash(), first) << threads << " threads";
    }
}

TEST(ReusePose, LetsBodiesRestAsDeepAsWithout)
{
    const auto deepest = [](ConvexWorld& world)
    {
        double depth = 0;
        for (int i = 0; i < world.dispatcher().getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *world.dispatcher().getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
                depth = std::max(depth, -double(manifold.getContactPoint(k).getDistance()));
        }
        return depth;
    };
    KeepingHeap without(1, {}), with(1, keeping(2e-3));
    without.world().step(400);
    with.world().step(400);
    EXPECT_GT(deepest(with.world()), 0);
    EXPECT_LT(deepest(with.world()), deepest(without.world()) + 4e-3);
    for (const auto& body : with.world().bodies)
        EXPECT_LT(double(body->getLinearVelocity().length()), 0.2);
}
}  // namespace
}  // namespace cullet::test
