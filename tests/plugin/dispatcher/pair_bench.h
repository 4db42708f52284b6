// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/dispatcher/doomed_body.h"

#include <cstddef>
#include <deque>

namespace cullet::test
{
/// A dispatcher, and pairs that a test adds to a cache directly.
class PairBench
{
public:
    ~PairBench()
    {
        for (DoomedBody& body : bodies)
            cache.removeOverlappingPairsContainingProxy(&body.proxy, &dispatcher);
    }

    /// @param gap between two adjacent cubes of edge 1
    btBroadphasePair& addPair(btCollisionShape& cube, double gap)
    {
        const double z = 10.0 * double(bodies.size());
        for (const double x : {0.0, 1.0 + gap})
        {
            bodies.emplace_back(cube, vec(x, 0, z)).proxy.m_uniqueId = int(bodies.size());
            bodies.back().get()->setActivationState(DISABLE_DEACTIVATION);
        }
        return *cache.addOverlappingPair(&bodies[bodies.size() - 2].proxy, &bodies.back().proxy);
    }
    void setShape(btCollisionShape& shape)
    {
        for (DoomedBody& body : bodies)
            body.get()->setCollisionShape(&shape);
    }
    void dispatch(int times = 1)
    {
        for (int i = 0; i < times; ++i)
            dispatcher.dispatchAllCollisionPairs(&cache, {}, &dispatcher);
    }
    int contactsOfPair(std::size_t pair)
    {
        int count = 0;
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            if (manifold.getBody0() == bodies[2 * pair].get() ||
                manifold.getBody1() == bodies[2 * pair].get())
                count += manifold.getNumContacts();
        }
        return count;
    }

    /// Moves the second body of a pair by a distance towards the first.
    void closeGap(std::size_t pair, double by)
    {
        btCollisionObject& body = *bodies[2 * pair + 1].get();
        btTransform at = body.getWorldTransform();
        at.setOrigin(at.getOrigin() - vec(by, 0, 0));
        body.setWorldTransform(at);
    }
    void setState(std::size_t pair, int state)
    {
        for (std::size_t i = 2 * pair; i < 2 * pair + 2; ++i)
            bodies[i].get()->forceActivationState(state);
    }

    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher{&configuration};
    btHashedOverlappingPairCache cache;
    std::deque<DoomedBody> bodies;
};
}  // namespace cullet::test
