// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/bent_face.h"
#include "cullet/narrow/gjk/feature_side.h"
#include "cullet/narrow/gjk/vertex_pairs.h"
#include "cullet/narrow/hull/block_scan.h"
#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/hull/vertex_fan.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Times the size of two shapes: below this, searches may disagree on whether they touch, and on which of two depths is
/// less.
constexpr double kTouchUncertainty = 4e-7;

/// The closest or deepest points of two hulls, computed from their features: a vertex, edge or face of each hull.
///
/// A search ends at the same features on every path, but its rounding depends on the path. FeaturePair uses only the
/// features, in a canonical order, so that the answer is a function of shapes and poses, bit by bit. That requires
/// features at which every path ends: the points are strictly inside of them, and all other vertices strictly behind,
/// by far more than rounding; or two faces, or a face and an edge, are level up to rounding. Else the caller runs a
/// search without a cache.
///
/// By convexity, a property of the neighbours of a feature holds for its whole hull: features of an earlier pose that
/// pass the tests are the closest ones, and no search is needed. For a depth, the tests prove only a local minimum.
///
/// Cost: the neighbours of one or two vertices, and the corners of a face; without a graph, all points up to three
/// times, or the boxes of their blocks and the points of few.
template <class S>
class FeaturePair
{
public:
    using Shape = PosedHull<S>;

    FeaturePair(const Shape& a, const Shape& b)
        : m_a{a, a.basis()},
          m_b{b, b.basis()},
          m_offset(b.origin() - a.origin()),
          m_size(m_a.reach() + m_b.reach())
    {
    }

    /// @param pairs  of the simplex with the closest points, or of the triangle with the foot of the origin
    /// @param about  of any length, approximately from B to A
    /// @param isDeep the hulls overlap, and no other normal has so little depth, by kTouchUncertainty at least
    /// @return false if the features are not unique; then no other result is valid
    bool solve(const VertexPairs& pairs, const Eigen::Vector3d& about, bool isDeep)
    {
        m_isDeep = isDeep;
        m_about = about;
        const Ids ofA = distinctVertices(pairs.a, pairs.count), ofB = distinctVertices(pairs.b, pairs.count);
        return areValidIds(ofA, m_a.shape) && areValidIds(ofB, m_b.shape) &&
               (solveStrict(ofA, ofB) || solveLevel(ofA.id[0], ofB.id[0])) && isCertain();
    }

    /// As solve() for hulls that do not overlap, without a result if features are level.
    bool solveStrict(const VertexPairs& pairs, const Eigen::Vector3d& about)
    {
        m_isDeep = false;
        m_about = about;
        const Ids ofA = distinctVertices(pairs.a, pairs.count), ofB = distinctVertices(pairs.b, pairs.count);
        return areValidIds(ofA, m_a.shape) && areValidIds(ofB, m_b.shape) && solveStrict(ofA, ofB) &&
               isCertain();
    }

    /// As solve(), for two hulls of which one lies on a face of the other, from vertices of these: the lowest vertex over
    /// a face, or two level faces. Finds it after a move of the hulls. Of several vertices that are lowest up to rounding it
    /// takes one that depends on shapes and poses alone.
    ///
    /// @param vertexA, vertexB of the faces, with a graph; -1: unknown
    /// @param about of any length, approximately from B to A
    /// @param isOnA the face was one of A the last time, which saves time
    bool solveNearFaces(std::int32_t vertexA, std::int32_t vertexB, const Eigen::Vector3d& about, bool isOnA)
    {
        m_isDeep = false;
        m_about = about;
        m_areCorners = false;
        if (vertexA < 0 || vertexB < 0 || vertexA >= m_a.shape.vertexCount() ||
            vertexB >= m_b.shape.vertexCount())
            return false;
        NearFace likely = nearFace(isOnA, isOnA ? vertexA : vertexB);
        if (solveLowest(likely, true))
            return isCertain();
        // What is lowest over one face is a vertex of the other, whose face has nearly the same normal if they are level.
        std::int32_t &ofLikely = isOnA ? vertexA : vertexB, &ofOther = isOnA ? vertexB : vertexA;
        ofOther = likely.isFound() ? likely.lowest : ofOther;
        alignWith(likely);
        const NearFace other = nearFace(!isOnA, ofOther);
        const bool isLate = !likely.isFound() && other.isFound();
        if (isLate)
        {
            ofLikely = other.lowest;
            alignWith(other);
            likely = nearFace(isOnA, ofLikely);
        }
        if (solveLowest(other, true) || (isLate && solveLowest(likely, true)))
            return isCertain();
        // In the order of solve(). Without a graph it is unknown whether faces are level.
        const NearFace &ofA = isOnA ? likely : other, &ofB = isOnA ? other : likely;
        return (solveLevelFaces(vertexA, vertexB) ||
                (!isCloud(m_a) && !isCloud(m_b) && (solveLowest(ofA, false) || solveLowest(ofB, false)))) &&
               isCertain();
    }

