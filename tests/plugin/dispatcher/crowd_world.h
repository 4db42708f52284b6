// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/dispatcher/manifold_log.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include <cmath>
#include <memory>
#include <ostream>
#include <random>
#include <utility>
#include <vector>

namespace cullet::test
{
/// What falls into a pit.
enum class Crowd
{
    Hulls,
    Boxes,
    Round,      ///< spheres and capsules
    Mixed,      ///< all convex shapes, a shape of a derived class among them
    Compounds,  ///< and boxes
    OnMesh,     ///< convex shapes on a mesh, a scaled mesh and a height field
    OnPlane     ///< convex shapes, with ghosts and bodies without response
};
inline constexpr Crowd kCrowds[] = {Crowd::Hulls,     Crowd::Boxes,  Crowd::Round,  Crowd::Mixed,
                                    Crowd::Compounds, Crowd::OnMesh, Crowd::OnPlane};

inline void PrintTo(Crowd crowd, std::ostream* out)
{
    constexpr const char* kNames[] = {"Hulls", "Boxes", "Round", "Mixed", "Compounds", "OnMesh", "OnPlane"};
    *out << kNames[static_cast<int>(crowd)];
}

/// A ball of the application: its functions might write to it.
class OwnBall : public btSphereShape
{
public:
    using btSphereShape::btSphereShape;
};

/// The shapes of a crowd and its ground.
class CrowdShapes
{
public:
    CrowdShapes()
    {
        for (unsigned i = 0; i < 4; ++i)
            m_hulls.push_back(
                makeHullShape(i == 0 ? boxPoints(0.4, 0.3, 0.35) : ballPoints(14 + 6 * i, 0.45, i)));
        m_compound.addChildShape(at(-0.3, 0), &m_box);
        m_compound.addChildShape(at(0.3, 0.2), m_hulls[1].get());
        m_compound.addChildShape(at(0.1, -0.2), &m_sphere);
        for (std::size_t i = 0; i < std::size(m_heights); ++i)
            m_heights[i] = heightAt(int(i % kGrid), int(i / kGrid));
        for (int x = 0; x + 1 < kGrid; ++x)
        {
            for (int z = 0; z + 1 < kGrid; ++z)
                addCell(x, z);
        }
        m_mesh = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
        m_scaled = std::make_unique<btScaledBvhTriangleMeshShape>(m_mesh.get(), vec(1, 0.5, 1));
        m_field = std::make_unique<btHeightfieldTerrainShape>(kGrid, kGrid, m_heights, btScalar(-1),
                                                              btScalar(1), 1, false);
    }

    btCollisionShape* shapeOf(Crowd crowd, int i)
    {
        const auto n = std::size_t(i);
        switch (crowd)
        {
            case Crowd::Hulls:
                return m_hulls[n % m_hulls.size()].get();
            case Crowd::Boxes:
                return &m_box;
            case Crowd::Round:
                return i % 2 == 0 ? static_cast<btCollisionShape*>(&m_sphere) : &m_capsule;
            case Crowd::Compounds:
                return i % 2 == 0 ? static_cast<btCollisionShape*>(&m_compound) : &m_box;
            default:
            {
                btCollisionShape* const all[] = {m_hulls[n % m_hulls.size()].get(),
                                                 &m_box,
                                                 &m_sphere,
                                                 &m_capsule,
                                                 &m_cylinder,
                                                 &m_cone,
                                                 &m_ownBall,
                                                 m_hulls[0].get()};
                return all[n % std::size(all)];
            }
        }
    }

    btBoxShape ground{vec(8, 0.5, 8)}, wall{vec(0.5, 3, 8)};
    btStaticPlaneShape plane{vec(0, 1, 0), 0};
    btCollisionShape* grounds(int i)
    {
        btCollisionShape* const all[] = {m_mesh.get(), m_scaled.get(), m_field.get()};
        return all[i];
    }

private:
    static constexpr int kGrid = 9;

    static btTransform at(double x, double y)
    {
        return btTransform(btQuaternion::getIdentity(), vec(x, y, 0));
    }
    static float heightAt(int x, int z) { return 0.5f * std::sin(float(x)) * std::cos(0.7f * float(z)); }
    static btVector3 corner(int x, int z)
    {
        return vec(x - kGrid / 2, double(heightAt(x, z)), z - kGrid / 2);
    }
    void addCell(int x, int z)
    {
        m_triangles.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
        m_triangles.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
    }

    std::vector<std::unique_ptr<btConvexHullShape>> m_hulls;
    btBoxShape m_box{vec(0.4, 0.35, 0.4)};
    OwnBall m_ownBall{btScalar(0.35)};
    btSphereShape m_sphere{btScalar(0.4)};
    btCapsuleShape m_capsule{btScalar(0.3), btScalar(0.4)};
    btCylinderShape m_cylinder{vec(0.4, 0.3, 0.4)};
    btConeShape m_cone{btScalar(0.4), btScalar(0.8)};
    btCompoundShape m_compound;
    float m_heights[kGrid * kGrid];
    btTriangleMesh m_triangles;
    std::unique_ptr<btBvhTriangleMeshShape> m_mesh;
    std::unique_ptr<btScaledBvhTriangleMeshShape> m_scaled;
    std::unique_ptr<btHeightfieldTerrainShape> m_field;
};

/// A crowd that falls onto its ground; bodies leave and join in every few steps.
class CrowdWorld
{
public:
    static constexpr int kBodies = 70;

