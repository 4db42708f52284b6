// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_batch.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
/// Two triangles with a common edge from `corner` to `other`. The first one leads down from the corner, where it touches.
struct SharedEdge
{
    explicit SharedEdge(const btVector3& lastOfSecond)
    {
        const btVector3 first[] = {corner, other, corner + vec(0, -1, 1)};
        const btVector3 second[] = {other, corner, lastOfSecond};
        batch.add(first, 0, 0);
        batch.add(second, 0, 1);
        const btTransform origin = btTransform::getIdentity();
        batch.placeAll(CoreFrame(origin, origin, FrameAxes::World));
    }

    /// Whether the second triangle stays, after a touch of the first one at a place that is off by a rounding.
    bool staysAfterTouchAt(const Eigen::Vector3d& rounding)
    {
        const Eigen::Vector3d touched =
            Eigen::Vector3d(double(corner.x()), double(corner.y()), double(corner.z())) + rounding;
        batch.dropRepeats(0, Eigen::Vector3d::UnitY(), touched);
        return batch.isNear(1);
    }

    const btVector3 corner = vec(1, 0, 0.5), other = vec(2, -1, 0.5);
    TriangleBatch batch;
};

const Eigen::Vector3d kRoundings[] = {
    {0, 0, 0}, {1.2e-15, 1e-15, 0}, {0, 1e-15, 0}, {-1e-15, 0, 1e-15}, {0, -1e-15, 0}};

TEST(TriangleBatch, KeepsTriangleThatRisesBeyondTheEndOfASharedEdge)
{
    // Down from the line of the edge, but up from its end.
    for (const Eigen::Vector3d& rounding : kRoundings)
        EXPECT_TRUE(SharedEdge(vec(-1.5, 1.5, -0.5)).staysAfterTouchAt(rounding)) << rounding.transpose();
}

TEST(TriangleBatch, DropsTriangleThatLeadsDownFromASharedCorner)
{
    for (const Eigen::Vector3d& rounding : kRoundings)
        EXPECT_FALSE(SharedEdge(vec(0.5, -0.5, -0.5)).staysAfterTouchAt(rounding)) << rounding.transpose();
}
}  // namespace
}  // namespace cullet::test