    /// Of the features that solveNearFaces() has found: see solve().
    const VertexPairs& pairs() const { return m_pairs; }

    /// Unit, from B to A, world axes.
    const Eigen::Vector3d& normal() const { return m_normal; }
    /// Along the normal; if negative, minus the depth.
    double distance() const { return m_distance; }
    /// World axes, relative to the origin of A.
    const Eigen::Vector3d& pointOfB() const { return m_onB; }
    /// Support vertices against the normal and along it.
    std::int32_t vertexA() const { return m_vertexA; }
    std::int32_t vertexB() const { return m_vertexB; }
    /// The points are vertexA() and vertexB().
    bool areCorners() const { return m_areCorners; }

private:
    /// Thresholds for strictly inside, as a part of an edge or of the size, and for strictly behind, as a slope; far
    /// more than rounding. Expansions end before they tell apart normals that differ by less than the one for depths.
    static constexpr double kInside = 1e-9, kBentInside = 1e-5, kSlope = 1e-9, kDeepSlope = 1e-5;
    /// Far more than the rounding of a cached axis, which is a float.
    static constexpr double kRoundedSlope = 1e-6;
    /// kSlope for a face and its neighbours; the squares of lengths hide smaller slopes from a search.
    static constexpr double kFaceSlope = 1e-7;
    /// Tolerance of coplanar points, times the size; some hundred roundings.
    static constexpr double kPlane = 1e-13;
    /// Squared sine below which the normal of two directions is unreliable.
    static constexpr double kParallel2 = 1e-12;

    using Vector = Eigen::Vector3d;
    using Corners = typename Hull<S>::Span;
    using Ids = DistinctVertices;

    using Side = FeatureSide<S>;

    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    static bool areValidIds(const Ids& ids, const Shape& shape)
    {
        return ids.count > 0 && ids.id[0] >= 0 && ids.id[at(ids.count - 1)] < shape.vertexCount();
    }

    Vector pointB(std::int32_t vertex) const { return m_b.point(vertex) + m_offset; }

    /// Neither so near that a search may disagree, nor NaN.
    bool isCertain() const
    {
        const double sure = kTouchUncertainty * m_size;
        return m_isDeep ? m_distance < -sure : m_distance > sure;
    }

    bool solveStrict(const Ids& ofA, const Ids& ofB)
    {
        m_vertexA = ofA.id[0];
        m_vertexB = ofB.id[0];
        m_areCorners = false;
        if (ofA.count < 3 && ofB.count < 3)
            return solveEdges(ofA, ofB);
        return (ofA.count == 1 || ofB.count == 1) && solveFace(ofA, ofB);
    }

    // Edges and vertices

    bool solveEdges(const Ids& ofA, const Ids& ofB)
    {
        const Vector a = m_a.point(ofA.id[0]), b = pointB(ofB.id[0]);
        bool isSolved;
        if (ofA.count == 2 && ofB.count == 2)
            isSolved = solveCrossingEdges(a, m_a.point(ofA.id[1]) - a, b, pointB(ofB.id[1]) - b);
        else if (ofA.count == 2)
            isSolved = solveEdgeAndVertex(a, m_a.point(ofA.id[1]) - a, b, 1.0);
        else if (ofB.count == 2)
            isSolved = solveEdgeAndVertex(b, pointB(ofB.id[1]) - b, a, -1.0);
        else
            isSolved = solveVertices(a, b);
        m_areCorners = ofA.count == 1 && ofB.count == 1;
        return isSolved && isStrictEdge(m_a, ofA.id[0], ofA.id[1], -m_normal) &&
               isStrictEdge(m_b, ofB.id[0], ofB.id[1], m_normal);
    }

