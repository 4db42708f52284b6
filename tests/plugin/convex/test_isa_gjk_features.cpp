// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
using Contacts = std::vector<btManifoldPoint>;

/// The points of a new pair.
Contacts contactsOf(btCollisionDispatcher& dispatcher, btCollisionShape& a, const btTransform& at,
                    btCollisionShape& b, const btTransform& bt)
{
    ConvexPairProbe probe(dispatcher, a, b);
    probe.place(at, bt);
    const btPersistentManifold* manifold = probe.step();
    Contacts contacts;
    for (int i = 0; i < manifold->getNumContacts(); ++i)
        contacts.push_back(manifold->getContactPoint(i));
    return contacts;
}

/// Distance of the deepest point; infinity without a point.
double deepestOf(const Contacts& contacts)
{
    double deepest = std::numeric_limits<double>::infinity();
    for (const btManifoldPoint& contact : contacts)
        deepest = std::min(deepest, double(contact.getDistance()));
    return deepest;
}

/// The lower face of a box or a wedge, over the middle of a wide slab.
class LowerFace
{
public:
    /// @param y,z half sizes of the face's shape; x is 0.5
    LowerFace(const btTransform& at, double y, double z) : m_normal(at.getBasis().getColumn(1))
    {
        for (const double side : {-0.5, 0.5})
            for (const double end : {-z, z})
                m_corners.push_back(at * vec(side, -y, end));
    }

    /// Expects the points that carry the load: all are corners with their heights over the slab, and none is missing
    /// that is hardly higher than the lowest.
    void expectCorners(const Contacts& contacts, double slabTop) const
    {
        // Some roundings of coordinates of about one.
        const double tolerance = 16.0 * double(SIMD_EPSILON);
        double lowest = std::numeric_limits<double>::infinity();
        for (const btVector3& corner : m_corners)
            lowest = std::min(lowest, double(corner.y()) - slabTop);
        std::size_t found = 0;
        for (const btVector3& corner : m_corners)
        {
            const double height = double(corner.y()) - slabTop;
            const auto isAtCorner = [&](const btManifoldPoint& contact)
            {
                const btVector3 onSlab = vec(corner.x(), slabTop, corner.z());
                return contact.getPositionWorldOnA().distance(corner) <= tolerance &&
                       contact.getPositionWorldOnB().distance(onSlab) <= tolerance &&
                       std::abs(double(contact.getDistance()) - height) <= tolerance;
            };
            const auto count = std::count_if(contacts.begin(), contacts.end(), isAtCorner);
            EXPECT_LE(count, 1);
            // A tenth of the breaking threshold; beyond, see makeContactPatch().
            if (height - lowest < 0.0019 && height < 0.0199)
            {
                EXPECT_EQ(count, 1) << "height " << height << ", the lowest " << lowest;
            }
            found += static_cast<std::size_t>(count);
        }
        EXPECT_EQ(found, contacts.size()) << "points that are no corners";
    }

    /// Expects points of Bullet's clipping on this face. Bullet projects them along the normal of this face instead of
    /// the slab's: distances are too large by the cosine between them. Its search for the touch adds some 1e-6.
    void expectOnFace(const Contacts& contacts, double slabTop) const
    {
        for (const btManifoldPoint& contact : contacts)
        {
            const btVector3 from = contact.getPositionWorldOnB() - m_corners[0];
            const double height =
                double(m_corners[0].y()) - slabTop -
                double(m_normal.x() * from.x() + m_normal.z() * from.z()) / double(m_normal.y());
            EXPECT_NEAR(double(contact.getDistance()), height,
                        (1.0 / double(m_normal.y()) - 1.0) * std::abs(height) + 2e-5);
        }
    }

private:
    std::vector<btVector3> m_corners;
    btVector3 m_normal;
};
}  // namespace

TEST(IsaGjkFeatures, RemoveMarginsFromContactDistances)
{
    auto upper = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    auto lower = makeHullShape(boxPoints(2, 0.5, 2));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *upper, *lower);
    probe.place(vec(0, 0.99, 0), vec(0, 0, 0));
    std::vector<Reported> points = probe.query();
    ASSERT_EQ(points.size(), 4u);
    EXPECT_NEAR(points[0].distance, -0.01 - 0.08, 1e-6);
    upper->initializePolyhedralFeatures();
    lower->initializePolyhedralFeatures();
    points = probe.query();
    ASSERT_EQ(points.size(), 4u);
    for (const Reported& point : points)
        EXPECT_NEAR(point.distance, -0.01, 1e-6);

    // Bullet's separating axis test, if the application enables it.
    btDispatcherInfo info;
    info.m_enableSatConvex = true;
    const std::uint64_t before = bench.registration->stats().delegatedTotal;
    points = probe.query(0, info);
    EXPECT_EQ(bench.registration->stats().delegatedTotal, before + 1);
    ASSERT_GE(points.size(), 4u);
    EXPECT_NEAR(points[0].distance, -0.01, 1e-3);
}

TEST(IsaGjkFeatures, GiveDistancesOfBulletsClippingAtCornersOfFace)
{
    constexpr unsigned kSeed = 67;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5)), slab = makeHullShape(boxPoints(2, 0.5, 2)),
         wedge = makeHullShape(boxPoints(0.5, 0.4, 0.3));
    wedge->addPoint(vec(0, 0.8, 0));
    for (const auto& shape : {cube.get(), slab.get(), wedge.get()})
        shape->initializePolyhedralFeatures();
    ConvexBench bench, stock(true);
    std::map<bool, int> contacts;
    std::map<std::size_t, int> corners;
    std::uniform_real_distribution<double> angle(-0.05, 0.05), gap(-0.03, 0.05);
    for (int i = 0; i < 400; ++i)
    {
        SCOPED_TRACE(i);
        btCollisionShape& upper = i % 2 == 0 ? *cube : *wedge;
        const double height = 0.5 + (i % 2 == 0 ? 0.5 : 0.4) + gap(engine);
        const auto pitch = btScalar(i % 3 == 0 ? angle(engine) : 0), yaw = btScalar(angle(engine));
        const btTransform at(btQuaternion(yaw, pitch, 0), vec(0.2, height, 0.1));
        const btTransform bt = btTransform::getIdentity();
        const Contacts ourPoints = contactsOf(bench.dispatcher, upper, at, *slab, bt);
        const Contacts bulletsPoints = contactsOf(stock.dispatcher, upper, at, *slab, bt);
        const double ours = deepestOf(ourPoints), bullets = deepestOf(bulletsPoints);
        // Skips cases in which rounding decides whether a point is within the breaking threshold.
        if (std::min(ours, bullets) > 0.0199)
            continue;
        EXPECT_NEAR(ours, bullets, 1e-3);
        ++contacts[bullets < 0];
        // Bullet adds the touch itself and drops points for it, so that the points differ; the face is the same.
        const LowerFace face = i % 2 == 0 ? LowerFace(at, 0.5, 0.5) : LowerFace(at, 0.4, 0.3);
        face.expectCorners(ourPoints, 0.5);
        face.expectOnFace(bulletsPoints, 0.5);
        ++corners[ourPoints.size()];
    }
    EXPECT_GT(contacts[false], 50);
    EXPECT_GT(contacts[true], 50);
    EXPECT_GT(corners[2], 50) << "tilted over an edge";
    EXPECT_GT(corners[4], 50);
}
}  // namespace cullet::test
