// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/soak/soak_checks.h"
#include "cullet/tests/soak/soak_world.h"
#include "cullet/tests/support/number_hash.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletDynamicsCommon.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
/// A body with a shape of its own.
struct SoakBody
{
    std::unique_ptr<btCollisionShape> shape;
    std::unique_ptr<btRigidBody> body;
};

/// A world of bodies and the operations on it.
class BodyChurn
{
public:
    BodyChurn(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts)
        : m_random(seed),
          m_chooser(circumstances.seed ^ seed),
          m_counts(counts),
          m_mistake(circumstances.mistake),
          m_pairs(m_margin)
    {
        const std::uint32_t size = m_random.below(20);
        m_target = size < 14   ? 4 + m_random.below(40)
                   : size < 19 ? 40 + m_random.below(120)
                               : 520 + m_random.below(kMostBodies - 519);
        if (circumstances.isLargest)
            m_target = kMostBodies;
        const float far[] = {0, 0, 0, 300, 2e4f};
        m_centre = toVector(m_random.point(-1, 1)) * btScalar(far[m_random.below(5)]);
        makeWorld(circumstances.isLargest);
        addGround();
        if (m_random.chance(0.3f))
            addGhost();
    }
    ~BodyChurn()
    {
        if (m_hasGhost)
            m_world->removeCollisionObject(&m_ghost);
        while (!m_bodies.empty())
            remove(m_bodies.size() - 1);
        m_world->removeRigidBody(m_ground.body.get());
    }
    BodyChurn(const BodyChurn&) = delete;
    BodyChurn& operator=(const BodyChurn&) = delete;

    std::uint64_t run()
    {
        const int steps = 15 + static_cast<int>(m_random.below(m_target < 200 ? 90 : 15));
        bool wasChecked = false;
        for (m_step = 0; m_step < steps; ++m_step)
        {
            change();
            step();
            if (m_mistake == SoakMistake::Leak)
                m_leak = new char[100];
            ++m_counts.steps;
            const bool isChecked = m_target < 130 || m_random.chance(0.2f);
            if (isChecked)
                check(wasChecked);
            wasChecked = isChecked;
            m_totals.check(m_step, m_broadphase->stats());
            if (m_own)
                m_totals.check(m_step, m_own->stats());
            else if (m_registration != nullptr)
                m_totals.check(m_step, m_registration->stats());
            hashStep();
        }
        return m_hash.value();
    }

private:
    static constexpr double m_margin = 0.05;
    static constexpr std::uint32_t kMostBodies = 820;