    /// @param to -1: the edge is a vertex
    bool isStrictEdge(const Side& side, std::int32_t from, std::int32_t to, const Vector& direction) const
    {
        return isStrictSupport(side, from, to, direction) &&
               (to < 0 || isStrictSupport(side, to, from, direction));
    }

    bool solveVertices(const Vector& a, const Vector& b)
    {
        m_onB = b;
        return setAlong(a - b);
    }

    bool setAlong(const Vector& v)
    {
        m_distance = std::sqrt(v.squaredNorm());
        if (m_isDeep || !(m_distance > 0.0))
            return false;
        m_normal = v * (1.0 / m_distance);
        return true;
    }

    /// @param side 1: the edge is A's; -1: B's
    bool solveEdgeAndVertex(const Vector& from, const Vector& edge, const Vector& vertex, double side)
    {
        const double length2 = edge.squaredNorm();
        if (!(length2 > 0.0))
            return false;
        const double part = edge.dot(vertex - from) / length2;
        const Vector foot = from + part * edge;
        m_onB = side > 0.0 ? vertex : foot;
        return isInsideEdge(part) && setAlong(side * (foot - vertex));
    }

    static bool isInsideEdge(double part) { return part > kInside && part < 1.0 - kInside; }

    bool solveCrossingEdges(const Vector& a, const Vector& edgeA, const Vector& b, const Vector& edgeB)
    {
        const Vector across = edgeA.cross(edgeB);
        const double across2 = across.squaredNorm();
        // A NaN makes the comparison false.
        if (!(across2 > kParallel2 * edgeA.squaredNorm() * edgeB.squaredNorm()))
            return false;
        m_normal = across * ((across.dot(m_about) < 0.0 ? -1.0 : 1.0) / std::sqrt(across2));
        const Vector apart = a - b;
        m_distance = m_normal.dot(apart);
        const double inverse = 1.0 / across2;
        const double partA = -apart.cross(edgeB).dot(across) * inverse;
        const double partB = -apart.cross(edgeA).dot(across) * inverse;
        m_onB = b + partB * edgeB;
        return isInsideEdge(partA) && isInsideEdge(partB);
    }

    // A face and a vertex

    /// A face in world axes, relative to the origin of its hull.
    struct Plane
    {
        Vector first;
        Vector ccwNormal;  ///< unit; counter-clockwise around it
    };

    bool solveFace(const Ids& ofA, const Ids& ofB)
    {
        const bool isOfA = ofA.count == 3;
        const Side &side = isOfA ? m_a : m_b, &other = isOfA ? m_b : m_a;
        const std::int32_t vertex = isOfA ? ofB.id[0] : ofA.id[0];
        const std::array<std::int32_t, 3>& three = isOfA ? ofA.id : ofB.id;
        ClearFace clear;
        Corners corners = {nullptr, nullptr};
        if (!isCloud(side))
            corners = faceOf(side, isOfA ? ofA : ofB, isOfA ? Vector(-m_about) : m_about);
        else if (findClearFace(side.hull(), three, clear))
            corners = {clear.corners.data(), clear.corners.data() + 3};
        else
            return false;
        Plane plane;
        const bool isFlat = corners.size() >= 3 && findPlane(side, corners, plane);
        if (!isFlat && !m_isDeep && corners.size() > 3)
            return solveBentFace(side, corners, other, vertex, isOfA);
        if (!isFlat)
            corners = {three.data(), three.data() + 3};
        if (!isFlat && !findPlane(side, corners, plane))
            return false;
        if (!setVertexOver(side, corners, plane, other, vertex, isOfA))
            return false;
        const Vector outward = isOfA ? Vector(-m_normal) : m_normal;
        return isFlat ? isOuterFace(side, plane, outward) && isStrictFace(side, corners, corners[0], outward)
                      : isStrictTriangle(side, three, outward);
    }

