// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/contact/contact_patch.h"

#include "cullet/plugin/contact/contact_polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Eigen::Vector3d;

/// The prism over a face along the contact normal.
class Prism
{
public:
    /// @param orientation  1: the face is counter-clockwise seen from the tip of the contact normal; -1: clockwise
    /// @param tolerance polygons that extend no farther outside are not clipped: with congruent faces, the points of a
    ///              stack would otherwise jump between nearly coincident corners
    Prism(ContactPolygon& base, btScalar orientation, btScalar tolerance)
        : m_base(base), m_tolerance(tolerance), m_count((base.count + 3) / 4)
    {
        // Padding edges have length 0.
        for (std::int32_t i = base.count; i <= 4 * m_count; ++i)
            base.corners[static_cast<std::size_t>(i)] = base.corners[0];
        for (std::int32_t k = 0; k < m_count; ++k)
            addSides(&base.corners[static_cast<std::size_t>(4 * k)], orientation, tolerance,
                     m_sides[static_cast<std::size_t>(k)]);
    }

    /// Clips a polygon to the prism. What it leaves is outside by no more than the root of 2 times the tolerance.
    ///
    /// @param buffer scratch memory; the result is in this or in `polygon`
    ContactPolygon& clip(ContactPolygon& polygon, ContactPolygon& buffer) const
    {
        ContactPolygon* current = &polygon;
        ContactPolygon* out = &buffer;
        bool isOutside = false;
        for (std::int32_t k = 0; k < m_count; ++k)
            isOutside |= clip(m_sides[static_cast<std::size_t>(k)], current, out);
        // At a sharp corner, little outside of both sides may be far from the corner.
        if (isOutside)
            clip(boxOfBase(), current, out);
        return *current;
    }

private:
    /// Four linear functions of the coordinates along the tangents, positive inside.
    struct Sides
    {
        Components x, y, offset;
        Components tolerance;
    };

    /// @param current [in, out] the polygon
    /// @param out     [in, out] scratch memory
    /// @return whether a side was left out beyond which the polygon extends
    static bool clip(const Sides& sides, ContactPolygon*& current, ContactPolygon*& out)
    {
        Components lowest = {};
        for (std::int32_t i = 0; i < current->count; ++i)
        {
            const Components& p = current->corners[static_cast<std::size_t>(i)];
            const Components heights = sides.x * p[0] + sides.y * p[1] + sides.offset;
            lowest = heights < lowest ? heights : lowest;
        }
        const Components allowed = lowest + sides.tolerance;
        for (int side = 0; side < 4; ++side)
        {
            if (allowed[side] >= 0)
                continue;
            ContactPolygon::Heights heights;
            for (std::size_t i = 0; i < static_cast<std::size_t>(current->count); ++i)
                heights[i] = sides.x[side] * current->corners[i][0] + sides.y[side] * current->corners[i][1] +
                             sides.offset[side];
            cullet::clip(*current, heights, *out);
            std::swap(current, out);
        }
        return quadBits<btScalar>((lowest < 0) & (allowed >= 0)) != 0;
    }

    /// The sides of a box along the tangents. Of the four directions, those that point away from a sharp corner are
    /// within 45 degrees of its bisector, or two are on either side of it.
    Sides boxOfBase() const
    {
        Components low = m_base.corners[0], high = low;
        for (std::size_t i = 1; i < static_cast<std::size_t>(m_base.count); ++i)
        {
            const Components& corner = m_base.corners[i];
            low = corner < low ? corner : low;
            high = corner > high ? corner : high;
        }
        return {Components{1, -1, 0, 0}, Components{0, 0, 1, -1},
                Components{-low[0], high[0], -low[1], high[1]},
                Components{m_tolerance, m_tolerance, m_tolerance, m_tolerance}};
    }

