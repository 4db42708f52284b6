// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/pair_distance.h"
#include "cullet/cuda/narrow/pair_search.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/polytope.h"
#include "cullet/cuda/narrow/posed_pair.h"

#include <cmath>
#include <cstdint>

namespace cullet::convex
{
/// A direction and how far A - B reaches along it, which is no less than the depth.
struct DepthBound
{
    Vec<double> outward;  ///< unit, from A to B
    double depth;
};

/// How a depth search has ended.
enum class DepthProof : std::uint8_t
{
    Whole,  ///< the record is complete
    Depth,  ///< the point is missing: rounding hides where A and B touch
    Full,   ///< a larger polytope may prove the depth
    None    ///< A - B has no volume up to rounding, or rounding has broken the polytope
};

/// The shape of a record in double.
CULLET_HOST_DEVICE inline PairDepth depthRecord(const DepthBound& bound, double gap,
                                                const Vec<double>& pointA)
{
    const double depth = bound.depth > 0.0 ? bound.depth : 0.0;
    const Vec<double> pointB = mulAdd(bound.outward, -depth, pointA);
    return {{float(-bound.outward.x), float(-bound.outward.y), float(-bound.outward.z)},
            float(depth),
            {float(pointB.x), float(pointB.y), float(pointB.z)},
            float(gap > 0.0 ? (gap < depth ? gap : depth) : 0.0)};
}

/// The point of A that touches B once A has been moved out of it: the closest one at a gap of a thousandth of the size.
CULLET_HOST_DEVICE inline Vec<double> touchingPoint(const PosedPair<double>& posed, const DepthBound& bound)
{
    const PosedPair<double> out = posed.moved(bound.outward * (-bound.depth - 1e-3 * posed.size()));
    PairSearch<double, SearchGoal::Distance> search(out);
    PairAxis axis = {{float(-bound.outward.x), float(-bound.outward.y), float(-bound.outward.z)},
                     kNoVertices};
    PairSimplex simplex = {{kNoVertices, kNoVertices, kNoVertices, kNoVertices}};
    search.run(axis, simplex, SearchStart::Axis);
    return closestOf(posed, search.simplex()).onA;
}

/// Expanding polytope algorithm (van den Bergen 2001) for one pair that overlaps, in double. It begins with supports
/// along directions that depend on the pair alone, so that nothing has to be kept from query to query, and the same
/// poses always give the same bits.
///
/// The least distance of a face of the polytope is a lower bound of the depth, the support along its normal an upper
/// one. Unlike usual, the origin may be outside of the polytope, beyond the faces with negative distances, which grow
/// first.
class DepthSearch
{
public:
    /// Bounds of the depth that agree to this, times the size, end a search; up to the second one they are a proof.
    static constexpr double kGapWanted = 1e-7, kGapAccepted = 1e-6;

    CULLET_HOST_DEVICE DepthSearch(const PosedPair<double>& pair, const PolytopeMemory& memory,
                                   std::uint32_t lane, std::uint32_t capacity)
        : m_pair(pair), m_polytope(memory, lane, capacity, pair.size()), m_size(pair.size())
    {
    }

    /// @param record [out] complete only if the result is Whole; else the normal, the depth and its gap are bounds
    CULLET_HOST_DEVICE DepthProof run(PairDepth& record)
    {
        DepthProof proof = enclose() ? grow() : DepthProof::None;
        if (proof == DepthProof::Whole && !findPoint())
            proof = DepthProof::Depth;
        const double least = m_least > 0.0 ? m_least : 0.0;
        record = depthRecord(m_best, m_best.depth - least, m_point);
        return proof;
    }

private:
    using Growth = GrownPolytope::Growth;

    /// A support point of A - B.
    struct Corner
    {
        Vec<double> point;
        VertexIds ids;
        double height;  ///< along the direction
    };

    /// Thinner polytopes, in units of the size, are taken as flat.
    static constexpr double kFlat = 1e-9;
    /// How far the touching point may be off, in units of the size.
    static constexpr double kMissAccepted = 1e-7;

    /// @param outward unit
    CULLET_HOST_DEVICE Corner supportAlong(const Vec<double>& outward, VertexIds near)
    {
        const AxisTest<double> test = m_pair.test(-outward, near);
        if (-test.along < m_best.depth)
            m_best = {outward, -test.along};
        return {m_pair.point(test.ids), test.ids, -test.along};
    }

    CULLET_HOST_DEVICE void keep(int i, const Corner& corner)
    {
        m_points[i] = corner.point;
        m_ids[i] = corner.ids;
    }

