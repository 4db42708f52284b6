// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace cullet
{
enum class TrianglePairState : std::uint8_t
{
    Apart,   ///< farther from each other than the limit
    Near,    ///< up to the limit
    Unknown  ///< they overlap, or are so close that rounding decides
};

/// The closest points of two triangles.
struct TrianglePairTouch
{
    Eigen::Vector3d normal;  ///< unit, from B to A; of triangles that are Apart: of a plane between them
    double distance;
    Eigen::Vector3d onB;
    int cornerA, cornerB;  ///< support corners against the normal and along it
    bool areCorners;       ///< the closest points are corners of both
};

using TriangleCorners = Eigen::Vector3d[3];

/// The distance of two triangles, if it is not 0: the least of those of their edges and of their corners from faces, three
/// at a time in the lanes of vectors (Ericson 2005, "Real-Time Collision Detection", section 5.1). Degenerate triangles
/// are segments or points.
///
/// A touch is returned only if no corner is closer along its normal, so that the distance is that of the triangles up to
/// 1e-10 of their size.
///
/// @param touch [out] valid for Near; the normal also for Apart
TrianglePairState findTouch(const TriangleCorners& a, const TriangleCorners& b, double limit,
                            TrianglePairTouch& touch) noexcept;
}  // namespace cullet
