// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <vector>

/// A world with a ghost object, and a ghost callback that counts.
namespace cullet::test
{
/// A btGhostPairCallback that also checks that each pair enters once and leaves once.
struct CheckedGhostCallback final : btGhostPairCallback
{
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        EXPECT_EQ(++live[pairKey({idOf(a), idOf(b)})], 1) << "added twice";
        ++addedCount;
        return btGhostPairCallback::addOverlappingPair(a, b);
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher* dispatcher) override
    {
        EXPECT_EQ(live.erase(pairKey({idOf(a), idOf(b)})), 1u) << "removed without having been added";
        ++removedCount;
        sawNullDispatcher = sawNullDispatcher || dispatcher == nullptr;
        return btGhostPairCallback::removeOverlappingPair(a, b, dispatcher);
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override { ADD_FAILURE(); }
    std::map<std::uint64_t, int> live;
    int addedCount = 0;
    int removedCount = 0;
    bool sawNullDispatcher = false;
};

/// A collision world with a sphere shape; objects remove themselves before the world is destroyed.
class GhostWorld
{
public:
    explicit GhostWorld(btOverlappingPairCache* cache = nullptr) : broadphase(cache, bruteOptions())
    {
        world.getPairCache()->setInternalGhostPairCallback(&callback);
    }
    ~GhostWorld()
    {
        while (world.getNumCollisionObjects() > 0)
            world.removeCollisionObject(world.getCollisionObjectArray()[0]);
    }
    GhostWorld(const GhostWorld&) = delete;
    GhostWorld& operator=(const GhostWorld&) = delete;

    template <class Object>
    Object* add(const btVector3& at)
    {
        auto object = std::make_unique<Object>();
        object->setCollisionShape(&shape);
        object->getWorldTransform().setOrigin(at);
        world.addCollisionObject(object.get());
        Object* raw = object.get();
        objects.push_back(std::move(object));
        return raw;
    }
    void move(btCollisionObject* object, const btVector3& to)
    {
        object->getWorldTransform().setOrigin(to);
        world.updateSingleAabb(object);
    }

    std::vector<std::unique_ptr<btCollisionObject>> objects;
    btSphereShape shape{btScalar(0.5)};
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    CheckedGhostCallback callback;
    Broadphase broadphase;
    btCollisionWorld world{&dispatcher, &broadphase, &configuration};
};
}  // namespace cullet::test
