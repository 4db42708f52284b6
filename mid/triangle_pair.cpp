// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/triangle_pair.h"

#include "cullet/mid/lane_vectors.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
using Eigen::Vector3d;
using Four = LaneNumbers;
using Vectors = LaneVectors;

/// Times the size: an error of the distance, which a touch may have.
constexpr double kAccuracy = 1e-10;
/// Times the size: closer triangles may overlap in another search.
constexpr double kTooClose = 4e-7;
/// A distance that is less by this part only is the same.
constexpr double kCloser = 1e-9;

/// The first lane once more in the fourth.
[[gnu::always_inline]] inline Vectors lanesOf(const TriangleCorners& corners)
{
    const auto row = [&](int i) { return Four(corners[0][i], corners[1][i], corners[2][i], corners[0][i]); };
    return {row(0), row(1), row(2)};
}

[[gnu::always_inline]] inline Vectors nextLanes(const Vectors& v)
{
    return {v.x.lanes<1, 2, 0, 1>(), v.y.lanes<1, 2, 0, 1>(), v.z.lanes<1, 2, 0, 1>()};
}

/// The index of the least of the first three lanes.
[[gnu::always_inline]] inline int leastLane(const Four& v)
{
    const int first = v[1] < v[0] ? 1 : 0;
    return v[2] < v[first] ? 2 : first;
}

struct Side
{
    explicit Side(const TriangleCorners& triangle)
        : points(triangle),
          edges{triangle[1] - triangle[0], triangle[2] - triangle[1], triangle[0] - triangle[2]},
          corners(lanesOf(triangle)),
          normal(normalOf(edges)),
          normal2(normal.squaredNorm())
    {
    }

    const TriangleCorners& points;
    const Vector3d edges[3];  ///< from each corner to the next
    const Vectors corners;
    const Vector3d normal;  ///< not of unit length; 0 if its direction is not known to kAccuracy
    const double normal2;

private:
    static Vector3d normalOf(const Vector3d (&edges)[3])
    {
        const Vector3d normal = edges[0].cross(edges[1]);
        const bool isKnown =
            normal.squaredNorm() > kParallelEdges2 * edges[0].squaredNorm() * edges[1].squaredNorm();
        return isKnown ? normal : Vector3d(Vector3d::Zero());
    }
};

/// The closest points that were found, and the square of their distance.
struct Closest
{
    double distance2 = std::numeric_limits<double>::infinity();
    Vector3d onA, onB;
    bool areCorners = false;
};

/// Heights of the corners of a triangle over a plane, times the length of the plane's normal.
[[gnu::always_inline]] inline Four heightsOver(const Side& face, const Side& other)
{
    return dot(other.corners - Vectors(face.points[0]), Vectors(face.normal));
}

/// Whether all corners of a triangle are on one side of a plane and farther from it than a limit.
[[gnu::always_inline]] inline bool areBeyond(const Side& face, const Four& heights, double limit)
{
    const unsigned above = (heights > Four(0.0)).bits() & 7u;
    const unsigned near = (heights * heights <= Four(limit * limit * face.normal2)).bits() & 7u;
    return near == 0 && (above == 0 || above == 7u);
}

/// @param other, closest corners of it may be over the face
/// @param isFaceOfA
void considerFace(const Side& face, const Four& heights, const Side& other, bool isFaceOfA, Closest& closest)
{
    if (face.normal2 == 0.0)
        return;
    Four isOutside(0.0);
    for (int i = 0; i < 3; ++i)
        isOutside = isOutside | (Four(0.0) > dot(other.corners - Vectors(face.points[i]),
                                                 Vectors(face.normal.cross(face.edges[i]))));
    const Four distance2 = Four::select(isOutside, Four(std::numeric_limits<double>::infinity()),
                                        heights * heights * (1.0 / face.normal2));
    const int lane = leastLane(distance2);
    if (!(distance2[lane] < closest.distance2))
        return;
    const Vector3d& corner = other.points[lane];
    const Vector3d foot = corner - face.normal * (heights[lane] / face.normal2);
    closest = {distance2[lane], isFaceOfA ? foot : corner, isFaceOfA ? corner : foot, false};
}

