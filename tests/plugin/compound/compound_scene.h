// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <LinearMath/btPoolAllocator.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <memory>
#include <tuple>
#include <vector>

namespace cullet::test
{
inline btTransform at(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
}

/// A point of a manifold of children: all that a solver reads, but not its age.
struct ChildContact
{
    int body0, body1;    ///< user indices
    int index0, index1;  ///< of the children
    btVector3 onA, onB, normal;
    btScalar distance, friction;

    auto key() const
    {
        return std::make_tuple(body0, body1, index0, index1, onA.x(), onA.y(), onA.z(), onB.x(), onB.y(),
                               onB.z(), normal.x(), normal.y(), normal.z(), distance, friction);
    }
    bool operator==(const ChildContact& other) const { return key() == other.key(); }
};

enum class CompoundLoop
{
    Bullets,
    Own
};

/// Objects whose contacts are found without a simulation.
class CompoundScene
{
public:
    explicit CompoundScene(CompoundLoop loop, int threads = 1)
        : m_dispatcher(&m_configuration, optionsOf(loop, threads)),
          m_world(&m_dispatcher, &m_broadphase, &m_configuration)
    {
    }
    ~CompoundScene() { clear(); }
    CompoundScene(const CompoundScene&) = delete;
    CompoundScene& operator=(const CompoundScene&) = delete;

    btCollisionObject& add(btCollisionShape& shape, const btTransform& at, bool isStatic = false)
    {
        m_objects.push_back(std::make_unique<btCollisionObject>());
        btCollisionObject& object = *m_objects.back();
        object.setCollisionShape(&shape);
        object.setWorldTransform(at);
        object.setUserIndex(static_cast<int>(m_objects.size()));
        object.setActivationState(DISABLE_DEACTIVATION);
        if (!isStatic)
            object.setCollisionFlags(0);
        m_world.addCollisionObject(&object, isStatic ? 2 : 1, isStatic ? 1 : 3);
        return object;
    }
    void clear()
    {
        for (const auto& object : m_objects)
            m_world.removeCollisionObject(object.get());
        m_objects.clear();
    }
    void step() { m_world.performDiscreteCollisionDetection(); }

    /// All contacts in the order of manifolds.
    std::vector<ChildContact> contacts()
    {
        std::vector<ChildContact> all;
        for (int i = 0; i < m_dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *m_dispatcher.getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
            {
                const btManifoldPoint& point = manifold.getContactPoint(k);
                all.push_back({manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex(),
                               point.m_index0, point.m_index1, point.m_positionWorldOnA,
                               point.m_positionWorldOnB, point.m_normalWorldOnB, point.m_distance1,
                               point.m_combinedFriction});
            }
        }
        return all;
    }
    /// Those that getAllContactManifolds() of the only pair names.
    btManifoldArray manifoldsOfPair()
    {
        btManifoldArray manifolds;
        pair().m_algorithm->getAllContactManifolds(manifolds);
        return manifolds;
    }
    btBroadphasePair& pair() { return m_broadphase.getOverlappingPairCache()->getOverlappingPairArray()[0]; }
    int manifoldCount() const { return m_dispatcher.getNumManifolds(); }
    int usedAlgorithms() { return m_configuration.getCollisionAlgorithmPool()->getUsedCount(); }
    Dispatcher& dispatcher() { return m_dispatcher; }
    btCollisionWorld& world() { return m_world; }

private:
    static DispatcherOptions optionsOf(CompoundLoop loop, int threads)
    {
        DispatcherOptions options;
        options.threads = threads;
        options.isaGjk.compounds = loop == CompoundLoop::Own;
        return options;
    }

    btDefaultCollisionConfiguration m_configuration;
    Dispatcher m_dispatcher;
    btDbvtBroadphase m_broadphase;
    btCollisionWorld m_world;
    std::vector<std::unique_ptr<btCollisionObject>> m_objects;
};
}  // namespace cullet::test
