// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/shapes/hull_cache.h"
#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <ostream>
#include <random>
#include <vector>

namespace cullet::test
{
enum class Narrow
{
    Stock,      ///< Bullet's dispatcher and algorithms
    IsaGjk,     ///< Bullet's dispatcher with registerIsaGjk()
    Dispatcher  ///< cullet::Dispatcher
};

inline void PrintTo(Narrow narrow, std::ostream* out)
{
    constexpr const char* kNames[] = {"Bullet", "IsaGjk", "Dispatcher"};
    *out << kNames[static_cast<int>(narrow)];
}

/// @param mass 0: static
inline std::unique_ptr<btRigidBody> makeBodyAt(const btTransform& at, btCollisionShape* shape, double mass)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape->calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, shape, inertia);
    info.m_startWorldTransform = at;
    return std::make_unique<btRigidBody>(info);
}

/// A world with a selectable narrow phase; Bullet's tree is the broad phase.
class ConvexWorld
{
public:
    explicit ConvexWorld(Narrow narrow, int threads = 1, const IsaGjkOptions& isaGjk = {})
        : m_dispatcher(makeDispatcher(narrow, threads, isaGjk)),
          world(m_dispatcher.get(), &m_broadphase, &m_solver, &configuration)
    {
        if (narrow == Narrow::IsaGjk)
            m_registration = &registerIsaGjk(*m_dispatcher, isaGjk);
    }
    ~ConvexWorld()
    {
        for (auto& body : bodies)
            world.removeRigidBody(body.get());
    }
    ConvexWorld(const ConvexWorld&) = delete;
    ConvexWorld& operator=(const ConvexWorld&) = delete;

    /// @param mass 0: static
    btRigidBody& add(btCollisionShape* shape, double mass, const btTransform& at)
    {
        bodies.push_back(makeBodyAt(at, shape, mass));
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
    btRigidBody& add(btCollisionShape* shape, double mass, const btVector3& at)
    {
        return add(shape, mass, btTransform(btQuaternion::getIdentity(), at));
    }

    /// Five bodies in a row without gravity that never sleep: neighbours are near but do not touch.
    ///
    /// @param cube hull of edges 1
    void addIdleRow(btCollisionShape* cube)
    {
        for (int i = 0; i < 5; ++i)
            add(cube, 1, vec(1.12 * i, 0, 0)).setActivationState(DISABLE_DEACTIVATION);
        world.setGravity(vec(0, 0, 0));
    }

    void step(int count = 1)
    {
        for (int i = 0; i < count; ++i)
            world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }

    btCollisionDispatcher& dispatcher() { return *m_dispatcher; }
    IsaGjkStats stats() const { return m_own != nullptr ? m_own->stats() : m_registration->stats(); }
    btPersistentManifold* manifoldOf(const btCollisionObject& a, const btCollisionObject& b)
    {
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        {
            btPersistentManifold* manifold = m_dispatcher->getManifoldByIndexInternal(i);
            if ((manifold->getBody0() == &a && manifold->getBody1() == &b) ||
                (manifold->getBody0() == &b && manifold->getBody1() == &a))
                return manifold;
        }
        return nullptr;
    }
    int contactsOf(const btCollisionObject& a, const btCollisionObject& b)
    {
        const btPersistentManifold* manifold = manifoldOf(a, b);
        return manifold == nullptr ? 0 : manifold->getNumContacts();
    }
    /// Fingerprint of all transforms, bit by bit.
    std::uint64_t hash() const { return hashOfBodies(bodies); }

    btDefaultCollisionConfiguration configuration;

private:
    std::unique_ptr<btCollisionDispatcher> makeDispatcher(Narrow narrow, int threads,
                                                          const IsaGjkOptions& isaGjk)
    {
        DispatcherOptions options;
        options.isaGjk = isaGjk;
        options.threads = threads;
        if (narrow != Narrow::Dispatcher)
            return std::make_unique<btCollisionDispatcher>(&configuration);
        auto own = std::make_unique<Dispatcher>(&configuration, options);
        m_own = own.get();
        return own;
    }

    const Dispatcher* m_own = nullptr;  ///< declared before the member that sets it
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btDbvtBroadphase m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;
    IsaGjkRegistration* m_registration = nullptr;

public:
    btDiscreteDynamicsWorld world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

inline std::unique_ptr<btConvexHullShape> makeHullShape(const std::vector<btVector3>& points)
{
    auto shape = std::make_unique<btConvexHullShape>();
    for (const btVector3& point : points)
        shape->addPoint(point, false);
    shape->recalcLocalAabb();
    return shape;
}

inline std::vector<btVector3> boxPoints(double x, double y, double z)
{
    std::vector<btVector3> points;
    for (int i = 0; i < 8; ++i)
        points.push_back(vec(i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z));
    return points;
}

/// Random points on a sphere: nearly all are corners.
inline std::vector<btVector3> ballPoints(int count, double radius, unsigned seed)
{
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    std::vector<btVector3> points;
    for (int i = 0; i < count; ++i)
    {
        const double x = normal(engine), y = normal(engine), z = normal(engine);
        const double scale = radius / std::sqrt(x * x + y * y + z * z);
        points.push_back(vec(x * scale, y * scale, z * scale));
    }
    return points;
}

/// Three draws, from the last coordinate to the first: in the order in which GCC evaluates arguments, which
/// recorded hashes rely on.
template <class Distribution>
btVector3 drawVec(Distribution& distribution, std::mt19937& engine)
{
    const double z = distribution(engine), y = distribution(engine), x = distribution(engine);
    return vec(x, y, z);
}

inline btQuaternion randomRotation(std::mt19937& engine)
{
    std::normal_distribution<double> normal;
    const double x = normal(engine), y = normal(engine), z = normal(engine), w = normal(engine);
    return btQuaternion(btScalar(x), btScalar(y), btScalar(z), btScalar(w)).normalized();
}
}  // namespace cullet::test