    /// At one corner the others of a bent face may be behind, and level at another corner.
    bool isStrictTriangle(const Side& side, const std::array<std::int32_t, 3>& three,
                          const Vector& direction) const
    {
        return isStrictSupport(side, three[0], three[1], direction, three[2]) &&
               isStrictSupport(side, three[1], three[2], direction, three[0]) &&
               isStrictSupport(side, three[2], three[0], direction, three[1]);
    }

    /// solveFace() for corners that rounding has moved off their plane. The triangle that is highest under the vertex is a
    /// face of the hull, whichever one the search has found.
    bool solveBentFace(const Side& side, const Corners& corners, const Side& other, std::int32_t vertex,
                       bool isOfA)
    {
        const Vector point = other.point(vertex) + (isOfA ? m_offset : Vector(-m_offset));
        const auto corner = [&](std::int32_t i) { return side.point(corners[i]); };
        const Vector normal = areaNormal(corners.size(), corner).normalized();
        std::array<std::int32_t, 3> three;
        if (!isInside(side, corners, normal, point, kBentInside) ||
            !findHighestTriangle(corners.size(), corner, normal, point, kPlane * double(side.shape.size()),
                                 three))
            return false;
        for (std::int32_t& id : three)
            id = corners[id];
        const Corners triangle = {three.data(), three.data() + 3};
        Plane plane;
        return findPlane(side, triangle, plane) &&
               setVertexOver(side, triangle, plane, other, vertex, isOfA) &&
               isStrictFace(side, corners, three[0], isOfA ? Vector(-m_normal) : m_normal);
    }

    /// Sets the answer of a vertex strictly over a face and strictly ahead of all other vertices of its hull.
    bool setVertexOver(const Side& side, const Corners& corners, const Plane& plane, const Side& other,
                       std::int32_t vertex, bool isOfA)
    {
        return setLowestOver(side, corners, plane, other, vertex, isOfA) &&
               isStrictSupport(other, vertex, -1, isOfA ? m_normal : Vector(-m_normal));
    }

    /// Sets the answer of a vertex strictly over a face, which is a lowest one of its hull.
    bool setLowestOver(const Side& side, const Corners& corners, const Plane& plane, const Side& other,
                       std::int32_t vertex, bool isOfA)
    {
        const Vector point = other.point(vertex) + (isOfA ? m_offset : Vector(-m_offset));
        // The foot of the least depth is always in the face.
        if (!m_isDeep && !isInside(side, corners, plane.ccwNormal, point, kInside))
            return false;
        setOver(plane, point, isOfA);
        (isOfA ? m_vertexA : m_vertexB) = corners[Side::firstOf(corners)];
        (isOfA ? m_vertexB : m_vertexA) = vertex;
        m_areCorners = false;
        return true;
    }

    static bool isCloud(const Side& side) { return side.hull().kind() == HullKind::Cloud; }

    /// Corners of the face that contains three vertices, towards a direction; none if it is unknown.
    static Corners faceOf(const Side& side, const Ids& ids, const Vector& direction)
    {
        const Hull<S>& hull = side.hull();
        const Vector local = side.basis.transpose() * direction;
        // A hull without thickness may have two faces of the same corners.
        const bool isPlane = hull.kind() == HullKind::Polygon && isFlattened(side, local, direction);
        const auto isTowards = [&](std::int32_t face)
        { return isPlane || local.dot(hull.faces()[static_cast<std::size_t>(face)].normal) >= 0.0; };
        for (const std::int32_t face : hull.facesOf(ids.id[0]))
        {
            const Corners corners = hull.faceVertices(face);
            int found = 0;
            for (const std::int32_t corner : corners)
                found += corner == ids.id[1] || corner == ids.id[2] ? 1 : 0;
            if (found == 2 && isTowards(face))
                return corners;
        }
        return {nullptr, nullptr};
    }

    /// Whether a basis flattens a hull across a direction, of which only rounding is left in the axes of the hull: as much
    /// as a float has, for a flat hull, whose two faces rounding would choose from.
    ///
    /// @param local the direction in the axes of the hull
    static bool isFlattened(const Side& side, const Vector& local, const Vector& direction)
    {
        const double least = side.hull().kind() == HullKind::Polygon ? kRoundedSlope : kSlope;
        const double norm = least * double(side.shape.norm());
        return !(local.squaredNorm() > norm * norm * direction.squaredNorm());
    }