bool isAtEnd(double place)
{
    return place == 0.0 || place == 1.0;
}

void considerEdges(const Side& a, const Side& b, Closest& closest)
{
    const Vectors edgesB = nextLanes(b.corners) - b.corners;
    for (int i = 0; i < 3; ++i)
    {
        const EdgePlaces places = closestOnEdges(a.points[i], a.edges[i], b.corners, edgesB);
        const int lane = leastLane(places.distance2);
        if (!(places.distance2[lane] < closest.distance2 * (1.0 - kCloser)))
            continue;
        const double onA = places.onOne[lane], onB = places.onFour[lane];
        closest = {places.distance2[lane], a.points[i] + onA * a.edges[i],
                   b.points[lane] + onB * b.edges[lane], isAtEnd(onA) && isAtEnd(onB)};
    }
}

/// Whether no corner is ahead of the closest points along the way between them, and which are not behind.
///
/// @param most the distance by which rounding may put a corner ahead
bool isCertain(const Side& a, const Side& b, const Closest& closest, double most, TrianglePairTouch& touch)
{
    const Four aheadA = dot(a.corners - Vectors(closest.onA), Vectors(touch.normal));
    const Four aheadB = dot(Vectors(closest.onB) - b.corners, Vectors(touch.normal));
    touch.cornerA = leastLane(aheadA);
    touch.cornerB = leastLane(aheadB);
    return aheadA[touch.cornerA] >= -most && aheadB[touch.cornerB] >= -most;
}

double sizeOf(const TriangleCorners& a, const TriangleCorners& b)
{
    double size = 0.0;
    for (int i = 0; i < 3; ++i)
        size = std::max({size, a[i].cwiseAbs().maxCoeff(), b[i].cwiseAbs().maxCoeff()});
    return size;
}

TrianglePairState findTouchNearOrigin(const TriangleCorners& cornersA, const TriangleCorners& cornersB,
                                      double limit, TrianglePairTouch& touch)
{
    const Side a(cornersA), b(cornersB);
    const Four overA = heightsOver(a, b), overB = heightsOver(b, a);
    const bool isBBeyond = areBeyond(a, overA, limit);
    if (isBBeyond || areBeyond(b, overB, limit))
    {
        const Vector3d& normal = isBBeyond ? a.normal : b.normal;
        const bool isUp = isBBeyond ? overA[0] < 0.0 : overB[0] > 0.0;
        touch.normal = normal * ((isUp ? 1.0 : -1.0) / std::sqrt(isBBeyond ? a.normal2 : b.normal2));
        return TrianglePairState::Apart;
    }
    Closest closest;
    considerFace(a, overA, b, true, closest);
    considerFace(b, overB, a, false, closest);
    considerEdges(a, b, closest);
    const double size = sizeOf(cornersA, cornersB);
    const Vector3d way = closest.onA - closest.onB;
    touch.distance = way.norm();
    // A NaN makes the comparisons false.
    if (!(touch.distance > kTooClose * size))
        return TrianglePairState::Unknown;
    touch.normal = way / touch.distance;
    touch.onB = closest.onB;
    touch.areCorners = closest.areCorners;
    if (!isCertain(a, b, closest, kAccuracy * size, touch))
        return TrianglePairState::Unknown;
    return touch.distance <= limit ? TrianglePairState::Near : TrianglePairState::Apart;
}
}  // namespace

TrianglePairState findTouch(const TriangleCorners& a, const TriangleCorners& b, double limit,
                            TrianglePairTouch& touch) noexcept
{
    const Vector3d origin = a[0];
    const TriangleCorners ownA = {Vector3d::Zero(), a[1] - origin, a[2] - origin};
    const TriangleCorners ownB = {b[0] - origin, b[1] - origin, b[2] - origin};
    const TrianglePairState state = findTouchNearOrigin(ownA, ownB, limit, touch);
    if (state == TrianglePairState::Near)
        touch.onB += origin;
    return state;
}
}  // namespace cullet
