// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/midphase/leaf_tests.h"

#include "cullet/mid/triangle_overlap.h"
#include "cullet/mid/triangle_pair.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <algorithm>
#include <limits>
#include <unordered_map>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Vertices = float[3][3];

void copyTo(const TriangleVertices& from, Vertices& to)
{
    for (std::size_t corner = 0; corner < 3; ++corner)
    {
        for (int axis = 0; axis < 3; ++axis)
            to[corner][axis] = from[corner][axis];
    }
}

bool overlap(const MeshBox& a, const MeshBox& b)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (a.min[axis] > b.max[axis] || b.min[axis] > a.max[axis])
            return false;
    }
    return true;
}

enum class Faces
{
    All,
    NearOnes  ///< those whose boxes overlap the triangle's
};

/// Triangles against triangles, some lanes at once.
class TriangleLeaves final : public LeafTest
{
public:
    TriangleLeaves(std::size_t lanes, Faces faces) : m_lanes(lanes), m_faces(faces) {}

    void run(LeafAnswers& answers) override
    {
        answers.isCrossing.assign(m_pairs->size(), 0);
        answers.tests = 0;
        for (std::size_t begin = 0; begin < m_pairs->size();)
        {
            std::size_t end = begin;
            while (end < m_pairs->size() && (*m_pairs)[end].a == (*m_pairs)[begin].a)
                ++end;
            if (m_scene->queries.hull != nullptr)
                testHull(begin, end, answers);
            else
                testTriangle(begin, end, answers);
            begin = end;
        }
    }

private:
    /// One triangle against those that it meets, next to each other in the list of pairs.
    void testTriangle(std::size_t begin, std::size_t end, LeafAnswers& answers)
    {
        Vertices one;
        copyTo(m_scene->queries.triangles[(*m_pairs)[begin].a], one);
        for (std::size_t i = begin; i < end; i += m_lanes)
        {
            const std::size_t count = std::min(end - i, m_lanes);
            for (std::size_t lane = 0; lane < count; ++lane)
                setLane(m_scene->mesh[(*m_pairs)[i + lane].b], lane);
            const std::uint32_t near = nearLanes(count, one, answers);
            for (std::size_t lane = 0; lane < count; ++lane)
                answers.isCrossing[i + lane] = (near >> lane & 1u) != 0 ? 1 : 0;
        }
    }

    /// The faces of a hull, moved once, against each triangle that it meets.
    void testHull(std::size_t begin, std::size_t end, LeafAnswers& answers)
    {
        const MidphaseQueries& queries = m_scene->queries;
        m_moved.clear();
        m_boxes.clear();
        for (std::size_t face = 0; face < queries.hullFaces.size(); ++face)
        {
            m_moved.push_back(queries.faceOf((*m_pairs)[begin].a, face));
            m_boxes.push_back(boxOfTriangle(m_moved.back().data(), 0.0));
        }
        for (std::size_t i = begin; i < end; ++i)
            answers.isCrossing[i] = isFaceNear(m_scene->mesh[(*m_pairs)[i].b], answers) ? 1 : 0;
    }

    bool isFaceNear(const TriangleVertices& triangle, LeafAnswers& answers)
    {
        Vertices one;
        copyTo(triangle, one);
        const MeshBox box = boxOfTriangle(triangle.data(), 0.0);
        std::size_t count = 0;
        for (std::size_t face = 0; face < m_moved.size(); ++face)
        {
            if (m_faces == Faces::NearOnes && !overlap(box, m_boxes[face]))
                continue;
            setLane(m_moved[face], count++);
            if (count == m_lanes && nearLanes(count, one, answers) != 0)
                return true;
            count %= m_lanes;
        }
        return count > 0 && nearLanes(count, one, answers) != 0;
    }

    std::uint32_t nearLanes(std::size_t count, const Vertices& one, LeafAnswers& answers)
    {
        ++answers.tests;
        return ~m_kernels.apart(m_block, one) & ((1u << count) - 1u);
    }

