// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/solver_group.h"

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kKinematic = -2;  ///< instead of a tag

/// Bodies with the tags of islands, and contacts and joints between them.
class TaggedGroup
{
public:
    explicit TaggedGroup(const std::vector<int>& tags)
    {
        for (const int tag : tags)
            m_bodies.push_back(&make(tag));
    }

    btRigidBody& make(int tag)
    {
        m_all.push_back(std::make_unique<btRigidBody>(btScalar(1), nullptr, nullptr));
        btRigidBody& body = *m_all.back();
        body.setIslandTag(tag == kKinematic ? -1 : tag);
        if (tag == kKinematic)
            body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
        return body;
    }
    btRigidBody& body(std::size_t index) { return *m_all[index]; }
    void touch(btRigidBody& a, btRigidBody& b)
    {
        m_allManifolds.push_back(std::make_unique<btPersistentManifold>(&a, &b, 0, 1, 1));
        m_manifolds.push_back(m_allManifolds.back().get());
    }
    btTypedConstraint& join(btRigidBody& a, btRigidBody& b)
    {
        const btVector3 pivot(0, 0, 0);
        m_allJoints.push_back(std::make_unique<btPoint2PointConstraint>(a, b, pivot, pivot));
        m_joints.push_back(m_allJoints.back().get());
        return *m_joints.back();
    }

    /// The islands as text: counts of bodies, contacts and joints of each.
    std::string islands()
    {
        std::string text;
        GroupIslands islands({m_bodies.data(), int(m_bodies.size()), m_manifolds.data(),
                              int(m_manifolds.size()), m_joints.data(), int(m_joints.size())});
        for (SolverGroup island; islands.next(island);)
            text += std::to_string(island.bodyCount) + std::to_string(island.manifoldCount) +
                    std::to_string(island.jointCount) + " ";
        return text;
    }

private:
    std::vector<std::unique_ptr<btRigidBody>> m_all;
    std::vector<std::unique_ptr<btPersistentManifold>> m_allManifolds;
    std::vector<std::unique_ptr<btTypedConstraint>> m_allJoints;
    std::vector<btCollisionObject*> m_bodies;
    std::vector<btPersistentManifold*> m_manifolds;
    std::vector<btTypedConstraint*> m_joints;
};

TEST(GroupIslands, FollowTags)
{
    TaggedGroup group({2, 2, 5, 5, 5, 9});
    group.touch(group.body(0), group.body(1));
    group.touch(group.body(2), group.body(4));
    group.touch(group.body(4), group.body(3));
    group.join(group.body(0), group.body(1));
    group.join(btTypedConstraint::getFixedBody(), group.body(5));
    EXPECT_EQ(group.islands(), "211 320 101 ");
}

TEST(GroupIslands, ShareKinematicBodies)
{
    TaggedGroup group({1, 2});
    btRigidBody& plate = group.make(kKinematic);
    group.touch(plate, group.body(0));
    group.touch(group.body(1), plate);
    EXPECT_EQ(group.islands(), "110 110 ");
}

TEST(GroupIslands, AreOneWithoutTags)
{
    TaggedGroup group({-1, -1, -1});
    group.touch(group.body(0), group.body(2));
    group.join(group.body(0), group.body(1));
    EXPECT_EQ(group.islands(), "311 ");
    EXPECT_EQ(TaggedGroup({}).islands(), "");
}

TEST(GroupIslands, AreOneWhenBodiesAreNotSorted)
{
    EXPECT_EQ(TaggedGroup({1, 2, 1, 3}).islands(), "400 ");
    EXPECT_EQ(TaggedGroup({2, 1}).islands(), "200 ");
    EXPECT_EQ(TaggedGroup({-1, 1}).islands(), "200 ");
    EXPECT_EQ(TaggedGroup({1, 2}).islands(), "100 100 ");
}

TEST(GroupIslands, AreOneWhenSomethingJoinsThem)
{
    TaggedGroup touching({1, 2}), joined({1, 2}), disabled({1, 2}), outside({1, 2});
    touching.touch(touching.body(0), touching.body(1));
    EXPECT_EQ(touching.islands(), "210 ");
    joined.join(joined.body(0), joined.body(1));
    EXPECT_EQ(joined.islands(), "201 ");
    disabled.join(disabled.body(0), disabled.body(1)).setEnabled(false);
    EXPECT_EQ(disabled.islands(), "101 100 ");
    outside.touch(outside.body(1), outside.make(7));
    EXPECT_EQ(outside.islands(), "210 ");
}
}  // namespace
}  // namespace cullet::test
