// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/hull_builder.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

/// Point sets for hulls: regular ones and thin ones. Sizes are about 1.
namespace cullet
{
// Instantiated in hull_points.cpp, since hull building dominates the compile time of a small test.
extern template Hull<float> makeHull(const std::vector<Eigen::Vector3f>&, HullExtra);
extern template Hull<double> makeHull(const std::vector<Eigen::Vector3d>&, HullExtra);
extern template Hull<float> makeHull(const Eigen::Vector3f*, std::int32_t, HullExtra);
extern template Hull<double> makeHull(const Eigen::Vector3d*, std::int32_t, HullExtra);
extern template Hull<float> makeCornerHull(const std::vector<Eigen::Vector3f>&);
extern template Hull<double> makeCornerHull(const std::vector<Eigen::Vector3d>&);

using Points = std::vector<Eigen::Vector3d>;

template <class S>
std::vector<Eigen::Matrix<S, 3, 1>> castPoints(const Points& points)
{
    std::vector<Eigen::Matrix<S, 3, 1>> out;
    for (const Eigen::Vector3d& p : points)
        out.push_back(p.cast<S>());
    return out;
}

template <class S>
Hull<S> hullOf(const Points& points, HullExtra extra = HullExtra::None)
{
    return makeHull(castPoints<S>(points), extra);
}

inline Eigen::Vector3d randomDirection(std::mt19937& engine)
{
    std::normal_distribution<double> normal;
    Eigen::Vector3d d;
    do
        d = {normal(engine), normal(engine), normal(engine)};
    while (d.norm() < 1e-3);
    return d.normalized();
}

inline Points boxPoints(double x, double y, double z)
{
    Points points;
    for (int i = 0; i < 8; ++i)
        points.push_back({i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
    return points;
}

/// A cube's surface as a grid of n x n points on each side: 6 n^2 - 12 n + 8 points, most inside a face.
inline Points gridBoxPoints(int n)
{
    Points points;
    const auto place = [n](int i) { return 1.0 * (2 * i - (n - 1)) / (n - 1) * 0.5773; };
    for (int i = 0; i < n; ++i)
    {
        for (int j = 0; j < n; ++j)
        {
            for (int k = 0; k < n; ++k)
            {
                const bool isSurface = i % (n - 1) == 0 || j % (n - 1) == 0 || k % (n - 1) == 0;
                if (isSurface)
                    points.push_back({place(i), place(j), place(k)});
            }
        }
    }
    return points;
}

/// Icosahedron after `subdivisions` subdivisions on the unit sphere: 12, 42, 162, 642, 2562 points.
inline Points icoPoints(int subdivisions)
{
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    Points points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    std::vector<std::array<int, 3>> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                             {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                             {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                             {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (Eigen::Vector3d& p : points)
        p.normalize();
    for (int level = 0; level < subdivisions; ++level)
    {
        std::map<std::pair<int, int>, int> middles;
        const auto middle = [&](int i, int j)
        {
            const auto [place, isNew] =
                middles.try_emplace(std::minmax(i, j), static_cast<int>(points.size()));
            if (isNew)
                points.push_back((points[i] + points[j]).normalized());
            return place->second;
        };
        std::vector<std::array<int, 3>> finer;
        for (const auto& [a, b, c] : faces)
        {
            const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        faces = std::move(finer);
    }
    return points;
}

inline Points ellipsoidPoints(int count, Eigen::Vector3d axes, unsigned seed)
{
    std::mt19937 engine(seed);
    Points points;
    for (int i = 0; i < count; ++i)
        points.push_back(randomDirection(engine).cwiseProduct(axes));
    return points;
}

inline Points prismPoints(int sides, double halfHeight)
{
    Points points;
    for (int i = 0; i < sides; ++i)
    {
        const double angle = 2.0 * 3.14159265358979323846 * i / sides;
        for (const double z : {-halfHeight, halfHeight})
            points.push_back({std::cos(angle), std::sin(angle), z});
    }
    return points;
}

inline Eigen::Matrix3d randomRotation(std::mt19937& engine)
{
    std::normal_distribution<double> normal;
    // In the order in which GCC evaluates arguments, which recorded counts rely on.
    const double z = normal(engine), y = normal(engine), x = normal(engine), w = normal(engine);
    return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

struct NamedPoints
{
    std::string name;
    Points points;
    bool isThin = false;
};

/// Shapes on which queries are tested and measured. `isThin`: one side is a thousand times shorter than the others.
inline std::vector<NamedPoints> hullShapes()
{
    return {{"ico12", icoPoints(0)},
            {"ico42", icoPoints(1)},
            {"ico162", icoPoints(2)},
            {"box8", boxPoints(0.7, 0.5, 0.6)},
            {"gridbox98", gridBoxPoints(5)},
            {"ell50", ellipsoidPoints(50, {1.0, 0.7, 0.5}, 50)},
            {"ell200", ellipsoidPoints(200, {1.0, 0.7, 0.5}, 200)},
            {"prism32", prismPoints(32, 0.5)},
            {"needle", boxPoints(1.0, 0.001, 0.001), true},
            {"plate", boxPoints(1.0, 1.0, 0.001), true}};
}
}  // namespace cullet
