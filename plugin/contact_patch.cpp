// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/contact_patch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMostCorners = 16;

/// Corners of a convex polygon, or the ends of a segment. Clipping by a plane adds one corner at most.
struct Polygon
{
    std::array<Vector3d, 2 * kMostCorners> points;
    int count = 0;

    /// More corners than there is room for can only come from rounding, and are next to another.
    void add(const Vector3d& point)
    {
        if (count < int(points.size()))
            points[static_cast<std::size_t>(count++)] = point;
    }
    const Vector3d& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
};

/// The face of a core that looks along a direction.
struct Feature
{
    Polygon corners;  ///< counter-clockwise seen against `normal`; less than three: an edge, or a corner
    Vector3d normal = Vector3d::Zero();  ///< unit, outward; zero without a face
    double alignment = 0.0;              ///< cosine between the normal and the direction
};

/// Normals turn with the cofactors of the basis, and keep their side under a mirrored one.
Matrix3d cofactors(const Matrix3d& m, bool& isMirrored)
{
    Matrix3d c;
    c << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
    isMirrored = c.col(0).dot(m.col(0)) < 0.0;
    if (isMirrored)
        c = -c;
    return c;
}

class FeatureFinder
{
public:
    FeatureFinder(const PosedShape& shape, const Vector3d& shift, const Vector3d& direction, Feature& feature)
        : m_shape(shape), m_shift(shift), m_direction(direction), m_feature(feature)
    {
    }

    void find()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        if (hull.kind() == HullKind::Segment && hull.vertexCount() == 2)
        {
            m_feature.corners.add(place(0));
            m_feature.corners.add(place(1));
        }
        if (hull.kind() == HullKind::Polygon || hull.kind() == HullKind::Solid)
            findFace();
    }

private:
    Vector3d place(std::int32_t vertex) const { return m_shape.point(vertex) + m_shift; }

    void findFace()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        bool isMirrored;
        m_cofactors = cofactors(m_shape.basis(), isMirrored);
        m_local = m_cofactors.transpose() * m_direction;
        std::int32_t best = -1;
        const auto faces = hull.facesOf(m_shape.support(m_direction, -1).vertex);
        for (const std::int32_t face : faces)
            consider(face, best);
        // A vertex inside a face is no corner of any.
        for (std::int32_t face = 0; faces.size() == 0 && face < std::int32_t(hull.faces().size()); ++face)
            consider(face, best);
        if (best < 0)
            return;
        m_feature.normal = normalOf(best).stableNormalized();
        m_feature.alignment = m_feature.normal.dot(m_direction);
        takeCorners(hull.faceVertices(best), isMirrored);
    }

    Vector3d normalOf(std::int32_t face) const { return m_cofactors * localNormal(face); }
    const Vector3d& localNormal(std::int32_t face) const
    {
        return m_shape.hull().faces()[static_cast<std::size_t>(face)].normal;
    }

    /// Compares squares of cosines: no root for each face.
    void consider(std::int32_t face, std::int32_t& best)
    {
        const double along = localNormal(face).dot(m_local);
        const double square = along * along / normalOf(face).squaredNorm();
        if (!(along > 0.0 && square > m_alignment2))
            return;
        m_alignment2 = square;
        best = face;
    }

    void takeCorners(const Hull<btScalar>::Span& corners, bool isMirrored)
    {
        const std::int32_t count = std::min<std::int32_t>(corners.size(), kMostCorners);
        for (std::int32_t i = 0; i < count; ++i)
        {
            const std::int32_t step = isMirrored ? count - 1 - i : i;
            m_feature.corners.add(place(corners[step * corners.size() / count]));
        }
    }

    const PosedShape& m_shape;
    Vector3d m_shift, m_direction;
    Matrix3d m_cofactors;
    Vector3d m_local;  ///< the direction in the frame of the hull, as long as the cofactors make it
    double m_alignment2 = 0.0;
    Feature& m_feature;
};

/// Keeps the side of the plane where inward . (x - base) >= 0.
void clip(const Polygon& in, const Vector3d& base, const Vector3d& inward, Polygon& out)
{
    out.count = 0;
    double height = inward.dot(in[0] - base);
    for (int i = 0; i < in.count; ++i)
    {
        const Vector3d& here = in[i];
        const Vector3d& next = in[i + 1 < in.count ? i + 1 : 0];
        const double heightHere = height;
        height = inward.dot(next - base);
        if (heightHere >= 0.0)
            out.add(here);
        if ((heightHere >= 0.0) != (height >= 0.0))
            out.add(here + heightHere / (heightHere - height) * (next - here));
    }
}