    /// Finds a tetrahedron between support points, towards the origin if there is a choice.
    ///
    /// @return false if A - B is flat
    CULLET_HOST_DEVICE bool enclose()
    {
        const Vec<double> offset = m_pair.offset();
        const double length2 = dot(offset, offset);
        const Vec<double> first =
            length2 > 0.0 ? offset * (1.0 / rootOf(length2)) : Vec<double>{1.0, 0.0, 0.0};
        keep(0, supportAlong(first, {-1, -1}));
        keep(1, supportAlong(-first, {-1, -1}));
        return addThird() && addFourth() && m_polytope.setTetrahedron(m_points, m_ids) == Growth::Grown;
    }

    CULLET_HOST_DEVICE bool addThird()
    {
        const Vec<double> edge = m_points[1] - m_points[0];
        const double length2 = dot(edge, edge);
        if (!(length2 > kFlat * kFlat * m_size * m_size))
            return false;
        Vec<double> across = mulAdd(edge, dot(m_points[0], edge) / length2, -m_points[0]);
        if (!(dot(across, across) > 1e-16 * m_size * m_size))
            across = acrossOf(edge);
        const Vec<double> unit = across * (1.0 / rootOf(dot(across, across)));
        const Vec<double> other = cross(unit, edge) * (1.0 / rootOf(length2));
        for (int k = 0; k < 4; ++k)
        {
            const Vec<double> direction = k < 2 ? unit : other;
            keep(2, supportAlong(k % 2 == 0 ? direction : -direction, m_ids[0]));
            const Vec<double> area = cross(edge, m_points[2] - m_points[0]);
            if (dot(area, area) > kFlat * kFlat * m_size * m_size * length2)
                return true;
        }
        return false;
    }

    CULLET_HOST_DEVICE bool addFourth()
    {
        const Vec<double> area = cross(m_points[1] - m_points[0], m_points[2] - m_points[0]);
        Vec<double> normal = area * (1.0 / rootOf(dot(area, area)));
        if (dot(normal, m_points[0]) > 0.0)
            normal = -normal;
        for (int k = 0; k < 2; ++k)
        {
            const Corner corner = supportAlong(normal, m_ids[2]);
            keep(3, corner);
            if (dot(normal, corner.point - m_points[0]) > kFlat * m_size)
                return true;
            normal = -normal;
        }
        return false;
    }

    /// A vector across another one, which is not 0.
    CULLET_HOST_DEVICE static Vec<double> acrossOf(const Vec<double>& v)
    {
        const double x = magnitude(v.x), y = magnitude(v.y), z = magnitude(v.z);
        if (x <= y && x <= z)
            return {0.0, v.z, -v.y};
        return y <= z ? Vec<double>{-v.z, 0.0, v.x} : Vec<double>{v.y, -v.x, 0.0};
    }

    CULLET_HOST_DEVICE DepthProof grow()
    {
        // Each step adds a vertex, and there are not more than the capacity.
        for (;;)
        {
            m_face = m_polytope.closest();
            m_least = m_face.plane.distance;
            const VertexIds near = m_polytope.idsOf(m_polytope.cornerOf(m_face.index, 0));
            const Corner corner = supportAlong(m_face.plane.normal, near);
            // Of several directions with the same depth, the one whose face has the point.
            const double gap = corner.height - m_least;
            if (gap <= kGapWanted * m_size || corner.height <= 0.0)
            {
                m_best = {m_face.plane.normal, corner.height};
                return corner.height <= 0.0 ? DepthProof::Depth : DepthProof::Whole;
            }
            const Growth growth = m_polytope.add(corner.point, corner.ids);
            if (growth != Growth::Grown)
                return growth == Growth::Full ? DepthProof::Full : DepthProof::None;
        }
    }

    /// @return false if the closest face has no point that is close enough to the origin's foot
    CULLET_HOST_DEVICE bool findPoint()
    {
        const double gap = m_best.depth - m_least;
        const GrownPolytope::Foot foot = m_polytope.footOf(m_face, gap);
        m_point = {0, 0, 0};
        for (int k = 0; k < 3; ++k)
            m_point = mulAdd(m_pair.pointA(m_polytope.idsOf(foot.vertex[k]).a), foot.weights[k], m_point);
        return foot.miss <= gap + kMissAccepted * m_size;
    }

    const PosedPair<double>& m_pair;
    GrownPolytope m_polytope;
    double m_size;
    Vec<double> m_points[4] = {};
    VertexIds m_ids[4] = {};
    DepthBound m_best = {{1.0, 0.0, 0.0}, INFINITY};
    double m_least = 0.0;  ///< lower bound of the depth
    GrownPolytope::Face m_face = {};
    Vec<double> m_point = {0, 0, 0};  ///< of A
};
}  // namespace cullet::convex