    /// @param corners five of them
    static void addSides(const Components* corners, btScalar orientation, btScalar tolerance, Sides& sides)
    {
        const Components low = CULLET_SHUFFLE(corners[0], corners[1], 0, 4, 1, 5);
        const Components high = CULLET_SHUFFLE(corners[2], corners[3], 0, 4, 1, 5);
        const Components x = CULLET_SHUFFLE(low, high, 0, 1, 4, 5);
        const Components y = CULLET_SHUFFLE(low, high, 2, 3, 6, 7);
        const Components nextX = {x[1], x[2], x[3], corners[4][0]};
        const Components nextY = {y[1], y[2], y[3], corners[4][1]};
        sides.x = (y - nextY) * orientation;
        sides.y = (nextX - x) * orientation;
        Components sizeX = sides.x, sizeY = sides.y;
        Quad<btScalar>::makePositive(sizeX);
        Quad<btScalar>::makePositive(sizeY);
        sides.tolerance = (sizeX + sizeY) * tolerance;
        sides.offset = -(sides.x * x + sides.y * y);
    }

    const ContactPolygon& m_base;
    const btScalar m_tolerance;
    std::array<Sides, kMostCorners / 4> m_sides;
    std::int32_t m_count;
};

/// In units of PatchLimits::mergeDistance.
constexpr btScalar kClipTolerance = btScalar(0.05);

/// The height over the touch up to which a point is load-bearing: in units of PatchLimits::mergeDistance, or of its
/// distance from the touch. In one step, gravity moves a body of a metre by a sixth of PatchLimits::mergeDistance.
constexpr btScalar kRise = btScalar(0.1);
constexpr btScalar kSlope = btScalar(0.02);
/// At this cosine between its normal and the contact normal, or above, a face rises by no more than kSlope.
constexpr double kLevel = 1.0 - 0.5 * 0.02 * 0.02;

/// A core that is larger than the other one by this factor does not rock over it. Not 2, which sizes may well have.
constexpr btScalar kMuchLarger = btScalar(2.1);

/// Times d s / r^2 of Rocking::closes(): the part of the limits above that holds at the end of an edge. With 1, a free
/// wheel of 24 sides would roll on one end of its edges as often as on both.
constexpr btScalar kLever = btScalar(1.25);

/// The bodies that can rock over an edge: the smaller one, or both if their sizes are similar. A triangle belongs to a
/// mesh and does not rock. Bodies come to rest on faces, and capsules on their sides, so these keep all their points.
class Rocking
{
public:
    /// @param tangential coordinates of the core's origin along both tangents
    /// @param height     of the core's origin over the touch, along the normal
    void add(const PosedShape& core, const PosedShape& other, const Components& tangential, double height)
    {
        const bool isRockedOver =
            other.hull().kind() == HullKind::Polygon || core.size() <= kMuchLarger * other.size();
        if (core.hull().kind() == HullKind::Polygon || !isRockedOver)
            return;
        const auto h = static_cast<btScalar>(height);
        m_origins[static_cast<std::size_t>(m_count++)] = Components{tangential[0], tangential[1], h * h, 0};
    }

    /// Whether gravity can close a gap in about the time in which a falling body closes `most`. A body that rocks over
    /// the touch towards a point at the distance d turns about an axis across the way to the point. Its origin, which is
    /// taken for the centre of mass as in Bullet, is at a distance r from the axis and s beside it. So the body turns with
    /// g s / r^2, and the point falls with g s d / r^2. What rests on the patch has its origin over it: s is at most d.
    ///
    /// @param d2 square of the point's distance from the touch
    bool closes(btScalar gap, const Components& point, btScalar d2, btScalar most) const
    {
        bool isClosing = m_count == 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(m_count); ++i)
        {
            const Components& origin = m_origins[i];
            const btScalar along = origin[0] * point[0] + origin[1] * point[1];  // s d
            // Both sides times d^2 r^2.
            isClosing |= gap * (along * along + origin[2] * d2) <= kLever * most * std::max(along, d2) * d2;
        }
        return isClosing;
    }

private:
    std::array<Components, 2> m_origins;  ///< relative to the touch; lane 2: square of the height
    int m_count = 0;
};

