// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/mesh_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>

namespace cullet
{
namespace
{
/// A file that is gone after the test.
class MeshFile
{
public:
    MeshFile(const std::string& name, const std::string& text) : m_path(testing::TempDir() + name)
    {
        std::ofstream(m_path) << text;
    }
    ~MeshFile() { std::remove(m_path.c_str()); }
    const std::string& path() const { return m_path; }

private:
    std::string m_path;
};

std::string failureOf(const std::string& path)
{
    try
    {
        loadMeshHull(path);
    }
    catch (const MeshError& error)
    {
        return error.what();
    }
    return "no failure";
}

/// Vertices on an ellipsoid with half axes 3, 2, 1 around (10, 20, 30).
std::vector<Point> ellipsoid(std::size_t count)
{
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    std::vector<Point> points;
    while (points.size() < count)
    {
        const float p[3] = {normal(random), normal(random), normal(random)};
        const float length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        points.push_back({10 + 3 * p[0] / length, 20 + 2 * p[1] / length, 30 + p[2] / length});
    }
    return points;
}

TEST(MeshHull, IsSmallCentredAndOfOneMetre)
{
    const HullPoints hull = reduceToHull("ellipsoid", ellipsoid(5000));
    EXPECT_EQ(hull.meshVertices, 5000u);
    EXPECT_GE(hull.points.size(), 40u);
    EXPECT_LE(hull.points.size(), kMaxHullPoints);
    double extent[3] = {};
    for (int axis = 0; axis < 3; ++axis)
    {
        double low = 1e9;
        double high = -1e9;
        double sum = 0.0;
        for (const Point& point : hull.points)
        {
            low = std::min<double>(low, point[axis]);
            high = std::max<double>(high, point[axis]);
            sum += point[axis];
        }
        extent[axis] = high - low;
        EXPECT_NEAR(sum / static_cast<double>(hull.points.size()), 0.0, 1e-6);
    }
    EXPECT_NEAR(extent[0], 1.0, 1e-6);
    // Loses at most 3 % of the longest edge to the reduction.
    EXPECT_NEAR(extent[1], 2.0 / 3.0, 0.03);
    EXPECT_NEAR(extent[2], 1.0 / 3.0, 0.03);
}

TEST(MeshHull, ReadsAnObjFile)
{
    const MeshFile file("cullet_tetrahedron.obj",
                        "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n");
    const HullPoints hull = loadMeshHull(file.path());
    EXPECT_EQ(hull.name, "cullet_tetrahedron.obj");
    EXPECT_EQ(hull.points.size(), 4u);
}

TEST(MeshHull, NamesTheMissingFile)
{
    EXPECT_EQ(failureOf("/nowhere/rabbit.obj"), "mesh '/nowhere/rabbit.obj': no such file");
}

TEST(MeshHull, SaysWhyAFileIsUseless)
{
    const MeshFile empty("cullet_empty.obj", "");
    const MeshFile noise("cullet_noise.3ds",
                         "this is not a mesh, only text that is long enough to be read as one");
    const MeshFile flat("cullet_flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n");
    EXPECT_NE(failureOf(empty.path()).find("cullet_empty.obj': cannot be read"), std::string::npos);
    EXPECT_NE(failureOf(noise.path()).find("cullet_noise.3ds': cannot be read"), std::string::npos);
    EXPECT_NE(failureOf(flat.path()).find("is flat"), std::string::npos);
    for (const MeshFile* file : {&empty, &noise, &flat})
        EXPECT_EQ(failureOf(file->path()).find('\n'), std::string::npos) << "one line";
}

TEST(MeshHull, RefusesVerticesThatAreNotFinite)
{
    std::vector<Point> vertices = ellipsoid(10);
    vertices[5][1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW(reduceToHull("nan", vertices), MeshError);
    EXPECT_THROW(reduceToHull("none", {}), MeshError);
}

TEST(MeshHull, RefusesALineOfPoints)
{
    std::vector<Point> line;
    for (int i = 0; i < 20; ++i)
        line.push_back({static_cast<float>(i), 0.5f * static_cast<float>(i), 1.0f});
    EXPECT_THROW(reduceToHull("line", line), MeshError);
}
}  // namespace
}  // namespace cullet
