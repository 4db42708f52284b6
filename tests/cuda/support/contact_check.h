// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

/// Depths and contacts of convex pairs against penetration() and the hulls in double.
namespace cullet::test
{
struct ContactTally
{
    std::int64_t pairs = 0, wrong = 0;
    std::int64_t shallow = 0, deep = 0;        ///< less than 1e-3, and more than .1 of the size
    std::int64_t points[5] = {0, 0, 0, 0, 0};  ///< contacts by their number of points
    double worstDepth = 0, worstGap = 0;       ///< in units of the size
};

inline Eigen::Vector3d vectorOf(const float (&v)[3])
{
    return {v[0], v[1], v[2]};
}

/// How far a point, relative to the origin of A, is from a hull with that place.
inline double distanceTo(const PosedHull<double>& hull, const Eigen::Vector3d& place,
                         const Eigen::Vector3d& point)
{
    const Hull<double> corner = makeHull(std::vector<Eigen::Vector3d>{{0, 0, 0}}, HullExtra::None);
    const PosedHull<double> other(corner, Eigen::Matrix3d::Identity(), point - place + hull.origin());
    GjkCache<double> cache;
    return gjkDistance(hull, other, std::numeric_limits<double>::infinity(), cache).distance;
}

/// The depth of penetration(), in the tolerance of the record, and a point of each hull that far apart and as far out
/// as the hulls are.
inline bool isDepthRight(const ConvexScene& scene, RowPair pair, const PairDepth& found, ContactTally& tally)
{
    const PosedHull<double> a = scene.posed(pair.a), b = scene.posed(pair.b);
    const double size = scene.sizeOf(pair);
    GjkCache<double> cache;
    const PenetrationResult<double> expected = penetration<double>(a, b, cache);
    const double truth = expected.state == GjkState::Overlapping ? expected.depth : 0.0;
    const Eigen::Vector3d normal = vectorOf(found.normal), onB = vectorOf(found.pointB);
    const Eigen::Vector3d place = b.origin() - a.origin(), onA = onB - found.depth * normal;
    tally.shallow += truth < 1e-3 * size;
    tally.deep += truth > 0.1 * size;
    tally.worstDepth = std::max(tally.worstDepth, std::abs(found.depth - truth) / size);
    tally.worstGap = std::max(tally.worstGap, found.gap / size);
    const double band = 2e-6 * size;
    const double offB = normal.dot(onB - place) - heightAlong(b, normal);
    const double offA = -normal.dot(onA) - heightAlong(a, -normal);
    const double outB = distanceTo(b, place, onB), outA = distanceTo(a, Eigen::Vector3d::Zero(), onA);
    const bool isRight = std::abs(normal.norm() - 1.0) < 1e-6 && found.gap >= 0.0f &&
                         found.gap <= 1e-4 * size && std::abs(found.depth - truth) <= band &&
                         std::abs(offB) <= band && std::abs(offA) <= band && outB <= band && outA <= band;
    EXPECT_TRUE(isRight || tally.wrong > 5)
        << "depth " << found.depth << " instead of " << truth << ", gap " << found.gap << ", heights " << offA
        << " " << offB << ", outside by " << outA << " " << outB << ", size " << size << ", hulls "
        << scene.poses[pair.a].hull << " " << scene.poses[pair.b].hull;
    return isRight;
}

/// One to four points in the hulls, the deepest first, none deeper than the pair or farther apart than the margin, and
/// no two in the same place.
inline bool isContactRight(const ConvexScene& scene, RowPair pair, const PairDepth& depth,
                           const PairContact& found, double margin, ContactTally& tally)
{
    if (found.count < 1 || found.count > 4)
        return false;
    ++tally.points[found.count];
    const PosedHull<double> a = scene.posed(pair.a), b = scene.posed(pair.b);
    const double size = scene.sizeOf(pair), band = 4e-6 * size;
    const Eigen::Vector3d normal = vectorOf(found.normal), place = b.origin() - a.origin();
    bool isRight = normal == vectorOf(depth.normal) &&
                   found.points[0].depth >= depth.depth - 1.01e-3 * (depth.depth + margin) - band;
    for (std::uint32_t i = 0; i < found.count; ++i)
    {
        const Eigen::Vector3d onB = vectorOf(found.points[i].pointB);
        const Eigen::Vector3d onA = onB - double(found.points[i].depth) * normal;
        isRight = isRight && found.points[i].depth <= depth.depth * (1 + 1e-6) &&
                  found.points[i].depth >= -margin - band && distanceTo(b, place, onB) <= band &&
                  distanceTo(a, Eigen::Vector3d::Zero(), onA) <= band;
        for (std::uint32_t j = 0; j < i; ++j)
            isRight = isRight && (onB - vectorOf(found.points[j].pointB)).norm() > 0.9e-3 * size;
    }
    EXPECT_TRUE(isRight || tally.wrong > 5)
        << found.count << " points, depths " << found.points[0].depth << " to "
        << found.points[found.count - 1].depth << " of " << depth.depth << ", hulls "
        << scene.poses[pair.a].hull << " " << scene.poses[pair.b].hull;
    return isRight;
}

/// The sample has contacts of every kind.
inline void expectVaried(const ContactTally& tally, bool isDeep)
{
    EXPECT_GT(tally.shallow, tally.pairs / 5);
    EXPECT_LT(tally.shallow, tally.pairs * 4 / 5);
    EXPECT_EQ(tally.deep > tally.pairs / 5, isDeep);
    for (int count = 1; count <= 4; ++count)
        EXPECT_GT(tally.points[count], tally.pairs / 20) << count;
}

inline void checkContacts(const ConvexScene& scene, const ConvexAnswers& answers, double margin,
                          ContactTally& tally)
{
    ASSERT_EQ(answers.overlaps, overlapsOf(answers.states));
    ASSERT_EQ(answers.depths.size(), answers.overlaps.size());
    ASSERT_EQ(answers.contacts.size(), answers.overlaps.size());
    for (std::size_t k = 0; k < answers.overlaps.size(); ++k)
    {
        const RowPair pair = scene.pairs[answers.overlaps[k]];
        ++tally.pairs;
        const bool isRight =
            isDepthRight(scene, pair, answers.depths[k], tally) &&
            isContactRight(scene, pair, answers.depths[k], answers.contacts[k], margin, tally);
        tally.wrong += !isRight;
    }
}
}  // namespace cullet::test
