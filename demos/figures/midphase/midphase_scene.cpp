// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/midphase/midphase_scene.h"

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Eigen::Vector3f;

std::vector<std::array<int, 3>> trianglesOf(const Hull<btScalar>& hull)
{
    std::vector<std::array<int, 3>> triangles;
    for (std::int32_t face = 0; face < static_cast<std::int32_t>(hull.faces().size()); ++face)
    {
        const auto corners = hull.faceVertices(face);
        for (std::int32_t i = 2; i < corners.size(); ++i)
            triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
    return triangles;
}

/// Hulls of 42 points with a radius.
class HullScene : public MidphaseScene
{
public:
    explicit HullScene(float radius)
    {
        Points points = icoPoints(1);
        for (Eigen::Vector3d& point : points)
            point *= double(radius);
        m_hull = std::make_unique<Hull<btScalar>>(hullOf<btScalar>(points));
        queries.hull = m_hull.get();
        for (std::int32_t i = 0; i < m_hull->vertexCount(); ++i)
            queries.hullPoints.push_back(m_hull->vertex(i).cast<float>());
        queries.hullFaces = trianglesOf(*m_hull);
    }

protected:
    void add(const Vector3f& origin)
    {
        queries.origins.push_back(origin);
        queries.bases.push_back(Eigen::Matrix3f::Identity());
    }

private:
    std::unique_ptr<Hull<btScalar>> m_hull;
};

class HillScene final : public HullScene
{
public:
    HillScene(bool isSmall, std::uint64_t seed) : HullScene(0.5f), m_reach(isSmall ? 4 : 8)
    {
        name = "hills";
        const int cells = 8 * m_reach;
        const auto corner = [&](int x, int z)
        {
            const float px = 0.25f * static_cast<float>(x - cells / 2);
            const float pz = 0.25f * static_cast<float>(z - cells / 2);
            return Vector3f(px, heightAt(px, pz), pz);
        };
        for (int x = 0; x < cells; ++x)
        {
            for (int z = 0; z < cells; ++z)
            {
                mesh.push_back({corner(x, z), corner(x, z + 1), corner(x + 1, z)});
                mesh.push_back({corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1)});
            }
        }
        SplitMix64 random(seed);
        for (int i = 0; i < 3 * m_reach; ++i)
        {
            const float x = random.uniform(-0.8f, 0.8f), z = random.uniform(-0.8f, 0.8f);
            add(static_cast<float>(m_reach) * Vector3f(x, 0.0f, z));
            m_depths.push_back(random.uniform(-0.1f, 0.05f));
        }
    }

    /// Each hull rolls in a circle, a little in the ground or above it.
    void advance() override
    {
        ++m_frame;
        const float angle = 0.02f * static_cast<float>(m_frame);
        for (std::size_t i = 0; i < queries.bases.size(); ++i)
        {
            queries.bases[i] = Eigen::AngleAxisf(angle, Vector3f::UnitX()).toRotationMatrix();
            Vector3f& origin = queries.origins[i];
            origin += 0.02f * Vector3f(std::cos(angle), 0.0f, std::sin(angle));
            origin[1] = heightAt(origin[0], origin[2]) + 0.5f + m_depths[i];
        }
    }

private:
    static float heightAt(float x, float z) { return 0.3f * std::sin(1.3f * x) * std::cos(1.1f * z); }

    int m_reach, m_frame = 0;
    std::vector<float> m_depths;
};

class BumpScene final : public MidphaseScene
{
public:
    BumpScene(bool isSmall, std::uint64_t seed)
    {
        name = "bumps";
        const Hull<btScalar> ball = hullOf<btScalar>(icoPoints(isSmall ? 2 : 3));
        SplitMix64 random(seed);
        std::vector<Vector3f> points;
        for (std::int32_t i = 0; i < ball.vertexCount(); ++i)
            points.push_back(ball.vertex(i).cast<float>() * random.uniform(0.95f, 1.05f));
        for (const std::array<int, 3>& face : trianglesOf(ball))
        {
            const auto at = [&](int i)
            { return points[static_cast<std::size_t>(face[static_cast<std::size_t>(i)])]; };
            m_ball.push_back({at(0), at(1), at(2)});
        }
        mesh = m_ball;
        queries.triangles = m_ball;
    }

    void advance() override
    {
        ++m_frame;
        const float turn = 0.02f * static_cast<float>(m_frame);
        const Eigen::Matrix3f basis =
            Eigen::AngleAxisf(turn, Vector3f(1, 2, 3).normalized()).toRotationMatrix();
        const Vector3f origin(1.2f - 0.01f * static_cast<float>(m_frame), 0.2f, 0.1f);
        for (std::size_t i = 0; i < m_ball.size(); ++i)
        {
            for (std::size_t corner = 0; corner < 3; ++corner)
                queries.triangles[i][corner] = basis * m_ball[i][corner] + origin;
        }
    }

private:
    std::vector<TriangleVertices> m_ball;
    int m_frame = 0;
};

