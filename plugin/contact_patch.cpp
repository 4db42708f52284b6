// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/contact_patch.h"

#include "plugin/contact_feature.h"

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

/// Keeps what lies on the inner side of an edge (x, y) + t (dx, dy); `turn` as in ContactFeature.
///
/// @return false if nothing was cut off, and `out` is as before
bool clip(const ContactPolygon& in, double x, double y, double dx, double dy, ContactPolygon& out)
{
    ContactPolygon::Coordinates heights;
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
const ContactPolygon& clipToPrism(const ContactPolygon& face, const ContactFeature& reference,
                                  std::array<ContactPolygon, 2>& buffers)
{
    const ContactPolygon* current = &face;
    ContactPolygon* out = buffers.data();
    const ContactPolygon& base = reference.corners;
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
    PatchBuilder(const Touch& touch, const ContactFrame& frame, double limit)
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
    const ContactFrame& m_frame;
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
    const ContactFrame frame(touch.normal);
    PatchBuilder builder(touch, frame, limit);
    ContactFeature ofA, ofB;
    FeatureFinder(a, frame, Vector3d::Zero(), -1.0, touch.vertexA, ofA).find();
    FeatureFinder(b, frame, b.origin() - a.origin(), 1.0, touch.vertexB, ofB).find();
    const bool isAReference = ofA.alignment >= ofB.alignment;
    const ContactFeature& reference = isAReference ? ofA : ofB;
    const ContactFeature& other = isAReference ? ofB : ofA;
    if (reference.alignment > kSteepest && other.corners.count >= 2)
    {
        std::array<ContactPolygon, 2> buffers;
        const ContactPolygon& clipped = clipToPrism(other.corners, reference, buffers);
        const ContactPolygon& base = reference.corners;
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