    /// @return false if the corners are not in one plane
    static bool findPlane(const Side& side, const Corners& corners, Plane& plane)
    {
        return findPlane(
            side, corners, [&](std::int32_t i) { return side.point(corners[i]); }, plane);
    }

    /// @param corner gives the place of one of the corners
    template <class Corner>
    static bool findPlane(const Side& side, const Corners& corners, const Corner& corner, Plane& plane)
    {
        const std::int32_t count = corners.size(), first = Side::firstOf(corners);
        const double size = double(side.shape.size());
        plane.first = corner(first);
        const Vector across = (corner((first + count / 3) % count) - plane.first)
                                  .cross(corner((first + 2 * count / 3) % count) - plane.first);
        const double length = std::sqrt(across.squaredNorm());
        if (!(length > kParallel2 * size * size))
            return false;
        plane.ccwNormal = across * (1.0 / length);
        for (std::int32_t i = 1; count > 3 && i < count; ++i)
        {
            if (!(std::abs(plane.ccwNormal.dot(corner(i) - plane.first)) <= kPlane * size))
                return false;
        }
        return true;
    }

    /// A face of a hull with a graph, which several tests read.
    struct KnownFace
    {
        static constexpr std::int32_t kMostCorners = 16;

        const std::int32_t* corners = nullptr;  ///< of the hull; null: none
        std::array<Vector, kMostCorners> points;
        Plane plane;
        bool isFlat;
    };

    /// findPlane() for a face of levelFace().
    bool findPlaneOnce(const Side& side, const Corners& corners, Plane& plane)
    {
        if (corners.size() > KnownFace::kMostCorners)
            return findPlane(side, corners, plane);
        KnownFace& known = m_known[&side == &m_b ? 1 : 0];
        if (known.corners != corners.begin())
        {
            known.corners = corners.begin();
            for (std::int32_t i = 0; i < corners.size(); ++i)
                known.points[at(i)] = side.point(corners[i]);
            known.isFlat = findPlane(
                side, corners, [&](std::int32_t i) -> const Vector& { return known.points[at(i)]; },
                known.plane);
        }
        plane = known.plane;
        return known.isFlat;
    }

    /// Whether a point is strictly over or under a face, by a part of the size.
    bool isInside(const Side& side, const Corners& corners, const Vector& ccwNormal, const Vector& point,
                  double part) const
    {
        const KnownFace& known = m_known[&side == &m_b ? 1 : 0];
        return known.corners == corners.begin()
                   ? isInside(corners.size(), ccwNormal, point, part,
                              [&](std::int32_t i) -> const Vector& { return known.points[at(i)]; })
                   : isInside(corners.size(), ccwNormal, point, part,
                              [&](std::int32_t i) { return side.point(corners[i]); });
    }

    template <class Corner>
    bool isInside(std::int32_t count, const Vector& ccwNormal, const Vector& point, double part,
                  const Corner& corner) const
    {
        Vector last = corner(count - 1);
        for (std::int32_t i = 0; i < count; ++i)
        {
            const Vector next = corner(i), edge = next - last;
            // A NaN makes the comparison false.
            if (!(ccwNormal.dot(edge.cross(point - last)) > part * m_size * edge.cwiseAbs().sum()))
                return false;
            last = next;
        }
        return true;
    }

    /// Whether the hull of a face is behind it along a direction; false if the hull has turned over since an earlier
    /// pose.
    bool isOuterFace(const Side& side, const Plane& plane, const Vector& direction) const
    {
        // A flat hull has a face on both sides.
        return direction.dot(plane.first - side.basis * side.hull().centre()) >= -kInside * m_size;
    }

    /// @param point of the other hull, relative to the origin of the face's hull
    void setOver(const Plane& plane, const Vector& point, bool isOfA)
    {
        m_normal = plane.ccwNormal.dot(m_about) < 0.0 ? Vector(-plane.ccwNormal) : plane.ccwNormal;
        const double height = m_normal.dot(point - plane.first);
        m_distance = isOfA ? -height : height;
        m_onB = isOfA ? point : Vector(point + m_offset - m_distance * m_normal);
    }

