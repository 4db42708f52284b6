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
using Eigen::Vector3d;

constexpr int kMostCorners = 16;

/// Two tangents of the contact and its normal: the frame in which a patch is made, with its origin in that of A.
struct Frame
{
    explicit Frame(const Vector3d& normal) : axes{Vector3d(), Vector3d(), normal}
    {
        // Duff et al. 2017, "Building an Orthonormal Basis, Revisited": without a root or a branch for special cases.
        const double sign = std::copysign(1.0, normal.z());
        const double a = -1.0 / (sign + normal.z());
        const double b = normal.x() * normal.y() * a;
        axes[0] = {1.0 + sign * normal.x() * normal.x() * a, sign * b, -sign * normal.x()};
        axes[1] = {b, sign + normal.y() * normal.y() * a, -normal.y()};
    }

    Vector3d local(const Vector3d& v) const { return {axes[0].dot(v), axes[1].dot(v), axes[2].dot(v)}; }
    Vector3d world(double x, double y, double z) const { return x * axes[0] + y * axes[1] + z * axes[2]; }

    std::array<Vector3d, 3> axes;
};

/// Corners of a convex polygon, or the ends of a segment, in the frame of the contact. Clipping by a plane adds one corner
/// at most.
struct Polygon
{
    using Coordinates = std::array<double, 2 * kMostCorners>;

    /// More corners than there is room for can only come from rounding, and are next to another.
    void add(double px, double py, double pz)
    {
        if (count == int(x.size()))
            return;
        const auto i = static_cast<std::size_t>(count++);
        x[i] = px;
        y[i] = py;
        z[i] = pz;
    }

    Coordinates x, y, z;
    int count = 0;
};

/// The face of a core that looks along a direction, in the frame of the contact.
struct Feature
{
    Polygon corners;    ///< seen against `normal`, less than three: an edge, or a corner
    double turn = 1.0;  ///< 1: counter-clockwise seen from the tip of the contact's normal; -1: clockwise
    Vector3d normal = Vector3d::Zero();  ///< outward, of any length; zero without a face
    double alignment = 0.0;              ///< cosine between the normal and the direction
};

class FeatureFinder
{
public:
    /// @param side   1 to look along the contact's normal, -1 to look against it
    /// @param vertex support vertex along that direction, or -1
    FeatureFinder(const PosedShape& shape, const Frame& frame, const Vector3d& shift, double side,
                  std::int32_t vertex, Feature& feature)
        : m_shape(shape),
          m_frame(frame),
          m_shift(frame.local(shift)),
          m_side(side),
          m_vertex(vertex),
          m_feature(feature)
    {
    }

    void find()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const bool isSegment = hull.kind() == HullKind::Segment && hull.vertexCount() == 2;
        if (!isSegment && hull.kind() != HullKind::Polygon && hull.kind() != HullKind::Solid)
            return;
        for (int k = 0; k < 3; ++k)
            m_columns[k] = m_frame.local({m_shape.row(0)[k], m_shape.row(1)[k], m_shape.row(2)[k]});
        if (!isSegment)
            return findFace();
        addCorner(0);
        addCorner(1);
    }

