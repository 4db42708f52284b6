// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/math/exact_orientation.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

/// Point sets with partly flat or otherwise difficult hulls, in addition to those of hull_points.h.
namespace cullet::test
{
/// The thesis's Figure 9: a face with vertices level with each other, so that a climb along the face's normal that
/// accepts level neighbours can walk between C and D for ever; a face inside which a vertex has only level neighbours.
inline Points figure9Points()
{
    Points points = prismPoints(6, 0.25);
    for (const double z : {-0.25, 0.25})
    {
        points.push_back({0.0, 0.0, z});
        points.push_back({0.25, 0.125, z});
        points.push_back({-0.25, 0.125, z});
        points.push_back({0.0, -0.5, z});
    }
    points.push_back({0.0, 0.0, 1.0});
    points.push_back({0.0, 0.0, -1.0});
    for (std::size_t i = 0; i + 2 < points.size(); ++i)
    {
        if (points[i].z() > 0.0 && i % 5 == 0)
            points.push_back(points[i]);
    }
    return points;
}

/// Four points that span space, the first of them in the order given.
inline std::array<std::int32_t, 4> seedOf(const Points& points)
{
    std::array<std::int32_t, 4> seed = {0, 1, 2, 3};
    const auto next = [&](int from, const auto& spans)
    {
        while (!spans(points[from]))
            ++from;
        return from;
    };
    seed[2] = next(2, [&](const Eigen::Vector3d& p) { return !isCollinear(points[0], points[1], p); });
    seed[3] = next(seed[2] + 1, [&](const Eigen::Vector3d& p)
                   { return orientation(points[0], points[1], points[seed[2]], p) != 0; });
    return seed;
}

/// Three draws, from the last coordinate to the first: in the order in which GCC evaluates arguments, which
/// recorded counts rely on.
template <class Distribution>
Eigen::Vector3d drawVector(Distribution& distribution, std::mt19937& engine)
{
    const double z = distribution(engine), y = distribution(engine), x = distribution(engine);
    return {x, y, z};
}

inline Points withDuplicatesAndInterior(Points points, unsigned seed)
{
    std::mt19937 engine(seed);
    const std::size_t count = points.size();
    std::uniform_real_distribution<double> shrink(0.0, 1.0);
    for (std::size_t i = 0; i < count; ++i)
    {
        points.push_back(points[i]);
        points.push_back(points[i] * shrink(engine));
    }
    std::shuffle(points.begin(), points.end(), engine);
    return points;
}

inline Points moved(Points points, const Eigen::Matrix3d& basis, const Eigen::Vector3d& shift)
{
    for (Eigen::Vector3d& p : points)
        p = basis * p + shift;
    return points;
}

inline Points scaled(const Points& points, double size)
{
    return moved(points, size * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
}

/// Shapes for the tests of queries.
inline std::vector<NamedPoints> queryShapes()
{
    std::vector<NamedPoints> shapes = hullShapes();
    shapes.push_back({"figure9", figure9Points()});
    return shapes;
}

/// Shapes for the tests of hulls and support searches: queryShapes() and more difficult ones.
inline std::vector<NamedPoints> nastyShapes()
{
    std::vector<NamedPoints> shapes = queryShapes();
    std::mt19937 engine(9);
    shapes.push_back({"gridbox98 turned", moved(gridBoxPoints(5), randomRotation(engine), {0.0, 0.0, 0.0})});
    shapes.push_back({"gridbox far", moved(gridBoxPoints(4), randomRotation(engine), {100.0, -50.0, 20.0})});
    shapes.push_back({"prism 1000", prismPoints(1000, 0.5)});
    shapes.push_back(
        {"prism 1000 turned", moved(prismPoints(1000, 0.01), randomRotation(engine), {0.0, 0.0, 0.0})});
    shapes.push_back(
        {"plate turned", moved(boxPoints(1.0, 1.0, 0.001), randomRotation(engine), {0.0, 0.0, 0.0}), true});
    shapes.push_back({"needle turned",
                      moved(boxPoints(1.0, 0.001, 0.001), randomRotation(engine), {0.0, 0.0, 0.0}), true});
    shapes.push_back({"ico642", icoPoints(3)});
    shapes.push_back(
        {"ell50 twice", withDuplicatesAndInterior(ellipsoidPoints(50, {1.0, 0.7, 0.5}, 51), 52)});
    shapes.push_back({"gridbox98 twice", withDuplicatesAndInterior(gridBoxPoints(5), 53)});
    shapes.push_back({"paper",
                      moved(gridBoxPoints(4), Eigen::Vector3d(1.0, 1.0, 1e-6).asDiagonal(), {0.0, 0.0, 0.0}),
                      true});
    return shapes;
}
}  // namespace cullet::test