    /// @param dispatcher made with `configuration`
    CrowdWorld(Crowd crowd, unsigned seed, std::unique_ptr<btDefaultCollisionConfiguration> configuration,
               std::unique_ptr<Dispatcher> made)
        : m_crowd(crowd),
          m_engine(seed),
          m_configuration(std::move(configuration)),
          m_dispatcher(std::move(made)),
          world(m_dispatcher.get(), &m_broadphase, &m_solver, m_configuration.get())
    {
        m_broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostPairs);
        addGround();
        for (int i = 0; i < kBodies; ++i)
            addBody();
        world.setInternalTickCallback(
            [](btDynamicsWorld* stepped, btScalar)
            { static_cast<CrowdWorld*>(stepped->getWorldUserInfo())->replaceInTick(); },
            this, true);
    }
    ~CrowdWorld()
    {
        for (const auto& ghost : m_ghosts)
            world.removeCollisionObject(ghost.get());
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
    }
    CrowdWorld(const CrowdWorld&) = delete;
    CrowdWorld& operator=(const CrowdWorld&) = delete;

    /// @param mass 0: static; others get a random rotation
    btRigidBody& add(btCollisionShape* shape, double mass, const btVector3& place)
    {
        const btTransform at(mass > 0 ? randomRotation(m_engine) : btQuaternion::getIdentity(), place);
        bodies.push_back(makeBodyAt(at, shape, mass));
        bodies.back()->setUserIndex(m_made++);
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
    void step()
    {
        if (m_steps % 7 == 3)
            replace();
        world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        ++m_steps;
    }
    /// @return a hash of all manifolds after each step
    std::vector<std::uint64_t> run(int steps)
    {
        std::vector<std::uint64_t> hashes;
        for (int i = 0; i < steps; ++i)
        {
            step();
            ManifoldLog log(m_crowd == Crowd::Compounds ? Places::Ignored : Places::Logged);
            log.add(*m_dispatcher, *m_broadphase.getOverlappingPairCache());
            points += log.points();
            hashes.push_back(log.hash() ^ hashOfBodies(bodies));
        }
        return hashes;
    }
    Dispatcher& dispatcher() { return *m_dispatcher; }
    const ContactStats& stats() const { return m_dispatcher->contactStats(); }

    int points = 0, replaced = 0;

private:
    void addGround()
    {
        if (m_crowd == Crowd::OnPlane)
            add(&m_shapes.plane, 0, vec(0, 0, 0));
        else if (m_crowd != Crowd::OnMesh)
            add(&m_shapes.ground, 0, vec(0, -0.5, 0));
        for (int i = 0; i < (m_crowd == Crowd::OnMesh ? 3 : 0); ++i)
            add(m_shapes.grounds(i), 0, vec(8 * i - 8, 0, 0));
        for (int i = 0; i < (m_crowd == Crowd::OnPlane ? 3 : 0); ++i)
            addGhost(vec(i - 1, 0.6, 0));
        btRigidBody& platform = add(&m_shapes.wall, 1, vec(-4, 0, 0));
        platform.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        platform.setActivationState(DISABLE_DEACTIVATION);
    }
    void addGhost(const btVector3& place)
    {
        m_ghosts.push_back(std::make_unique<btPairCachingGhostObject>());
        btGhostObject& ghost = *m_ghosts.back();
        ghost.setCollisionShape(m_shapes.shapeOf(m_crowd, int(m_ghosts.size())));
        ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
        ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
        ghost.setUserIndex(m_made++);
        world.addCollisionObject(&ghost);
    }
    void addBody()
    {
        std::uniform_real_distribution<double> any(-1.0, 1.0);
        const double x = any(m_engine), z = any(m_engine);
        const double spread = m_crowd == Crowd::OnMesh ? 9 : 2.2;
        const int i = m_made;
        btRigidBody& body =
            add(m_shapes.shapeOf(m_crowd, i), 1, vec(spread * x, 0.8 + 0.06 * (i % kBodies), 2.2 * z));
        body.setRestitution(btScalar(0.3));
        body.setRollingFriction(btScalar(0.01) * btScalar(i % 3));
        if (i % 11 == 5)
            body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
        if (i % 13 == 6)
            body.setContactStiffnessAndDamping(btScalar(1000), btScalar(10));
    }
    /// Removes a body that is not of the ground, and adds another.
    void replace()
    {
        const std::size_t first = bodies.size() - kBodies;
        const std::size_t which = first + m_engine() % kBodies;
        world.removeRigidBody(bodies[which].get());
        bodies.erase(bodies.begin() + std::ptrdiff_t(which));
        addBody();
        ++replaced;
    }
    void replaceInTick()
    {
        if (m_steps % 11 == 5)
            replace();
    }

    Crowd m_crowd;
    std::mt19937 m_engine;
    CrowdShapes m_shapes;
    std::unique_ptr<btDefaultCollisionConfiguration> m_configuration;
    std::unique_ptr<Dispatcher> m_dispatcher;
    btGhostPairCallback m_ghostPairs;
    btDbvtBroadphase m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;
    int m_made = 0, m_steps = 0;
    std::vector<std::unique_ptr<btPairCachingGhostObject>> m_ghosts;

public:
    btDiscreteDynamicsWorld world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

/// A dispatcher of the application, whose contacts take Bullet's path one by one.
class DerivedDispatcher : public Dispatcher
{
public:
    using Dispatcher::Dispatcher;
};

template <class Made = Dispatcher, class Configuration = btDefaultCollisionConfiguration>
std::unique_ptr<CrowdWorld> makeCrowd(Crowd crowd, unsigned seed, const DispatcherOptions& options)
{
    auto configuration = std::make_unique<Configuration>();
    auto dispatcher = std::make_unique<Made>(configuration.get(), options);
    return std::make_unique<CrowdWorld>(crowd, seed, std::move(configuration), std::move(dispatcher));
}

inline DispatcherOptions onThreadCount(int threads)
{
    DispatcherOptions options;
    options.threads = threads;
    return options;
}
}  // namespace cullet::test
