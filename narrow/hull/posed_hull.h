// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/paired_climb.h"
#include "cullet/narrow/hull/support.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace cullet
{
/// A support point in world axes, relative to the origin() of its shape.
struct SupportPoint
{
    Eigen::Vector3d point;
    std::int32_t
        vertex;  ///< id that point() turns into the same point later, or -1 if the shape has no vertices
};

/// A hull with a pose in the world, and the interface that the queries expect of any convex shape:
///
/// * `Vector3d origin()`, in world space, exact: all other points are relative to it, so that no precision is lost far
///    from the world's origin (the difference of two origins is taken in double).
///  * `SupportPoint support(const Vector3d& direction, int32_t start)`: farthest point along a world direction of any
///    length; `start` is a vertex that is likely near the answer, or -1.
///  * `Vector3d point(int32_t vertex)`: for 0 <= vertex < vertexCount(); a shape without vertices returns 0 there.
///  * `Vector3d centre()`: any inner point, as a first guess.
///
/// The world position of a vertex is basis * vertex + origin, evaluated in double. The basis is a rotation, or any
/// linear map that can be inverted, mirrored and unequal scales included: a linear map keeps the graph of a hull.
template <class S>
class PosedHull
{
public:
    using Scalar = S;
    using Vector = Eigen::Matrix<S, 3, 1>;
    using Matrix = Eigen::Matrix<S, 3, 3>;
    using Quad = typename cullet::Quad<S>::Vector;

    /// @pre the hull has a vertex and outlives this object
    PosedHull(const Hull<S>& hull, const Matrix& basis, const Vector& origin,
              SupportMethod method = SupportMethod::Automatic)
        : m_rows{{basis(0, 0), basis(0, 1), basis(0, 2), S(0)},
                 {basis(1, 0), basis(1, 1), basis(1, 2), S(0)},
                 {basis(2, 0), basis(2, 1), basis(2, 2), S(0)}},
          m_origin{origin[0], origin[1], origin[2], S(0)},
          m_hull(&hull.corners()),
          m_norm(normOfRows()),
          m_size(m_norm * m_hull->reach()),
          m_band(bandOf()),
          m_startCount(method == SupportMethod::Automatic ? m_hull->blockCount() : 0),
          m_method(method),
          m_hasFewVertices(method == SupportMethod::Automatic && m_hull->vertexCount() <= kFewVertices)
    {
    }

    /// @param rows of the basis; their fourth lanes, and the origin's, are 0
    PosedHull(const Hull<S>& hull, const Quad (&rows)[3], const Quad& origin)
        : m_rows{rows[0], rows[1], rows[2]},
          m_origin(origin),
          m_hull(&hull.corners()),
          m_norm(normOfRows()),
          m_size(m_norm * m_hull->reach()),
          m_band(bandOf()),
          m_startCount(m_hull->blockCount()),
          m_method(SupportMethod::Automatic),
          m_hasFewVertices(m_hull->vertexCount() <= kFewVertices)
    {
    }

    /// Changes the origin().
    void moveTo(const Eigen::Vector3d& place)
    {
        m_origin = Quad{static_cast<S>(place[0]), static_cast<S>(place[1]), static_cast<S>(place[2]), S(0)};
        // GCC 12 drops the rounding of two lanes where it follows the place to origin().
        asm("" : "+m"(m_origin));
    }

    /// The hull of the corners, to which all vertex ids of this class refer.
    const Hull<S>& hull() const { return *m_hull; }
    Eigen::Matrix3d basis() const
    {
        Eigen::Matrix3d basis;
        for (int i = 0; i < 3; ++i)
            basis.row(i) << m_rows[i][0], m_rows[i][1], m_rows[i][2];
        return basis;
    }
    Eigen::Vector3d origin() const { return {m_origin[0], m_origin[1], m_origin[2]}; }
    Eigen::Vector3d centre() const { return basis() * m_hull->centre(); }
    std::int32_t vertexCount() const { return m_hull->vertexCount(); }
    Eigen::Vector3d point(std::int32_t v) const
    {
        return basis() * m_hull->vertex(v).template cast<double>();
    }

    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t start) const
    {
        Quad d;
        toLocal(usableDirection(direction), d);
        const std::int32_t v = supportVertex<S>(*m_hull, {d[0], d[1], d[2]}, start, m_method);
        return {point(v), v};
    }

    /// A world direction in the hull's scalar, scaled where its products would underflow or overflow.
    static Vector usableDirection(const Eigen::Vector3d& direction)
    {
        const double largest =
            std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
        if (largest > 1e-8 && largest < 1e8)
            return direction.template cast<S>();
        return (direction / (largest > 0.0 ? largest : 1.0)).template cast<S>();
    }

    /// The support vertices of A against a direction and of B along it.
    /// @param direction a usableDirection()
    /// @param start     vertices that are likely near them, or -1
    static VertexPair supportVertices(const PosedHull& a, const PosedHull& b, const Vector& direction,
                                      const VertexPair& start)
    {
        Quad dA, dB;
        a.toLocal(-direction, dA);
        b.toLocal(direction, dB);
        const Vector localA(dA[0], dA[1], dA[2]), localB(dB[0], dB[1], dB[2]);
        if (a.isMapped() && b.isMapped() && start.a < 0 && start.b < 0)
            return climbBoth(*a.m_hull, localA, *b.m_hull, localB,
                             {cubeMapStart(*a.m_hull, localA), cubeMapStart(*b.m_hull, localB)});
        return {supportVertex<S>(*a.m_hull, localA, start.a, a.m_method),
                supportVertex<S>(*b.m_hull, localB, start.b, b.m_method)};
    }

    /// The support vertices of A against a direction and of B along it, from the vertices of a simplex that is likely
    /// the closest already.
    /// @param direction a usableDirection()
    /// @param ofA, ofB  vertices of the simplex, `count` of each
    [[gnu::always_inline]] static VertexPair supportsNearSimplex(const PosedHull& a, const PosedHull& b,
                                                                 const Vector& direction,
                                                                 const std::array<std::int32_t, 4>& ofA,
                                                                 const std::array<std::int32_t, 4>& ofB,
                                                                 int count)
    {
        bool isProvedA = true, isProvedB = true;
        for (int i = 1; i < count; ++i)
        {
            isProvedA &= ofA[i] == ofA[0];
            isProvedB &= ofB[i] == ofB[0];
        }
        Quad dA, dB;
        a.toLocal(-direction, dA);
        b.toLocal(direction, dB);
        isProvedA = isProvedA && a.isSupportAlong(dA, ofA[0]);
        isProvedB = isProvedB && b.isSupportAlong(dB, ofB[0]);
        const Vector localA(dA[0], dA[1], dA[2]), localB(dB[0], dB[1], dB[2]);
        // The newest vertex of the simplex is a good start: finding the highest one costs more than the steps it saves.
        if (!isProvedA && !isProvedB && a.isClimbed() && b.isClimbed())
            return climbBoth(*a.m_hull, localA, *b.m_hull, localB, {ofA[count - 1], ofB[count - 1]});
        return {isProvedA ? ofA[0] : a.supportFrom(localA, ofA[count - 1]),
                isProvedB ? ofB[0] : b.supportFrom(localB, ofB[count - 1])};
    }

    /// Whether vertices are the support vertices of A against a direction and of B along it, as far as their neighbours
    /// prove it.
    /// @param direction a usableDirection()
    [[gnu::always_inline]] static bool areSupports(const PosedHull& a, const PosedHull& b,
                                                   const Vector& direction, const VertexPair& vertices)
    {
        Quad dA, dB;
        a.toLocal(direction, dA);
        b.toLocal(direction, dB);
        // Bitwise & of integers, since && would add a branch.
        return (static_cast<int>(a.isSupportAlong(-dA, vertices.a)) &
                static_cast<int>(b.isSupportAlong(dB, vertices.b))) != 0;
    }

    /// Whether a vertex is higher along a direction than all other vertices, by more than `height`.
    ///
    /// @param direction unit
    /// @return false, too, if only a scan of all vertices could decide
    bool isStrictSupport(std::int32_t vertex, const Vector& direction, S height) const
    {
        if (vertex < 0 || vertex >= m_hull->blockCount())
            return false;
        Quad d;
        toLocal(direction, d);
        S unused;
        return isPeak(*m_hull, vertex, LaneDirection<S>(d), height, unused);
    }

    /// A row of the basis; the fourth lane is 0.
    const Quad& row(int i) const { return m_rows[i]; }
    const Quad& originQuad() const { return m_origin; }
    SupportMethod method() const { return m_method; }
    /// Whether the graph of the hull may be used.
    bool isClimbable() const { return m_method == SupportMethod::Automatic && m_hull->hasNeighbours(); }
    /// Frobenius norm of the basis: the basis lengthens no vector by more than this factor.
    S norm() const { return m_norm; }
    /// No vertex is farther from the origin of the shape.
    S size() const { return m_size; }
    /// Whether all vertices are scanned, see kFewVertices.
    bool hasFewVertices() const { return m_hasFewVertices; }
    /// Number of vertices from which a search may start with a test of the neighbours: none, or all.
    std::int32_t startCount() const { return m_startCount; }
    /// The band of isPeak() for world axes of a length of at most the root of 3: the 1-norm of a local direction is at
    /// most sqrt(3) F |v|, plus an allowance for rounding.
    S tieBand() const { return m_band; }

private:
    S normOfRows() const
    {
        const Quad sums = m_rows[0] * m_rows[0] + m_rows[1] * m_rows[1] + m_rows[2] * m_rows[2];
        return squareRoot(cullet::Quad<S>::sumOfThree(sums));
    }

    S bandOf() const { return m_hull->tieBand() * (S(3) * m_norm); }

    void toLocal(const Vector& d, Quad& local) const
    {
        local = m_rows[0] * d[0] + m_rows[1] * d[1] + m_rows[2] * d[2];
    }

    /// @param d local
    [[gnu::always_inline]] bool isSupportAlong(const Quad& d, std::int32_t vertex) const
    {
        if (!isClimbable())
            return false;
        Quad magnitudes = d;
        cullet::Quad<S>::makePositive(magnitudes);
        const S band = m_hull->tieBand() * cullet::Quad<S>::sumOfThree(magnitudes);
        S height;
        return isPeak(*m_hull, vertex, LaneDirection<S>(d), band, height);
    }

    /// Whether to climb, given up to how many vertices a scan is faster.
    bool isClimbedAbove(std::int32_t mostScanned) const
    {
        return isClimbable() && m_hull->vertexCount() > mostScanned;
    }
    /// Whether to climb from a vertex near the answer.
    bool isClimbed() const { return isClimbedAbove(cheapScanMaximum<S>()); }
    /// Whether to climb from the start table, for unrelated directions.
    bool isMapped() const { return isClimbedAbove(linearSupportMaximum<S>()); }

    /// @param d local
    [[gnu::noinline]] std::int32_t supportFrom(const Vector& d, std::int32_t start) const
    {
        if (m_method != SupportMethod::Automatic)
            return supportVertex<S>(*m_hull, d, -1, m_method);
        if (!isClimbed())
            return hitLinear(*m_hull, d).vertex;
        return supportClimbArtificial(*m_hull, d, start).vertex;
    }

    Quad m_rows[3];
    Quad m_origin;
    const Hull<S>* m_hull;
    S m_norm;
    S m_size;
    S m_band;
    std::int32_t m_startCount;
    SupportMethod m_method;
    bool m_hasFewVertices;
};
}  // namespace cullet
