// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_contact.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

/// Two boxes and their contact in long double, by formulas that have nothing in common with narrow/box.
namespace cullet::test
{
using Wide = long double;
using WideVector = Eigen::Matrix<Wide, 3, 1>;
using WideMatrix = Eigen::Matrix<Wide, 3, 3>;

struct WideBox
{
    WideMatrix axes;  ///< columns
    WideVector centre, half;

    Wide reach(const WideVector& direction) const
    {
        return (axes.transpose() * direction).cwiseAbs().dot(half);
    }
    /// How far a point is outside; negative: inside, by the distance to the nearest face.
    Wide outside(const WideVector& point) const
    {
        return ((axes.transpose() * (point - centre)).cwiseAbs() - half).maxCoeff();
    }
    /// The corners of the face whose normal is closest to a direction, in order; the second best alignment.
    std::vector<WideVector> faceAlong(const WideVector& direction, Wide& best, Wide& second) const
    {
        const WideVector along = axes.transpose() * direction;
        int k;
        best = along.cwiseAbs().maxCoeff(&k);
        const int u = (k + 1) % 3, v = (k + 2) % 3;
        second = std::max(std::abs(along[u]), std::abs(along[v]));
        std::vector<WideVector> corners;
        for (const auto& [su, sv] : {std::array<int, 2>{1, 1}, {-1, 1}, {-1, -1}, {1, -1}})
            corners.push_back(centre + axes.col(k) * std::copysign(half[k], along[k]) +
                              axes.col(u) * su * half[u] + axes.col(v) * sv * half[v]);
        return corners;
    }
};

/// What 15 axes say about two boxes.
struct WideAxes
{
    Wide separation = -std::numeric_limits<Wide>::infinity();  ///< the largest surplus of all axes
    Wide certain =
        -std::numeric_limits<Wide>::infinity();  ///< the same, less what rounding may take from each

    void add(const WideBox& a, const WideBox& b, const WideVector& axis, Wide noise)
    {
        const Wide length = axis.norm();
        if (length < 1e-12L)
            return;
        const WideVector n = axis / length;
        const Wide surplus = std::abs(n.dot(b.centre - a.centre)) - a.reach(n) - b.reach(n);
        separation = std::max(separation, surplus);
        certain = std::max(certain, surplus - noise / length);
    }
};

/// @param noise rounding error of an axis of length 1
inline WideAxes axesOf(const WideBox& a, const WideBox& b, Wide noise)
{
    WideAxes axes;
    for (int i = 0; i < 3; ++i)
    {
        axes.add(a, b, a.axes.col(i), noise);
        axes.add(a, b, b.axes.col(i), noise);
        for (int j = 0; j < 3; ++j)
            axes.add(a, b, a.axes.col(i).cross(b.axes.col(j)), noise);
    }
    return axes;
}

/// A corner in which the faces overlap along the normal.
struct WideCorner
{
    WideVector onB;
    Wide distance;
};

/// The part of a polygon on one side of a plane.
inline std::vector<WideVector> clipWide(const std::vector<WideVector>& in, const WideVector& normal,
                                        Wide offset)
{
    std::vector<WideVector> out;
    for (std::size_t i = 0; i < in.size(); ++i)
    {
        const WideVector &p = in[i], &q = in[(i + 1) % in.size()];
        const Wide hp = normal.dot(p) - offset, hq = normal.dot(q) - offset;
        if (hp >= 0)
            out.push_back(p);
        if ((hp >= 0) != (hq >= 0))
            out.push_back(p + (q - p) * (hp / (hp - hq)));
    }
    return out;
}

/// The corners of the region in which the two faces along a normal overlap, and where the boxes overlap: B's face is
/// clipped by the four planes through the edges of A's face along the normal.
///
/// @param normal from B to A
/// @param isClear [out] no other face is nearly as well aligned
inline std::vector<WideCorner> cornersOf(const WideBox& a, const WideBox& b, const WideVector& normal,
                                         bool& isClear)
{
    Wide bestA, secondA, bestB, secondB;
    const std::vector<WideVector> faceA = a.faceAlong(-normal, bestA, secondA);
    std::vector<WideVector> polygon = b.faceAlong(normal, bestB, secondB);
    isClear = bestA - secondA > 1e-3L && bestB - secondB > 1e-3L;
    const WideVector middle = (faceA[0] + faceA[2]) / 2;
    for (std::size_t i = 0; i < 4; ++i)
    {
        WideVector side = (faceA[(i + 1) % 4] - faceA[i]).cross(normal);
        if (side.dot(middle - faceA[i]) < 0)
            side = -side;
        polygon = clipWide(polygon, side, side.dot(faceA[i]));
    }
    const WideVector planeA = (faceA[1] - faceA[0]).cross(faceA[3] - faceA[0]).normalized();
    std::vector<WideCorner> corners;
    for (const WideVector& p : polygon)
    {
        const Wide distance = planeA.dot(middle - p) / planeA.dot(normal);
        if (distance <= 0)
            corners.push_back({p, distance});
    }
    return corners;
}

/// Area of a polygon with its corners in order, seen along a normal.
inline Wide areaOf(const std::vector<WideVector>& corners, const WideVector& normal)
{
    Wide area = 0;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        area += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]).dot(normal) / 2;
    return std::abs(area);
}
}  // namespace cullet::test