/// Corners of `face` inside the prism over `reference` along the reference's direction.
///
/// @param buffers scratch; the result may be one of them
const Polygon& clipToPrism(const Polygon& face, const Feature& reference, const Vector3d& direction,
                           std::array<Polygon, 2>& buffers)
{
    const Polygon* current = &face;
    const Polygon& base = reference.corners;
    // A convex polygon grows by one corner per plane at most, a segment to three points.
    for (int i = 0; i < base.count && current->count > 0; ++i)
    {
        const Vector3d edge = base[i + 1 < base.count ? i + 1 : 0] - base[i];
        Polygon& next = buffers[static_cast<std::size_t>(i % 2)];
        clip(*current, base[i], direction.cross(edge), next);
        current = &next;
    }
    return *current;
}

/// Candidate points, reduced to four at the end.
class PatchBuilder
{
public:
    PatchBuilder(const Touch& touch, double limit)
        : m_touch(touch), m_limit(limit), m_tolerance(1e-3 * (limit - touch.distance))
    {
    }

    void add(const Vector3d& onB, double distance)
    {
        if (!(distance <= m_limit))
            return;
        m_points[static_cast<std::size_t>(m_count++)] = {onB, distance};
        m_deepest = std::min(m_deepest, distance);
    }

    /// The touch itself, unless a candidate is as deep.
    void addTouch()
    {
        if (!(m_deepest <= m_touch.distance + 0.1 * m_tolerance))
            add(m_touch.onB, m_touch.distance);
    }

    ContactPatch reduce() const
    {
        ContactPatch patch;
        const auto take = [&](int i)
        { patch.points[static_cast<std::size_t>(patch.count++)] = m_points[static_cast<std::size_t>(i)]; };
        if (m_count <= 4)
        {
            for (int i = 0; i < m_count; ++i)
                take(i);
            return patch;
        }
        // The deepest, the farthest from it, and the farthest on either side of the line through both. A candidate has
        // to be better by a margin, so that noise does not choose other points in every frame.
        const int first = best([&](int i) { return m_deepest - at(i).distance; }, m_tolerance);
        const Vector3d& p = at(first).onB;
        const auto farness = [&](int i) { return (at(i).onB - p).norm(); };
        const double size = farness(best(farness, 0.0));
        const int second = best(farness, 1e-3 * size);
        const Vector3d side = m_touch.normal.cross(at(second).onB - p);
        const auto left = [&](int i) { return side.dot(at(i).onB - p); };
        const auto right = [&](int i) { return -left(i); };
        const double smallest = 1e-3 * size * size;
        const int third = best(left, smallest);
        const int fourth = best(right, smallest);
        take(first);
        if (second != first)
            take(second);
        if (left(third) > smallest)
            take(third);
        if (right(fourth) > smallest)
            take(fourth);
        return patch;
    }

private:
    const ContactPoint& at(int i) const { return m_points[static_cast<std::size_t>(i)]; }

    template <class Score>
    int best(const Score& score, double margin) const
    {
        int found = 0;
        double highest = score(0);
        for (int i = 1; i < m_count; ++i)
        {
            const double s = score(i);
            if (s > highest + margin)
            {
                found = i;
                highest = s;
            }
        }
        return found;
    }

    const Touch& m_touch;
    double m_limit;
    double m_tolerance;
    double m_deepest = HUGE_VAL;
    std::array<ContactPoint, 2 * kMostCorners + 1> m_points;
    int m_count = 0;
};

/// Below this cosine a plane is too steep to measure heights over it.
constexpr double kSteepest = 0.05;
}  // namespace

ContactPatch makeContactPatch(const PosedShape& a, const PosedShape& b, const Touch& touch, double limit)
{
    PatchBuilder builder(touch, limit);
    Feature ofA, ofB;
    FeatureFinder(a, Vector3d::Zero(), -touch.normal, ofA).find();
    FeatureFinder(b, b.origin() - a.origin(), touch.normal, ofB).find();
    const bool isAReference = ofA.alignment >= ofB.alignment;
    const Feature& reference = isAReference ? ofA : ofB;
    const Feature& other = isAReference ? ofB : ofA;
    if (reference.alignment > kSteepest && other.corners.count >= 2)
    {
        const Vector3d direction = isAReference ? Vector3d(-touch.normal) : touch.normal;
        std::array<Polygon, 2> buffers;
        const Polygon& clipped = clipToPrism(other.corners, reference, direction, buffers);
        for (int i = 0; i < clipped.count; ++i)
        {
            const double height =
                reference.normal.dot(reference.corners[0] - clipped[i]) / reference.normal.dot(touch.normal);
            if (isAReference)
                builder.add(clipped[i], height);
            else
                builder.add(clipped[i] + height * touch.normal, -height);
        }
    }
    builder.addTouch();
    return builder.reduce();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
