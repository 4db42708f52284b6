// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/cuda/support/triangle_scene.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

// Checks of trees of triangles that the CPU's executor and a device share.
//
// A subject has two trees and build(tree, mesh), refit(tree, mesh), pairs(a, b), ownPairs(tree, which), which return lists, and
// invalid(), of the last list.
namespace cullet::test
{
/// All searches of two meshes.
template <class Subject>
void checkSearches(Subject& subject, const TriangleScene& scene)
{
    const std::uint64_t invalidA = scene.a.invalidCount(), invalidB = scene.b.invalidCount();
    EXPECT_EQ(subject.pairs(0, 1), pairsByMeshTree(scene.a, scene.b));
    EXPECT_EQ(subject.invalid(), invalidA + invalidB);
    EXPECT_EQ(subject.pairs(1, 0), pairsByMeshTree(scene.b, scene.a));
    for (const OwnPairs which : {OwnPairs::All, OwnPairs::WithoutNeighbours})
    {
        EXPECT_EQ(subject.ownPairs(0, which), ownPairsByMeshTree(scene.a, which));
        EXPECT_EQ(subject.invalid(), invalidA);
    }
}

/// Builds, refits, and builds anew, as the meshes deform.
template <class Subject>
void checkDeformation(Subject& subject, TriangleScene& scene)
{
    for (int frame = 0; frame < 6; ++frame)
    {
        SCOPED_TRACE("frame " + std::to_string(frame));
        if (frame % 3 == 0)
        {
            subject.build(0, scene.a);
            subject.build(1, scene.b);
        }
        else
        {
            subject.refit(0, scene.a);
            subject.refit(1, scene.b);
        }
        checkSearches(subject, scene);
        scene.step();
    }
}

/// The scene has pairs of each kind, and others than they.
inline void expectRepresentative(const TriangleScene& scene)
{
    const std::size_t all = ownPairsByMeshTree(scene.a, OwnPairs::All).size();
    const std::size_t notNeighbours = ownPairsByMeshTree(scene.a, OwnPairs::WithoutNeighbours).size();
    EXPECT_GT(all, scene.a.size() / 2);
    EXPECT_TRUE(scene.a.indices.empty() ? notNeighbours == all : notNeighbours < all && notNeighbours > 0);
    EXPECT_GT(pairsByMeshTree(scene.a, scene.b).size(), scene.a.size() / 8);
}

/// Trees of no triangle and of one, and trees that there are not.
template <class Subject>
void checkSmallMeshes(Subject& subject)
{
    const TriangleMesh none;
    TriangleMesh one;
    one.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const TrianglePairList onePair = {{0, 0}};
    EXPECT_EQ(subject.pairs(0, 1), TrianglePairList());
    subject.build(0, one);
    EXPECT_EQ(subject.pairs(0, 1), TrianglePairList());
    EXPECT_EQ(subject.ownPairs(0, OwnPairs::All), TrianglePairList());
    subject.build(1, none);
    EXPECT_EQ(subject.pairs(0, 1), TrianglePairList());
    EXPECT_EQ(subject.pairs(1, 0), TrianglePairList());
    subject.build(1, one);
    EXPECT_EQ(subject.pairs(0, 1), onePair);
    EXPECT_EQ(subject.pairs(0, 0), onePair);
    // Trees of the numbers 2 and 3 do not exist.
    subject.build(2, one);
    subject.refit(3, one);
    EXPECT_EQ(subject.pairs(0, 2), TrianglePairList());
    EXPECT_EQ(subject.pairs(3, 1), TrianglePairList());
    EXPECT_EQ(subject.ownPairs(0xffffffffu, OwnPairs::All), TrianglePairList());
    // Boxes are closed: these touch in a point. A refit to another number of triangles builds.
    TriangleMesh two = one;
    two.vertices.insert(two.vertices.end(), {1, 1, 0, 2, 1, 0, 1, 2, 0});
    subject.refit(1, two);
    EXPECT_EQ(subject.pairs(0, 1), (TrianglePairList{{0, 0}, {0, 1}}));
    two.vertices[9] = std::nextafter(1.0f, 2.0f);
    two.vertices[15] = std::nextafter(1.0f, 2.0f);
    subject.refit(1, two);
    EXPECT_EQ(subject.pairs(0, 1), onePair);
    subject.refit(1, none);
    EXPECT_EQ(subject.pairs(0, 1), TrianglePairList());
}

/// A triangle is in no pair while it is invalid.
template <class Subject>
void checkRepair(Subject& subject, TriangleScene& scene)
{
    subject.build(1, scene.b);
    const TriangleMesh whole = scene.a;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::uint32_t i = 0; i < scene.a.vertexCount(); i += 2)
        scene.a.vertex(i)[i % 3] = nan;
    subject.build(0, scene.a);
    EXPECT_GT(scene.a.invalidCount(), scene.a.size() / 2);
    checkSearches(subject, scene);
    scene.a = whole;
    subject.refit(0, scene.a);
    EXPECT_EQ(scene.a.invalidCount(), 0u);
    checkSearches(subject, scene);
}

/// Coordinates at the ends of the floats.
template <class Subject>
void checkExtremes(Subject& subject)
{
    TriangleScene scene("soup", 20, 63);
    const float most = std::numeric_limits<float>::max(), least = std::numeric_limits<float>::denorm_min();
    for (std::uint32_t i = 0; i < scene.a.vertexCount(); ++i)
    {
        float* const at = scene.a.vertex(i);
        for (int axis = 0; axis < 3; ++axis)
        {
            const std::uint32_t choice = (i / 3 * 7 + static_cast<std::uint32_t>(axis)) % 11;
            at[axis] = choice == 0   ? most
                       : choice == 1 ? -most
                       : choice == 2 ? least
                       : choice == 3 ? -0.0f
                                     : at[axis];
        }
    }
    subject.build(0, scene.a);
    subject.build(1, scene.b);
    EXPECT_EQ(scene.a.invalidCount(), 0u);
    checkSearches(subject, scene);
}
}  // namespace cullet::test
