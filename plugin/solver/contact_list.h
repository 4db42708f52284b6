// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/shuffled_order.h"
#include "cullet/plugin/solver/solver_bodies.h"

#include <cstdint>
#include <vector>

class btManifoldPoint;
class btPersistentManifold;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// A manifold that has a point and moves a body.
struct Contact
{
    btPersistentManifold* manifold;
    std::uint32_t a, b;   ///< numbers of its bodies
    std::uint32_t hash;   ///< of the numbers of its bodies in their island
    std::uint8_t points;  ///< the number of those that count
    std::uint8_t live;    ///< a bit for each point of the manifold: whether it counts
    std::uint8_t deep;    ///< a bit for each of those that count
    std::uint8_t turns;   ///< a bit for each with turning friction
    bool isPlain;         ///< no point has flags that rows depend on, and no object anisotropic friction
};

/// Whether the application has given points of a manifold that count a softness, or anchored them.
bool hasOwnSoftness(const btPersistentManifold& manifold);

/// The contacts of a group in a shuffled order that stays the same while they last.
class ContactList
{
public:
    /// Finds the contacts, and adds their bodies.
    void collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                 SolverBodies& bodies, ParallelLoops& loops);

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_contacts.size()); }
    const Contact& operator[](std::size_t index) const { return m_contacts[index]; }

    /// Whether the application has given points a softness, or anchored them.
    bool hasOwnSoftness() const { return m_hasOwnSoftness; }
    /// Whether some point has a restitution.
    bool bounces() const { return m_bounces; }

private:
    /// What one task finds.
    struct alignas(64) Part
    {
        std::vector<Contact> contacts;
        bool bounces, hasOwnSoftness;
        bool hasUnknown;  ///< some contact has a body without a number
    };

    void find(const btContactSolverInfo& info, btPersistentManifold& manifold, const SolverBodies& bodies,
              Part& part);
    static void addUnknown(SolverBodies& bodies, Part& part);
    void join(unsigned parts, ParallelLoops& loops);

    std::vector<Part> m_parts;  ///< [task]
    std::vector<Contact> m_found;
    std::vector<Contact> m_contacts;
    ShuffledOrder<Contact> m_order;
    bool m_bounces = false, m_hasOwnSoftness = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
