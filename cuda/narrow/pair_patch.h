// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/posed_pair.h"
#include "cullet/cuda/narrow/turn.h"

#include <cmath>
#include <cstdint>

/// The points of a contact: where the faces that touch overlap, seen along the normal.
namespace cullet::convex
{
/// A point in the frame of a contact: coordinates across the normal, and along it.
struct FramePoint
{
    double x, y, z;
};

/// Two tangents of a contact and its normal.
class ContactFrame
{
public:
    /// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    ///
    /// @param normal unit
    CULLET_HOST_DEVICE explicit ContactFrame(const Vec<double>& normal) : m_normal(normal)
    {
        const double sign = normal.z < 0.0 ? -1.0 : 1.0;
        const double a = -1.0 / (sign + normal.z), b = normal.x * normal.y * a;
        m_x = {1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
        m_y = {b, sign + normal.y * normal.y * a, -normal.y};
    }

    CULLET_HOST_DEVICE const Vec<double>& x() const { return m_x; }
    CULLET_HOST_DEVICE const Vec<double>& y() const { return m_y; }
    CULLET_HOST_DEVICE const Vec<double>& normal() const { return m_normal; }

    CULLET_HOST_DEVICE FramePoint coordinatesOf(const Vec<double>& v) const
    {
        return {dot(m_x, v), dot(m_y, v), dot(m_normal, v)};
    }
    CULLET_HOST_DEVICE Vec<double> world(const FramePoint& p) const
    {
        return mulAdd(m_x, p.x, mulAdd(m_y, p.y, m_normal * p.z));
    }

private:
    Vec<double> m_x, m_y, m_normal;
};

/// The face of a hull that touches: of those around its support vertex the one that is best aligned with the outward
/// direction. Corners are in the frame of the contact.
class TouchingFace
{
public:
    /// @param sense 1 if the hull is on the lower side of the contact, -1 if it is on that of the normal
    /// @param place of the hull's origin
    CULLET_HOST_DEVICE TouchingFace(const SurfaceTables& tables, std::uint32_t index, const HullView& hull,
                                    const Turn<double>& turn, const ContactFrame& frame, double sense,
                                    const Vec<double>& place)
        : m_tables(&tables),
          m_hull(hull),
          m_x(turn.back(frame.x())),
          m_y(turn.back(frame.y())),
          m_z(turn.back(frame.normal())),
          m_place(frame.coordinatesOf(place))
    {
        const SurfaceRow& row = tables.rows[index];
        if (row.faces != 0)
            chooseFace(row, m_z * sense);
        else if (row.edges != 0)
            setSegment(tables.edges[row.firstEdge]);
    }

    /// Corners: none of a point or of a hull whose faces are unknown, two of a segment.
    CULLET_HOST_DEVICE std::uint32_t count() const { return m_count; }
    /// Cosine of the angle between the face's normal and the outward direction; -2: no face.
    CULLET_HOST_DEVICE double alignment() const { return m_alignment; }

    CULLET_HOST_DEVICE FramePoint corner(std::uint32_t i) const
    {
        const std::uint32_t vertex = m_ends[0] != m_ends[1] ? m_ends[i] : m_tables->corners[m_first + i];
        const Vec<double> v = m_hull.template vertex<double>(static_cast<std::int32_t>(vertex));
        return {dot(m_x, v) + m_place.x, dot(m_y, v) + m_place.y, dot(m_z, v) + m_place.z};
    }
    CULLET_HOST_DEVICE FramePoint cornerAfter(std::uint32_t i) const
    {
        return corner(i + 1 < m_count ? i + 1 : 0);
    }

    /// How high the plane of the face is at a place of the frame.
    ///
    /// @pre alignment() > 0
    CULLET_HOST_DEVICE double heightAt(double x, double y) const
    {
        return mulAdd(m_slopeX, x, mulAdd(m_slopeY, y, m_height));
    }

private:
    CULLET_HOST_DEVICE void chooseFace(const SurfaceRow& row, const Vec<double>& outward)
    {
        const auto vertex = static_cast<std::uint32_t>(m_hull.support(outward, -1).vertex);
        const std::uint32_t* const around = m_tables->around + row.firstVertex + vertex;
        Vec<double> best = {0, 0, 0};
        for (std::uint32_t i = around[0]; i < around[1]; ++i)
        {
            const HullFace& face = m_tables->faces[row.firstFace + m_tables->vertexFaces[i]];
            const Vec<double> normal = {double(face.normal[0]), double(face.normal[1]),
                                        double(face.normal[2])};
            const double alignment = dot(normal, outward);
            if (alignment > m_alignment)
            {
                m_alignment = alignment;
                best = normal;
                m_first = face.first;
                m_count = face.count;
            }
        }
        const FramePoint on = corner(0);
        const double scale = -1.0 / dot(m_z, best);
        m_slopeX = dot(m_x, best) * scale;
        m_slopeY = dot(m_y, best) * scale;
        m_height = on.z - (m_slopeX * on.x + m_slopeY * on.y);
    }

