// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/shapes/convex_mesh_hull.h"
#include "cullet/plugin/shapes/hull_cache.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <array>
#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One call of the algorithm of a pair, in which contacts may be kept or computed.
struct ContactCall
{
    IsaGjkRegistration& isaGjk;
    const btCollisionObjectWrapper &a, &b;  ///< those of the manifold's bodies, in its order
    const btDispatcherInfo& info;
    btManifoldResult& result;  ///< with the manifold set
    btPersistentManifold& manifold;
    HullUse (&hulls)[2];  ///< of a and b

    /// Whether contacts may be kept in this call; see IsaGjkOptions::reusePose.
    bool mayKeep() const;
};

/// The contacts of a pair that IsaGjkOptions::reusePose keeps while the pair stays where it is, and all that they were
/// computed from.
///
/// It is compared in each call, and nothing of it is trusted. Contacts that are kept are those of the pose in which they
/// were computed, carried along by the bodies: their points are fixed to the bodies, and their normals to the second one.
class KeptContacts
{
public:
    /// Whether the pair is where its contacts were computed, the shapes are as they were, and the manifold has these
    /// contacts. Of a concave shape the triangles are not compared.
    ///
    /// @pre call.mayKeep()
    bool holdFor(const ContactCall& call) const noexcept;

    /// Gives the points of the manifold what they would get if they were found again in this call: normals, friction and
    /// restitution. btManifoldResult::refreshContactPoints() must follow.
    ///
    /// @pre holdFor(call)
    void renew(const ContactCall& call) const;

    /// Remembers the contacts that this call has computed. Call before the manifold is refreshed, since its callbacks may
    /// change points.
    ///
    /// @pre call.mayKeep()
    void store(const ContactCall& call) noexcept;

    bool isStored() const noexcept { return m_count > 0; }
    void forget() noexcept { m_count = 0; }

private:
    /// Where one object is relative to another, and how far it may move from there.
    struct Place
    {
        /// @param pointsWithin bounds the distances of the points that count from the origin of `at`
        void set(const btTransform& at, const btTransform& relativeTo, btScalar pointsWithin);
        bool isLeft(const btTransform& at, const btTransform& relativeTo,
                    const ReusePose& reuse) const noexcept;

        std::array<btScalar, 12> relative;  ///< basis and origin
        btScalar radius = 0;
    };
    using Normal = std::array<btScalar, 3>;

    static std::uint64_t placesOf(const btPersistentManifold& manifold) noexcept;
    static std::uint64_t shapesOf(const ContactCall& call) noexcept;
    bool storePlaces(const ContactCall& call) noexcept;

    // Little memory: in a world at rest, its cache lines are much of the cost of a pair.
    int m_count = 0;                   ///< of the contacts; 0: none are kept
    std::uint32_t m_registration = 0;  ///< see IsaGjkRegistration::resets()
    btScalar m_breakingThreshold = 0;
    bool m_isSecondSmaller = false;
    std::uint64_t m_shapes = 0;                         ///< hash of both shapes
    std::uint64_t m_places = 0;                         ///< hash of the points' places
    Place m_place;                                      ///< of the smaller shape, relative to the other
    std::array<Normal, MANIFOLD_CACHE_SIZE> m_normals;  ///< in the frame of the second body
    std::unique_ptr<Place> m_bodies;  ///< the same of their bodies, if one has the shape as a part; else null
};

/// Hulls in place of both shapes of a pair.
using PairOfMeshHulls = std::array<ConvexMeshHull, 2>;

/// The registration of an algorithm, and what few algorithms keep between their calls, in the size of a pointer: Bullet's
/// pool has no room for two in an IsaGjkAlgorithm. That are contacts, and hulls in place of meshes. Nothing is allocated
/// before there is one of them.
class ContactKeeper
{
public:
    explicit ContactKeeper(IsaGjkRegistration& isaGjk) : m_address(reinterpret_cast<std::uintptr_t>(&isaGjk))
    {
    }
    ~ContactKeeper() { delete contacts(); }
    ContactKeeper(const ContactKeeper&) = delete;
    ContactKeeper& operator=(const ContactKeeper&) = delete;

    IsaGjkRegistration& isaGjk() const
    {
        return hasContacts() ? contacts()->isaGjk : *reinterpret_cast<IsaGjkRegistration*>(m_address);
    }

    /// Keeps the contacts of the manifold and refreshes it, if they hold.
    ///
    /// @return false if the contacts must be computed
    bool keep(const ContactCall& call) { return hasContacts() && keepOrForget(call); }

    /// The contacts of this call were computed, and are to be kept from now on. Call before the manifold is refreshed.
    void store(const ContactCall& call) noexcept
    {
        if (call.mayKeep() && call.manifold.getNumContacts() > 0)
            storeAll(call);
    }

    /// @return valid as long as this; null if out of memory
    PairOfMeshHulls* meshHulls() noexcept;

private:
    struct Contacts
    {
        explicit Contacts(IsaGjkRegistration& registration) : isaGjk(registration) {}

        IsaGjkRegistration& isaGjk;
        KeptContacts kept;
        std::unique_ptr<PairOfMeshHulls> hulls;
    };

    /// The lowest bit of the address, which is that of the registration without it.
    bool hasContacts() const { return (m_address & 1) != 0; }
    Contacts* contacts() const
    {
        return hasContacts() ? reinterpret_cast<Contacts*>(m_address - 1) : nullptr;
    }
    Contacts* makeContacts() noexcept;
    bool keepOrForget(const ContactCall& call);
    void storeAll(const ContactCall& call) noexcept;

    std::uintptr_t m_address;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
