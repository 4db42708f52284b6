// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/pair_depth.h"
#include "cullet/cuda/narrow/posed_pair.h"

#include <cmath>
#include <cstdint>

namespace cullet::convex
{
/// The surface of one hull of a pair, in world axes.
class PosedSurface
{
public:
    struct Edge
    {
        Vec<double> point, along;
        Vec<double> left, right;  ///< outer normals of the faces on its sides; 0 without faces
    };

    /// @param sign 1, or -1 for the hull mirrored at its origin
    CULLET_HOST_DEVICE PosedSurface(const SurfaceTables& tables, std::uint32_t index, const HullView& hull,
                                    const Turn<double>& turn, double sign)
        : m_tables(tables), m_row(tables.rows[index]), m_hull(hull), m_turn(turn), m_sign(sign)
    {
    }

    CULLET_HOST_DEVICE std::uint32_t faces() const { return m_row.faces; }
    CULLET_HOST_DEVICE std::uint32_t edges() const { return m_row.edges; }

    CULLET_HOST_DEVICE Vec<double> normal(std::uint32_t face) const
    {
        if (face == HullEdge::kNoFace)
            return {0, 0, 0};
        const float* const normal = m_tables.faces[m_row.firstFace + face].normal;
        const Vec<double> v = {double(normal[0]), double(normal[1]), double(normal[2])};
        return m_turn.forward(v * (m_sign / rootOf(dot(v, v))));
    }

    CULLET_HOST_DEVICE Edge edge(std::uint32_t index) const
    {
        const HullEdge& edge = m_tables.edges[m_row.firstEdge + index];
        const Vec<double> from = point(edge.from);
        return {from, point(edge.to) - from, normal(edge.left), normal(edge.right)};
    }

private:
    CULLET_HOST_DEVICE Vec<double> point(std::uint32_t vertex) const
    {
        return m_turn.forward(m_hull.template vertex<double>(static_cast<std::int32_t>(vertex))) * m_sign;
    }

    const SurfaceTables& m_tables;
    SurfaceRow m_row;
    const HullView& m_hull;
    const Turn<double>& m_turn;
    double m_sign;
};

/// The least bound so far, and which feature of A - B it is of. Of equal ones the first is the least, so that the order
/// in which features are examined does not matter.
struct LeastBound
{
    DepthBound bound = {{1.0, 0.0, 0.0}, INFINITY};
    std::uint64_t feature = ~std::uint64_t{0};

    CULLET_HOST_DEVICE void take(const LeastBound& other)
    {
        if (other.bound.depth < bound.depth || (other.bound.depth == bound.depth && other.feature < feature))
            *this = other;
    }
};

/// Depth of a pair by all faces of A - B: those of A, those of B, and one for each pair of edges whose arcs cross on the
/// Gauss map (Gregorius 2013; narrow/epa/exact_penetration.h). A face too many does no harm, since each is a bound.
class FeatureDepths
{
public:
    /// @param a, b indices of the hulls
    CULLET_HOST_DEVICE FeatureDepths(const PosedPair<double>& pair, const SurfaceTables& tables,
                                     std::uint32_t a, std::uint32_t b)
        : m_pair(pair),
          m_a(tables, a, pair.hullA(), pair.turnA(), 1.0),
          m_b(tables, b, pair.hullB(), pair.turnB(), -1.0)
    {
    }

    CULLET_HOST_DEVICE std::uint64_t features() const
    {
        return std::uint64_t{m_a.faces()} + m_b.faces() + std::uint64_t{m_a.edges()} * m_b.edges();
    }

    /// Examines one feature.
    ///
    /// @param index less than features()
    CULLET_HOST_DEVICE void examine(std::uint64_t index, LeastBound& least) const
    {
        const std::uint64_t faces = std::uint64_t{m_a.faces()} + m_b.faces();
        if (index < m_a.faces())
            offer(m_a.normal(static_cast<std::uint32_t>(index)), index, least);
        else if (index < faces)
            offer(m_b.normal(static_cast<std::uint32_t>(index - m_a.faces())), index, least);
        else
        {
            const std::uint64_t edges = index - faces;
            const PosedSurface::Edge a = m_a.edge(static_cast<std::uint32_t>(edges / m_b.edges()));
            const PosedSurface::Edge b = m_b.edge(static_cast<std::uint32_t>(edges % m_b.edges()));
            if (areCrossing(a, b))
                offerEdges(a, b, index, least);
        }
    }

private:
    /// Products of a normal and a sum of unit normals below this may be rounding.
    static constexpr double kNoSide = 1e-6;

    CULLET_HOST_DEVICE static bool areCrossing(const PosedSurface::Edge& a, const PosedSurface::Edge& b)
    {
        const Vec<double> acrossA = cross(a.right, a.left);
        const double leftB = dot(b.left, acrossA), rightB = dot(b.right, acrossA);
        if (leftB * rightB > 0.0)
            return false;
        const Vec<double> acrossB = cross(b.right, b.left);
        const double leftA = dot(a.left, acrossB), rightA = dot(a.right, acrossB);
        return leftA * rightA <= 0.0 && leftB * rightA >= 0.0;
    }

    CULLET_HOST_DEVICE void offerEdges(const PosedSurface::Edge& a, const PosedSurface::Edge& b,
                                       std::uint64_t feature, LeastBound& least) const
    {
        const Vec<double> scaled = cross(a.along, b.along);
        const double length2 = dot(scaled, scaled);
        if (!(length2 > 1e-24 * dot(a.along, a.along) * dot(b.along, b.along)))
            return;
        const Vec<double> normal = scaled * (1.0 / rootOf(length2));
        const double side = dot(normal, a.left + a.right + b.left + b.right);
        const double height = dot(normal, a.point + b.point - m_pair.offset());
        // Segments and polygons, whose normals are opposite, have a face on both sides.
        if (side > -kNoSide && height < least.bound.depth)
            offer(normal, feature, least);
        if (side < kNoSide && -height < least.bound.depth)
            offer(-normal, feature, least);
    }

    CULLET_HOST_DEVICE void offer(const Vec<double>& outward, std::uint64_t feature, LeastBound& least) const
    {
        const AxisTest<double> test = m_pair.test(-outward, {-1, -1});
        least.take({{outward, -test.along}, feature});
    }

    const PosedPair<double>& m_pair;
    PosedSurface m_a, m_b;
};
}  // namespace cullet::convex
