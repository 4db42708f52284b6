// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/face_touch.h"

#include "cullet/mid/lane_vectors.h"
#include "cullet/narrow/hull/linear_scan_avx2.h"
#include "cullet/plugin/contact/contact_feature.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Squared sine of the angle between two edges below which they give no normal.
constexpr double kDegenerate2 = 1e-12;
/// Times the size of both: below this distance, searches may find an overlap.
constexpr double kTooClose = 4e-7;

using Heights = std::array<double, FaceTouch::kMostVertices>;

/// Compiled for several instruction sets, without fused products, so that the bits are the same.
[[gnu::always_inline]] inline void measure(const Hull<btScalar>& hull, const Eigen::Vector3d& direction,
                                           Heights& heights)
{
    const double x = direction[0], y = direction[1], z = direction[2];
    const btScalar *const px = hull.x(), *const py = hull.y(), *const pz = hull.z();
    for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
        heights[static_cast<std::size_t>(i)] = x * double(px[i]) + y * double(py[i]) + z * double(pz[i]);
}

void measureBaseline(const Hull<btScalar>& hull, const Eigen::Vector3d& direction, Heights& heights)
{
    measure(hull, direction, heights);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void measureAvx2(const Hull<btScalar>& hull, const Eigen::Vector3d& direction,
                                         Heights& heights)
{
    measure(hull, direction, heights);
}
#endif

void measureHeights(const Hull<btScalar>& hull, const Eigen::Vector3d& direction, Heights& heights)
{
#if defined(__x86_64__)
    if (kHasAvx2)
        return measureAvx2(hull, direction, heights);
#endif
    measureBaseline(hull, direction, heights);
}

/// Heights of four vertices, with the bits of measureHeights().
[[gnu::always_inline]] inline LaneNumbers heightsOfFour(const Hull<btScalar>& hull,
                                                        const Eigen::Vector3d& direction, std::int32_t first)
{
    const auto four = [first](const btScalar* all)
    {
        double wide[4];
        for (std::int32_t i = 0; i < 4; ++i)
            wide[i] = double(all[first + i]);
        return LaneNumbers::load(wide);
    };
    return four(hull.x()) * direction[0] + four(hull.y()) * direction[1] + four(hull.z()) * direction[2];
}

[[gnu::always_inline]] inline double leastOf(const LaneNumbers& v)
{
    const LaneNumbers halves = LaneNumbers::smaller(v, v.lanes<2, 3, 0, 1>());
    return LaneNumbers::smaller(halves, halves.lanes<1, 0, 3, 2>())[0];
}

/// Bit i: number i is the least.
[[gnu::always_inline]] inline std::uint64_t areLeast(const LaneNumbers& v, double least)
{
    return (v == LaneNumbers(least)).bits();
}

bool comesFirst(const Hull<btScalar>& hull, std::int32_t i, std::int32_t j)
{
    const auto place = [&](std::int32_t v) { return std::make_tuple(hull.x()[v], hull.y()[v], hull.z()[v]); };
    return place(i) < place(j);
}

/// The vertex that comes first.
///
/// @param vertices a bit for each
std::int32_t firstOf(const Hull<btScalar>& hull, std::uint64_t vertices)
{
    std::int32_t first = -1;
    for (; vertices != 0; vertices &= vertices - 1)
    {
        const std::int32_t vertex = __builtin_ctzll(vertices);
        if (first < 0 || comesFirst(hull, vertex, first))
            first = vertex;
    }
    return std::max(first, 0);
}
}  // namespace

bool isOver(const Eigen::Vector3d (&corners)[3], const Eigen::Vector3d& point)
{
    const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    for (int i = 0; i < 3; ++i)
    {
        if (normal.dot((corners[(i + 1) % 3] - corners[i]).cross(point - corners[i])) < 0.0)
            return false;
    }
    return true;
}

/// The face of a core that lies over a triangle best, or the core itself if it is a segment.
struct FaceTouch::Polygon
{
    static constexpr int kMostCorners = 16;

    /// @param down   unit
    /// @param vertex the lowest
    Polygon(const PosedShape& core, const Eigen::Vector3d& down, std::int32_t vertex, const NormalMap* map)
    {
        const ContactFace face(core, down, vertex, nullptr, map);
        const Hull<btScalar>::Span ids = face.corners();
        if (ids.size() > kMostCorners)
            return;
        count = ids.size();
        for (int i = 0; i < count; ++i)
            at[static_cast<std::size_t>(i)] = core.point(ids[i]) + core.origin();
        if (count > 2)
            outward = face.normal();
    }

    const Eigen::Vector3d& corner(int i) const
    {
        return at[static_cast<std::size_t>(i < count ? i : i - count)];
    }
    Eigen::Vector3d edge(int i) const { return corner(i + 1) - corner(i); }