    CULLET_HOST_DEVICE void setSegment(const HullEdge& edge)
    {
        m_ends[0] = edge.from;
        m_ends[1] = edge.to;
        m_count = 2;
    }

    const SurfaceTables* m_tables;
    HullView m_hull;
    Vec<double> m_x, m_y, m_z;  ///< axes of the frame in those of the hull
    FramePoint m_place;
    double m_slopeX = 0.0, m_slopeY = 0.0, m_height = 0.0;  ///< of the face's plane
    double m_alignment = -2.0;
    std::uint32_t m_first = 0, m_count = 0;
    std::uint32_t m_ends[2] = {0, 0};  ///< of a segment
};

/// A point of a contact in its frame.
struct PatchPoint
{
    double x, y;
    double onB;  ///< height of the second body
    double depth;
};

/// The corners of the part of two faces that overlap along the normal, and are no farther apart than a margin.
///
/// The better aligned face is the reference: heights are measured between its plane and the other face. Each edge of
/// one face is cut to the prism over the other; what is left has two ends, which are the corners. Nothing is stored, so
/// that faces may have any number of corners.
class PatchCorners
{
public:
    CULLET_HOST_DEVICE PatchCorners(const TouchingFace& a, const TouchingFace& b, double deepest,
                                    double margin)
        : m_isAReference(a.alignment() >= b.alignment()),
          m_faces{m_isAReference ? a : b, m_isAReference ? b : a},
          m_deepest(deepest),
          m_margin(margin)
    {
    }

    /// Calls body(point) for each corner, in a fixed order; some more than once.
    template <class Body>
    CULLET_HOST_DEVICE void forEach(const Body& body) const
    {
        if (!(m_faces[0].alignment() > kSteepest))
            return;
        // One loop for the edges of both faces, so that a GPU has one copy of its body.
        for (int side = 1; side >= 0 && m_faces[side].count() >= 2; --side)
        {
            const TouchingFace& subject = m_faces[side];
            // A segment has no edge from its last end back to its first.
            const std::uint32_t edges = subject.count() == 2 ? 1 : subject.count();
            for (std::uint32_t i = 0; i < edges; ++i)
                cut(subject.corner(i), subject.cornerAfter(i), m_faces[1 - side], side == 0, body);
            if (subject.count() == 2 || !(subject.alignment() > kSteepest))
                return;
        }
    }

private:
    /// The plane of a face with a lower cosine is no measure of heights along the normal.
    static constexpr double kSteepest = 0.05;

    /// Cuts an edge to the prism over a face, and to the heights within the margin.
    template <class Body>
    CULLET_HOST_DEVICE void cut(const FramePoint& from, const FramePoint& to, const TouchingFace& face,
                                bool isOfReference, const Body& body) const
    {
        double first = 0.0, last = 1.0;
        // In the frame, faces of A are clockwise.
        const double sense = m_isAReference != isOfReference ? -1.0 : 1.0;
        FramePoint corner = face.corner(0);
        for (std::uint32_t i = 0; i < face.count(); ++i)
        {
            const FramePoint next = face.cornerAfter(i);
            const double x = sense * (next.x - corner.x), y = sense * (next.y - corner.y);
            limit(x * (from.y - corner.y) - y * (from.x - corner.x),
                  x * (to.y - corner.y) - y * (to.x - corner.x), first, last);
            corner = next;
        }
        const double depthFrom = depthOf(from, face, isOfReference),
                     depthTo = depthOf(to, face, isOfReference);
        limit(depthFrom + m_margin, depthTo + m_margin, first, last);
        if (!(first <= last))
            return;
        body(pointAt(from, to, depthFrom, depthTo, first, isOfReference));
        body(pointAt(from, to, depthFrom, depthTo, last, isOfReference));
    }

    /// Cuts the part of an edge where a linear function of it is negative.
    ///
    /// @param from, to values at its ends
    CULLET_HOST_DEVICE static void limit(double from, double to, double& first, double& last)
    {
        if (from < 0.0 && to < 0.0)
            last = -1.0;
        else if (from < 0.0)
            first = fmax(first, from / (from - to));
        else if (to < 0.0)
            last = fmin(last, from / (from - to));
    }

