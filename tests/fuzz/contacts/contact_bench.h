// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <btBulletCollisionCommon.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

/// The ways in which an application asks for the contacts of a pair.
namespace cullet::test
{
using Contacts = std::vector<Reported>;

inline bool areSame(const Contacts& a, const Contacts& b)
{
    const auto isSame = [](const Reported& p, const Reported& q)
    { return p.normal == q.normal && p.onB == q.onB && p.distance == q.distance; };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), isSame);
}

/// For messages: how many there are, and the first one.
inline std::string textOf(const Contacts& contacts)
{
    std::ostringstream text;
    text.precision(17);
    text << contacts.size() << " points";
    if (contacts.empty())
        return text.str();
    const Reported& first = contacts.front();
    const btVector3 &normal = first.normal, &onB = first.onB;
    text << " (distance " << first.distance << ", normal " << normal.x() << ' ' << normal.y() << ' '
         << normal.z() << ", on B " << onB.x() << ' ' << onB.y() << ' ' << onB.z() << ')';
    return text.str();
}

inline bool isFinite(const btVector3& v)
{
    return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

/// Two convex shapes and their transforms.
struct PosedPair
{
    btConvexShape* a;
    btConvexShape* b;
    btTransform atA, atB;

    PosedPair swapped() const { return {b, a, atB, atA}; }
    /// @param shape from one more thread of shapes, in the same places
    PosedPair withShapes(btConvexShape& shapeA, btConvexShape& shapeB) const
    {
        return {&shapeA, &shapeB, atA, atB};
    }
    PosedPair movedBy(const btTransform& motion) const { return {a, b, motion * atA, motion * atB}; }
};

/// Dispatchers with ISA-GJK, one for each number of patch points, and Bullet's own; they serve all inputs of a process.
class ContactBenches
{
public:
    static ContactBenches& get()
    {
        static auto& benches = *new ContactBenches;
        return benches;
    }

    /// @param patchPoints 1 to 4
    ConvexBench& ours(int patchPoints) { return *m_ours[static_cast<std::size_t>(patchPoints - 1)]; }
    ConvexBench& stock() { return m_stock; }

private:
    ContactBenches()
    {
        for (int points = 1; points <= 4; ++points)
        {
            IsaGjkOptions options;
            options.boxPairs = BoxPairs::IsaGjk;
            options.patchPoints = points;
            m_ours.push_back(std::make_unique<ConvexBench>(false, options));
        }
    }

    std::vector<std::unique_ptr<ConvexBench>> m_ours;
    ConvexBench m_stock{true};
};

/// Algorithms of one pair, which live as long as this.
class PairAlgorithms
{
public:
    PairAlgorithms(ConvexBench& bench, const PosedPair& pair)
        : m_closest(bench.dispatcher, *pair.a, *pair.b, BT_CLOSEST_POINT_ALGORITHMS),
          m_contacts(bench.dispatcher, *pair.a, *pair.b, BT_CONTACT_POINT_ALGORITHMS)
    {
    }

    Contacts closest(const PosedPair& pair, double threshold)
    {
        m_closest.place(pair.atA, pair.atB);
        return m_closest.query(threshold);
    }

    Contacts patch(const PosedPair& pair, double threshold)
    {
        m_contacts.place(pair.atA, pair.atB);
        return m_contacts.query(threshold);
    }

    /// A step from an empty manifold.
    Contacts step(const PosedPair& pair)
    {
        m_contacts.place(pair.atA, pair.atB);
        btManifoldArray manifolds;
        m_contacts.algorithm->getAllContactManifolds(manifolds);
        for (int i = 0; i < manifolds.size(); ++i)
            manifolds[i]->clearManifold();
        const btPersistentManifold* manifold = m_contacts.step();
        Contacts contacts;
        for (int i = 0; manifold != nullptr && i < manifold->getNumContacts(); ++i)
        {
            const btManifoldPoint& point = manifold->getContactPoint(i);
            contacts.push_back(
                {point.m_normalWorldOnB, point.m_positionWorldOnB, double(point.getDistance())});
        }
        return contacts;
    }

private:
    ConvexPairProbe m_closest, m_contacts;
};

/// contactPairTest() of a world without a broad phase's pairs.
inline Contacts contactPairTest(ConvexBench& bench, const PosedPair& pair, double threshold)
{
    struct Collector : btCollisionWorld::ContactResultCallback
    {
        btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                                 const btCollisionObjectWrapper*, int, int) override
        {
            contacts.push_back(
                {point.m_normalWorldOnB, point.m_positionWorldOnB, double(point.getDistance())});
            return 0;
        }
        Contacts contacts;
    };
    btCollisionWorld world(&bench.dispatcher, nullptr, &bench.configuration);
    btCollisionObject bodyA, bodyB;
    bodyA.setCollisionShape(pair.a);
    bodyB.setCollisionShape(pair.b);
    bodyA.setWorldTransform(pair.atA);
    bodyB.setWorldTransform(pair.atB);
    Collector collector;
    collector.m_closestDistanceThreshold = btScalar(threshold);
    world.contactPairTest(&bodyA, &bodyB, collector);
    return collector.contacts;
}
}  // namespace cullet::test
