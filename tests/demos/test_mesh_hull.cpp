// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/mesh_file.h"
#include "cullet/demos/scenes/hulls/mesh_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <sys/stat.h>
#include <unistd.h>

namespace cullet
{
namespace
{
/// A file that is deleted after the test.
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
    // The reduction loses at most 3 % of the longest edge.
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

/// A tetrahedron with edges of `size` along the axes around `centre`.
std::vector<Point> tetrahedron(float size, float centre)
{
    const float low = centre - size / 2, high = centre + size / 2;
    return {{low, low, low}, {high, low, low}, {low, high, low}, {low, low, high}};
}

TEST(MeshHull, IsTheSameForEverySizeThatFloatsHold)
{
    const HullPoints unit = reduceToHull("unit", tetrahedron(1.0f, 0.0f));
    // Largest, difference of two corners above the largest float, smallest normal ones, and below these.
    for (const float size : {3e38f, 6e37f, 1e30f, 1e-37f, 1e-41f})
    {
        SCOPED_TRACE(size);
        const HullPoints hull = reduceToHull("scaled", tetrahedron(size, 0.0f));
        ASSERT_EQ(hull.points.size(), unit.points.size());
        for (std::size_t i = 0; i < hull.points.size(); ++i)
        {
            for (std::size_t axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(hull.points[i][axis], unit.points[i][axis], 1e-3);
        }
    }
    std::vector<Point> far = tetrahedron(1.0f, 0.0f);
    for (Point& point : far)
    {
        for (float& coordinate : point)
            coordinate = 2 * (coordinate * 3.4e38f);
    }
    ASSERT_TRUE(std::isfinite(far[1][0])) << "half of it is a float, the difference of two is none";
    EXPECT_EQ(reduceToHull("far", far).points, unit.points);
}

TEST(MeshHull, ReadsCoordinatesNearTheLargestFloat)
{
    const MeshFile file("cullet_large.obj",
                        "v -3e38 -3e38 -3e38\nv 3e38 -3e38 -3e38\nv -3e38 3e38 -3e38\nv -3e38 -3e38 3e38\n"
                        "f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n");
    const HullPoints hull = loadMeshHull(file.path());
    ASSERT_EQ(hull.points.size(), 4u);
    for (const Point& point : hull.points)
        EXPECT_GT(std::fabs(point[0]) + std::fabs(point[1]) + std::fabs(point[2]), 0.1f);
}

TEST(MeshHull, RefusesCoordinatesThatNoFloatHolds)
{
    const MeshFile infinite("cullet_infinite.obj",
                            "v 0 0 0\nv 4e39 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n");
    EXPECT_EQ(failureOf(infinite.path()), "mesh '" + infinite.path() + "': has a vertex that is not finite");
    const MeshFile one("cullet_one.obj", "v 1 2 3\nf 1 1 1\n");
    EXPECT_NE(failureOf(one.path()).find("cullet_one.obj"), std::string::npos) << failureOf(one.path());
}

/// The header of an ASCII file that declares more vertices than it has.
std::string plyOf(const std::string& count)
{
    return "ply\nformat ascii 1.0\nelement vertex " + count +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
}

TEST(MeshFile, GivesUpOnCountsThatTheFileDoesNotHold)
{
    for (const char* count : {"1000000", "400000000", "4000000000", "18446744073709551615", "-1"})
    {
        const MeshFile file("cullet_counts.ply", plyOf(count));
        std::string message = "no failure";
        try
        {
            readMeshVertices(file.path(), {0.3, std::uint64_t{1} << 28});
        }
        catch (const MeshError& error)
        {
            message = error.what();
        }
        EXPECT_EQ(message.rfind("mesh '" + file.path() + "': cannot be read: ", 0), 0u)
            << count << ": " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << "one line: " << message;
    }
}

TEST(MeshFile, GivesUpAtTheTimeLimit)
{
    const std::string path = testing::TempDir() + "cullet_" + std::to_string(getpid()) + ".ply";
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    std::string message = "no failure";
    try
    {
        // No process writes into the pipe.
        readMeshVertices(path, {0.05, std::uint64_t{1} << 28});
    }
    catch (const MeshError& error)
    {
        message = error.what();
    }
    std::remove(path.c_str());
    EXPECT_EQ(message,
              "mesh '" + path + "': cannot be read: takes longer than 0.05 s, as a broken file does");
}

TEST(MeshFile, HasMoreTimeAndMemoryForLargeFiles)
{
    EXPECT_EQ(limitsForMesh(0).seconds, 10.0);
    EXPECT_GT(limitsForMesh(100000000).seconds, 100.0);
    EXPECT_GT(limitsForMesh(100000000).bytes, limitsForMesh(0).bytes);
    EXPECT_GT(limitsForMesh(~std::uint64_t{0}).bytes, limitsForMesh(100000000).bytes) << "no overflow";
}

TEST(MeshFile, NamesFoldersAndTruncatedBinaries)
{
    EXPECT_EQ(failureOf(testing::TempDir()), "mesh '" + testing::TempDir() + "': is a folder");
    // An STL file that declares 16 million triangles and has half of one.
    std::string stl(80, ' ');
    stl += std::string("\xff\xff\xff\x00", 4) + std::string(25, '\x01');
    const MeshFile truncated("cullet_truncated.stl", stl);
    EXPECT_EQ(failureOf(truncated.path()).rfind("mesh '" + truncated.path() + "': cannot be read: ", 0), 0u)
        << failureOf(truncated.path());
    std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 100\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n";
    const MeshFile cut("cullet_cut.ply", ply + std::string(40, '\x01'));
    EXPECT_NE(failureOf(cut.path()).find("cullet_cut.ply"), std::string::npos) << failureOf(cut.path());
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