    /// Whether a point is within the prism over the polygon.
    bool isBelow(const Eigen::Vector3d& point) const
    {
        bool isLeft = false, isRight = false;
        for (int i = 0; i < count; ++i)
        {
            const double side = outward.dot(edge(i).cross(point - corner(i)));
            isLeft |= side > 0.0;
            isRight |= side < 0.0;
        }
        return !(isLeft && isRight);
    }

    double highest() const
    {
        double most = outward.dot(corner(0));
        for (int i = 1; i < count; ++i)
            most = std::max(most, outward.dot(corner(i)));
        return most;
    }

    std::array<Eigen::Vector3d, kMostCorners> at;
    int count = 0;
    Eigen::Vector3d outward;  ///< unit; of three corners or more
};

/// Where the corners of a polygon are in relation to the prism over a triangle.
class FaceTouch::Prism
{
public:
    struct Place
    {
        LaneNumbers
            inside;     ///< of each side of the triangle, times a length; the fourth lane repeats the first
        double height;  ///< over the triangle's plane

        bool isInside() const { return (LaneNumbers(0.0) > inside).bits() == 0; }
    };
    struct Crossing
    {
        int edge = -1, side = -1;  ///< of polygon and triangle; -1: there is none
    };

    /// @param normal unit, towards the polygon
    Prism(const Polygon& polygon, const Corners& corners, const Eigen::Vector3d& normal)
    {
        // Sides are positive inside, whichever way the triangle turns.
        const Eigen::Vector3d ab = corners[1] - corners[0], bc = corners[2] - corners[1];
        const Eigen::Vector3d up = normal.dot(ab.cross(bc)) > 0.0 ? normal : Eigen::Vector3d(-normal);
        const Eigen::Vector3d sides[] = {up.cross(ab), up.cross(bc), up.cross(corners[0] - corners[2])};
        const auto row = [](const Eigen::Vector3d(&v)[3], int i)
        { return LaneNumbers(v[0][i], v[1][i], v[2][i], v[0][i]); };
        const LaneVectors inward(row(sides, 0), row(sides, 1), row(sides, 2)),
            from(row(corners, 0), row(corners, 1), row(corners, 2));
        for (int i = 0; i < polygon.count; ++i)
        {
            const Eigen::Vector3d& corner = polygon.corner(i);
            m_places[static_cast<std::size_t>(i)] = {dot(LaneVectors(corner) - from, inward),
                                                     normal.dot(corner - corners[0])};
        }
    }

    const Place& place(int i) const { return m_places[static_cast<std::size_t>(i)]; }

    Crossing lowestCrossing(int count) const
    {
        Crossing lowest;
        double least = std::numeric_limits<double>::infinity();
        for (int i = 0; i < count; ++i)
        {
            const Place &a = place(i), &b = place(i + 1 < count ? i + 1 : 0);
            const unsigned outsideA = (LaneNumbers(0.0) > a.inside).bits() & 7u,
                           outsideB = (LaneNumbers(0.0) > b.inside).bits() & 7u;
            if ((outsideA & outsideB) != 0)
                continue;
            for (int side = 0; side < 3; ++side)
            {
                if (((outsideA ^ outsideB) >> side & 1u) == 0)
                    continue;
                const double part = a.inside[side] / (a.inside[side] - b.inside[side]);
                const LaneNumbers there = a.inside + (b.inside - a.inside) * part;
                const unsigned outside = (LaneNumbers(0.0) > there).bits() & 7u & ~(1u << side);
                const double height = a.height + part * (b.height - a.height);
                if (outside == 0 && height < least)
                {
                    least = height;
                    lowest = {i, side};
                }
            }
        }
        return lowest;
    }

private:
    std::array<Place, Polygon::kMostCorners> m_places;
};

FaceTouch::FaceTouch(const PosedShape& core, const Eigen::Vector3d (&corners)[3], double limit,
                     const NormalMap* map)
{
    const Eigen::Vector3d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
    const Eigen::Vector3d across = ab.cross(ac), fromCentre = corners[0] - core.origin() - core.centre();
    const double length2 = across.squaredNorm();
    // A NaN makes the comparison false.
    if (!(length2 > kDegenerate2 * ab.squaredNorm() * ac.squaredNorm()))
        return;
    m_touch.normal = across * ((across.dot(fromCentre) > 0.0 ? -1.0 : 1.0) / std::sqrt(length2));
    const Lowest lowest = lowestAlong(core, m_touch.normal);
    m_touch.vertexA = lowest.vertex;
    m_touch.distance = lowest.height + m_touch.normal.dot(core.origin() - corners[0]);
    if (m_touch.distance > limit)
    {
        m_state = State::Separated;
        return;
    }
    const double size = double(core.size()) + ab.cwiseAbs().sum() + ac.cwiseAbs().sum();
    m_least = kTooClose * size;
    m_rounding = 2.0 * double(std::numeric_limits<btScalar>::epsilon()) * size;
    if (m_touch.distance <= m_least)
        return;
    const Polygon polygon(core, -m_touch.normal, lowest.vertex, map);
    if (polygon.count < 2)
        return;
    const Prism prism(polygon, corners, m_touch.normal);
    const bool isFound = findOverTriangle(polygon, prism) || findCrossing(core, polygon, prism, corners) ||
                         findOverPolygon(polygon, corners);
    if (!isFound)
        return;
    m_touch.onB -= core.origin();
    m_state = State::Near;
}

