// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/facing_faces.h"
#include "cullet/narrow/gjk/feature_pair.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

namespace cullet::test
{
namespace
{
template <class S>
class FacingFacesTest : public testing::Test
{
};
using FacingScalars = testing::Types<float, double>;
TYPED_TEST_SUITE(FacingFacesTest, FacingScalars);

/// A prism on another one, almost level, anywhere over it.
template <class S>
struct PrismOnPrism
{
    PrismOnPrism(const Hull<S>& above, const Hull<S>& below, double tilt, double reach, std::mt19937& engine)
        : hullA(above), hullB(below)
    {
        std::uniform_real_distribution<double> any(-1, 1);
        const double x = any(engine), z = any(engine);
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(tilt, Eigen::Vector3d(x, 0.1, z).normalized()).toRotationMatrix() *
            Eigen::AngleAxisd(3 * any(engine), Eigen::Vector3d::UnitZ()).toRotationMatrix();
        basis = turn.template cast<S>();
        const double dx = reach * any(engine), dy = reach * any(engine);
        origin << S(dx), S(dy), S(1.05 + tilt);
    }
    PosedHull<S> a() const { return {hullA, basis, origin}; }
    PosedHull<S> b() const
    {
        return {hullB, Eigen::Matrix<S, 3, 3>::Identity(), Eigen::Matrix<S, 3, 1>::Zero()};
    }

    const Hull<S>&hullA, &hullB;
    Eigen::Matrix<S, 3, 3> basis;
    Eigen::Matrix<S, 3, 1> origin;
};

/// A vertex of the face that is highest along the third axis.
template <class S>
std::int32_t anyVertexOfFace(const PosedHull<S>& shape, double side, std::mt19937& engine)
{
    for (;;)
    {
        const auto vertex = static_cast<std::int32_t>(engine() % unsigned(shape.vertexCount()));
        if (side * shape.point(vertex).z() > 0.3)
            return vertex;
    }
}
}  // namespace

/// What it guesses is what a search finds, with the same bits, or nothing that can be proved.
TYPED_TEST(FacingFacesTest, GuessesFeaturesThatSearchFinds)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 47;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 engine(kSeed);
    const std::array<Hull<S>, 3> hulls = {hullOf<S>(prismPoints(8, 0.5)), hullOf<S>(prismPoints(5, 0.5)),
                                          hullOf<S>(boxPoints(1.0, 0.8, 0.5))};
    int asked = 0, proved = 0;
    std::array<int, 4> kinds = {};
    for (int i = 0; i < 2000; ++i)
    {
        const double tilt = std::array<double, 4>{0.03, 1e-3, 1e-5, 1e-7}[std::size_t(i) % 4];
        const PrismOnPrism<S> scene(hulls[std::size_t(i) % 3], hulls[std::size_t(i / 3) % 3], tilt, 1.2,
                                    engine);
        const PosedHull<S> a = scene.a(), b = scene.b();
        GjkCache<S> cache;
        const GjkResult<S> near = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
        FeaturePair<S> searched(a, b), guessed(a, b);
        const Eigen::Vector3d axis = near.axis.template cast<double>();
        if (near.state != GjkState::Near || axis.z() < 0.99 || !searched.solveStrict(pairsOf(cache), axis))
            continue;
        ++asked;
        const std::int32_t vertexA = anyVertexOfFace(a, -1.0, engine),
                           vertexB = anyVertexOfFace(b, 1.0, engine);
        const FacingFaces<S> faces(a, b, vertexA, vertexB, {0.002, -0.003, 2.0});
        if (!faces.isFound() || !guessed.solveStrict(faces.pairs(), {0.002, -0.003, 2.0}))
            continue;
        ++proved;
        const VertexPairs& pairs = faces.pairs();
        ++kinds[std::size_t(distinctVertices(pairs.a, pairs.count).count)];
        EXPECT_EQ(guessed.normal(), searched.normal()) << i;
        EXPECT_EQ(guessed.distance(), searched.distance()) << i;
        EXPECT_EQ(guessed.pointOfB(), searched.pointOfB()) << i;
        EXPECT_EQ(guessed.vertexA(), searched.vertexA()) << i;
        EXPECT_EQ(guessed.vertexB(), searched.vertexB()) << i;
    }
    EXPECT_GT(asked, 1000);
    EXPECT_GT(proved, asked * 9 / 10);
    for (int kind = 1; kind <= 3; ++kind)
        EXPECT_GT(kinds[std::size_t(kind)], 100)
            << "corners of A over B, edges that cross, corners of B over A";
}

TYPED_TEST(FacingFacesTest, FindNothingWithoutFacesThatOverlap)
{
    using S = TypeParam;
    const Hull<S> prism = hullOf<S>(prismPoints(8, 0.5)), wide = hullOf<S>(prismPoints(40, 0.5)),
                  segment = hullOf<S>({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}});
    const Eigen::Matrix<S, 3, 3> identity = Eigen::Matrix<S, 3, 3>::Identity();
    const Eigen::Vector3d up(0, 0, 1);
    const auto isFound = [&](const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& at, std::int32_t vertex,
                             const Eigen::Vector3d& about)
    {
        std::mt19937 engine(1);
        const PosedHull<S> a(hull, identity, at), b(prism, identity, Eigen::Matrix<S, 3, 1>::Zero());
        return FacingFaces<S>(a, b, vertex, anyVertexOfFace(b, 1.0, engine), about).isFound();
    };
    std::mt19937 engine(2);
    const std::int32_t low =
        anyVertexOfFace(PosedHull<S>(prism, identity, Eigen::Matrix<S, 3, 1>::Zero()), -1.0, engine);
    const Eigen::Matrix<S, 3, 1> above(S(0.1), S(0.2), S(1.1)), beside(S(3), S(0.2), S(1.1));
    EXPECT_TRUE(isFound(prism, above, low, up));
    EXPECT_FALSE(isFound(prism, beside, low, up));
    EXPECT_FALSE(isFound(prism, above, -1, up));
    EXPECT_FALSE(isFound(prism, above, 99, up));
    EXPECT_FALSE(isFound(prism, above, low, Eigen::Vector3d::Zero()));
    EXPECT_FALSE(
        isFound(prism, above, low, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())));
    EXPECT_FALSE(isFound(segment, above, 0, up));
    EXPECT_FALSE(
        isFound(wide, above, anyVertexOfFace(PosedHull<S>(wide, identity, above * S(0)), -1.0, engine), up))
        << "too many corners";
}
}  // namespace cullet::test
