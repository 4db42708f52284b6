// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/hull/placement.h"
#include "cullet/narrow/math/lanes.h"
#include "cullet/narrow/math/simplex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Largest relative width of the interval of possible distances that still counts as an answer when it stops shrinking.
constexpr double kGjkAccuracy = 1e-7;

/// The state that ISA-GJK, GJK and EPA share: a simplex in the Minkowski difference A - B and its point closest to the
/// origin. World axes, relative to the origin of A, double.
template <class A, class B>
class GjkSearch
{
public:
    struct Support
    {
        Eigen::Vector3d w;  ///< point of A - B
        Eigen::Vector3d a;  ///< point of A
        std::int32_t vertexA, vertexB;
    };

    GjkSearch(const A& a, const B& b) : m_a(a), m_b(b), m_placement(a, b), m_offset(b.origin() - a.origin())
    {
    }

    const Eigen::Vector3d& closest() const { return m_closest; }
    double length2() const { return m_length2; }
    int count() const { return m_count; }
    bool isInside() const { return m_isInside; }
    const SimplexPoints& points() const { return m_points; }
    Support support(int i) const { return {m_points[i], m_tags[i].a, m_tags[i].vertexA, m_tags[i].vertexB}; }
    /// Largest squared length of a point of A - B seen so far: the unit of relative tolerances.
    double size2() const { return m_size2; }
    /// False once a point has had a coordinate that is NaN, infinite, or too large to square.
    bool isFinite() const { return m_sum2 <= std::numeric_limits<double>::max(); }
    /// The closest point is the origin up to the rounding of coordinates. 1e-20: 1e-10 of the size.
    bool isTouching() const { return m_isInside || m_length2 <= 1e-20 * m_size2; }

    /// State of a search that stalled at a support with this v.w: |v| and v.w / |v| enclose the distance.
    ///
    /// @return NotConverged unless the two bounds agree up to rounding
    GjkState stalledState(double along) const
    {
        const double upper = std::sqrt(m_length2);
        const double lower = along > 0.0 ? along / upper : 0.0;
        // A NaN makes the comparison false.
        if (!(upper - lower <= kGjkAccuracy * std::sqrt(m_size2)))
            return GjkState::NotConverged;
        return lower > 0.0 ? GjkState::Near : GjkState::Overlapping;
    }

    Eigen::Vector3d centreDifference() const
    {
        const Eigen::Vector3d difference = m_a.centre() - m_b.centre() - m_offset;
        return difference.squaredNorm() > 0.0 ? difference : Eigen::Vector3d(1.0, 0.0, 0.0);
    }

    /// Support point of A - B against v: the smallest v.w.
    Support supportAgainst(const Eigen::Vector3d& v, std::int32_t startA = -1, std::int32_t startB = -1)
    {
        if constexpr (HasVertexAmong<A, B>::value)
        {
            const auto [vertexA, vertexB] =
                A::supportVertices(m_a, m_b, A::usableDirection(v), {startA, startB});
            return supportOf(vertexA, vertexB);
        }
        else
        {
            const SupportPoint a = m_a.support(-v, startA);
            const SupportPoint b = m_b.support(v, startB);
            return recordSize({a.point - b.point - m_offset, a.point, a.vertex, b.vertex});
        }
    }

    /// Support point against closest(), for a simplex that likely contains it already.
    Support supportNearSimplex()
    {
        if constexpr (HasVertexAmong<A, B>::value)
        {
            std::array<std::int32_t, 4> ofA, ofB;
            for (int i = 0; i < m_count; ++i)
            {
                ofA[i] = m_tags[i].vertexA;
                ofB[i] = m_tags[i].vertexB;
            }
            const auto direction = A::usableDirection(m_closest);
            const auto [vertexA, vertexB] = A::supportsNearSimplex(m_a, m_b, direction, ofA, ofB, m_count);
            for (int i = 0; i < m_count; ++i)
            {
                if (m_tags[i].vertexA == vertexA && m_tags[i].vertexB == vertexB)
                    return support(i);
            }
            return supportOf(vertexA, vertexB);
        }
        else
        {
            return supportAgainst(m_closest);
        }
    }

    /// The point of A - B of two vertices.
    [[gnu::always_inline]] Support supportOf(std::int32_t vertexA, std::int32_t vertexB)
    {
        Eigen::Vector3d a, b;
        m_placement.place(vertexA, vertexB, a, b);
        return recordSize({a - b - m_offset, a, vertexA, vertexB});
    }

    /// Starts from one point.
    void start(const Support& s)
    {
        m_count = 0;
        push(s);
        solveAll();
    }