    /// The depth between a point of one face and the plane of the other.
    CULLET_HOST_DEVICE double depthOf(const FramePoint& p, const TouchingFace& face, bool isOfReference) const
    {
        const double plane = face.heightAt(p.x, p.y);
        return m_isAReference == isOfReference ? plane - p.z : p.z - plane;
    }

    CULLET_HOST_DEVICE PatchPoint pointAt(const FramePoint& from, const FramePoint& to, double depthFrom,
                                          double depthTo, double at, bool isOfReference) const
    {
        const double rest = 1.0 - at, z = rest * from.z + at * to.z;
        // The plane of a steep face goes on where the hull does not: no point is deeper than the pair.
        const double depth = fmin(rest * depthFrom + at * depthTo, m_deepest);
        return {rest * from.x + at * to.x, rest * from.y + at * to.y,
                m_isAReference == isOfReference ? z + depth : z, depth};
    }

    bool m_isAReference;
    TouchingFace m_faces[2];  ///< the reference, and the other one
    double m_deepest, m_margin;
};

/// Selects up to four points of a contact: the deepest, the one farthest from it, the one farthest from the line
/// through both, and the one that adds most to their triangle.
class PatchChoice
{
public:
    /// @param touch the deepest point of the pair
    /// @param distance points closer to each other count as one
    CULLET_HOST_DEVICE PatchChoice(const PatchCorners& corners, const PatchPoint& touch, double margin,
                                   double distance)
        : m_corners(corners)
    {
        m_corners.forEach(
            [&](const PatchPoint& p)
            {
                if (m_keptCount < kKept)
                    m_kept[m_keptCount] = p;
                ++m_keptCount;
            });
        const double least2 = distance * distance;
        // A corner that is nearly as deep as the touch is chosen instead of it.
        choose(0, touch, touch.depth - kNearlyAsDeep * (touch.depth + margin));
        m_count = 1;
        double least = least2;
        for (int place = 1; place < 4; ++place)
        {
            if (!choose(place, {}, least))
                return;
            m_count = static_cast<std::uint32_t>(place) + 1;
            const double x = m_points[1].x - m_points[0].x, y = m_points[1].y - m_points[0].y;
            // The area of a point at the least distance from a side: that between the first two for the third point; for
            // the fourth also the others, which are at most twice as long.
            least = place * rootOf((x * x + y * y) * least2);
        }
    }

    CULLET_HOST_DEVICE std::uint32_t count() const { return m_count; }
    CULLET_HOST_DEVICE const PatchPoint& point(std::uint32_t i) const { return m_points[i]; }

private:
    static constexpr double kNearlyAsDeep = 1e-3;
    /// Corners that are computed once; all are computed for each point if there are more.
    static constexpr std::uint32_t kKept = 16;

    /// Sets a point to the corner with the largest score, or to another point if none is above the least one.
    ///
    /// @return false in that case
    CULLET_HOST_DEVICE bool choose(int place, const PatchPoint& otherwise, double least)
    {
        double best = least;
        PatchPoint chosen = otherwise;
        const auto offer = [&](const PatchPoint& p)
        {
            const double value = scoreOf(place, p);
            if (value > best)
            {
                best = value;
                chosen = p;
            }
        };
        if (m_keptCount > kKept)
            m_corners.forEach(offer);
        else
        {
            for (std::uint32_t i = 0; i < m_keptCount; ++i)
                offer(m_kept[i]);
        }
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
        {
            if (i == place)
                m_points[i] = chosen;
        }
        return best > least;
    }

    CULLET_HOST_DEVICE double scoreOf(int place, const PatchPoint& p) const
    {
        if (place == 0)
            return p.depth;
        if (place == 1)
        {
            const double x = p.x - m_points[0].x, y = p.y - m_points[0].y;
            return x * x + y * y;
        }
        const double first = area(m_points[0], m_points[1], p);
        if (place == 2)
            return fabs(first);
        // How far outside of each side of the triangle.
        const double sense = area(m_points[0], m_points[1], m_points[2]) < 0.0 ? 1.0 : -1.0;
        return fmax(sense * first, fmax(sense * area(m_points[1], m_points[2], p),
                                        sense * area(m_points[2], m_points[0], p)));
    }

    /// Twice the area of a triangle, positive if it is counter-clockwise.
    CULLET_HOST_DEVICE static double area(const PatchPoint& a, const PatchPoint& b, const PatchPoint& c)
    {
        return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    }

    const PatchCorners& m_corners;
    PatchPoint m_kept[kKept];
    std::uint32_t m_keptCount = 0;  ///< corners, also those beyond kKept
    PatchPoint m_points[4] = {};    ///< indexed by constants only, so that they stay in registers
    std::uint32_t m_count = 0;
};
}  // namespace cullet::convex
