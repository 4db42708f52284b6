// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_speculation.h"

#include "cullet/plugin/step/pair_motion.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Collects what a body might meet, as Bullet's sweeps do.
class Candidates final : public btBroadphaseAabbCallback
{
public:
    Candidates(btCollisionWorld& world, btCollisionObject& body, std::vector<btCollisionObject*>& found)
        : m_world(world), m_proxy(*body.getBroadphaseHandle()), m_body(body), m_found(found)
    {
        m_found.clear();
    }

    bool process(const btBroadphaseProxy* proxy) override
    {
        auto* const other = static_cast<btCollisionObject*>(proxy->m_clientObject);
        if (other != &m_body && mayMeet(*proxy, *other))
            m_found.push_back(other);
        return true;
    }
    /// In an order that does not depend on the broad phase.
    void sort()
    {
        const auto idOf = [](const btCollisionObject* object)
        { return object->getBroadphaseHandle()->getUid(); };
        std::sort(m_found.begin(), m_found.end(),
                  [&](const btCollisionObject* a, const btCollisionObject* b) { return idOf(a) < idOf(b); });
    }

private:
    bool mayMeet(const btBroadphaseProxy& proxy, const btCollisionObject& other) const
    {
        auto& mutableProxy = const_cast<btBroadphaseProxy&>(proxy);
        return m_world.getPairCache()->needsBroadphaseCollision(&mutableProxy, &m_proxy) &&
               m_world.getDispatcher()->needsCollision(&m_body, &other) &&
               m_world.getDispatcher()->needsResponse(&m_body, &other);
    }

    btCollisionWorld& m_world;
    btBroadphaseProxy& m_proxy;
    const btCollisionObject& m_body;
    std::vector<btCollisionObject*>& m_found;
};

/// The thinnest side of a body's box.
btScalar thinnestSide(const btCollisionShape& shape)
{
    btVector3 low, high;
    shape.getAabb(btTransform::getIdentity(), low, high);
    const btVector3 size = high - low;
    return size[size.minAxis()];
}

bool isSweptByBullet(const btCollisionWorld& world, const btRigidBody& body, btScalar motion)
{
    const btScalar threshold = body.getCcdSquareMotionThreshold();
    return world.getDispatchInfo().m_useContinuous && threshold > 0 && threshold < motion * motion;
}

/// The point acts on the centre of a fast body. Where the shapes will touch, it would only turn a small one, which then
/// passes with much of its speed. Without friction: Bullet's direction of friction, the velocity less its normal part, is
/// off by rounding where a body is much faster along the normal, and would push it aside.
void addPoint(btPersistentManifold& manifold, const PairMotion& pair, const PairContact& contact)
{
    btManifoldPoint point(btVector3(0, 0, 0), contact.localB, contact.normal, contact.distance);
    point.m_positionWorldOnA = pair.a.start.getOrigin();
    point.m_positionWorldOnB = pair.b.start * contact.localB;
    point.m_combinedRestitution = point.m_combinedFriction = 0;
    constexpr bool kIsPredictive = true;
    manifold.addManifoldPoint(point, kIsPredictive);
}
}  // namespace

struct WorldSpeculation::Parts
{
    btScalar least = 0;  ///< motion, in thinnest sides
    SpeculationStats stats;
    std::vector<btCollisionObject*> found;
    std::vector<PairContact> contacts;

    bool isFast(const btCollisionWorld& world, const btRigidBody& body, btScalar timeStep) const
    {
        if (!body.isActive() || body.isStaticOrKinematicObject() || !body.hasContactResponse())
            return false;
        const btScalar distance = body.getLinearVelocity().length() * timeStep;
        // Infinite or NaN motions are none.
        return distance > least * thinnestSide(*body.getCollisionShape()) && distance < BT_LARGE_FLOAT &&
               !isSweptByBullet(world, body, distance);
    }
    void findCandidates(btCollisionWorld& world, btRigidBody& body, btScalar timeStep)
    {
        const BodyMotion motion(body);
        btVector3 low, high, lowEnd, highEnd;
        body.getCollisionShape()->getAabb(motion.start, low, high);
        body.getCollisionShape()->getAabb(motion.at(timeStep), lowEnd, highEnd);
        low.setMin(lowEnd);
        high.setMax(highEnd);
        Candidates candidates(world, body, found);
        world.getBroadphase()->aabbTest(low, high, candidates);
        candidates.sort();
    }
    void find(btCollisionWorld& world, btRigidBody& body,
              btAlignedObjectArray<btPersistentManifold*>& predictive, btScalar timeStep)
    {
        findCandidates(world, body, timeStep);
        const btScalar touch = btMin(btScalar(0.01), thinnestSide(*body.getCollisionShape()) / 20);
        for (btCollisionObject* const other : found)
        {
            PairMotion pair{BodyMotion(body), BodyMotion(*other)};
            contacts.clear();
            stats.queries += findContacts(pair, world, timeStep, touch, contacts);
            if (contacts.empty())
                continue;
            // The manifold must not be lost for want of memory.
            if (predictive.size() == predictive.capacity())
                predictive.reserve(2 * predictive.size() + 8);
            btPersistentManifold* const manifold = world.getDispatcher()->getNewManifold(&body, other);
            predictive.push_back(manifold);
            for (const PairContact& contact : contacts)
                addPoint(*manifold, pair, contact);
            stats.contacts += contacts.size();
        }
        stats.pairs += found.size();
    }
};

WorldSpeculation::WorldSpeculation() : m(std::make_unique<Parts>()) {}

WorldSpeculation::~WorldSpeculation() = default;

void WorldSpeculation::setMotion(btScalar motion)
{
    m->least = motion;
}

bool WorldSpeculation::isOn() const
{
    return m->least > 0;
}

void WorldSpeculation::find(btCollisionWorld& world, const btAlignedObjectArray<btRigidBody*>& bodies,
                            btAlignedObjectArray<btPersistentManifold*>& predictive, btScalar timeStep)
{
    BT_PROFILE("speculative contacts");
    m->stats = {};
    for (int i = 0; i < bodies.size(); ++i)
    {
        if (!m->isFast(world, *bodies[i], timeStep))
            continue;
        ++m->stats.bodies;
        m->find(world, *bodies[i], predictive, timeStep);
    }
}

const SpeculationStats& WorldSpeculation::stats() const
{
    return m->stats;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