/// Collects candidate points in the contact frame and reduces them to a few at the end.
class PatchBuilder
{
public:
    PatchBuilder(const Touch& touch, const ContactFrame& frame, const PatchLimits& limits)
        : m_frame(frame),
          m_mergeDistance(limits.mergeDistance),
          m_maxPoints(limits.most),
          m_distance(static_cast<btScalar>(touch.distance)),
          m_range(static_cast<btScalar>(limits.distance - touch.distance))
    {
        // Compilers cannot prove that there is at least one point in the end.
        m_points[0] = Components{};
    }

    Rocking& rocking() { return m_rocking; }

    /// The distance outside of the prism below which a face is not clipped.
    btScalar tolerance() const { return kClipTolerance * m_mergeDistance; }

    /// Whether a whole polygon coincides with the touch.
    bool isOnePoint(const ContactPolygon& polygon) const
    {
        btScalar farthest2 = 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.count); ++i)
        {
            const Components squares = polygon.corners[i] * polygon.corners[i];
            farthest2 = std::max(farthest2, squares[0] + squares[1]);
        }
        return farthest2 <= m_mergeDistance * m_mergeDistance;
    }

    /// Adds load-bearing corners within the limit, but not those where a face was clipped to the limit.
    ///
    /// @param noise rounding error of distances
    void add(const ContactPolygon& polygon, btScalar noise)
    {
        const btScalar limit = m_distance + btScalar(1 - 1e-4) * m_range - 4 * noise;
        for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.count); ++i)
        {
            const Components& corner = polygon.corners[i];
            if (!(corner[3] < limit) || !isLoadBearing(corner, noise))
                continue;
            m_points[static_cast<std::size_t>(m_count++)] = corner;
            m_deepest = std::min(m_deepest, corner[3]);
        }
    }

    /// Adds the touch itself, unless a candidate is as deep.
    ///
    /// @param noise rounding error of distances
    void addTouch(btScalar noise)
    {
        if (m_deepest > m_distance + btScalar(1e-4) * m_range + noise)
            m_points[static_cast<std::size_t>(m_count++)] = Components{0, 0, 0, m_distance};
    }

    ContactPatch reduce() const
    {
        ContactPatch patch;
        if (m_count > m_maxPoints)
            selectPoints(patch);
        else
        {
            const int first = deepest(0);
            for (int i = 0; i < m_count; ++i)
                i == first ? addPoint(i, patch) : addDistinctPoint(i, first, patch);
        }
        return patch;
    }

