// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/fuzz/hulls/lattice_hull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

/// The queries of one pair of hulls, in one order, against the exact answer.
namespace cullet::test
{
using LongPoint = Vector3<long double>;
using LongPoints = std::vector<LongPoint>;

/// The exact answer in world units, and how far the answers of a precision may be from it, as gjk_types.h and
/// penetration_result.h document it.
template <class S>
struct PairTruth
{
    PairTruth(const LatticeTruth& lattice, long double unit)
        : isSeparated(lattice.isSeparated),
          isFlat(lattice.isFlat),
          distance(lattice.distance * unit),
          depth(lattice.depth * unit),
          rounding((sizeof(S) == sizeof(float) ? 4e-7L : 1e-13L) * lattice.size * unit),
          touching(1e-7L * lattice.size * unit + rounding)
    {
    }

    bool isSeparated, isFlat;
    long double distance, depth;
    long double rounding;  ///< of numbers and points
    long double touching;  ///< up to here a state is undecided
};

/// What queries return, for comparisons bit by bit.
template <class S>
struct PairAnswers
{
    GjkResult<S> isa, near;
    PenetrationResult<S> deep;
};

template <class S>
bool isSameAnswer(const GjkResult<S>& a, const GjkResult<S>& b)
{
    return a.state == b.state && a.distance == b.distance && a.axis == b.axis && a.pointA == b.pointA &&
           a.pointB == b.pointB;
}

template <class S>
bool isSameAnswer(const PenetrationResult<S>& a, const PenetrationResult<S>& b)
{
    return a.state == b.state && a.depth == b.depth && a.axis == b.axis && a.pointA == b.pointA &&
           a.pointB == b.pointB && a.vertexA == b.vertexA && a.vertexB == b.vertexB;
}

template <class S>
class HullPairCheck
{
public:
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// @param a, b  points in the world
    HullPairCheck(const LatticePoints& a, const LatticePoints& b, const Lattice& originA, long double unit,
                  const PairTruth<S>& truth)
        : m_a(relative(a, originA, unit)),
          m_b(relative(b, originA, unit)),
          m_truth(truth),
          m_place(std::numeric_limits<S>::epsilon() * std::max(reachOf(m_a), reachOf(m_b)))
    {
    }

    /// Asks all queries, each with a copy of a cache.
    ///
    /// @param name  of the cache, for the message
    PairAnswers<S> ask(const PosedHull<S>& a, const PosedHull<S>& b, S limit, const GjkCache<S>& cache,
                       const char* name)
    {
        m_name = name;
        PairAnswers<S> answers;
        GjkCache<S> used = cache;
        answers.isa = isaGjk(a, b, S(0), used);
        checkBoolean(answers.isa, S(0));
        // The cache that one kind of query leaves is one for the next.
        checkBoolean(isaGjk(a, b, limit, used), limit);
        used = cache;
        answers.near = gjkDistance(a, b, std::numeric_limits<S>::infinity(), used);
        checkDistance(answers.near, std::numeric_limits<S>::infinity());
        checkDistance(gjkDistance(a, b, limit, used), limit);
        used = cache;
        answers.deep = penetration(a, b, used);
        checkDepth(answers.deep);
        return answers;
    }

    /// The depth from a remembered surface, if that proves one.
    void askRemembered(const PosedHull<S>& a, const PosedHull<S>& b, GjkCache<S>& cache, EpaCache& memory)
    {
        m_name = "remembered surface";
        const PenetrationResult<S> result = rememberedPenetration(a, b, cache, memory);
        if (result.state == GjkState::Overlapping)
            checkDepth(result);
        else
            require(result.state == GjkState::NotConverged && memory.vertexCount == 0,
                    "rememberedPenetration() keeps a surface that proves nothing");
    }

    void checkExactPenetration(const PosedHull<S>& a, const PosedHull<S>& b)
    {
        m_name = "no cache";
        if (m_truth.isSeparated)
            return;
        Eigen::Vector3d normal;
        double depth = 0;
        const bool isKnown = exactPenetration(a, b, normal, depth);
        require(isKnown || m_truth.isFlat, "exactPenetration() knows no depth");
        if (!isKnown)
            return;
        const long double tolerance = m_truth.rounding * (sizeof(S) == sizeof(float) ? 1e-6L : 1.0L);
        require(std::abs(depth - m_truth.depth) <= tolerance, "exactPenetration() is ", depth, " instead of ",
                m_truth.depth);
        require(std::abs(extentAlong(toLong(normal)) - depth) <= tolerance,
                "exactPenetration(): the normal has extent ", extentAlong(toLong(normal)), ", not ", depth);
    }

    /// Empty where all is well.
    const std::string& error() const { return m_error; }

    template <class... Parts>
    void require(bool isTrue, const Parts&... parts)
    {
        if (isTrue || !m_error.empty())
            return;
        std::ostringstream text;
        text.precision(12);
        text << (sizeof(S) == sizeof(float) ? "float, " : "double, ") << m_name << ": ";
        (text << ... << parts);
        text << " (exact distance " << m_truth.distance << ", depth " << m_truth.depth << ", rounding "
             << m_truth.rounding << ")";
        m_error = text.str();
    }

private:
    static LongPoints relative(const LatticePoints& points, const Lattice& origin, long double unit)
    {
        LongPoints converted;
        for (const Lattice& point : points)
        {
            const Lattice p = minus(point, origin);
            const auto at = [&](std::size_t i) { return static_cast<long double>(p[i]) * unit; };
            converted.push_back({at(0), at(1), at(2)});
        }
        return converted;
    }

