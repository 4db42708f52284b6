// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/kept_contacts.h"

#include "cullet/plugin/contact/pair_material.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/mix_bits.h"
#include "cullet/plugin/shapes/shape_hash.h"

#include <cmath>
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

/// A shape of the pair and the other one, of which the first is smaller.
struct SmallAndLarge
{
    const btCollisionObjectWrapper &small, &large;

    SmallAndLarge(const ContactCall& call, bool isSecondSmaller)
        : small(isSecondSmaller ? call.b : call.a), large(isSecondSmaller ? call.a : call.b)
    {
    }
    bool areWhole() const { return isWhole(small) && isWhole(large); }
    const btTransform& smallBodyAt() const { return small.getCollisionObject()->getWorldTransform(); }
    const btTransform& largeBodyAt() const { return large.getCollisionObject()->getWorldTransform(); }
};
}  // namespace

bool ContactCall::mayKeep() const
{
    return isaGjk.options().reusePose.isOn() && isExactly<btManifoldResult>(result) &&
           result.m_closestPointDistanceThreshold == 0 && !info.m_enableSatConvex &&
           isaGjk.stock().m_numPerturbationIterations == 0 && manifold.getBody0() == a.getCollisionObject() &&
           manifold.getBody1() == b.getCollisionObject() &&
           !areShown(*a.getCollisionObject(), *b.getCollisionObject());
}

void KeptContacts::Place::set(const btTransform& at, const btTransform& relativeTo, btScalar pointsWithin)
{
    const btTransform now = relativeTo.inverseTimes(at);
    for (int row = 0; row < 3; ++row)
    {
        for (int column = 0; column < 3; ++column)
            relative[static_cast<std::size_t>(3 * row + column)] = now.getBasis()[row][column];
        relative[static_cast<std::size_t>(9 + row)] = now.getOrigin()[row];
    }
    radius = pointsWithin;
}

/// True for poses that are not finite, too.
bool KeptContacts::Place::isLeft(const btTransform& at, const btTransform& relativeTo,
                                 const ReusePose& reuse) const noexcept
{
    const btTransform now = relativeTo.inverseTimes(at);
    const btScalar* const then = relative.data();
    const auto from = [then](int row) { return btVector3(then[row], then[row + 1], then[row + 2]); };
    btScalar turned = 0;
    for (int row = 0; row < 3; ++row)
        turned += (now.getBasis()[row] - from(3 * row)).length2();
    const btScalar shift = (now.getOrigin() - from(9)).length();
    // Of a point at distance 1 from the axis: 2 sin(angle / 2), since `turned` is 8 sin^2(angle / 2).
    const btScalar chord = std::sqrt(turned * btScalar(0.5));
    const btScalar chordOfAngle = reuse.angle * (1 - reuse.angle * reuse.angle * btScalar(1.0 / 24));
    return !(shift + chord * radius <= reuse.distance && chord <= chordOfAngle);
}

/// A hash of the places of all points on the first body.
std::uint64_t KeptContacts::placesOf(const btPersistentManifold& manifold) noexcept
{
    std::uint64_t hash = 0;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        const btVector3& place = manifold.getContactPoint(i).m_localPointA;
        hash += mixBits(mixBits(bitsOf(place.x()), bitsOf(place.y()) + std::uint64_t(i)), bitsOf(place.z()));
    }
    return hash;
}

/// @return 0 if a shape is of a kind whose contacts are not kept
std::uint64_t KeptContacts::shapesOf(const ContactCall& call) noexcept
{
    const std::uint64_t pass = call.isaGjk.pass(),
                        a = hashOfShape(*call.a.getCollisionShape(), call.hulls[0], pass),
                        b = hashOfShape(*call.b.getCollisionShape(), call.hulls[1], pass);
    return a == 0 || b == 0 ? 0 : mixBits(a, b);
}