private:
    bool isLoadBearing(const Components& corner, btScalar noise) const
    {
        const btScalar rise = corner[3] - m_distance - noise;
        if (rise <= 0)
            return true;
        const Components squares = corner * corner;
        const btScalar d2 = squares[0] + squares[1];
        const btScalar most = std::max(kRise * m_mergeDistance, kSlope * squareRoot(d2));
        return rise <= most && m_rocking.closes(rise, corner, d2, most);
    }

    /// @param margin a later candidate must be better by this much
    int deepest(btScalar margin) const
    {
        return best([](const Components& c) { return -c[3]; }, margin);
    }

    /// Selects the deepest candidate, the farthest from it, and the farthest on either side of the line through both;
    /// if all candidates are on one side, the farthest from the triangle. A candidate must be better by a margin, so
    /// that noise does not change the selection from frame to frame.
    void selectPoints(ContactPatch& patch) const
    {
        const int first = deepest(btScalar(1e-3) * m_range);
        addPoint(first, patch);
        const Components& p = at(first);
        const auto distance2 = [&](const Components& c)
        { return (c[0] - p[0]) * (c[0] - p[0]) + (c[1] - p[1]) * (c[1] - p[1]); };
        const btScalar size2 = distance2(at(best(distance2, 0)));
        const int second = best(distance2, btScalar(2e-3) * size2);
        addDistinctPoint(second, first, patch);
        if (m_maxPoints > 2)
            selectBesideLine(first, second, size2, patch);
    }

    /// Selects the farthest candidate on either side of the line through two points.
    ///
    /// @param size2 square of the distance of the two points, up to the margin
    void selectBesideLine(int first, int second, btScalar size2, ContactPatch& patch) const
    {
        const Components& p = at(first);
        const btScalar dx = at(second)[0] - p[0], dy = at(second)[1] - p[1];
        const auto left = [&](const Components& c) { return dx * (c[1] - p[1]) - dy * (c[0] - p[0]); };
        const auto right = [&](const Components& c) { return -left(c); };
        const btScalar smallest = btScalar(1e-3) * size2;
        const int third = best(left, smallest), fourth = best(right, smallest);
        const btScalar leftmost = left(at(third)), rightmost = right(at(fourth));
        const bool hasThird = leftmost > smallest, hasFourth = rightmost > smallest;
        const bool hasRoom = m_maxPoints == 4;
        if (hasThird && (hasRoom || leftmost >= rightmost))
            addDistinctPoint(third, first, patch);
        if (hasFourth && (hasRoom || rightmost > leftmost))
            addDistinctPoint(fourth, first, patch);
        if (hasThird != hasFourth && hasRoom)
            selectOutsideTriangle(hasThird ? std::array<int, 3>{first, second, third}
                                           : std::array<int, 3>{second, first, fourth},
                                  smallest, first, patch);
    }

    /// Selects the candidate farthest outside of the last two edges of a counter-clockwise triangle; all points are on
    /// the left of its first edge.
    void selectOutsideTriangle(const std::array<int, 3>& triangle, btScalar smallest, int first,
                               ContactPatch& patch) const
    {
        const Components &i = at(triangle[0]), &j = at(triangle[1]), &k = at(triangle[2]);
        const auto rightOf = [&](const Components& from, const Components& to, const Components& c)
        { return (to[1] - from[1]) * (c[0] - from[0]) - (to[0] - from[0]) * (c[1] - from[1]); };
        const auto beyond = [&](const Components& c) { return std::max(rightOf(j, k, c), rightOf(k, i, c)); };
        const int fourth = best(beyond, smallest);
        if (beyond(at(fourth)) > smallest)
            addDistinctPoint(fourth, first, patch);
    }

    /// Adds a point unless it coincides with the first.
    void addDistinctPoint(int i, int first, ContactPatch& patch) const
    {
        const Components apart = at(i) - at(first);
        const Components squares = apart * apart;
        if (squares[0] + squares[1] > m_mergeDistance * m_mergeDistance)
            addPoint(i, patch);
    }

    const Components& at(int i) const { return m_points[static_cast<std::size_t>(i)]; }

    void addPoint(int i, ContactPatch& patch) const
    {
        ContactPoint& point = patch.points[static_cast<std::size_t>(patch.count++)];
        point.fromTouch = m_frame.world(at(i));
        // Rounding must not make a contact deeper than the shapes are.
        point.distance = std::max(at(i)[3], m_distance);
    }

    template <class Score>
    int best(const Score& score, btScalar margin) const
    {
        int found = 0;
        btScalar highest = score(at(0));
        for (int i = 1; i < m_count; ++i)
        {
            const btScalar s = score(at(i));
            if (s > highest + margin)
            {
                found = i;
                highest = s;
            }
        }
        return found;
    }

    const ContactFrame& m_frame;
    Rocking m_rocking;
    btScalar m_mergeDistance;  ///< see PatchLimits
    int m_maxPoints;           ///< limit of points in the patch
    btScalar m_distance;       ///< of the cores at the touch
    btScalar m_range;          ///< from m_distance to the limit
    btScalar m_deepest = BT_LARGE_FLOAT;
    std::array<Components, 2 * kMostCorners + 1> m_points;
    int m_count = 0;
};

/// Below this cosine between its normal and the contact normal, a plane is too steep to measure heights over it.
constexpr double kSteepest = 0.05;

