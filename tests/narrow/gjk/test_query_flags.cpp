// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/shapes.h"
#include "cullet/tests/support/process/floating_point_flags.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// The first kFlat shapes have hulls without volume.
constexpr std::size_t kFlat = 6;

/// Flat and usual point sets.
std::vector<NamedPoints> samples()
{
    std::vector<NamedPoints> shapes;
    shapes.push_back({"point", {{0.2, 0.1, -0.3}}});
    shapes.push_back({"point at the origin", {{0.0, 0.0, 0.0}}});
    shapes.push_back({"segment", {{-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}});
    shapes.push_back({"triangle", {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}});
    shapes.push_back({"square", {{-1.0, -1.0, 0.0}, {1.0, -1.0, 0.0}, {1.0, 1.0, 0.0}, {-1.0, 1.0, 0.0}}});
    shapes.push_back({"polygon", moved(prismPoints(40, 0.0), Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.1})});
    shapes.push_back({"tetrahedron", {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}});
    for (const NamedPoints& shape : nastyShapes())
        shapes.push_back(shape);
    return shapes;
}

/// Number of queries by answer, to check that the sample has every kind.
struct Answers
{
    int separated = 0, near = 0, overlapping = 0, flat = 0, remembered = 0;

    void count(GjkState state)
    {
        separated += state == GjkState::Separated ? 1 : 0;
        near += state == GjkState::Near ? 1 : 0;
        overlapping += state == GjkState::Overlapping ? 1 : 0;
    }
};

template <class S>
class QueryFlags
{
public:
    Answers answers;

    /// Runs all kinds of queries of a pair, each with and without the cache of the previous one.
    void query(const PairScene<S>& scene)
    {
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        for (const GjkStart start : {GjkStart::Memory, GjkStart::Axis, GjkStart::FourDirections})
            boolean(a, b, start);
        distance(a, b);
        depth(a, b);
    }

    /// Clears the caches for another pair.
    void forget()
    {
        m_boolean = m_distance = m_depth = GjkCache<S>();
        m_memory = EpaCache();
    }

private:
    void boolean(const PosedHull<S>& a, const PosedHull<S>& b, GjkStart start)
    {
        NoObserver observer;
        for (const S limit : {S(0), S(0.02)})
        {
            GjkCache<S> fresh;
            check("boolean", [&] { isaGjk(a, b, limit, fresh, observer, {start, 0}); });
            GjkState state = GjkState::NotConverged;
            check("remembered boolean",
                  [&] {
                      state = isaGjk(a, b, limit, m_boolean, observer, {start, 0}).state;
                  });
            answers.count(state);
        }
    }

    void distance(const PosedHull<S>& a, const PosedHull<S>& b)
    {
        for (const S limit : {std::numeric_limits<S>::infinity(), S(0.1)})
        {
            GjkCache<S> fresh;
            check("distance", [&] { gjkDistance(a, b, limit, fresh); });
            GjkState state = GjkState::NotConverged;
            check("remembered distance", [&] { state = gjkDistance(a, b, limit, m_distance).state; });
            answers.count(state);
        }
    }

    void depth(const PosedHull<S>& a, const PosedHull<S>& b)
    {
        bool isRecalled = false;
        check(
            "remembered depth", [&]
            { isRecalled = rememberedPenetration(a, b, m_depth, m_memory).state == GjkState::Overlapping; });
        answers.remembered += isRecalled ? 1 : 0;
        GjkState state = GjkState::NotConverged;
        check("boolean before a depth", [&] { state = isaGjk(a, b, S(0), m_depth).state; });
        if (state != GjkState::Overlapping)
            return;
        PenetrationResult<S> result;
        check("depth", [&] { result = penetration(a, b, m_depth, &m_memory); });
        answers.flat += result.method == PenetrationMethod::Flat ? 1 : 0;
        GjkCache<S> fresh;
        check("fresh depth", [&] { penetration(a, b, fresh); });
        if (a.vertexCount() + b.vertexCount() > 100)
            return;
        Eigen::Vector3d normal;
        double depth = 0.0;
        check("exact depth", [&] { exactPenetration(a, b, normal, depth); });
    }

    template <class F>
    void check(const char* query, const F& code)
    {
        const int flags = flagsOf(code);
        EXPECT_EQ(flags, 0) << query << nameFlags(flags);
    }

    GjkCache<S> m_boolean, m_distance, m_depth;
    EpaCache m_memory;
};

/// The pair, scaled.
template <class S>
void scale(PairScene<S>& scene, S size)
{
    for (Pose<S>* pose : {&scene.a, &scene.b})
    {
        pose->basis *= size;
        pose->origin *= size;
    }
}

/// Runs pairs of all shapes, separated, near, touching, deep and concentric, of all sizes, or each with a small motion.
template <class S>
Answers queryAll(int rounds, unsigned seed)
{
    const std::vector<NamedPoints> shapes = samples();
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : shapes)
        hulls.push_back(hullOf<S>(shape.points));
    std::mt19937 engine(seed);
    QueryFlags<S> flags;
    const S sizes[] = {1, 1, 1, S(1e-5), S(1e-2), S(1e2), S(1e5)};
    const double gaps[] = {-0.5, -0.05, -1e-3, -1e-6, 0.0, 1e-6, 1e-3, 0.05, 0.5, 3.0};
    for (int i = 0; i < rounds; ++i)
    {
        const bool areConcentric = i % 11 == 0;
        const std::size_t count = areConcentric && i % 2 == 0 ? kFlat : shapes.size();
        const std::size_t a = engine() % count, b = engine() % count;
        SCOPED_TRACE(testing::Message()
                     << shapes[a].name << ", " << shapes[b].name << ", pair " << i << " of seed " << seed);
        PairScene<S> scene = randomPair(hulls[a], hulls[b], gaps[i % 10], i % 3 == 0 ? 100.0 : 0.0, engine);
        if (areConcentric)
            scene.b = scene.a;
        const S size = sizes[i % 7];
        scale(scene, size);
        flags.forget();
        for (int frame = 0; frame < (size == S(1) ? 4 : 1); ++frame)
        {
            flags.query(scene);
            if (testing::Test::HasFailure())
                return flags.answers;
            perturb(scene, 0.01, engine);
        }
    }
    return flags.answers;
}

void expectAll(const Answers& answers)
{
    EXPECT_GT(answers.separated, 100);
    EXPECT_GT(answers.near, 100);
    EXPECT_GT(answers.overlapping, 100);
    EXPECT_GT(answers.flat, 3);
    EXPECT_GT(answers.remembered, 30);
}

TEST(QueryFlags, ReportNoFloatingPointExceptionOfFloatQueries)
{
    expectAll(queryAll<float>(700, 1));
}

TEST(QueryFlags, ReportNoFloatingPointExceptionOfDoubleQueries)
{
    expectAll(queryAll<double>(700, 2));
}

TEST(QueryFlags, ReportNoFloatingPointExceptionWhenHullsAreBuilt)
{
    for (const NamedPoints& shape : samples())
    {
        SCOPED_TRACE(shape.name);
        const auto narrow = castPoints<float>(shape.points);
        int flags = flagsOf([&] { makeHull(narrow, HullExtra::Hierarchy); });
        EXPECT_EQ(flags, 0) << "float" << nameFlags(flags);
        flags = flagsOf([&] { makeHull(shape.points, HullExtra::Hierarchy); });
        EXPECT_EQ(flags, 0) << "double" << nameFlags(flags);
    }
}
}  // namespace
}  // namespace cullet::test