    /// Starts from the support points against four directions, those of a regular tetrahedron: the thesis, section
    /// 6.2.1. Equal points are added once.
    /// @param observe called with each direction and support point
    /// @return false if observe() did for one of them; then the simplex is not solved
    template <class Observe>
    bool startFromFour(const Observe& observe)
    {
        m_count = 0;
        for (const Eigen::Vector3d& v : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1),
                                         Eigen::Vector3d(-1, 1, -1), Eigen::Vector3d(-1, -1, 1)})
        {
            const Support s = supportAgainst(v);
            if (!observe(v, s))
                return false;
            if (!has(s))
                push(s);
        }
        solveAll();
        return true;
    }

    /// Starts from the cached vertex pairs, and `extra` if it is new and the simplex is not full.
    /// @return false if the cache has no vertex pairs and there is no extra point
    template <class S>
    bool seed(const GjkCache<S>& cache, const Support* extra)
    {
        m_count = 0;
        for (int i = 0; i < cache.count; ++i)
        {
            const std::int32_t vertexA = cache.verticesA[i];
            const std::int32_t vertexB = cache.verticesB[i];
            if (vertexA < m_a.vertexCount() && vertexB < m_b.vertexCount())
                pushPair(vertexA, vertexB);
        }
        if (extra != nullptr && m_count < 4 && !has(*extra))
            push(*extra);
        if (m_count == 0)
            return false;
        solveAll();
        return true;
    }

    /// Whether the simplex contains a support point already: then no progress is possible.
    bool has(const Support& s) const
    {
        for (int i = 0; i < m_count; ++i)
        {
            // A shape without vertices has -1 for all of its points.
            const bool isSameVertex = s.vertexA >= 0 && s.vertexB >= 0 && s.vertexA == m_tags[i].vertexA &&
                                      s.vertexB == m_tags[i].vertexB;
            if (isSameVertex || s.w == m_points[i])
                return true;
        }
        return false;
    }

    /// Adds a support point against closest() and solves.
    /// @return false, with the simplex unchanged, if that does not bring it closer to the origin
    bool advance(const Support& s)
    {
        push(s);
        ClosestOnSimplex next = closestOnSimplexNewest(m_points, m_count);
        if (!isProgress(next))
            next = closestOnSimplex(m_points, m_count);
        if (!isProgress(next))
        {
            --m_count;
            return false;
        }
        accept(next);
        return true;
    }

    /// Adds a support point that is nearer to the origin along closest() than the simplex, by so little that no length
    /// shows it: shapes whose faces are nearly level have closest points of equal distance and different normals.
    /// @return false, with the simplex unchanged, if no triangle or edge with the point has a closest point inside of it
    ///         that is as close
    bool advanceLevel(const Support& s)
    {
        push(s);
        const ClosestOnSimplex next = closestOfNewest();
        const double same = 2.0 * noise() * std::sqrt(m_length2);
        if ((next.subset >> (m_count - 1) & 1u) == 0 || !(next.length2 <= m_length2 + same))
        {
            --m_count;
            return false;
        }
        accept(next);
        return true;
    }

    /// Rounding of a height over a plane.
    double noise() const { return 8.0 * std::numeric_limits<double>::epsilon() * std::sqrt(m_size2); }

    /// Takes over the simplex of another search of the same shapes.
    void take(const GjkSearch& other)
    {
        m_points = other.m_points;
        m_tags = other.m_tags;
        m_count = other.m_count;
        m_closest = other.m_closest;
        m_length2 = other.m_length2;
        m_size2 = other.m_size2;
        m_sum2 = other.m_sum2;
    }

    /// Closest point of A (relative to its origin); the point of B is this minus closest().
    Eigen::Vector3d pointOfA() const
    {
        if (m_count == 1)
            return m_tags[0].a;
        const std::array<double, 4> weights = simplexWeights(m_points, (1u << m_count) - 1u);
        Eigen::Vector3d point = weights[0] * m_tags[0].a;
        for (int i = 1; i < m_count; ++i)
            point += weights[i] * m_tags[i].a;
        return point;
    }

    template <class S>
    void remember(GjkState state, GjkCache<S>& cache) const
    {
        remember(state, m_tags[m_count - 1].vertexA, m_tags[m_count - 1].vertexB, cache);
    }

    /// remember() at the end of a query; clears the cache if the query has no answer.
    ///
    /// @param along support against closest(), which becomes the axis; may be null
    /// @return whether the query has an answer
    template <class S>
    bool rememberOutcome(GjkState state, const Support* along, GjkCache<S>& cache) const
    {
        if (state == GjkState::NotConverged || !isFinite())
        {
            cache = GjkCache<S>();
            return false;
        }
        if (along != nullptr)
            remember(state, along->vertexA, along->vertexB, cache);
        else
            remember(state, cache);
        return true;
    }

    /// @param vertexA support vertices against v
    template <class S>
    [[gnu::always_inline]] static void rememberAxis(const Eigen::Vector3d& v, std::int32_t vertexA,
                                                    std::int32_t vertexB, GjkCache<S>& cache)
    {
        const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
        cullet::rememberAxis(Eigen::Vector3d(v * scaleBelowOne(largest)), cache);
        cache.startA = narrowId<S>(vertexA);
        cache.startB = narrowId<S>(vertexB);
    }