    // The lowest vertex over a face that is nearly level

    struct NearFace
    {
        bool isOfA;
        Corners corners = {nullptr, nullptr};
        Plane plane = {};
        std::int32_t lowest = -1;  ///< vertex of the other hull

        bool isFound() const { return lowest >= 0; }
    };

    NearFace nearFace(bool isOfA, std::int32_t vertex)
    {
        const Side &side = isOfA ? m_a : m_b, &other = isOfA ? m_b : m_a;
        NearFace face = {isOfA};
        face.corners = levelFace(side, vertex, isOfA ? Vector(-m_about) : m_about);
        if (face.corners.size() < 3 || !other.isScanned() || !findPlaneOnce(side, face.corners, face.plane))
            return face;
        const bool isDownward = (face.plane.ccwNormal.dot(m_about) < 0.0) != isOfA;
        face.lowest = other.scanSupport(isDownward ? face.plane.ccwNormal : Vector(-face.plane.ccwNormal));
        return face;
    }

    /// Replaces the direction from B to A by the normal of a face that was found with it.
    void alignWith(const NearFace& face)
    {
        if (face.isFound())
            m_about = face.plane.ccwNormal.dot(m_about) < 0.0 ? Vector(-face.plane.ccwNormal)
                                                              : face.plane.ccwNormal;
    }

    bool solveLowest(const NearFace& face, bool isStrict)
    {
        const Side &side = face.isOfA ? m_a : m_b, &other = face.isOfA ? m_b : m_a;
        if (!face.isFound() ||
            !(isStrict ? setVertexOver(side, face.corners, face.plane, other, face.lowest, face.isOfA)
                       : setLowestOver(side, face.corners, face.plane, other, face.lowest, face.isOfA)))
            return false;
        const Vector outward = face.isOfA ? Vector(-m_normal) : m_normal;
        if (!isOuterFace(side, face.plane, outward) ||
            !isStrictFace(side, face.corners, face.corners[0], outward))
            return false;
        const std::array<std::int32_t, 3> three = {face.corners[0], face.corners[1], face.corners[2]},
                                          one = {face.lowest, face.lowest, face.lowest};
        m_pairs = face.isOfA ? VertexPairs{three, one, 3} : VertexPairs{one, three, 3};
        return true;
    }

    bool solveLevelFaces(std::int32_t vertexA, std::int32_t vertexB)
    {
        m_pairs = {{vertexA, -1, -1}, {vertexB, -1, -1}, 1};
        return solveLevel(vertexA, vertexB);
    }

    // Two faces, or a face and an edge, that are level; or a vertex over a diagonal of a face

    bool solveLevel(std::int32_t vertexA, std::int32_t vertexB)
    {
        return solveLevel(m_a, m_b, vertexA, vertexB, true) || solveLevel(m_b, m_a, vertexB, vertexA, false);
    }

    bool solveLevel(const Side& side, const Side& other, std::int32_t vertex, std::int32_t otherVertex,
                    bool isOfA)
    {
        const Corners corners = levelFace(side, vertex, isOfA ? Vector(-m_about) : m_about);
        Plane plane;
        if (corners.size() < 3)
            return false;
        if (!findPlaneOnce(side, corners, plane))
            return !m_isDeep && corners.size() > 3 && solveBentFace(side, corners, other, otherVertex, isOfA);
        const Vector offset = isOfA ? m_offset : Vector(-m_offset);
        const Corners above = levelFace(other, otherVertex, isOfA ? m_about : Vector(-m_about));
        if (above.size() >= 3 && areLevel(other, above, plane.ccwNormal))
            return setLevel(side, corners, plane, other, above, offset, isOfA) &&
                   isStrictFace(other, above, above[0], isOfA ? m_normal : Vector(-m_normal));
        std::array<std::int32_t, 2> edge;
        if (levelEdge(other, otherVertex, plane.ccwNormal, isOfA, edge))
            return setLevel(side, corners, plane, other, {edge.data(), edge.data() + 2}, offset, isOfA);
        // The foot is on a diagonal of the face.
        const auto outward = [&] { return isOfA ? Vector(-m_normal) : m_normal; };
        return !m_isDeep && setVertexOver(side, corners, plane, other, otherVertex, isOfA) &&
               isOuterFace(side, plane, outward()) && isStrictFace(side, corners, corners[0], outward());
    }

