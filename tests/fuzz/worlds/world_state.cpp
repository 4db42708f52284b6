// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What is compared of a twin.

#include "cullet/tests/fuzz/worlds/world_twin.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <utility>

namespace cullet::test
{
namespace
{
/// FNV-1a over words.
class Bits
{
public:
    void add(std::uint64_t word) { m_hash = (m_hash ^ word) * 1099511628211ull; }
    void add(btScalar value)
    {
        std::uint64_t word = 0;
        std::memcpy(&word, &value, sizeof value);
        // The sign and the payload of a NaN are no result.
        add(value == value ? word : ~std::uint64_t(0));
    }
    void add(const btVector3& value)
    {
        for (int axis = 0; axis < 3; ++axis)
            add(value[axis]);
    }
    void add(const btTransform& pose)
    {
        add(pose.getOrigin());
        for (int row = 0; row < 3; ++row)
            add(pose.getBasis()[row]);
    }
    std::uint64_t hash() const { return m_hash; }

private:
    std::uint64_t m_hash = 14695981039346656037ull;
};

int idOf(const btCollisionObject& object)
{
    const btBroadphaseProxy* proxy = object.getBroadphaseHandle();
    return proxy == nullptr ? 0 : proxy->m_uniqueId;
}

std::uint64_t bitsOf(const btManifoldPoint& point)
{
    Bits bits;
    bits.add(point.getPositionWorldOnA());
    bits.add(point.getPositionWorldOnB());
    bits.add(point.m_normalWorldOnB);
    bits.add(point.getDistance());
    bits.add(point.m_appliedImpulse);
    return bits.hash();
}
}  // namespace

void WorldTwin::answer(btScalar value)
{
    Bits bits;
    bits.add(value);
    m_answers.push_back(bits.hash());
}

void WorldTwin::answer(const btVector3& value)
{
    Bits bits;
    bits.add(value);
    m_answers.push_back(bits.hash());
}

void WorldTwin::answer(const btCollisionObject* object)
{
    m_answers.push_back(object == nullptr ? 0 : static_cast<std::uint64_t>(idOf(*object)));
}

std::uint64_t WorldTwin::slotBits(std::size_t slot)
{
    const btCollisionObject* object = m_slots[slot].object.get();
    if (object == nullptr)
        return 0;
    Bits bits;
    bits.add(static_cast<std::uint64_t>(idOf(*object)));
    bits.add(object->getWorldTransform());
    bits.add(object->getInterpolationWorldTransform());
    bits.add(static_cast<std::uint64_t>(object->getActivationState()));
    bits.add(static_cast<std::uint64_t>(object->getCollisionFlags()));
    bits.add(object->getBroadphaseHandle()->m_aabbMin);
    bits.add(object->getBroadphaseHandle()->m_aabbMax);
    if (const btRigidBody* body = btRigidBody::upcast(object))
    {
        bits.add(body->getLinearVelocity());
        bits.add(body->getAngularVelocity());
    }
    if (const btGhostObject* ghost = btGhostObject::upcast(object))
        for (int i = 0; i < ghost->getNumOverlappingObjects(); ++i)
            bits.add(static_cast<std::uint64_t>(idOf(*ghost->getOverlappingObject(i))));
    return bits.hash();
}

void WorldTwin::addPairs(State& state)
{
    Bits bits;
    const btBroadphasePairArray& pairs = m_world->getPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
    {
        bits.add(static_cast<std::uint64_t>(pairs[i].m_pProxy0->m_uniqueId));
        bits.add(static_cast<std::uint64_t>(pairs[i].m_pProxy1->m_uniqueId));
    }
    state.add("number of pairs", static_cast<std::uint64_t>(pairs.size()));
    state.add("order of pairs", bits.hash());
}

void WorldTwin::addManifolds(State& state)
{
    // Until the next step Bullet keeps predictive manifolds, whose bodies may have been destroyed.
    if (m_settings.hasContinuous)
        return;
    for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *m_dispatcher->getManifoldByIndexInternal(i);
        Bits bits;
        bits.add(static_cast<std::uint64_t>(idOf(*manifold.getBody0())));
        bits.add(static_cast<std::uint64_t>(idOf(*manifold.getBody1())));
        for (int point = 0; point < manifold.getNumContacts(); ++point)
            bits.add(bitsOf(manifold.getContactPoint(point)));
        state.add("manifold " + std::to_string(i), bits.hash());
    }
}

WorldTwin::State WorldTwin::takeState()
{
    State state;
    for (const std::uint64_t word : std::exchange(m_answers, {}))
        state.add("answer", word);
    addPairs(state);
    for (std::size_t slot = 0; slot < kSlots; ++slot)
        state.add("body " + std::to_string(slot), slotBits(slot));
    addManifolds(state);
    return state;
}

/// The list of a ghost has an object for each of its pairs.
std::string WorldTwin::checkGhost(const btGhostObject& ghost, std::size_t slot)
{
    std::multiset<const void*> listed, paired;
    for (int i = 0; i < ghost.getNumOverlappingObjects(); ++i)
        listed.insert(ghost.getOverlappingObject(i));
    const btBroadphasePairArray& pairs = m_world->getPairCache()->getOverlappingPairArray();
    const btBroadphaseProxy* own = ghost.getBroadphaseHandle();
    for (int i = 0; i < pairs.size(); ++i)
    {
        if (pairs[i].m_pProxy0 == own)
            paired.insert(pairs[i].m_pProxy1->m_clientObject);
        if (pairs[i].m_pProxy1 == own)
            paired.insert(pairs[i].m_pProxy0->m_clientObject);
    }
    if (!m_settings.hasGhosts)
        paired.clear();
    if (listed == paired)
        return {};
    return "ghost in slot " + std::to_string(slot) + " lists " + std::to_string(listed.size()) +
           " objects and has " + std::to_string(paired.size()) + " pairs";
}

std::string WorldTwin::check()
{
    if (m_watched != nullptr)
    {
        m_watched->checkPairs();
        if (!m_watched->fault().empty())
            return m_watched->fault();
    }
    for (std::size_t slot = 0; slot < kSlots; ++slot)
    {
        const btCollisionObject* object = m_slots[slot].object.get();
        const btGhostObject* ghost = object == nullptr ? nullptr : btGhostObject::upcast(object);
        const std::string fault = ghost == nullptr ? "" : checkGhost(*ghost, slot);
        if (!fault.empty())
            return fault;
    }
    return {};
}
}  // namespace cullet::test