    void setLane(const TriangleVertices& triangle, std::size_t lane)
    {
        for (std::size_t corner = 0; corner < 3; ++corner)
        {
            for (int axis = 0; axis < 3; ++axis)
                m_block.corners[corner][axis][lane] = triangle[corner][axis];
        }
    }

    std::size_t m_lanes;
    Faces m_faces;
    const MeshKernels& m_kernels = meshKernels(false);
    TriangleBlock m_block = {};
    std::vector<TriangleVertices> m_moved;  ///< faces of a hull
    std::vector<MeshBox> m_boxes;           ///< of those
};

/// The distance of two triangles; triangles that cross have none.
class DistanceLeaves final : public LeafTest
{
public:
    void run(LeafAnswers& answers) override
    {
        answers.isCrossing.assign(m_pairs->size(), 0);
        answers.tests = m_pairs->size();
        TrianglePairTouch touch;
        TriangleCorners a, b;
        for (std::size_t i = 0; i < m_pairs->size(); ++i)
        {
            for (std::size_t corner = 0; corner < 3; ++corner)
            {
                a[corner] = m_scene->queries.triangles[(*m_pairs)[i].a][corner].cast<double>();
                b[corner] = m_scene->mesh[(*m_pairs)[i].b][corner].cast<double>();
            }
            answers.isCrossing[i] = findTouch(a, b, 1e30, touch) == TrianglePairState::Unknown ? 1 : 0;
        }
    }
};

enum class Start
{
    Cold,
    Warm  ///< where the last search for the pair ended
};

/// A search for each pair.
class GjkLeaves final : public LeafTest
{
public:
    GjkLeaves(bool isBoolean, Start start) : m_isBoolean(isBoolean), m_start(start) {}

    void setFrame(const MidphaseScene& scene, const std::vector<RowPair>& pairs) override
    {
        m_known.clear();
        for (std::size_t i = 0; i < m_ends.size() && m_start == Start::Warm; ++i)
            m_known[keyOf(m_before[i])] = m_ends[i];
        LeafTest::setFrame(scene, pairs);
        m_before = pairs;
        m_caches.clear();
        for (const RowPair& pair : pairs)
        {
            const auto known = m_known.find(keyOf(pair));
            m_caches.push_back(known != m_known.end() ? known->second : GjkCache<btScalar>());
        }
    }

    void run(LeafAnswers& answers) override
    {
        answers.isCrossing.assign(m_pairs->size(), 0);
        answers.tests = m_pairs->size();
        m_ends = m_caches;
        for (std::size_t i = 0; i < m_pairs->size(); ++i)
        {
            const RowPair& pair = (*m_pairs)[i];
            const PosedShape a = queryOf(m_scene->queries, pair.a), b = poseOf(m_scene->mesh[pair.b]);
            constexpr btScalar kAny = std::numeric_limits<btScalar>::infinity();
            const GjkState state = m_isBoolean ? isaGjk(a, b, btScalar(0), m_ends[i]).state
                                               : gjkDistance(a, b, kAny, m_ends[i]).state;
            answers.isCrossing[i] = state == GjkState::Overlapping ? 1 : 0;
        }
    }

private:
    static std::uint64_t keyOf(const RowPair& pair) { return std::uint64_t(pair.a) << 32 | pair.b; }

    static PosedShape poseOf(const TriangleVertices& triangle)
    {
        const Eigen::Vector3d corners[3] = {triangle[0].cast<double>(), triangle[1].cast<double>(),
                                            triangle[2].cast<double>()};
        return poseTriangle(corners);
    }

    static PosedShape queryOf(const MidphaseQueries& queries, std::size_t query)
    {
        if (queries.hull == nullptr)
            return poseOf(queries.triangles[query]);
        return {*queries.hull, queries.bases[query].cast<btScalar>(),
                queries.origins[query].cast<btScalar>()};
    }