private:
    void addCorner(std::int32_t vertex)
    {
        const Hull<btScalar>& hull = m_shape.hull();
        const double x = hull.x()[vertex], y = hull.y()[vertex], z = hull.z()[vertex];
        const Vector3d p = m_columns[0] * x + m_columns[1] * y + m_columns[2] * z + m_shift;
        m_feature.corners.add(p.x(), p.y(), p.z());
    }

    void findFace()
    {
        const Hull<btScalar>& hull = m_shape.hull();
        turnNormals();
        if (m_vertex < 0)
            m_vertex = m_shape.support(m_side * m_frame.axes[2], -1).vertex;
        const auto faces = hull.facesOf(m_vertex);
        Best best;
        for (const std::int32_t face : faces)
            consider(face, best);
        // A vertex inside a face is no corner of any.
        for (std::int32_t face = 0; faces.size() == 0 && face < std::int32_t(hull.faces().size()); ++face)
            consider(face, best);
        if (best.face < 0)
            return;
        const Vector3d& n = hull.faces()[static_cast<std::size_t>(best.face)].normal;
        m_feature.normal = m_normals[0] * n.x() + m_normals[1] * n.y() + m_normals[2] * n.z();
        m_feature.alignment = std::sqrt(best.score);
        const auto corners = hull.faceVertices(best.face);
        const std::int32_t count = std::min<std::int32_t>(corners.size(), kMostCorners);
        for (std::int32_t i = 0; i < count; ++i)
            addCorner(corners[count == corners.size() ? i : i * corners.size() / count]);
    }

    /// Normals turn with the cofactors of the basis, and keep their side under a mirrored one.
    void turnNormals()
    {
        for (int k = 0; k < 3; ++k)
            m_normals[k] = m_columns[(k + 1) % 3].cross(m_columns[(k + 2) % 3]);
        m_feature.turn = m_side;
        if (m_normals[0].dot(m_columns[0]) >= 0.0)
            return;
        m_feature.turn = -m_side;
        for (Vector3d& normal : m_normals)
            normal = -normal;
    }

    struct Best
    {
        std::int32_t face = -1;
        double score = 0.0;  ///< square of the cosine
    };

    /// Without a branch, since no processor can guess which face is better.
    void consider(std::int32_t face, Best& best) const
    {
        const Vector3d& n = m_shape.hull().faces()[static_cast<std::size_t>(face)].normal;
        const Vector3d normal = m_normals[0] * n.x() + m_normals[1] * n.y() + m_normals[2] * n.z();
        const double along = m_side * normal.z();
        const double score = along * std::abs(along) / normal.squaredNorm();
        best.face = score > best.score ? face : best.face;
        best.score = std::max(best.score, score);
    }

    const PosedShape& m_shape;
    const Frame& m_frame;
    Vector3d m_shift;
    double m_side;
    std::int32_t m_vertex;
    std::array<Vector3d, 3> m_columns;  ///< of the basis
    std::array<Vector3d, 3> m_normals;  ///< of the matrix that turns normals
    Feature& m_feature;
};

/// Keeps what lies on the inner side of an edge (x, y) + t (dx, dy); `turn` as in Feature.
///
/// @return false if nothing was cut off, and `out` is as before
bool clip(const Polygon& in, double x, double y, double dx, double dy, Polygon& out)
{
    Polygon::Coordinates heights;
    const auto count = static_cast<std::size_t>(in.count);
    double lowest = 0.0;
    for (std::size_t i = 0; i < count; ++i)
    {
        heights[i] = dx * (in.y[i] - y) - dy * (in.x[i] - x);
        lowest = std::min(lowest, heights[i]);
    }
    if (lowest >= 0.0)
        return false;
    out.count = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (heights[i] >= 0.0)
            out.add(in.x[i], in.y[i], in.z[i]);
        // A segment has no edge back to its first end.
        const std::size_t next = i + 1 < count ? i + 1 : 0;
        if ((heights[i] >= 0.0) == (heights[next] >= 0.0) || (next == 0 && count == 2))
            continue;
        const double t = heights[i] / (heights[i] - heights[next]);
        out.add(in.x[i] + t * (in.x[next] - in.x[i]), in.y[i] + t * (in.y[next] - in.y[i]),
                in.z[i] + t * (in.z[next] - in.z[i]));
    }
    return true;
}

/// Corners of `face` inside the prism over `reference` along the contact's normal.
///
/// @param buffers scratch; the result may be one of them
const Polygon& clipToPrism(const Polygon& face, const Feature& reference, std::array<Polygon, 2>& buffers)
{
    const Polygon* current = &face;
    Polygon* out = buffers.data();
    const Polygon& base = reference.corners;
    const auto count = static_cast<std::size_t>(base.count);
    // A convex polygon grows by one corner per plane at most.
    for (std::size_t i = 0; i < count && current->count > 0; ++i)
    {
        const std::size_t next = i + 1 < count ? i + 1 : 0;
        const double dx = reference.turn * (base.x[next] - base.x[i]);
        const double dy = reference.turn * (base.y[next] - base.y[i]);
        if (!clip(*current, base.x[i], base.y[i], dx, dy, *out))
            continue;
        current = out;
        out = out == buffers.data() ? &buffers[1] : buffers.data();
    }
    return *current;
}

/// Candidate points in the frame of the contact, z on B, reduced to four at the end.
class PatchBuilder
{
public:
    PatchBuilder(const Touch& touch, const Frame& frame, double limit)
        : m_touch(touch), m_frame(frame), m_limit(limit), m_tolerance(1e-3 * (limit - touch.distance))
    {
    }

    void add(double x, double y, double z, double distance)
    {
        if (!(distance <= m_limit))
            return;
        m_points[static_cast<std::size_t>(m_count++)] = {x, y, z, distance};
        m_deepest = std::min(m_deepest, distance);
    }