/// If the alignments of both faces differ by no more than this, the reference is that of the core that is much larger, which
/// the other one's face is seldom clipped to, or else A's; independent of rounding.
constexpr double kAligned = 1e-5;

/// The data of one of the two cores of a patch.
struct PatchSide
{
    const PosedShape& shape;
    ContactFace face;
    Vector3d origin;  ///< relative to the touch's point of B
};

/// Reduces a polygon to the triangle at its only corner with a distance below the limit.
void cutCorner(ContactPolygon& face, std::size_t corner, btScalar limit)
{
    const auto count = static_cast<std::size_t>(face.count);
    const Components tip = face.corners[corner];
    const Components next = face.corners[corner + 1 < count ? corner + 1 : 0];
    const Components last = face.corners[corner > 0 ? corner - 1 : count - 1];
    const btScalar offset = limit - tip[3];
    face.corners[0] = tip;
    face.corners[1] = tip + (next - tip) * (offset / (next[3] - tip[3]));
    face.corners[2] = tip + (last - tip) * (offset / (last[3] - tip[3]));
    face.count = 3;
}

/// The share of the tolerance of a Prism over a face. Distances beside the face are measured over its plane, so that they
/// are off by what a point is outside times the slope of the plane. Beyond 45 degrees the share is as much less.
///
/// @param alignment cosine between the normals of face and contact
btScalar toleranceShare(double alignment)
{
    const double cosine2 = alignment * alignment;
    return cosine2 >= 0.5 ? btScalar(1) : static_cast<btScalar>(std::sqrt(cosine2 / (1.0 - cosine2)));
}

/// Clips one face to the prism over the other face and to the limit, and adds the corners of the result.
///
/// @param frame [out] measures distances from the reference face
/// @return rounding error of the distances
btScalar clipFaces(const PatchSide& reference, const PatchSide& other, bool isAReference, const Touch& touch,
                   double limit, ContactFrame& frame, PatchBuilder& builder)
{
    frame.setReference(reference.face.normal(), touch.normal, isAReference);
    const CornerMap referenceMap(reference.shape, frame, reference.origin);
    CornerMap otherMap(other.shape, frame, other.origin);
    ContactPolygon base, face, cut;
    referenceMap.corner(reference.face.corners()[0], base.corners[0]);
    // Makes distances 0 in the plane of the reference face.
    const btScalar plane = base.corners[0][3];
    otherMap.shift(Components{0, 0, isAReference ? 0 : plane, -plane});
    face.set(otherMap, other.face.corners());
    const btScalar noise =
        2 * std::numeric_limits<btScalar>::epsilon() * (referenceMap.originSize() + otherMap.originSize());
    const btScalar range = static_cast<btScalar>(limit);
    unsigned within = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(face.count); ++i)
        within |= unsigned(face.corners[i][3] <= range) << i;
    if (within == 0)
        return noise;
    // If only one corner is within the limit, the triangle there is cheaper to clip, and often all of it is the touch.
    if ((within & (within - 1)) == 0 && face.count > 2)
    {
        cutCorner(face, static_cast<std::size_t>(__builtin_ctz(within)), range);
        if (builder.isOnePoint(face))
            return noise;
    }
    base.set(referenceMap, reference.face.corners());
    if (other.face.alignment() < kLevel && other.face.corners().size() > 2)
    {
        Rocking& rocking = builder.rocking();
        rocking.add(reference.shape, other.shape, referenceMap.origin(), reference.origin.dot(touch.normal));
        rocking.add(other.shape, reference.shape, otherMap.origin(), other.origin.dot(touch.normal));
    }
    const bool isClockwise = isAReference != reference.face.isMirrored();
    const btScalar tolerance = builder.tolerance() * toleranceShare(reference.face.alignment());
    const Prism prism(base, isClockwise ? -1 : 1, tolerance);
    builder.add(prism.clip(face, cut), noise);
    return noise;
}