bool KeptContacts::holdFor(const ContactCall& call) const noexcept
{
    if (m_count == 0 || call.manifold.getNumContacts() != m_count || m_registration != call.isaGjk.resets() ||
        m_breakingThreshold != call.manifold.getContactBreakingThreshold())
        return false;
    const SmallAndLarge pair(call, m_isSecondSmaller);
    const ReusePose& reuse = call.isaGjk.options().reusePose;
    if (m_place.isLeft(pair.small.getWorldTransform(), pair.large.getWorldTransform(), reuse) ||
        (m_bodies == nullptr) != pair.areWhole() ||
        (m_bodies != nullptr && m_bodies->isLeft(pair.smallBodyAt(), pair.largeBodyAt(), reuse)))
        return false;
    return shapesOf(call) == m_shapes && placesOf(call.manifold) == m_places;
}

void KeptContacts::renew(const ContactCall& call) const
{
    const btMatrix3x3& basis = call.manifold.getBody1()->getWorldTransform().getBasis();
    btManifoldPoint common;
    setMaterial(*call.result.getBody0Internal(), *call.result.getBody1Internal(), common);
    for (int i = 0; i < m_count; ++i)
    {
        const Normal& normal = m_normals[static_cast<std::size_t>(i)];
        if (i == 0 || normal != m_normals[static_cast<std::size_t>(i - 1)])
            setNormal(basis * btVector3(normal[0], normal[1], normal[2]), common);
        renewPoint(common, call.manifold.getContactPoint(i));
    }
}

void KeptContacts::store(const ContactCall& call) noexcept
{
    forget();
    m_shapes = shapesOf(call);
    if (m_shapes == 0 || !storePlaces(call))
        return;
    m_registration = call.isaGjk.resets();
    m_breakingThreshold = call.manifold.getContactBreakingThreshold();
    m_places = placesOf(call.manifold);
    m_count = call.manifold.getNumContacts();
    const btMatrix3x3& basis = call.manifold.getBody1()->getWorldTransform().getBasis();
    for (int i = 0; i < m_count; ++i)
    {
        const btVector3 normal = call.manifold.getContactPoint(i).m_normalWorldOnB * basis;
        m_normals[static_cast<std::size_t>(i)] = {normal.x(), normal.y(), normal.z()};
    }
}

/// @return false if out of memory
bool KeptContacts::storePlaces(const ContactCall& call) noexcept
{
    const std::uint64_t pass = call.isaGjk.pass();
    const btScalar a = radiusOfShape(*call.a.getCollisionShape(), call.hulls[0], pass),
                   b = radiusOfShape(*call.b.getCollisionShape(), call.hulls[1], pass);
    m_isSecondSmaller = b < a;
    const SmallAndLarge pair(call, m_isSecondSmaller);
    const btTransform& at = pair.small.getWorldTransform();
    const btScalar radius = m_isSecondSmaller ? b : a;
    m_place.set(at, pair.large.getWorldTransform(), radius);
    if (pair.areWhole())
    {
        m_bodies.reset();
        return true;
    }
    if (m_bodies == nullptr)
        m_bodies.reset(new (std::nothrow) Place);
    if (m_bodies == nullptr)
        return false;
    m_bodies->set(pair.smallBodyAt(), pair.largeBodyAt(),
                  radius + (at.getOrigin() - pair.smallBodyAt().getOrigin()).length());
    return true;
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

/// @return null if out of memory
ContactKeeper::Contacts* ContactKeeper::makeContacts() noexcept
{
    if (hasContacts())
        return contacts();
    auto* const made = new (std::nothrow) Contacts(isaGjk());
    if (made != nullptr)
        m_address = reinterpret_cast<std::uintptr_t>(made) | 1;
    return made;
}

void ContactKeeper::storeAll(const ContactCall& call) noexcept
{
    if (Contacts* const made = makeContacts())
        made->kept.store(call);
}

PairOfMeshHulls* ContactKeeper::meshHulls() noexcept
{
    Contacts* const made = makeContacts();
    if (made != nullptr && made->hulls == nullptr)
        made->hulls.reset(new (std::nothrow) PairOfMeshHulls);
    return made == nullptr ? nullptr : made->hulls.get();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