    bool m_isBoolean;
    Start m_start;
    std::vector<RowPair> m_before;
    std::vector<GjkCache<btScalar>> m_caches, m_ends;
    std::unordered_map<std::uint64_t, GjkCache<btScalar>> m_known;
};

btVector3 toBulletVector(const Eigen::Vector3f& v)
{
    return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])};
}

/// Bullet's search, without margins.
class BulletLeaves final : public LeafTest
{
public:
    void setFrame(const MidphaseScene& scene, const std::vector<RowPair>& pairs) override
    {
        LeafTest::setFrame(scene, pairs);
        if (scene.queries.hull == nullptr || m_hull)
            return;
        m_hull = std::make_unique<btConvexHullShape>();
        for (const Eigen::Vector3f& point : scene.queries.hullPoints)
            m_hull->addPoint(toBulletVector(point), false);
        m_hull->setMargin(0);
    }

    void run(LeafAnswers& answers) override
    {
        answers.isCrossing.assign(m_pairs->size(), 0);
        answers.tests = m_pairs->size();
        const MidphaseQueries& queries = m_scene->queries;
        for (std::size_t i = 0; i < m_pairs->size(); ++i)
        {
            const RowPair& pair = (*m_pairs)[i];
            btGjkPairDetector::ClosestPointInput input;
            input.m_transformA.setIdentity();
            input.m_transformB.setIdentity();
            if (m_hull)
            {
                input.m_transformA.setOrigin(toBulletVector(queries.origins[pair.a]));
                for (int row = 0; row < 3; ++row)
                    input.m_transformA.getBasis()[row] =
                        toBulletVector(queries.bases[pair.a].row(row).transpose());
            }
            const btTriangleShape b = triangleOf(m_scene->mesh[pair.b]);
            const btTriangleShape a = m_hull ? b : triangleOf(queries.triangles[pair.a]);
            answers.isCrossing[i] =
                isApart(m_hull ? static_cast<const btConvexShape&>(*m_hull) : a, b, input) ? 0 : 1;
        }
    }

private:
    static bool isApart(const btConvexShape& a, const btConvexShape& b,
                        const btGjkPairDetector::ClosestPointInput& input)
    {
        btVoronoiSimplexSolver simplex;
        btGjkPairDetector detector(&a, &b, &simplex, nullptr);
        btPointCollector out;
        detector.getClosestPoints(input, out, nullptr);
        return out.m_hasResult && out.m_distance > btScalar(0);
    }

    static btTriangleShape triangleOf(const TriangleVertices& corners)
    {
        btTriangleShape triangle(toBulletVector(corners[0]), toBulletVector(corners[1]),
                                 toBulletVector(corners[2]));
        triangle.setMargin(0);
        return triangle;
    }

    std::unique_ptr<btConvexHullShape> m_hull;
};
}  // namespace

std::vector<NamedLeafTest> makeLeafTests(bool hasHulls)
{
    std::vector<NamedLeafTest> tests;
    const auto add = [&](const char* name, std::unique_ptr<LeafTest> test) {
        tests.push_back({name, std::move(test)});
    };
    add("triangles", std::make_unique<TriangleLeaves>(8, Faces::All));
    add("triangles-1", std::make_unique<TriangleLeaves>(1, Faces::All));
    if (hasHulls)
        add("faces", std::make_unique<TriangleLeaves>(8, Faces::NearOnes));
    else
        add("triangle-distance", std::make_unique<DistanceLeaves>());
    add("isa-gjk", std::make_unique<GjkLeaves>(true, Start::Cold));
    add("isa-gjk-warm", std::make_unique<GjkLeaves>(true, Start::Warm));
    add("gjk", std::make_unique<GjkLeaves>(false, Start::Cold));
    add("gjk-warm", std::make_unique<GjkLeaves>(false, Start::Warm));
    add("bullet", std::make_unique<BulletLeaves>());
    return tests;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