    /// The face at a vertex whose normal is nearest to a direction; none if all normals differ too much.
    static Corners levelFace(const Side& side, std::int32_t vertex, const Vector& direction)
    {
        // If the direction is parallel to the face's normal in the world, this is so in the hull's frame, however the
        // basis scales.
        const Vector local = side.basis.transpose() * direction;
        if (isCloud(side) || isFlattened(side, local, direction))
            return {nullptr, nullptr};
        double best = 0.999 * std::sqrt(local.squaredNorm());
        std::int32_t found = -1;
        for (const std::int32_t face : side.hull().facesOf(vertex))
        {
            const double along = local.dot(side.hull().faces()[static_cast<std::size_t>(face)].normal);
            found = along > best ? face : found;
            best = std::max(along, best);
        }
        return found < 0 ? Corners{nullptr, nullptr} : side.hull().faceVertices(found);
    }

    bool areLevel(const Side& side, const Corners& corners, const Vector& normal) const
    {
        const Vector first = side.point(corners[0]);
        return std::all_of(corners.begin(), corners.end(),
                           [&](std::int32_t corner)
                           { return std::abs(normal.dot(side.point(corner) - first)) <= kPlane * m_size; });
    }

    /// Finds the level edge at a vertex, its ends in ascending order; both ends are strictly ahead of all other
    /// vertices.
    bool levelEdge(const Side& side, std::int32_t vertex, const Vector& ccwNormal, bool isOfA,
                   std::array<std::int32_t, 2>& edge) const
    {
        const Vector first = side.point(vertex);
        std::int32_t other = -1;
        const Vector direction = (ccwNormal.dot(m_about) < 0.0) == isOfA ? Vector(-ccwNormal) : ccwNormal;
        const double level = kPlane * m_size;
        const bool isGraph = side.hull().hasNeighbours();
        const auto consider = [&](std::int32_t end)
        {
            const bool isLevel = end != vertex && std::abs(ccwNormal.dot(side.point(end) - first)) <= level;
            // The last one; points of a hull without a graph come in any order.
            other = isLevel && (isGraph || end > other) ? end : other;
            return true;
        };
        allOfNeighbours<S>(side.hull(), vertex, side.basis.transpose() * direction, kSlope, 2.0 * level,
                           consider);
        if (other < 0)
            return false;
        edge = {std::min(vertex, other), std::max(vertex, other)};
        return isStrictEdge(side, vertex, other, direction);
    }

    /// Sets the answer at the first corner that is over the other face: a corner of `above`, or of the face.
    bool setLevel(const Side& side, const Corners& corners, const Plane& plane, const Side& other,
                  const Corners& above, const Vector& offset, bool isOfA)
    {
        const Vector level = other.point(above[0]) + offset;
        setOver(plane, level, isOfA);
        (isOfA ? m_vertexA : m_vertexB) = corners[Side::firstOf(corners)];
        (isOfA ? m_vertexB : m_vertexA) = above[0];
        m_areCorners = false;
        if (!isStrictFace(side, corners, corners[0], isOfA ? Vector(-m_normal) : m_normal))
            return false;
        for (const std::int32_t corner : above)
        {
            const Vector point = other.point(corner) + offset;
            if (isInside(side, corners, plane.ccwNormal, point, kInside))
                return setLevelPoint(plane, point, level, isOfA), true;
        }
        Plane otherPlane;
        if (above.size() < 3 || !findPlane(other, above, otherPlane))
            return false;
        for (const std::int32_t corner : corners)
        {
            const Vector point = side.point(corner);
            if (isInside(other, above, otherPlane.ccwNormal, point - offset, kInside))
                return setLevelPoint(plane, point, level, isOfA), true;
        }
        return false;
    }

