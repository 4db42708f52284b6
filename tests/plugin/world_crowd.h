// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <btBulletDynamicsCommon.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <memory>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace cullet::test
{
/// A shape of an application: its box is computed at the first request, without a lock.
class LazyBox final : public btBoxShape
{
public:
    using btBoxShape::btBoxShape;
    void getAabb(const btTransform& transform, btVector3& min, btVector3& max) const override
    {
        foreignCalls += std::this_thread::get_id() != m_maker;
        if (!m_isKnown)
            m_halfExtents = getHalfExtentsWithMargin();
        m_isKnown = true;
        btTransformAabb(m_halfExtents, 0, transform, min, max);
    }
    mutable std::atomic<int> foreignCalls{0};

private:
    std::thread::id m_maker = std::this_thread::get_id();
    mutable bool m_isKnown = false;
    mutable btVector3 m_halfExtents;
};

/// One of every kind of moving shape: first those with a thread-safe getAabb(), then the others.
class MixedShapes
{
public:
    MixedShapes()
    {
        add<btSphereShape>(btScalar(0.4));
        add<btBoxShape>(vec(0.4, 0.3, 0.5));
        add<btCapsuleShape>(btScalar(0.3), btScalar(0.4));
        add<btCapsuleShapeX>(btScalar(0.3), btScalar(0.4));
        add<btCapsuleShapeZ>(btScalar(0.3), btScalar(0.4));
        add<btCylinderShape>(vec(0.4, 0.3, 0.4));
        add<btCylinderShapeX>(vec(0.3, 0.4, 0.4));
        add<btConeShape>(btScalar(0.4), btScalar(0.8));
        add<btConeShapeZ>(btScalar(0.4), btScalar(0.8));
        add<btBU_Simplex1to4>(vec(0, 0, 0), vec(0.6, 0, 0), vec(0, 0.6, 0), vec(0, 0, 0.6));
        const btVector3 centres[] = {vec(-0.3, 0, 0), vec(0.3, 0, 0)};
        const btScalar radii[] = {btScalar(0.3), btScalar(0.2)};
        add<btMultiSphereShape>(centres, radii, 2);
        auto& hull = add<btConvexHullShape>();
        for (int corner = 0; corner < 8; ++corner)
            hull.addPoint(vec(corner & 1, (corner >> 1) & 1, corner >> 2) * btScalar(0.7));
        auto& compound = add<btCompoundShape>();
        btTransform shift = btTransform::getIdentity();
        shift.setOrigin(vec(0.3, 0, 0));
        compound.addChildShape(shift, shapes[0].get());
        pureCount = shapes.size();

        lazy = &add<LazyBox>(vec(0.4, 0.4, 0.4));
        add<btUniformScalingShape>(static_cast<btConvexShape*>(shapes[0].get()), btScalar(0.8));
        add<btMinkowskiSumShape>(static_cast<btConvexShape*>(shapes[0].get()),
                                 static_cast<btConvexShape*>(shapes[1].get()));
        add<btConvex2dShape>(static_cast<btConvexShape*>(shapes[1].get()));
    }

    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::size_t pureCount = 0;
    LazyBox* lazy = nullptr;

private:
    template <class Shape, class... Args>
    Shape& add(Args&&... args)
    {
        auto shape = std::make_unique<Shape>(std::forward<Args>(args)...);
        Shape& added = *shape;
        shapes.push_back(std::move(shape));
        return added;
    }
};

/// Bodies of all shapes that fall on a plane: dynamic, fast, kinematic, static, asleep, and one that is too large.
class Crowd
{
public:
    static constexpr int kBodies = 600;

    explicit Crowd(btCollisionWorld& world) : m_world(world)
    {
        add(&m_plane, 0, vec(0, 0, 0));
        Random random(7);
        for (int i = 0; i < kBodies; ++i)
        {
            btCollisionShape* shape = shapes.shapes[std::size_t(i) % shapes.shapes.size()].get();
            const btVector3 cell = vec(1.4 * (i % 21), 0.9 + 1.4 * (i / 441), 1.4 * (i / 21 % 21));
            add(shape, i % 11 == 0 ? 0 : 1, cell + vec(random.point(0, 0.2f)));
            btRigidBody& body = *bodies.back();
            body.setLinearVelocity(vec(random.between(-2, 2), 0, i % 50 == 1 ? 200 : 0));
            body.setAngularVelocity(vec(0, random.between(-3, 3), 1));
            if (i % 11 == 0 && i % 2 == 0)
                body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
            if (i % 13 == 0)
                body.forceActivationState(ISLAND_SLEEPING);
        }
        add(&m_huge, 0, vec(0, 3e6, 0));
        bodies.back()->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    }
    ~Crowd()
    {
        for (auto& body : bodies)
            m_world.removeCollisionObject(body.get());
    }
    Crowd(const Crowd&) = delete;
    Crowd& operator=(const Crowd&) = delete;

    const btRigidBody& hugeBody() const { return *bodies.back(); }

    /// Moves the bodies of a world without dynamics.
    void drift(int step)
    {
        for (std::size_t i = 0; i < bodies.size(); i += 3)
        {
            btTransform& transform = bodies[i]->getWorldTransform();
            transform.setOrigin(transform.getOrigin() + vec(0.02 * double(i % 5), 0, 0.01 * (step % 7)));
        }
    }

    MixedShapes shapes;
    std::vector<std::unique_ptr<btRigidBody>> bodies;

private:
    void add(btCollisionShape* shape, double mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape->calculateLocalInertia(btScalar(mass), inertia);
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, shape, inertia));
        bodies.back()->setWorldTransform(
            btTransform(btQuaternion(vec(1, 1, 0), btScalar(bodies.size())), at));
        bodies.back()->setInterpolationWorldTransform(bodies.back()->getWorldTransform());
        if (auto* dynamics = dynamic_cast<btDynamicsWorld*>(&m_world))
            dynamics->addRigidBody(bodies.back().get());
        else
            m_world.addCollisionObject(bodies.back().get());
    }

    btCollisionWorld& m_world;
    btStaticPlaneShape m_plane{vec(0, 1, 0), 0};
    btBoxShape m_huge{vec(8e5, 1, 1)};
};

/// Hash of all state that boxes may influence, bit by bit: boxes, transforms, activation, pairs and their order.
inline std::uint64_t hashOfWorld(btCollisionWorld& world)
{
    std::uint64_t hash = 14695981039346656037ull;
    const auto mix = [&hash](std::uint64_t bits) { hash = (hash ^ bits) * 1099511628211ull; };
    const auto mixVector = [&mix](const btVector3& vector)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &vector[axis], sizeof(btScalar));
            mix(bits);
        }
    };
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btCollisionObject& object = *world.getCollisionObjectArray()[i];
        btVector3 min, max;
        world.getBroadphase()->getAabb(const_cast<btBroadphaseProxy*>(object.getBroadphaseHandle()), min,
                                       max);
        mixVector(min);
        mixVector(max);
        mixVector(object.getWorldTransform().getOrigin());
        mixVector(object.getWorldTransform().getBasis()[1]);
        mix(std::uint64_t(object.getActivationState()));
    }
    const btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
        mix(std::uint64_t(idOf(pairs[i].m_pProxy0)) << 32 | idOf(pairs[i].m_pProxy1));
    return hash;
}
}  // namespace cullet::test