class ClothScene final : public HullScene
{
public:
    explicit ClothScene(bool isSmall) : HullScene(kRadius), m_side(isSmall ? 25 : 61)
    {
        name = "cloth";
        const int hulls = (m_side - 1) / 12;
        for (int i = 0; i < hulls * hulls; ++i)
            add(Vector3f(static_cast<float>(i % hulls), 0.0f, static_cast<float>(i / hulls)));
        const float spacing = 1.1f * static_cast<float>(hulls) / static_cast<float>(m_side - 1);
        for (int i = 0; i < m_side * m_side; ++i)
            m_points.push_back(Vector3f(spacing * static_cast<float>(i % m_side) - 0.6f, kRadius + 0.05f,
                                        spacing * static_cast<float>(i / m_side) - 0.6f));
        m_before = m_points;
        for (int x = 0; x + 1 < m_side; ++x)
        {
            for (int z = 0; z + 1 < m_side; ++z)
            {
                const int corner = x + m_side * z;
                m_faces.push_back({corner, corner + m_side, corner + 1});
                m_faces.push_back({corner + 1, corner + m_side, corner + m_side + 1});
            }
        }
        addSprings(spacing);
        mesh.resize(m_faces.size());
        copyToMesh();
    }

    void advance() override
    {
        constexpr float kStep = 1.0f / 60.0f;
        for (std::size_t i = 0; i < m_points.size(); ++i)
        {
            const Vector3f next = m_points[i] + 0.99f * (m_points[i] - m_before[i]) -
                                  Vector3f(0.0f, 9.8f * kStep * kStep, 0.0f);
            m_before[i] = m_points[i];
            m_points[i] = next;
        }
        for (int iteration = 0; iteration < 12; ++iteration)
        {
            for (const Spring& spring : m_springs)
                relax(spring);
            for (Vector3f& point : m_points)
                pushOut(point);
        }
        copyToMesh();
    }

private:
    static constexpr float kRadius = 0.45f;

    struct Spring
    {
        std::size_t a, b;
        float length;
    };

    void addSprings(float spacing)
    {
        const auto add = [&](int a, int b, float length) {
            m_springs.push_back({static_cast<std::size_t>(a), static_cast<std::size_t>(b), length});
        };
        for (int x = 0; x < m_side; ++x)
        {
            for (int z = 0; z < m_side; ++z)
            {
                const int corner = x + m_side * z;
                if (x + 1 < m_side)
                    add(corner, corner + 1, spacing);
                if (z + 1 < m_side)
                    add(corner, corner + m_side, spacing);
                if (x + 1 < m_side && z + 1 < m_side)
                    add(corner, corner + m_side + 1, spacing * std::sqrt(2.0f));
            }
        }
    }

    void relax(const Spring& spring)
    {
        const Vector3f way = m_points[spring.b] - m_points[spring.a];
        const float length = way.norm();
        if (!(length > 0.0f))
            return;
        const Vector3f half = way * (0.5f * (1.0f - spring.length / length));
        m_points[spring.a] += half;
        m_points[spring.b] -= half;
    }

    /// A little into the hulls, so that some triangles cross them.
    void pushOut(Vector3f& point) const
    {
        constexpr float kReach = 0.96f * kRadius;
        for (const Vector3f& origin : queries.origins)
        {
            const Vector3f way = point - origin;
            const float distance = way.norm();
            if (distance < kReach && distance > 0.0f)
                point = origin + way * (kReach / distance);
        }
    }

    void copyToMesh()
    {
        for (std::size_t i = 0; i < m_faces.size(); ++i)
        {
            for (std::size_t corner = 0; corner < 3; ++corner)
                mesh[i][corner] = m_points[static_cast<std::size_t>(m_faces[i][corner])];
        }
    }

    int m_side;
    std::vector<Vector3f> m_points, m_before;
    std::vector<std::array<int, 3>> m_faces;
    std::vector<Spring> m_springs;
};

MeshBox boxOfVertices(const TriangleVertices& triangle)
{
    return boxOfTriangle(triangle.data(), 0.0);
}
}  // namespace

TriangleVertices MidphaseQueries::faceOf(std::size_t query, std::size_t face) const
{
    TriangleVertices corners;
    for (std::size_t corner = 0; corner < 3; ++corner)
        corners[corner] =
            bases[query] * hullPoints[static_cast<std::size_t>(hullFaces[face][corner])] + origins[query];
    return corners;
}

MeshBox MidphaseQueries::boxOf(std::size_t query) const
{
    if (hull == nullptr)
        return boxOfVertices(triangles[query]);
    Vector3f low = Vector3f::Constant(1e30f), high = -low;
    for (const Vector3f& point : hullPoints)
    {
        const Vector3f moved = bases[query] * point + origins[query];
        low = low.cwiseMin(moved);
        high = high.cwiseMax(moved);
    }
    return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

std::vector<MeshBox> MidphaseScene::meshBoxes() const
{
    std::vector<MeshBox> boxes;
    boxes.reserve(mesh.size());
    for (const TriangleVertices& triangle : mesh)
        boxes.push_back(boxOfVertices(triangle));
    return boxes;
}

std::vector<std::unique_ptr<MidphaseScene>> makeMidphaseScenes(bool isSmall, std::uint64_t seed)
{
    std::vector<std::unique_ptr<MidphaseScene>> scenes;
    scenes.push_back(std::make_unique<HillScene>(isSmall, seed));
    scenes.push_back(std::make_unique<BumpScene>(isSmall, seed));
    scenes.push_back(std::make_unique<ClothScene>(isSmall));
    return scenes;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