    /// Sets the two points that lie over each other at a place.
    ///
    /// @param level a point of the other hull's feature
    void setLevelPoint(const Plane& plane, const Vector& place, const Vector& level, bool isOfA)
    {
        const Vector point = place + plane.ccwNormal * plane.ccwNormal.dot(level - place);
        setOver(plane, point, isOfA);
    }

    // Supports

    /// Whether all neighbours of a vertex, except one or two, are strictly behind it along a direction.
    bool isStrictSupport(const Side& side, std::int32_t vertex, std::int32_t but, const Vector& direction,
                         std::int32_t alsoExcept = -1) const
    {
        const S clear = side.clearHeight(kSlope);
        if (!m_isDeep && but < 0 && side.shape.isStrictSupport(vertex, direction.template cast<S>(), clear))
            return true;
        const StrictlyBehind<S> isBehind(side, direction, m_isDeep ? kDeepSlope : kSlope);
        const Vector from = side.localPoint(vertex);
        return allOfHighNeighbours(side, isBehind.direction(), {vertex, but, alsoExcept},
                                   isBehind.longestFall(),
                                   [&](std::int32_t other) { return isBehind(other, from); });
    }

    /// Whether all points of a hull that are no corners of a face are behind its plane by the fall of the slope over the
    /// whole hull. By convexity the highest of them is a neighbour of a corner, so that a graph changes no answer.
    ///
    /// @param from a vertex in the plane
    bool isStrictFace(const Side& side, const Corners& corners, std::int32_t from,
                      const Vector& direction) const
    {
        const StrictlyBehind<S> isBehind(side, direction, kFaceSlope);
        const Vector& local = isBehind.direction();
        const double most = local.dot(side.localPoint(from)) - isBehind.longestFall();
        const auto isFarBehind = [&](std::int32_t vertex)
        { return local.dot(side.localPoint(vertex)) < most; };
        if (isCloud(side))
            return allOfHighNeighbours(side, local, {corners[0], corners[1], corners[2]},
                                       isBehind.longestFall(), isFarBehind);
        // A flat hull has no other points. Of few points it costs less to compare all.
        if (!side.hull().hasNeighbours() ||
            (side.isScanned() && side.countAbove(local, most) == corners.size()))
            return true;
        std::int32_t last = corners[corners.size() - 1];
        for (std::int32_t k = 0; k < corners.size(); ++k)
        {
            const std::int32_t corner = corners[k], next = corners[k + 1 < corners.size() ? k + 1 : 0];
            for (const std::int32_t other : side.hull().naturalNeighbours(corner))
            {
                if (other != last && other != next && !isFarBehind(other) &&
                    std::find(corners.begin(), corners.end(), other) == corners.end())
                    return false;
            }
            last = corner;
        }
        return true;
    }

    /// Whether visit(neighbour) is true for all neighbours of the first of three vertices, except for the three; without a
    /// graph, for all points that are higher along a direction, or lower by less than `fall`.
    ///
    /// @param local in the axes of the hull
    template <class Visit>
    static bool allOfHighNeighbours(const Side& side, const Vector& local,
                                    const std::array<std::int32_t, 3>& except, double fall,
                                    const Visit& visit)
    {
        if (!isCloud(side) || !side.hull().pointBlocks().isEmpty())
            return allOfNeighbours<S>(
                side.hull(), except[0], local, 0.0, fall,
                [&](std::int32_t other)
                { return other == except[0] || other == except[1] || other == except[2] || visit(other); });
        // Most points are farther behind than rounding and the fall.
        const double sure =
            32.0 * double(std::numeric_limits<S>::epsilon()) * side.hull().radius() * local.cwiseAbs().sum() +
            2.0 * fall;
        return isTrueNear<S>(side.hull(), local.template cast<S>(), except[0], static_cast<S>(sure), except,
                             visit);
    }

    const Side m_a, m_b;
    Vector m_offset;
    double m_size;
    bool m_isDeep = false;
    std::array<KnownFace, 2> m_known;  ///< of each hull
    VertexPairs m_pairs;
    Vector m_about, m_normal, m_onB;
    double m_distance = 0.0;
    std::int32_t m_vertexA = -1, m_vertexB = -1;
    bool m_areCorners = false;
};
}  // namespace cullet
