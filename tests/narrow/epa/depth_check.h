// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <random>
#include <string>
#include <vector>

/// Depths, queried like by the algorithm of a pair, against the exact search over all faces and edge pairs.
namespace cullet::test
{
/// Normally distributed points around the origin, with a standard deviation per axis.
struct NormalPoints
{
    std::mt19937& engine;
    std::normal_distribution<double> normal{};

    Eigen::Vector3d operator()() { return drawVector(normal, engine); }
};

/// A translated hull.
template <class S>
PosedHull<S> at(const Hull<S>& hull, double x, double y, double z)
{
    return {hull, Eigen::Matrix<S, 3, 3>::Identity(), Eigen::Vector3d(x, y, z).cast<S>()};
}

struct DepthTally
{
    std::int64_t queries = 0, exact = 0, unanswered = 0, deep = 0, shallow = 0, remembered = 0, atOnce = 0;
    double worstDepth = 0.0;
    double worstGap = 0.0;
    double worstPoint = 0.0;
    double worstOutside = 0.0;  ///< of a deepest point, from its own shape
};

/// Distance of a point outside of a hull, 0 for one inside. Both are relative to the origin of a shape.
///
/// @param shift from that origin to the origin of the hull
template <class S>
double outsideOf(const PosedHull<S>& posed, const Eigen::Vector3d& shift, const Eigen::Matrix<S, 3, 1>& point)
{
    const PlacedHull placed(posed, shift, 1.0);
    double outside = 0.0;
    for (const Eigen::Vector3d& normal : placed.normals)
        outside = std::max(outside, normal.dot(point.template cast<double>()) - placed.extent(normal));
    return outside;
}

template <class S>
PenetrationResult<S> depthOf(const PairScene<S>& scene, GjkCache<S>& cache, EpaCache& memory,
                             DepthTally& tally)
{
    const PosedHull<S> a = scene.posedA();
    const PosedHull<S> b = scene.posedB();
    const PenetrationResult<S> remembered = rememberedPenetration(a, b, cache, memory);
    if (remembered.state == GjkState::Overlapping)
    {
        ++tally.remembered;
        tally.atOnce += remembered.iterations == 0;
        return remembered;
    }
    EXPECT_EQ(memory.vertexCount, 0);
    if (isaGjk(a, b, S(0), cache).state != GjkState::Overlapping)
    {
        PenetrationResult<S> none;
        none.state = GjkState::Separated;
        return none;
    }
    return penetration(a, b, cache, &memory);
}

template <class S>
void checkDepth(const PairScene<S>& scene, GjkCache<S>& cache, EpaCache& memory, DepthTally& tally)
{
    const PosedHull<S> a = scene.posedA();
    const PosedHull<S> b = scene.posedB();
    const PenetrationResult<S> result = depthOf(scene, cache, memory, tally);
    if (result.state == GjkState::Separated)
        return;
    if (result.state != GjkState::Overlapping)
    {
        ++tally.unanswered;
        return;
    }
    Eigen::Vector3d normal;
    double depth = 0.0;
    exactPenetration(a, b, normal, depth);
    ++tally.queries;
    tally.exact += result.method == PenetrationMethod::Exact;
    (depth > 0.05 ? tally.deep : tally.shallow) += 1;
    tally.worstDepth = std::max(tally.worstDepth, std::abs(static_cast<double>(result.depth) - depth));
    tally.worstGap = std::max(tally.worstGap, static_cast<double>(result.dualGap));
    // After moving A along the axis by the depth, the shapes overlap by no more than rounding.
    const DistanceOracle oracle(a, b);
    const double rest =
        static_cast<double>(oracle.extent(-result.axis.template cast<long double>())) - result.depth;
    tally.worstPoint = std::max(tally.worstPoint, std::abs(rest));
    tally.worstOutside = std::max({tally.worstOutside, outsideOf(a, Eigen::Vector3d::Zero(), result.pointA),
                                   outsideOf(b, b.origin() - a.origin(), result.pointB)});
    EXPECT_LT((result.pointB - result.pointA - result.depth * result.axis).norm(), 1e-5);
}

/// Random pairs of the named shapes, each with a second query after a small motion, which uses the cache of the first.
/// @param farAway of both shapes from the world's origin
template <class S>
DepthTally checkDepths(bool isThin, double farAway, int rounds, unsigned seed)
{
    const std::vector<NamedPoints> shapes = queryShapes();
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : shapes)
        hulls.push_back(hullOf<S>(shape.points));
    const double gaps[] = {-1e-5, -1e-3, -0.01, -0.05, -0.15, -0.3, -0.5};
    DepthTally tally;
    std::mt19937 engine(seed);
    for (int i = 0; i < rounds; ++i)
    {
        const std::size_t a = engine() % shapes.size();
        const std::size_t b = engine() % shapes.size();
        const bool isLarge = hulls[a].vertexCount() + hulls[b].vertexCount() > 200;
        if ((shapes[a].isThin || shapes[b].isThin) != isThin || (isLarge && i % 8 != 0))
            continue;
        SCOPED_TRACE(testing::Message() << shapes[a].name << " " << shapes[b].name << " query " << i);
        PairScene<S> scene =
            randomPair(hulls[a], hulls[b], gaps[engine() % std::size(gaps)], farAway, engine);
        GjkCache<S> cache;
        EpaCache memory;
        checkDepth(scene, cache, memory, tally);
        perturb(scene, 0.005, engine);
        checkDepth(scene, cache, memory, tally);
    }
    return tally;
}

inline void expectGood(const DepthTally& tally, double tolerance, const char* name)
{
    testing::Test::RecordProperty(std::string(name) + ".queries", std::to_string(tally.queries));
    testing::Test::RecordProperty(std::string(name) + ".exact", std::to_string(tally.exact));
    testing::Test::RecordProperty(std::string(name) + ".worstDepth",
                                  std::to_string(tally.worstDepth * 1e9) + "e-9");
    testing::Test::RecordProperty(std::string(name) + ".worstGap",
                                  std::to_string(tally.worstGap * 1e9) + "e-9");
    testing::Test::RecordProperty(std::string(name) + ".worstOutside",
                                  std::to_string(tally.worstOutside * 1e9) + "e-9");
    EXPECT_EQ(tally.unanswered, 0) << name;
    EXPECT_LE(tally.worstDepth, tolerance) << name;
    EXPECT_LE(tally.worstPoint, tolerance) << name;
    EXPECT_LE(tally.worstOutside, tolerance) << name;
    EXPECT_GT(tally.deep, tally.queries / 20) << name;
    EXPECT_GT(tally.shallow, tally.queries / 20) << name;
    // Expects answers from the cached surface of the previous query, and from its closest face alone.
    EXPECT_GT(tally.remembered, tally.queries / 4) << name;
    EXPECT_GT(tally.atOnce, tally.remembered / 4) << name;
    EXPECT_GT(tally.remembered - tally.atOnce, tally.remembered / 10) << name;
    // The exact fallback is rare.
    EXPECT_LT(tally.exact, tally.queries / 10) << name;
}
}  // namespace cullet::test
