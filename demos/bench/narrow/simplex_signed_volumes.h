// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/simplex.h"

#include <array>
#include <cmath>
#include <limits>

/// Signed volumes, the second comparator: Montanari, Petrinic and Barbieri 2017, "Improving the GJK Algorithm for
/// Faster and More Reliable Distance Queries Between Convex Objects", section 4: project on the coordinate axis or
/// plane where the simplex is largest, and compare signs of lengths, areas and volumes there.
namespace cullet
{
inline ClosestOnSimplex onSubset(const Eigen::Vector3d& point, unsigned subset)
{
    return {point, point.squaredNorm(), subset, false};
}

inline ClosestOnSimplex signedVolumesSegment(const SimplexPoints& p, int i, int j)
{
    const Eigen::Vector3d edge = p[j] - p[i];
    const Eigen::Vector3d foot = p[i] - edge * (p[i].dot(edge) / edge.squaredNorm());
    int axis = 0;
    edge.cwiseAbs().maxCoeff(&axis);
    const double total = p[i][axis] - p[j][axis];
    const double weightI = (foot[axis] - p[j][axis]) / total;
    if (!(weightI > 0.0))
        return onSubset(p[j], 1u << j);
    if (!(weightI < 1.0))
        return onSubset(p[i], 1u << i);
    return onSubset(foot, (1u << i) | (1u << j));
}

inline ClosestOnSimplex signedVolumesTriangle(const SimplexPoints& p, int i, int j, int k)
{
    const Eigen::Vector3d normal = (p[j] - p[i]).cross(p[k] - p[i]);
    const Eigen::Vector3d foot = normal * (p[i].dot(normal) / normal.squaredNorm());
    int drop = 0;
    normal.cwiseAbs().maxCoeff(&drop);
    const int x = (drop + 1) % 3;
    const int y = (drop + 2) % 3;
    const auto area = [x, y](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
    { return (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]); };
    const double total = area(p[i], p[j], p[k]);
    const std::array<double, 3> weight = {area(foot, p[j], p[k]) / total, area(p[i], foot, p[k]) / total,
                                          area(p[i], p[j], foot) / total};
    if (weight[0] > 0.0 && weight[1] > 0.0 && weight[2] > 0.0)
        return onSubset(foot, (1u << i) | (1u << j) | (1u << k));
    ClosestOnSimplex best = nothingOnSimplex(p, 1);
    const std::array<std::array<int, 2>, 3> sides = {{{j, k}, {k, i}, {i, j}}};
    for (int side = 0; side < 3; ++side)
    {
        if (weight[side] > 0.0)
            continue;
        const ClosestOnSimplex candidate = signedVolumesSegment(p, sides[side][0], sides[side][1]);
        if (candidate.length2 < best.length2)
            best = candidate;
    }
    return best;
}

inline ClosestOnSimplex signedVolumesTetrahedron(const SimplexPoints& p)
{
    const auto volume = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                           const Eigen::Vector3d& d) { return (a - d).dot((b - d).cross(c - d)); };
    const Eigen::Vector3d o = Eigen::Vector3d::Zero();
    const double total = volume(p[0], p[1], p[2], p[3]);
    const std::array<double, 4> weight = {
        volume(o, p[1], p[2], p[3]) / total, volume(p[0], o, p[2], p[3]) / total,
        volume(p[0], p[1], o, p[3]) / total, volume(p[0], p[1], p[2], o) / total};
    ClosestOnSimplex best = nothingOnSimplex(p, 4);
    best.isInside = true;
    for (int face = 0; face < 4; ++face)
    {
        if (weight[face] > 0.0)
            continue;
        const auto [i, j, k] = kTetrahedronFaces[face];
        const ClosestOnSimplex candidate = signedVolumesTriangle(p, i, j, k);
        if (candidate.length2 < best.length2)
            best = candidate;
    }
    return best;
}

/// @pre the simplex is not degenerate
inline ClosestOnSimplex closestBySignedVolumes(const SimplexPoints& p, int count)
{
    switch (count)
    {
        case 1:
            return onSubset(p[0], 1u);
        case 2:
            return signedVolumesSegment(p, 0, 1);
        case 3:
            return signedVolumesTriangle(p, 0, 1, 2);
        default:
            return signedVolumesTetrahedron(p);
    }
}
}  // namespace cullet
