// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/exact_depth.h"

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace cullet
{
namespace
{
btTransform at(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), btVector3(btScalar(x), btScalar(y), btScalar(z)));
}

/// Objects of a world whose contacts are never computed.
class Objects
{
public:
    ~Objects()
    {
        for (const auto& object : m_objects)
            m_world.removeCollisionObject(object.get());
    }

    btCollisionObject& add(btCollisionShape& shape, const btTransform& transform)
    {
        m_objects.push_back(std::make_unique<btCollisionObject>());
        m_objects.back()->setCollisionShape(&shape);
        m_objects.back()->setWorldTransform(transform);
        m_world.addCollisionObject(m_objects.back().get());
        return *m_objects.back();
    }

    std::vector<double> depths()
    {
        m_world.updateAabbs();
        m_world.computeOverlappingPairs();
        return exactDepths(m_world);
    }

private:
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btDbvtBroadphase m_broadphase;
    btCollisionWorld m_world{&m_dispatcher, &m_broadphase, &m_configuration};
    std::vector<std::unique_ptr<btCollisionObject>> m_objects;
};

void expectDepth(btCollisionShape& a, const btTransform& atA, btCollisionShape& b, const btTransform& atB,
                 double depth, const char* what)
{
    Objects objects;
    objects.add(a, atA);
    objects.add(b, atB);
    const std::vector<double> depths = objects.depths();
    ASSERT_EQ(depths.size(), depth > 0 ? 1u : 0u) << what;
    if (depth > 0)
    {
        EXPECT_NEAR(depths[0], depth, 1e-5) << what;
    }
}

class ExactDepth : public testing::Test
{
protected:
    btBoxShape box{btVector3(1, 1, 1)};
    btSphereShape ball{btScalar(0.5)};
    btCapsuleShape capsule{btScalar(0.25), 2};
};

TEST_F(ExactDepth, IsThatOfShapesOfEachClass)
{
    expectDepth(box, at(0, 0, 0), box, at(1.9, 0.3, 0), 0.1, "boxes");
    expectDepth(box, at(0, 0, 0), box, at(2.001, 0, 0), 0, "boxes apart");
    const btTransform onEdge(btQuaternion(btVector3(0, 0, 1), SIMD_PI / 4), at(0, 2.4, 0).getOrigin());
    expectDepth(box, at(0, 0, 0), box, onEdge, 1 + std::sqrt(2.0) - 2.4, "a box on its edge");
    expectDepth(box, at(0, 0, 0), ball, at(0, 1.4, 0), 0.1, "ball and box");
    expectDepth(box, at(0, 0, 0), ball, at(0, 0.9, 0), 0.6, "centre of a ball inside of a box");
    expectDepth(ball, at(0, 0, 0), capsule, at(0, 1.7, 0), 0.05, "end of a capsule");
    btConvexHullShape hull;
    for (int i = 0; i < 4; ++i)
        hull.addPoint(btVector3(i == 1 ? 1 : 0, i == 2 ? 1 : 0, i == 3 ? 1 : 0));
    hull.setMargin(btScalar(0.04));
    hull.setLocalScaling(btVector3(2, 2, 2));
    expectDepth(hull, at(0, 0, 0), ball, at(1, 0.5, -0.5), 0.04, "hull with a margin and ball");
}

TEST_F(ExactDepth, IsThatOfDeepestPart)
{
    btCompoundShape pair;
    pair.addChildShape(at(-2, 0, 0), &ball);
    pair.addChildShape(at(2, 0.1, 0), &ball);
    expectDepth(box, at(0, -1, 0), pair, at(0, 0.45, 0), 0, "between the parts");
    btBoxShape floor(btVector3(5, 1, 5));
    expectDepth(floor, at(0, -1, 0), pair, at(0, 0.3, 0), 0.2, "both parts on a floor");
    btTriangleMesh triangles;
    triangles.addTriangle(btVector3(-5, 0, -5), btVector3(5, 0, -5), btVector3(0, 0, 5));
    btBvhTriangleMeshShape mesh(&triangles, true);
    mesh.setMargin(0);
    expectDepth(mesh, at(0, 0, 0), pair, at(0, 0.3, 0), 0.2, "both parts on a triangle");
}

TEST_F(ExactDepth, LeavesOutOtherClassesAndObjectsThatDoNotCollide)
{
    btCylinderShape cylinder(btVector3(1, 1, 1));
    expectDepth(box, at(0, 0, 0), cylinder, at(0, 1, 0), 0, "cylinder");
    Objects objects;
    btCollisionObject& first = objects.add(box, at(0, 0, 0));
    btCollisionObject& second = objects.add(box, at(0, 1, 0));
    EXPECT_EQ(objects.depths().size(), 1u);
    first.setIgnoreCollisionCheck(&second, true);
    EXPECT_EQ(objects.depths().size(), 0u);
    first.setIgnoreCollisionCheck(&second, false);
    second.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
    EXPECT_EQ(objects.depths().size(), 0u);
}
}  // namespace
}  // namespace cullet