    void makeWorld(bool isLargest)
    {
        const std::uint32_t narrow = isLargest ? 3 : m_random.below(4);
        DispatcherOptions options;
        options.threads = 1 + static_cast<int>(m_chooser.below(3));
        options.isaGjk.boxPairs = m_random.chance(0.5f) ? BoxPairs::IsaGjk : BoxPairs::SeparatingAxes;
        if (narrow >= 2)
            m_dispatcher = &m_own.emplace(&m_configuration, options);
        else
            m_dispatcher = &m_plain.emplace(&m_configuration);
        if (narrow == 1)
            m_registration = &registerIsaGjk(*m_dispatcher, options.isaGjk);
        BroadphaseOptions broadphase;
        broadphase.margin = btScalar(m_margin);
        broadphase.threads = 1 + static_cast<int>(m_chooser.below(3));
        broadphase.grid.flatLimit = m_chooser.chance(0.5f) ? 0 : GridOptions::kMeasured;
        broadphase.backend = m_chooser.chance(0.2f) ? BackendChoice::Brute : BackendChoice::Grid;
        m_broadphase = std::make_unique<Broadphase>(broadphase);
        m_broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostCallback);
        if (m_chooser.chance(0.5f))
            m_world = std::make_unique<World<btDiscreteDynamicsWorld>>(m_dispatcher, m_broadphase.get(),
                                                                       &m_solver, &m_configuration);
        else
            m_world = std::make_unique<btDiscreteDynamicsWorld>(m_dispatcher, m_broadphase.get(), &m_solver,
                                                                &m_configuration);
    }

    void addGround()
    {
        m_ground.shape = std::make_unique<btBoxShape>(btVector3(30, 1, 30));
        m_ground.body = std::make_unique<btRigidBody>(btScalar(0), nullptr, m_ground.shape.get());
        m_ground.body->setWorldTransform(
            btTransform(btQuaternion::getIdentity(), m_centre - btVector3(0, 3, 0)));
        m_world->addRigidBody(m_ground.body.get());
    }
    void addGhost()
    {
        m_hasGhost = true;
        m_ghost.setCollisionShape(&m_zone);
        m_ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), m_centre));
        m_ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
        m_world->addCollisionObject(&m_ghost);
    }

    std::unique_ptr<btCollisionShape> drawShape()
    {
        const float size = m_random.chance(0.1f) ? m_random.logUniform(-4, 2) : m_random.between(0.2f, 0.6f);
        switch (m_random.below(8))
        {
            case 0:
                return std::make_unique<btSphereShape>(btScalar(size));
            case 1:
                return std::make_unique<btBoxShape>(toVector(m_random.point(0.3f, 1)) * btScalar(size));
            case 2:
                return std::make_unique<btCapsuleShape>(btScalar(0.5f * size), btScalar(size));
            case 3:
                return std::make_unique<btCylinderShape>(toVector(m_random.point(0.5f, 1)) * btScalar(size));
            default:
                return drawHull(size);
        }
    }
    std::unique_ptr<btCollisionShape> drawHull(float size)
    {
        auto hull = std::make_unique<btConvexHullShape>();
        const std::uint32_t count = m_random.chance(0.5f) ? 8 : 5 + m_random.below(60);
        for (std::uint32_t i = 0; i < count; ++i)
        {
            // Bricks, whose faces are level, and clouds.
            const btVector3 corner((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
            hull->addPoint((count == 8 ? corner : toVector(m_random.point(-1, 1))) * btScalar(size), false);
        }
        hull->recalcLocalAabb();
        if (m_random.chance(0.1f))
            prepare(*hull);
        ++m_counts.hulls;
        return hull;
    }

    void add(const btVector3& at)
    {
        SoakBody made;
        made.shape = drawShape();
        btVector3 inertia(0, 0, 0);
        made.shape->calculateLocalInertia(1, inertia);
        made.body = std::make_unique<btRigidBody>(btScalar(1), nullptr, made.shape.get(), inertia);
        const btVector3 axis = toVector(m_random.point(-1, 1));
        const btQuaternion turn(axis.x(), axis.y(), axis.z(), btScalar(m_random.between(0.1f, 1)));
        made.body->setWorldTransform(btTransform(turn.normalized(), at));
        made.body->setInterpolationWorldTransform(made.body->getWorldTransform());
        m_world->addRigidBody(made.body.get());
        m_bodies.push_back(std::move(made));
    }
    void remove(std::size_t index)
    {
        SoakBody& gone = m_bodies[index];
        m_world->removeRigidBody(gone.body.get());
        if (gone.shape->getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE)
            invalidate(static_cast<const btConvexHullShape&>(*gone.shape));
        std::swap(gone, m_bodies.back());
        m_bodies.pop_back();
    }

    void change()
    {
        // Away for good: fallen off the ground, or thrown.
        for (std::size_t i = m_bodies.size(); i-- > 0;)
            if (!((m_bodies[i].body->getWorldTransform().getOrigin() - m_centre).length() < btScalar(60)))
                remove(i);
        pour();
        switch (m_random.below(40))
        {
            case 0:
                clear();
                break;
            case 1:
                teleport();
                break;
            case 2:
                editHulls();
                break;
            case 3:
                for (std::uint32_t i = m_random.below(8); i > 0 && !m_bodies.empty(); --i)
                    remove(m_random.below(static_cast<std::uint32_t>(m_bodies.size())));
                break;
            default:
                break;
        }
    }
    void pour()
    {
        for (int i = 0; i < 1 + static_cast<int>(m_target / 8) && m_bodies.size() < m_target; ++i)
        {
            const float wide = 0.6f * std::cbrt(static_cast<float>(m_target));
            const btVector3 at = toVector(m_random.point(-wide, wide));
            add(m_centre + btVector3(at.x(), btScalar(std::fabs(double(at.y()))), at.z()));
        }
    }
    void clear()
    {
        while (!m_bodies.empty())
            remove(m_bodies.size() - 1);
        if (!m_random.chance(0.5f))
            return;
        m_world->removeRigidBody(m_ground.body.get());
        if (m_hasGhost)
            m_world->removeCollisionObject(&m_ghost);
        m_broadphase->resetPool(m_dispatcher);
        m_hasNewIds = true;
        m_world->addRigidBody(m_ground.body.get());
        if (m_hasGhost)
            m_world->addCollisionObject(&m_ghost);
    }
    void teleport()
    {
        for (const SoakBody& body : m_bodies)
        {
            body.body->setWorldTransform(btTransform(body.body->getWorldTransform().getBasis(),
                                                     m_centre + toVector(m_random.point(-3, 3))));
            body.body->setInterpolationWorldTransform(body.body->getWorldTransform());
            body.body->activate(true);
        }
        if (m_hasGhost)
            m_ghost.getWorldTransform().setOrigin(m_centre + toVector(m_random.point(-2, 2)));
    }
    /// Points of shapes in use are changed, as the contract with Bullet allows between steps.
    void editHulls()
    {
        for (const SoakBody& body : m_bodies)
        {
            if (body.shape->getShapeType() != CONVEX_HULL_SHAPE_PROXYTYPE || !m_random.chance(0.2f))
                continue;
            auto& hull = static_cast<btConvexHullShape&>(*body.shape);
            hull.getUnscaledPoints()[0] *= btScalar(m_random.between(0.7f, 1.2f));
            hull.recalcLocalAabb();
        }
    }

    void step()
    {
        const auto go = [this] { m_world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60); };
        if (m_chooser.chance(0.01f))
            std::thread(go).join();
        else
            go();
    }

    void check(bool wasChecked)
    {
        std::vector<btBroadphaseProxy*> proxies;
        for (int i = 0; i < m_world->getNumCollisionObjects(); ++i)
            proxies.push_back(m_world->getCollisionObjectArray()[i]->getBroadphaseHandle());
        // Bullet finds pairs before it moves the bodies, and gives them their new boxes in the next step.
        const bool loses = m_mistake == SoakMistake::LostPair && ++m_checked == 40;
        m_pairs.setGhost(m_ghost.getBroadphaseHandle());
        m_pairs.check(m_step, proxies, *m_world->getPairCache(), wasChecked && !m_hasNewIds, m_counts, loses);
        m_hasNewIds = false;
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
            checkManifold(*m_dispatcher->getManifoldByIndexInternal(i));
    }
    void checkManifold(const btPersistentManifold& manifold)
    {
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            const btManifoldPoint& point = manifold.getContactPoint(k);
            const double length = double(point.m_normalWorldOnB.length());
            if (!(std::fabs(length - 1) < 1e-3) || !(std::fabs(double(point.getDistance())) < 100))
                throw SoakFault(m_step, "a contact with a normal of length " + std::to_string(length) +
                                            " and a distance of " + std::to_string(point.getDistance()));
            ++m_counts.contacts;
        }
    }

    void hashStep()
    {
        for (const SoakBody& body : m_bodies)
        {
            m_hash.addVector(body.body->getWorldTransform().getOrigin());
            m_hash.addVector(body.body->getWorldTransform().getBasis()[0]);
        }
        const btBroadphasePairArray& pairs = m_world->getPairCache()->getOverlappingPairArray();
        for (int i = 0; i < pairs.size(); ++i)
        {
            m_hash.add(pairs[i].m_pProxy0->m_uniqueId);
            m_hash.add(pairs[i].m_pProxy1->m_uniqueId);
        }
    }

    Random m_random;   ///< of the world
    Random m_chooser;  ///< of what changes nothing
    SoakCounts& m_counts;
    SoakMistake m_mistake;
    SoakPairs m_pairs;
    SoakTotals m_totals;
    NumberHash m_hash;
    std::uint32_t m_target = 0;
    btVector3 m_centre;
    bool m_hasGhost = false, m_hasNewIds = false;
    int m_step = 0, m_checked = 0;
    char* m_leak = nullptr;  ///< of SoakMistake::Leak
    btDefaultCollisionConfiguration m_configuration;
    // At the same address in each world of a thread: a registration stays for each address that a dispatcher ever had.
    std::optional<Dispatcher> m_own;
    std::optional<btCollisionDispatcher> m_plain;
    btCollisionDispatcher* m_dispatcher = nullptr;
    IsaGjkRegistration* m_registration = nullptr;
    btGhostPairCallback m_ghostCallback;
    std::unique_ptr<Broadphase> m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    btSphereShape m_zone{btScalar(1.5)};
    btPairCachingGhostObject m_ghost;
    SoakBody m_ground;
    std::vector<SoakBody> m_bodies;
};
}  // namespace

std::uint64_t soakBodies(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts)
{
    BodyChurn churn(seed, circumstances, counts);
    const std::uint64_t hash = churn.run();
    ++counts.worlds;
    return hash;
}
}  // namespace cullet::test