/// PosedHull::isStrictSupport(), with a scan of all vertices for a hull without a graph: whether the graph is built
/// changes no bit of a patch.
bool isStrictSupport(const PosedShape& shape, std::int32_t vertex, const PosedShape::Vector& direction,
                     btScalar height)
{
    const Hull<btScalar>& hull = shape.hull();
    if (hull.kind() != HullKind::Cloud || vertex < 0)
        return shape.isStrictSupport(vertex, direction, height);
    const PosedShape::Quad d =
        shape.row(0) * direction[0] + shape.row(1) * direction[1] + shape.row(2) * direction[2];
    const auto along = [&](std::int32_t i)
    { return hull.x()[i] * d[0] + hull.y()[i] * d[1] + hull.z()[i] * d[2]; };
    const btScalar low = along(vertex) - height;
    std::int32_t count = 0;
    for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
        count += along(i) >= low ? 1 : 0;
    return count == 1;
}

/// Whether the touch, between two vertices, is the whole patch: along every edge from either vertex, and so in all of
/// its hull, the distance grows beyond the limit. The vertices lie on one line along the normal, so that the prisms
/// over their faces intersect in a cone with its tip there; the clipped cone has only the tip and points at the limit,
/// which are not yet contacts.
bool isOnlyTouch(const PosedShape& a, const PosedShape& b, const Touch& touch, double limit)
{
    if (!touch.areCorners)
        return false;
    const PosedShape::Vector normal = touch.normal.cast<btScalar>();
    const btScalar range = static_cast<btScalar>(limit - touch.distance);
    return isStrictSupport(a, touch.vertexA, -normal, range) &&
           isStrictSupport(b, touch.vertexB, normal, range);
}

/// Whether a triangle touches at a corner only, from which both edges lead down steeply: then all of it does.
bool isSteepCorner(const PosedShape& shape, std::int32_t vertex, const Vector3d& outward)
{
    if (shape.hull().kind() != HullKind::Polygon || shape.vertexCount() != 3 || vertex < 0)
        return false;
    const Vector3d corner = shape.point(vertex);
    return isSteep(shape.point((vertex + 1) % 3) - corner, outward) &&
           isSteep(shape.point((vertex + 2) % 3) - corner, outward);
}
/// Whether points of a hull rise from one of its vertices by a slope above kRise: those that rise no more than kRise merge
/// distances are then as close as points that the manifold merges.
class SteepRise
{
public:
    using Vector = Eigen::Matrix<btScalar, 3, 1>;

    /// @param up unit, into the hull
    SteepRise(const PosedShape& shape, std::int32_t vertex, const Vector3d& up)
        : m_shape(shape), m_vertex(vertex)
    {
        const Components local =
            shape.row(0) * btScalar(up[0]) + shape.row(1) * btScalar(up[1]) + shape.row(2) * btScalar(up[2]);
        m_up = {local[0], local[1], local[2]};
    }

    bool ofAllPoints() const
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const auto isSteep = [this](std::int32_t other) { return this->isSteep(other); };
        if (hull.kind() == HullKind::Solid)
        {
            // By convexity, all others rise as steeply.
            const auto neighbours = hull.naturalNeighbours(m_vertex);
            return std::all_of(neighbours.begin(), neighbours.end(), isSteep);
        }
        // No two points are farther apart than twice the size, so those that are higher are steep.
        const btScalar high = btScalar(2.02) * kRise * m_shape.size();
        return isTrueNear<btScalar>(hull, -m_up, m_vertex, high, {m_vertex, -1, -1}, isSteep);
    }

private:
    /// Or equal to the vertex. Computes the same for a point of a hull with a graph and without.
    bool isSteep(std::int32_t other) const
    {
        // The square of the sine of the slope.
        constexpr btScalar kSine2 = kRise * kRise / (1 + kRise * kRise);
        const Hull<btScalar>& hull = m_shape.hull();
        const Vector way = hull.vertex(other) - hull.vertex(m_vertex);
        const btScalar rise = m_up.dot(way);
        btScalar length2 = 0;
        for (int i = 0; i < 3; ++i)
        {
            const Components& row = m_shape.row(i);
            const btScalar along = row[0] * way[0] + row[1] * way[1] + row[2] * way[2];
            length2 += along * along;
        }
        return length2 == 0 || (rise > 0 && rise * rise > kSine2 * length2);
    }

    const PosedShape& m_shape;
    const std::int32_t m_vertex;
    Vector m_up;  ///< in the axes of the hull
};