    /// The touch itself, unless a candidate is as deep.
    void addTouch()
    {
        if (m_deepest <= m_touch.distance + 0.1 * m_tolerance)
            return;
        const Vector3d p = m_frame.local(m_touch.onB);
        add(p.x(), p.y(), p.z(), m_touch.distance);
    }

    ContactPatch reduce() const
    {
        ContactPatch patch;
        if (m_count <= 4)
        {
            for (int i = 0; i < m_count; ++i)
                take(i, patch);
        }
        else
            takeFour(patch);
        return patch;
    }

private:
    struct Candidate
    {
        double x, y, z, distance;
    };

    /// The deepest, the farthest from it, and the farthest on either side of the line through both. A candidate has to
    /// be better by a margin, so that noise does not choose other points in every frame.
    void takeFour(ContactPatch& patch) const
    {
        const int first = best([&](const Candidate& c) { return m_deepest - c.distance; }, m_tolerance);
        const Candidate& p = at(first);
        const auto farness2 = [&](const Candidate& c)
        { return (c.x - p.x) * (c.x - p.x) + (c.y - p.y) * (c.y - p.y); };
        const double size2 = farness2(at(best(farness2, 0.0)));
        const int second = best(farness2, 2e-3 * size2);
        const double dx = at(second).x - p.x, dy = at(second).y - p.y;
        const auto left = [&](const Candidate& c) { return dx * (c.y - p.y) - dy * (c.x - p.x); };
        const auto right = [&](const Candidate& c) { return -left(c); };
        const double smallest = 1e-3 * size2;
        const int third = best(left, smallest);
        const int fourth = best(right, smallest);
        take(first, patch);
        if (second != first)
            take(second, patch);
        if (left(at(third)) > smallest)
            take(third, patch);
        if (right(at(fourth)) > smallest)
            take(fourth, patch);
    }

    const Candidate& at(int i) const { return m_points[static_cast<std::size_t>(i)]; }

    void take(int i, ContactPatch& patch) const
    {
        const Candidate& c = at(i);
        patch.points[static_cast<std::size_t>(patch.count++)] = {m_frame.world(c.x, c.y, c.z), c.distance};
    }

    template <class Score>
    int best(const Score& score, double margin) const
    {
        int found = 0;
        double highest = score(at(0));
        for (int i = 1; i < m_count; ++i)
        {
            const double s = score(at(i));
            if (s > highest + margin)
            {
                found = i;
                highest = s;
            }
        }
        return found;
    }

    const Touch& m_touch;
    const Frame& m_frame;
    double m_limit;
    double m_tolerance;
    double m_deepest = HUGE_VAL;
    std::array<Candidate, 2 * kMostCorners + 1> m_points;
    int m_count = 0;
};

/// Below this cosine a plane is too steep to measure heights over it.
constexpr double kSteepest = 0.05;
}  // namespace

ContactPatch makeContactPatch(const PosedShape& a, const PosedShape& b, const Touch& touch, double limit)
{
    const Frame frame(touch.normal);
    PatchBuilder builder(touch, frame, limit);
    Feature ofA, ofB;
    FeatureFinder(a, frame, Vector3d::Zero(), -1.0, touch.vertexA, ofA).find();
    FeatureFinder(b, frame, b.origin() - a.origin(), 1.0, touch.vertexB, ofB).find();
    const bool isAReference = ofA.alignment >= ofB.alignment;
    const Feature& reference = isAReference ? ofA : ofB;
    const Feature& other = isAReference ? ofB : ofA;
    if (reference.alignment > kSteepest && other.corners.count >= 2)
    {
        std::array<Polygon, 2> buffers;
        const Polygon& clipped = clipToPrism(other.corners, reference, buffers);
        const Polygon& base = reference.corners;
        const double slopeX = reference.normal.x() / reference.normal.z();
        const double slopeY = reference.normal.y() / reference.normal.z();
        for (std::size_t i = 0; i < static_cast<std::size_t>(clipped.count); ++i)
        {
            const double x = clipped.x[i], y = clipped.y[i], z = clipped.z[i];
            const double plane = base.z[0] - slopeX * (x - base.x[0]) - slopeY * (y - base.y[0]);
            if (isAReference)
                builder.add(x, y, z, plane - z);
            else
                builder.add(x, y, plane, z - plane);
        }
    }
    builder.addTouch();
    return builder.reduce();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