private:
    /// @param vertexA support vertices against closest()
    template <class S>
    void remember(GjkState state, std::int32_t vertexA, std::int32_t vertexB, GjkCache<S>& cache) const
    {
        cache.state = state;
        cache.count = static_cast<std::uint8_t>(m_count);
        for (int i = 0; i < m_count; ++i)
        {
            cache.verticesA[i] = narrowId<S>(m_tags[i].vertexA);
            cache.verticesB[i] = narrowId<S>(m_tags[i].vertexB);
        }
        rememberAxis(m_closest, vertexA, vertexB, cache);
    }

    /// Attributes of a point of the simplex, besides its position.
    struct Tag
    {
        Eigen::Vector3d a;
        std::int32_t vertexA, vertexB;
    };

    const Support& recordSize(const Support& s)
    {
        recordSize(s.w);
        return s;
    }

    void recordSize(const Eigen::Vector3d& w)
    {
        const double length2 = w.squaredNorm();
        m_sum2 += length2;
        m_size2 = std::max(m_size2, length2);
    }

    void pushPair(std::int32_t vertexA, std::int32_t vertexB)
    {
        Eigen::Vector3d a, b;
        m_placement.place(vertexA, vertexB, a, b);
        m_points[m_count] = a - b - m_offset;
        m_tags[m_count] = {a, vertexA, vertexB};
        recordSize(m_points[m_count]);
        ++m_count;
    }

    void push(const Support& s)
    {
        m_points[m_count] = s.w;
        std::int32_t vertexA = s.vertexA, vertexB = s.vertexB;
        // Without this barrier both ids are read in one load, which waits for the two stores that wrote them.
        asm("" : "+r"(vertexA), "+r"(vertexB));
        m_tags[m_count] = {s.a, vertexA, vertexB};
        ++m_count;
    }

    /// Closest point of the largest triangle with the newest point that has it inside: the origin is over slivers by
    /// chance. Else, of the edges with the newest point.
    ClosestOnSimplex closestOfNewest() const
    {
        const int newest = m_count - 1;
        ClosestOnSimplex best = nothingOnSimplex(m_points, m_count);
        double largest = 0.0;
        for (int i = 0; i < newest; ++i)
        {
            for (int j = i + 1; j < newest; ++j)
            {
                ClosestOnSimplex inside = nothingOnSimplex(m_points, m_count);
                const Eigen::Vector3d &p = m_points[i], &q = m_points[j], &r = m_points[newest];
                const double area2 = (q - p).cross(r - p).squaredNorm();
                if (area2 > largest && considerInside(m_points, i, j, newest, inside))
                {
                    largest = area2;
                    best = inside;
                }
            }
        }
        for (int i = 0; i < newest && largest == 0.0; ++i)
            considerSegment(m_points, newest, i, best);
        return best;
    }

    // A NaN makes the comparison false.
    bool isProgress(const ClosestOnSimplex& next) const { return next.isInside || next.length2 < m_length2; }

    void solveAll()
    {
        if (m_count > 1)
            return accept(closestOnSimplex(m_points, m_count));
        m_isInside = false;
        m_closest = m_points[0];
        m_length2 = m_closest.squaredNorm();
    }

    /// Keeps the points of the subset; all four when the origin is inside.
    void accept(const ClosestOnSimplex& c)
    {
        m_isInside = c.isInside;
        if (c.isInside)
            return;
        int kept = 0;
        for (int i = 0; i < m_count; ++i)
        {
            if ((c.subset >> i & 1u) == 0)
                continue;
            if (kept != i)
            {
                m_points[kept] = m_points[i];
                m_tags[kept] = m_tags[i];
            }
            ++kept;
        }
        m_count = kept;
        m_closest = c.point;
        m_length2 = c.length2;
    }

    const A& m_a;
    const B& m_b;
    Placement<A, B> m_placement;
    Eigen::Vector3d m_offset;
    SimplexPoints m_points;
    std::array<Tag, 4> m_tags;
    Eigen::Vector3d m_closest = Eigen::Vector3d::Zero();
    double m_length2 = 0.0;
    double m_size2 = 0.0;
    double m_sum2 = 0.0;
    int m_count = 0;
    bool m_isInside = false;
};

/// More simplices than any query needs: 36 was the maximum over some 3 million queries. Exceeding the limit is reported
/// as NotConverged; the strict decrease of |v| would end the search in any case.
constexpr std::int32_t kGjkIterationLimit = 200;
}  // namespace cullet
