// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Collision detection of a whole world in which an allocation, a thread or a callback fails once: the next detection has
// all pairs and all contacts.
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/faults/support/sweep.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <btBulletCollisionCommon.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace cullet::test
{
namespace
{
/// Shapes of all kinds that cullet treats differently.
struct Shapes
{
    Shapes()
        : ball(makeHullShape(ballPoints(40, 0.6, 1))),
          crate(makeHullShape(boxPoints(0.5, 0.5, 0.45))),
          triangles(makeTriangles()),
          mesh(triangles.get(), true)
    {
        const btTransform left(btQuaternion::getIdentity(), vec(-0.3, 0, 0));
        const btTransform right(btQuaternion::getIdentity(), vec(0.3, 0, 0));
        compound.addChildShape(left, ball.get());
        compound.addChildShape(right, crate.get());
    }

    btCollisionShape& at(std::size_t i)
    {
        btCollisionShape* const all[] = {ball.get(), crate.get(), &box, &sphere, &compound};
        return *all[i];
    }

    std::unique_ptr<btConvexHullShape> ball, crate;
    btBoxShape box{vec(0.5, 0.5, 0.5)};
    btSphereShape sphere{btScalar(0.6)};
    btCompoundShape compound;
    std::unique_ptr<btTriangleMesh> triangles;
    btBvhTriangleMeshShape mesh;

private:
    static std::unique_ptr<btTriangleMesh> makeTriangles()
    {
        auto made = std::make_unique<btTriangleMesh>();
        for (int i = 0; i < 6; ++i)
            made->addTriangle(vec(8.0 * i - 4, -0.4, -9), vec(8.0 * i + 4, -0.4, -9), vec(8.0 * i, -0.4, 9));
        return made;
    }
};

/// A near callback of an application, which may throw.
void faultyNear(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info)
{
    failInCallback();
    btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

/// A contact callback of an application, which may throw.
bool faultyContact(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                   const btCollisionObjectWrapper*, int, int)
{
    failInCallback();
    return true;
}

/// Installs a contact callback while it lives; null: none.
class ContactCallback
{
public:
    explicit ContactCallback(ContactAddedCallback callback) { gContactAddedCallback = callback; }
    ~ContactCallback() { gContactAddedCallback = nullptr; }
    ContactCallback(const ContactCallback&) = delete;
    ContactCallback& operator=(const ContactCallback&) = delete;
};

struct WorldLayout
{
    std::size_t bodies;
    int threads;
    int steps;
    std::size_t shapes = 5;  ///< of Shapes, the compound last; fewer than all: also without the mesh
    bool hasNearCallback = false;
};
// With 512 objects World computes boxes on several threads.
constexpr WorldLayout kSmall = {20, 1, 4}, kSimple = {20, 1, 4, 4}, kNear = {20, 1, 4, 5, true},
                      kLarge = {520, 3, 2};

class FaultyWorld
{
public:
    FaultyWorld(FaultRun& run, const WorldLayout& layout) : m_run(run), m_layout(layout)
    {
        DispatcherOptions forDispatcher;
        forDispatcher.threads = layout.threads;
        BroadphaseOptions forBroadphase;
        forBroadphase.threads = layout.threads;
        forBroadphase.margin = 0;
        forBroadphase.backend = BackendChoice::Grid;
        m_run.insist([&] { m_dispatcher.emplace(&m_configuration, forDispatcher); });
        m_run.insist([&] { m_broadphase.emplace(forBroadphase); });
        m_run.insist([&] { m_world.emplace(&*m_dispatcher, &*m_broadphase, &m_configuration); });
        m_run.insist([&] { m_world->setUpdateThreads(layout.threads); });
        if (layout.hasNearCallback)
            m_dispatcher->setNearCallback(faultyNear);
    }
    ~FaultyWorld()
    {
        for (const auto& body : m_bodies)
            m_run.certain([&] { m_world->removeCollisionObject(body.get()); });
        m_run.certain(
            [&]
            {
                m_world.reset();
                m_broadphase.reset();
                m_dispatcher.reset();
            });
        m_bodies.clear();
        for (const btConvexHullShape* hull : {m_shapes.ball.get(), m_shapes.crate.get()})
            m_run.certain([&] { invalidate(*hull); });
        m_run.certain([] { trimHullCache(); });
    }
    FaultyWorld(const FaultyWorld&) = delete;
    FaultyWorld& operator=(const FaultyWorld&) = delete;

    void live()
    {
        m_run.certain([&] { prepare(*m_shapes.ball); });
        m_run.certain([&] { setDeforming(*m_shapes.crate, m_layout.threads > 1); });
        const bool hasMesh = m_layout.shapes == 5;
        add(hasMesh ? static_cast<btCollisionShape&>(m_shapes.mesh) : m_shapes.box, vec(0, 0, 0), true);
        for (std::size_t i = 0; i < m_layout.bodies; ++i)
            add(m_shapes.at(i % m_layout.shapes), placeOf(i, 0), false);
        for (int step = 0; step < m_layout.steps; ++step)
        {
            for (std::size_t i = 0; i < m_layout.bodies; ++i)
                m_bodies[i + 1]->getWorldTransform().setOrigin(placeOf(i, step));
            m_run.certain([&] { m_world->updateAabbs(); });
            if (m_run.update([&] { m_world->performDiscreteCollisionDetection(); }))
                expectPairsAndContacts(step);
        }
    }

    /// By step: pairs with contacts, in lives of the same layout.
    static inline std::array<int, 8> touchingIn{};

private:
    /// Neighbours in a row touch by far, or are far apart; rows pass each other.
    btVector3 placeOf(std::size_t i, int step) const
    {
        const std::size_t inRow = 20;
        return vec(0.8 * double(i % inRow) + (step % 2) * 0.1, 0,
                   3.0 * double(i / inRow) + (i % 3 == 0 ? 1.4 : 0) * step);
    }

    void add(btCollisionShape& shape, const btVector3& at, bool isStatic)
    {
        m_bodies.push_back(std::make_unique<btCollisionObject>());
        btCollisionObject& body = *m_bodies.back();
        body.setCollisionShape(&shape);
        body.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        if (!isStatic)
        {
            body.setCollisionFlags(btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
            body.setActivationState(DISABLE_DEACTIVATION);
        }
        const int group = isStatic ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter;
        const auto addIt = [&] { m_world->addCollisionObject(&body, group, btBroadphaseProxy::AllFilter); };
        if (m_run.attempt(addIt))
            return;
        // Bullet's world has listed the body before the broad phase had no memory for it.
        if (body.getWorldArrayIndex() >= 0)
            m_world->removeCollisionObject(&body);
        m_run.certain(addIt);
    }

    void expectPairsAndContacts(int step)
    {
        const FaultPause pause;
        int pairs = 0, touching = 0;
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
            for (std::size_t k = 0; k < i; ++k)
                pairs += overlap(*m_bodies[i]->getBroadphaseHandle(), *m_bodies[k]->getBroadphaseHandle());
        EXPECT_EQ(m_world->getPairCache()->getNumOverlappingPairs(), pairs);
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
            touching += m_dispatcher->getManifoldByIndexInternal(i)->getNumContacts() > 0 ? 1 : 0;
        EXPECT_GT(touching, static_cast<int>(m_layout.bodies / 3)) << "too few to be a test";
        // The first life has no fault.
        int& expected = touchingIn[std::size_t(step)];
        expected = expected == 0 ? touching : expected;
        EXPECT_EQ(touching, expected) << "pairs with contacts in step " << step;
    }

    static int overlap(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            if (a.m_aabbMin[axis] > b.m_aabbMax[axis] || b.m_aabbMin[axis] > a.m_aabbMax[axis])
                return 0;
        }
        return 1;
    }

    FaultRun& m_run;
    const WorldLayout m_layout;
    const ContactCallback m_contactCallback{m_layout.hasNearCallback ? nullptr : faultyContact};
    Shapes m_shapes;
    btDefaultCollisionConfiguration m_configuration;
    std::optional<Dispatcher> m_dispatcher;
    std::optional<Broadphase> m_broadphase;
    std::optional<World<btCollisionWorld>> m_world;
    std::vector<std::unique_ptr<btCollisionObject>> m_bodies;
};

SweepCounts sweepWorld(const char* name, FaultKind kind, const WorldLayout& layout, std::uint64_t every,
                       std::int64_t (*memory)() = liveBesideDispatchers<>)
{
    FaultyWorld::touchingIn = {};
    return sweepFaults(
        name, kind, [&](FaultRun& run) { FaultyWorld(run, layout).live(); }, every, memory);
}

TEST(WorldFaults, KeepPairsAndContactsWhenAllocationFails)
{
    EXPECT_GE(sweepWorld("world of all shapes", FaultKind::New, kSmall, kEveryOfMost).injected, 150u);
}

TEST(WorldFaults, KeepPairsAndContactsWhenAllocationOfAnyThreadFails)
{
    EXPECT_GE(sweepWorld("large world on threads", FaultKind::New, kLarge, kEveryOfFew).injected, 60u);
}

TEST(WorldFaults, KeepPairsAndContactsWhenThreadDoesNotStart)
{
    EXPECT_GE(sweepWorld("large world on threads", FaultKind::ThreadStart, kLarge, kEveryOfFew).injected, 1u);
}

TEST(WorldFaults, KeepPairsAndContactsWhenCallbackThrows)
{
    // Bullet's algorithms of compounds and meshes never destroy that of a child whose contact callback throws.
    EXPECT_GE(sweepWorld("contact callback", FaultKind::Callback, kSimple, kEveryOfMost).injected, 80u);
    EXPECT_GE(sweepWorld("near callback", FaultKind::Callback, kNear, kEveryOfMost).injected, 100u);
}

TEST(WorldFaults, KeepPairsAndContactsWhenBulletsAllocationFails)
{
    // Bullet's own algorithms leave memory behind where their constructors throw.
    EXPECT_GE(sweepWorld("world of all shapes", FaultKind::BulletAllocation, kSmall, kEveryOfMost,
                         liveBesideDispatchers<liveNewCount>)
                  .injected,
              40u);
}
}  // namespace
}  // namespace cullet::test