FaceTouch::Lowest FaceTouch::lowestAlong(const PosedShape& core, const Eigen::Vector3d& direction)
{
    const Hull<btScalar>& hull = core.hull();
    const Eigen::Vector3d local = core.basis().transpose() * direction;
    const auto count = static_cast<std::size_t>(hull.vertexCount());
    const std::uint64_t all = (std::uint64_t(1) << count) - 1;
    if (hull.paddedCount() == 8)
    {
        // Most cores are boxes. What pads the coordinates repeats the first vertex.
        const LaneNumbers low = heightsOfFour(hull, local, 0), high = heightsOfFour(hull, local, 4);
        const double least = leastOf(LaneNumbers::smaller(high, low));
        return {firstOf(hull, (areLeast(low, least) | areLeast(high, least) << 4) & all), least};
    }
    Heights heights;
    // Compilers cannot prove that a hull has a vertex.
    heights[0] = 0.0;
    measureHeights(hull, local, heights);
    // The lanes that are left repeat the first vertex.
    for (std::size_t i = count; i % 4 != 0; ++i)
        heights[i] = heights[0];
    LaneNumbers lowest = LaneNumbers::load(heights.data());
    for (std::size_t i = 4; i < count; i += 4)
        lowest = LaneNumbers::smaller(LaneNumbers::load(&heights[i]), lowest);
    const double least = leastOf(lowest);
    std::uint64_t isLowest = 0;
    for (std::size_t i = 0; i < count; i += 4)
        isLowest |= areLeast(LaneNumbers::load(&heights[i]), least) << i;
    return {firstOf(hull, isLowest & all), least};
}

/// A corner of the polygon that is one of the lowest and over the triangle.
bool FaceTouch::findOverTriangle(const Polygon& polygon, const Prism& prism)
{
    for (int i = 0; i < polygon.count; ++i)
    {
        const Prism::Place& place = prism.place(i);
        if (place.height - m_touch.distance > m_rounding || !place.isInside())
            continue;
        m_touch.onB = polygon.corner(i) - place.height * m_touch.normal;
        m_touch.vertexB = 0;
        return true;
    }
    return false;
}

/// A corner of the triangle that is one of the closest to the plane of the polygon and in the prism over it.
bool FaceTouch::findOverPolygon(const Polygon& polygon, const Corners& corners)
{
    if (polygon.count < 3)
        return false;
    const double plane = polygon.highest();
    const double heights[] = {polygon.outward.dot(corners[0]) - plane,
                              polygon.outward.dot(corners[1]) - plane,
                              polygon.outward.dot(corners[2]) - plane};
    const double least = std::min({heights[0], heights[1], heights[2]});
    if (least <= m_least)
        return false;
    for (int i = 0; i < 3; ++i)
    {
        if (heights[i] - least > m_rounding || !polygon.isBelow(corners[i]))
            continue;
        m_touch.normal = -polygon.outward;
        m_touch.distance = least;
        m_touch.onB = corners[i];
        m_touch.vertexB = i;
        return true;
    }
    return false;
}

/// The closest points of the two edges that cross, seen along the normal, where the core is lowest.
bool FaceTouch::findCrossing(const PosedShape& core, const Polygon& polygon, const Prism& prism,
                             const Corners& corners)
{
    const Prism::Crossing crossing = prism.lowestCrossing(polygon.count);
    if (crossing.side < 0)
        return false;
    const Eigen::Vector3d from = polygon.corner(crossing.edge), edge = polygon.edge(crossing.edge);
    const Eigen::Vector3d start = corners[crossing.side], way = corners[(crossing.side + 1) % 3] - start;
    const EdgePlaces places = closestOnEdges(start, way, LaneVectors(from), LaneVectors(edge));
    const double part = places.onFour[0], partOfTriangle = places.onOne[0];
    const Eigen::Vector3d onTriangle = start + partOfTriangle * way;
    const Eigen::Vector3d apart = from + part * edge - onTriangle;
    const double distance = apart.norm();
    if (!(distance > m_least))
        return false;
    const Eigen::Vector3d normal = apart / distance;
    const Lowest lowest = lowestAlong(core, normal);
    const double heights[] = {normal.dot(corners[0]), normal.dot(corners[1]), normal.dot(corners[2])};
    const auto highest = static_cast<int>(std::max_element(heights, heights + 3) - heights);
    const double gap = lowest.height + normal.dot(core.origin()) - heights[highest];
    if (gap < distance - m_rounding)
        return false;
    m_touch = {normal, gap, onTriangle, lowest.vertex, highest, false};
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