    template <class V>
    static LongPoint toLong(const V& v)
    {
        return {static_cast<long double>(v[0]), static_cast<long double>(v[1]),
                static_cast<long double>(v[2])};
    }

    /// Largest extent of A - B along a direction.
    long double extentAlong(const LongPoint& direction) const
    {
        return (highest(m_a, direction) - lowest(m_b, direction)) / lengthOf(direction);
    }

    /// Gap between A and B along an axis from B to A.
    template <class V>
    long double gapAlong(const V& axis) const
    {
        const LongPoint direction = toLong(axis);
        return (lowest(m_a, direction) - highest(m_b, direction)) / lengthOf(direction);
    }

    void checkState(const char* query, GjkState state, S limit)
    {
        require(state != GjkState::NotConverged, query, " does not converge");
        if (state == GjkState::Overlapping)
            require(m_truth.distance <= m_truth.touching, query, " is Overlapping");
        else
            require(m_truth.isSeparated || m_truth.depth <= m_truth.touching, query, " is not Overlapping");
        const auto most = static_cast<long double>(limit);
        if (state == GjkState::Separated)
            require(m_truth.distance >= most - m_truth.touching, query, " is Separated by ", limit);
        else if (state == GjkState::Near)
            require(m_truth.distance <= most + m_truth.touching, query, " is Near within ", limit);
    }

    void checkBoolean(const GjkResult<S>& result, S limit)
    {
        checkState("isaGjk()", result.state, limit);
        if (result.state != GjkState::Near && result.state != GjkState::Separated)
            return;
        require(result.axis.allFinite() && !result.axis.isZero(S(0)), "isaGjk() has no axis");
        const long double gap = m_error.empty() ? gapAlong(result.axis) : 0;
        const long double least = result.state == GjkState::Separated ? static_cast<long double>(limit) : 0;
        require(gap >= least - m_truth.rounding || !m_error.empty(), "the axis of isaGjk() has gap ", gap,
                ", not ", least);
    }

    void checkUnit(const Vector& axis)
    {
        require(std::abs(axis.norm() - S(1)) <= 4 * std::numeric_limits<S>::epsilon(), "the axis has length ",
                axis.norm());
    }

    /// @param between exact distance of the points, and `length` that of the answer
    void checkPoints(const Vector& pointA, const Vector& pointB, const Vector& along)
    {
        require(pointA.allFinite() && pointB.allFinite(), "a point is not finite");
        if (!m_error.empty())
            return;
        const long double outA = solveLattice<long double>({toLong(pointA)}, m_a).distance;
        const long double outB = solveLattice<long double>({toLong(pointB)}, m_b).distance;
        const long double allowed = m_truth.touching + m_place;
        require(outA <= allowed, "point A is outside of A by ", outA, ", allowed ", allowed);
        require(outB <= allowed, "point B is outside of B by ", outB, ", allowed ", allowed);
        const long double off = lengthOf(toLong(Vector(pointA - pointB - along)));
        require(off <= allowed, "the points differ from axis and length by ", off, ", allowed ", allowed);
    }

    void checkDistance(const GjkResult<S>& result, S limit)
    {
        checkState("gjkDistance()", result.state, limit);
        if (result.state != GjkState::Near && result.state != GjkState::Separated)
            return;
        checkUnit(result.axis);
        const long double gap = gapAlong(result.axis);
        if (result.state == GjkState::Separated)
        {
            require(gap >= limit - m_truth.rounding, "the axis of gjkDistance() has gap ", gap, ", not ",
                    limit);
            return;
        }
        require(std::abs(result.distance - m_truth.distance) <= m_truth.rounding, "gjkDistance() is ",
                result.distance);
        require(gap >= m_truth.distance - m_truth.touching, "the axis of gjkDistance() has gap ", gap);
        checkPoints(result.pointA, result.pointB, result.distance * result.axis);
    }

    void checkDepth(const PenetrationResult<S>& result)
    {
        checkState("penetration()", result.state, S(0));
        if (result.state != GjkState::Overlapping)
            return;
        checkUnit(result.axis);
        require(result.depth >= S(0) && result.dualGap >= S(0), "depth ", result.depth, ", dual gap ",
                result.dualGap);
        require(result.depth - m_truth.depth >= -m_truth.touching &&
                    result.depth - result.dualGap - m_truth.depth <= m_truth.touching,
                "penetration() is ", result.depth, ", dual gap ", result.dualGap);
        const long double extent = extentAlong(toLong(Vector(-result.axis)));
        require(std::abs(extent - result.depth) <= m_truth.touching, "A moved by depth ", result.depth,
                " along an axis of extent ", extent, " does not touch");
        checkPoints(result.pointA, result.pointB, -result.depth * result.axis);
    }

    static long double reachOf(const LongPoints& points)
    {
        long double reach = 0;
        for (const LongPoint& point : points)
            reach = std::max(reach, lengthOf(point));
        return reach;
    }

    LongPoints m_a, m_b;  ///< relative to the origin of A
    const PairTruth<S> m_truth;
    /// Points are relative to the origin of A, from which both hulls may be much farther than from each other. The nearest
    /// point with coordinates in S is off by up to u = eps / 2 of its distance, which no size bounds; both points together
    /// by eps.
    const long double m_place;
    const char* m_name = "";
    std::string m_error;
};
}  // namespace cullet::test
