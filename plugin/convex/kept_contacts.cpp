// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/kept_contacts.h"

#include "cullet/plugin/contact/pair_material.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <cmath>
#include <cstring>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Whether the application sees or changes single points when they are added.
bool areShown(const btCollisionObject& a, const btCollisionObject& b)
{
    const int flags = a.getCollisionFlags() | b.getCollisionFlags();
    constexpr int kPointFlags =
        btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING | btCollisionObject::CF_HAS_FRICTION_ANCHOR;
    return (flags & kPointFlags) != 0 || (gContactAddedCallback != nullptr &&
                                          (flags & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) != 0);
}

/// The shape is the body's own, and no part of it.
bool isWhole(const btCollisionObjectWrapper& shape)
{
    return &shape.getWorldTransform() == &shape.getCollisionObject()->getWorldTransform();
}

/// The squares of the differences of all elements; for rotations 8 sin^2(angle / 2).
btScalar squaredDifference(const btMatrix3x3& a, const btMatrix3x3& b)
{
    return (a[0] - b[0]).length2() + (a[1] - b[1]).length2() + (a[2] - b[2]).length2();
}

bool areEqual(const btVector3& a, const btVector3& b)
{
    return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}
}  // namespace

bool ContactCall::mayKeep() const
{
    return isaGjk.options().reusePose.isOn() && isExactly<btManifoldResult>(result) &&
           result.m_closestPointDistanceThreshold == 0 && !info.m_enableSatConvex &&
           isaGjk.stock().m_numPerturbationIterations == 0 && manifold.getBody0() == a.getCollisionObject() &&
           manifold.getBody1() == b.getCollisionObject() &&
           !areShown(*a.getCollisionObject(), *b.getCollisionObject());
}

void KeptContacts::Place::set(const btTransform& at, const btTransform& relativeTo, btScalar radius)
{
    m_relative = relativeTo.inverseTimes(at);
    m_radius = radius;
}

/// True for poses that are not finite, too.
bool KeptContacts::Place::isLeft(const btTransform& at, const btTransform& relativeTo,
                                 const ReusePose& reuse) const noexcept
{
    const btTransform now = relativeTo.inverseTimes(at);
    const btScalar shift = (now.getOrigin() - m_relative.getOrigin()).length();
    // Of a point at distance 1 from the axis: 2 sin(angle / 2).
    const btScalar chord =
        std::sqrt(squaredDifference(now.getBasis(), m_relative.getBasis()) * btScalar(0.5));
    const btScalar chordOfAngle = reuse.angle * (1 - reuse.angle * reuse.angle * btScalar(1.0 / 24));
    return !(shift + chord * m_radius <= reuse.distance && chord <= chordOfAngle);
}

/// A hash of the places of all points on the first body. With 64 bits it is not equal for other places by chance.
std::uint64_t KeptContacts::placesOf(const btPersistentManifold& manifold) noexcept
{
    std::uint64_t hash = 0;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        const btVector3& place = manifold.getContactPoint(i).m_localPointA;
        for (int axis = 0; axis < 3; ++axis)
        {
            const auto number = static_cast<double>(place[axis]);
            std::uint64_t bits;
            std::memcpy(&bits, &number, sizeof(bits));
            hash = ((hash << 7 | hash >> 57) ^ bits) * 0x9e3779b97f4a7c15;
        }
    }
    return hash;
}

bool KeptContacts::holdFor(const ContactCall& call) const noexcept
{
    if (m_count == 0 || call.manifold.getNumContacts() != m_count || m_registration != call.isaGjk.resets() ||
        m_breakingThreshold != call.manifold.getContactBreakingThreshold())
        return false;
    const btCollisionObjectWrapper &smaller = m_isSecondSmaller ? call.b : call.a,
                                   &larger = m_isSecondSmaller ? call.a : call.b;
    const ReusePose& reuse = call.isaGjk.options().reusePose;
    if (m_shapesPlace.isLeft(smaller.getWorldTransform(), larger.getWorldTransform(), reuse) ||
        m_hasParts != !(isWhole(smaller) && isWhole(larger)) ||
        (m_hasParts && m_bodiesPlace.isLeft(smaller.getCollisionObject()->getWorldTransform(),
                                            larger.getCollisionObject()->getWorldTransform(), reuse)))
        return false;
    ShapeState a, b;
    return a.read(*call.a.getCollisionShape(), call.hulls[0], call.isaGjk.pass()) && a == m_a &&
           b.read(*call.b.getCollisionShape(), call.hulls[1], call.isaGjk.pass()) && b == m_b &&
           placesOf(call.manifold) == m_places;
}

void KeptContacts::renew(const ContactCall& call) const
{
    const btMatrix3x3& basis = call.manifold.getBody1()->getWorldTransform().getBasis();
    btManifoldPoint common;
    setMaterial(*call.result.getBody0Internal(), *call.result.getBody1Internal(), common);
    for (int i = 0; i < m_count; ++i)
    {
        const auto place = static_cast<std::size_t>(i);
        if (i == 0 || !areEqual(m_normals[place], m_normals[place - 1]))
            setNormal(basis * m_normals[place], common);
        renewPoint(common, call.manifold.getContactPoint(i));
    }
}

void KeptContacts::store(const ContactCall& call) noexcept
{
    forget();
    if (!m_a.read(*call.a.getCollisionShape(), call.hulls[0], call.isaGjk.pass()) ||
        !m_b.read(*call.b.getCollisionShape(), call.hulls[1], call.isaGjk.pass()))
        return;
    storePlaces(call);
    m_registration = call.isaGjk.resets();
    m_breakingThreshold = call.manifold.getContactBreakingThreshold();
    m_places = placesOf(call.manifold);
    m_count = call.manifold.getNumContacts();
    const btMatrix3x3& basis = call.manifold.getBody1()->getWorldTransform().getBasis();
    for (int i = 0; i < m_count; ++i)
        m_normals[static_cast<std::size_t>(i)] = call.manifold.getContactPoint(i).m_normalWorldOnB * basis;
}

void KeptContacts::storePlaces(const ContactCall& call)
{
    m_isSecondSmaller = m_b.radius() < m_a.radius();
    const btCollisionObjectWrapper &smaller = m_isSecondSmaller ? call.b : call.a,
                                   &larger = m_isSecondSmaller ? call.a : call.b;
    const btScalar radius = m_isSecondSmaller ? m_b.radius() : m_a.radius();
    const btTransform& at = smaller.getWorldTransform();
    m_shapesPlace.set(at, larger.getWorldTransform(), radius);
    m_hasParts = !(isWhole(smaller) && isWhole(larger));
    if (!m_hasParts)
        return;
    const btTransform& bodyAt = smaller.getCollisionObject()->getWorldTransform();
    m_bodiesPlace.set(bodyAt, larger.getCollisionObject()->getWorldTransform(),
                      radius + (at.getOrigin() - bodyAt.getOrigin()).length());
}

bool ContactKeeper::keepOrForget(const ContactCall& call)
{
    KeptContacts& kept = contacts()->kept;
    if (!call.mayKeep() || !kept.holdFor(call))
    {
        kept.forget();
        return false;
    }
    kept.renew(call);
    call.result.refreshContactPoints();
    call.isaGjk.counters().reused.add(1);
    return true;
}

void ContactKeeper::storeAll(const ContactCall& call) noexcept
{
    if (!hasContacts())
    {
        const auto* const made = new (std::nothrow) Contacts{isaGjk(), {}};
        if (made == nullptr)
            return;
        m_address = reinterpret_cast<std::uintptr_t>(made) | 1;
    }
    contacts()->kept.store(call);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