/// isLoneCorner() for one of both shapes.
///
/// @param place  of the touch, relative to the shape's origin
/// @param up     unit, into the shape
/// @param within how far the place is from the corner at most
bool isLoneCorner(const PosedShape& shape, std::int32_t vertex, const Vector3d& place, const Vector3d& up,
                  double within)
{
    // Without a graph, a hull of one or two points is of another kind than with one.
    if (vertex < 0 || !shape.hull().pointBlocks().isEmpty())
        return false;
    return (shape.point(vertex) - place).squaredNorm() <= within * within &&
           SteepRise(shape, vertex, up).ofAllPoints();
}

/// Edges that rise by kRise or more bound faces whose cosine with the normal is less. Most faces that carry have more.
constexpr double kLoneAlignment = 1.0 - 0.4 * 0.1 * 0.1;

ContactPatch onlyTouch(const Touch& touch)
{
    return {{{{btVector3(0, 0, 0), static_cast<btScalar>(touch.distance)}}}, 1};
}
}  // namespace

bool isLoneCorner(const PosedShape& a, const PosedShape& b, const Touch& touch)
{
    const double within = 1e-6 * (double(a.size()) + double(b.size()));
    return isLoneCorner(a, touch.vertexA, touch.onB + touch.distance * touch.normal, touch.normal, within) ||
           isLoneCorner(b, touch.vertexB, touch.onB + a.origin() - b.origin(), -touch.normal, within);
}

bool isTouchAlone(const PosedShape& a, const PosedShape& b, const Touch& touch, double limit)
{
    return isSteepCorner(b, touch.vertexB, touch.normal) || isSteepCorner(a, touch.vertexA, -touch.normal) ||
           isOnlyTouch(a, b, touch, limit);
}

ContactPatch makeContactPatch(const PosedShape& a, const PosedShape& b, const Touch& touch,
                              const PatchLimits& limits, const PatchFans& fans)
{
    // A sphere's core is a point.
    const bool isPoint = a.vertexCount() == 1 || b.vertexCount() == 1;
    if (limits.most == 1 || isPoint || isTouchAlone(a, b, touch, limits.distance))
        return onlyTouch(touch);
    return makeWidePatch(a, b, touch, limits, fans);
}

ContactPatch makeWidePatch(const PosedShape& a, const PosedShape& b, const Touch& touch,
                           const PatchLimits& limits, const PatchFans& fans, const NormalMap* mapOfA)
{
    ContactFrame frame(touch.normal);
    PatchBuilder builder(touch, frame, limits);
    const PatchSide sideA = {a, ContactFace(a, -touch.normal, touch.vertexA, fans.a, mapOfA), -touch.onB};
    const PatchSide sideB = {b, ContactFace(b, touch.normal, touch.vertexB, fans.b),
                             b.origin() - a.origin() - touch.onB};
    if (std::min(sideA.face.alignment(), sideB.face.alignment()) < kLoneAlignment &&
        isLoneCorner(a, b, touch))
        return onlyTouch(touch);
    const double surplus = sideA.face.alignment() - sideB.face.alignment();
    const bool isAReference =
        surplus >= -kAligned && (surplus > kAligned || b.size() <= kMuchLarger * a.size());
    const PatchSide& reference = isAReference ? sideA : sideB;
    const PatchSide& other = isAReference ? sideB : sideA;
    btScalar noise = 0;
    if (reference.face.alignment() > kSteepest && other.face.corners().size() >= 2)
        noise = clipFaces(reference, other, isAReference, touch, limits.distance, frame, builder);
    builder.addTouch(noise);
    return builder.reduce();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
