// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/contact_list.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/solver/point_source.h"
#include "cullet/plugin/step/prefetch_step.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Manifolds for which a task pays.
constexpr std::size_t kManifoldGrain = 512;

/// Flags of points that give them a softness of their own.
constexpr int kOwnSoftness = BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP |
                             BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING | BT_CONTACT_FLAG_FRICTION_ANCHOR;

/// Two rounds of a mixing function by Chris Wellons ("hash prospector"), each of which changes all bits.
std::uint32_t hashOf(std::uint32_t a, std::uint32_t b)
{
    std::uint32_t hash = 0;
    for (const std::uint32_t id : {a, b})
    {
        hash ^= id;
        hash = (hash ^ hash >> 16) * 0x7feb352du;
        hash = (hash ^ hash >> 15) * 0x846ca68bu;
        hash ^= hash >> 16;
    }
    return hash;
}

/// Prefetches what finding the contacts that follow reads. Bullet's own narrow phase has a manifold for each pair of boxes,
/// most of them without points.
void readAhead(btPersistentManifold* const* manifolds, int index, int count)
{
    if (index + 2 * kPrefetchDistance < count)
        prefetchBodiesOf(manifolds[index + 2 * kPrefetchDistance]);
    if (index + kPrefetchDistance < count && manifolds[index + kPrefetchDistance]->getNumContacts() > 0)
        prefetchPointsOf(manifolds[index + kPrefetchDistance]);
}

void notePoint(const btContactSolverInfo& info, const btManifoldPoint& point, int index, Contact& contact)
{
    const bool isDeep = info.m_splitImpulse &&
                        point.getDistance() + info.m_linearSlop <= info.m_splitImpulsePenetrationThreshold;
    contact.deep |= static_cast<std::uint8_t>(isDeep << index);
    contact.turns |= static_cast<std::uint8_t>((point.m_combinedRollingFriction > 0) << index);
}

bool isDirected(const btCollisionObject& object, std::uint32_t number, const SolverBodies& bodies)
{
    return number != kFixedBody ? bodies.isAnisotropic(number) : isAnisotropic(object);
}

/// Completes a contact whose bodies have numbers.
void complete(const SolverBodies& bodies, Contact& contact)
{
    contact.hash = hashOf(bodies.localId(contact.a), bodies.localId(contact.b));
    contact.isPlain = contact.isPlain && !isDirected(*contact.manifold->getBody0(), contact.a, bodies) &&
                      !isDirected(*contact.manifold->getBody1(), contact.b, bodies);
}

bool movesABody(const SolverBodies& bodies, const Contact& contact)
{
    return bodies.isMoved(contact.a) || bodies.isMoved(contact.b);
}
}  // namespace

bool hasOwnSoftness(const btPersistentManifold& manifold)
{
    const unsigned live = livePointsOf(manifold);
    for (int k = 0; k < manifold.getNumContacts(); ++k)
    {
        if ((live >> k & 1) != 0 && (manifold.getContactPoint(k).m_contactPointFlags & kOwnSoftness) != 0)
            return true;
    }
    return false;
}

void ContactList::collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                          SolverBodies& bodies, ParallelLoops& loops)
{
    const auto size = static_cast<std::size_t>(count);
    const unsigned tasks = loops.tasksFor(size, kManifoldGrain);
    if (m_parts.size() < tasks)
        m_parts.resize(tasks);
    loops.run(tasks,
              [&](unsigned task)
              {
                  Part& part = m_parts[task];
                  part.contacts.clear();
                  part.bounces = part.hasOwnSoftness = part.hasUnknown = false;
                  const TaskRange range(size, task, tasks);
                  for (std::uint32_t i = range.begin; i < range.end; ++i)
                  {
                      readAhead(manifolds, static_cast<int>(i), count);
                      find(info, *manifolds[i], bodies, part);
                  }
              });
    m_bounces = m_hasOwnSoftness = false;
    for (unsigned task = 0; task < tasks; ++task)
    {
        Part& part = m_parts[task];
        m_bounces = m_bounces || part.bounces;
        m_hasOwnSoftness = m_hasOwnSoftness || part.hasOwnSoftness;
        // In the order of the manifolds.
        if (part.hasUnknown)
            addUnknown(bodies, part);
    }
    join(tasks, loops);
    m_order.sort(m_found, m_contacts, loops, [](const Contact& contact) { return contact.hash; });
}

void ContactList::find(const btContactSolverInfo& info, btPersistentManifold& manifold,
                       const SolverBodies& bodies, Part& part)
{
    const unsigned live = livePointsOf(manifold);
    if (live == 0)
        return;
    Contact contact{};
    contact.manifold = &manifold;
    contact.a = bodies.find(*manifold.getBody0());
    contact.b = bodies.find(*manifold.getBody1());
    const bool isKnown = contact.a != SolverBodies::kUnknown && contact.b != SolverBodies::kUnknown;
    if (isKnown && !movesABody(bodies, contact))
        return;
    const LivePoints points(manifold, live);
    contact.live = static_cast<std::uint8_t>(live);
    contact.points = static_cast<std::uint8_t>(points.count);
    int flags = 0;
    for (int k = 0; k < points.count; ++k)
    {
        const btManifoldPoint& point = *points.points[k];
        notePoint(info, point, k, contact);
        flags |= point.m_contactPointFlags;
        part.bounces = part.bounces || point.m_combinedRestitution > 0;
    }
    const bool keepsSlides = (info.m_solverMode & SOLVER_ENABLE_FRICTION_DIRECTION_CACHING) != 0;
    part.hasOwnSoftness = part.hasOwnSoftness || (flags & kOwnSoftness) != 0;
    contact.isPlain =
        (flags & (kOwnSoftness | (keepsSlides ? BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED : 0))) == 0;
    part.hasUnknown = part.hasUnknown || !isKnown;
    if (isKnown)
        complete(bodies, contact);
    part.contacts.push_back(contact);
}

/// Adds the bodies of a part that have no number yet.
void ContactList::addUnknown(SolverBodies& bodies, Part& part)
{
    const auto add = [&](const btCollisionObject* object)
    { return bodies.add(*const_cast<btCollisionObject*>(object)); };
    for (Contact& contact : part.contacts)
    {
        if (contact.a != SolverBodies::kUnknown && contact.b != SolverBodies::kUnknown)
            continue;
        contact.a = add(contact.manifold->getBody0());
        contact.b = add(contact.manifold->getBody1());
        complete(bodies, contact);
    }
    const auto movesNone = [&](const Contact& contact) { return !movesABody(bodies, contact); };
    part.contacts.erase(std::remove_if(part.contacts.begin(), part.contacts.end(), movesNone),
                        part.contacts.end());
}

/// Puts the contacts of all parts together.
void ContactList::join(unsigned parts, ParallelLoops& loops)
{
    if (parts == 1)
    {
        m_found.swap(m_parts[0].contacts);
        return;
    }
    std::size_t count = 0;
    for (unsigned i = 0; i < parts; ++i)
        count += m_parts[i].contacts.size();
    m_found.resize(count);
    loops.run(parts,
              [&](unsigned task)
              {
                  std::size_t first = 0;
                  for (unsigned i = 0; i < task; ++i)
                      first += m_parts[i].contacts.size();
                  std::copy(m_parts[task].contacts.begin(), m_parts[task].contacts.end(),
                            m_found.begin() + static_cast<std::ptrdiff_t>(first));
              });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
