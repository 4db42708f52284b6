// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/closest_point.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/posed_pair.h"

#include <cstdint>

namespace cullet::convex
{
/// The simplex with which a search has ended; packed(), or kNoVertices. Any content only costs time.
struct alignas(16) PairSimplex
{
    std::uint32_t vertices[4];
};

enum class SearchResult
{
    Apart,
    Overlapping,
    Doubtful  ///< rounding decides
};

/// Up to four points of A - B. Indexed by constants only, so that they stay in registers.
template <class T>
class Simplex
{
public:
    CULLET_HOST_DEVICE int count() const { return m_count; }
    CULLET_HOST_DEVICE const Vec<T> (&points() const)[4] { return m_points; }

    /// @pre count() < 4
    CULLET_HOST_DEVICE void add(const Vec<T>& point, VertexIds ids)
    {
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
        {
            if (i == m_count)
            {
                m_points[i] = point;
                m_ids[i] = ids;
            }
        }
        ++m_count;
    }

    CULLET_HOST_DEVICE const VertexIds (&ids() const)[4] { return m_ids; }

    CULLET_HOST_DEVICE bool has(VertexIds ids) const
    {
        bool isHere = false;
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
            isHere = isHere || (i < m_count && m_ids[i].a == ids.a && m_ids[i].b == ids.b);
        return isHere;
    }

    /// @param members bit i: point i stays
    CULLET_HOST_DEVICE void keep(unsigned members)
    {
        const int count = m_count;
        m_count = 0;
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
        {
            if (i < count && (members >> i & 1u) != 0)
                add(m_points[i], m_ids[i]);
        }
    }

    CULLET_HOST_DEVICE void store(PairSimplex& simplex) const
    {
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
            simplex.vertices[i] = i < m_count ? packed(m_ids[i]) : kNoVertices;
    }

private:
    Vec<T> m_points[4] = {};
    VertexIds m_ids[4] = {};
    int m_count = 0;
};

/// Where a search begins.
enum class SearchStart
{
    Axis,    ///< the support point of the axis, then the remembered simplex
    Simplex  ///< the remembered simplex
};

/// What ends a search.
enum class SearchGoal
{
    Boolean,  ///< an axis that separates
    Distance  ///< bounds of the distance that agree. Only in double, and for hulls that are apart
};

/// ISA-GJK (van den Bergen 1999) for one pair: a separating axis, or a simplex around the origin; with
/// SearchGoal::Distance GJK (Gilbert, Johnson and Keerthi 1988), whose simplex is the closest feature of A - B.
///
/// In float an answer is given where it holds for any rounding. In double rounding decides below 1e-7 of the size.
template <class T, SearchGoal kGoal = SearchGoal::Boolean>
class PairSearch
{
public:
    CULLET_HOST_DEVICE explicit PairSearch(const PosedPair<T>& pair) : m_pair(pair) {}

    /// Searches from what is remembered of the pair, and stores where the search has ended. Ends, since the distance of
    /// the simplex decreases strictly, and after kMostSteps.
    ///
    /// @param axis    [in, out] unit; its vertices are its supports, or once were, or unknown
    /// @param simplex [in, out]
    CULLET_HOST_DEVICE SearchResult run(PairAxis& axis, PairSimplex& simplex, SearchStart start)
    {
        m_axis = {T(axis.axis[0]), T(axis.axis[1]), T(axis.axis[2])};
        m_ids = unpacked(axis.vertices);
        const SearchResult result =
            start == SearchStart::Axis && !addAxis() ? SearchResult::Apart : searchFrom(simplex);
        axis = {{float(m_axis.x), float(m_axis.y), float(m_axis.z)}, packed(m_ids)};
        m_simplex.store(simplex);
        return result;
    }

    /// Of the last search.
    CULLET_HOST_DEVICE const Simplex<T>& simplex() const { return m_simplex; }

private:
    static constexpr bool kIsFloat = sizeof(T) == sizeof(float);
    static constexpr int kMostSteps = kIsFloat ? 24 : 96;
    /// Relative size, squared, of a distance that is taken as zero: 1e-10 in double.
    static constexpr T kTouching2 = kIsFloat ? T(1e-12) : T(1e-20);

    /// Adds the support point of the axis.
    ///
    /// @return false if the axis separates the hulls
    CULLET_HOST_DEVICE bool addAxis()
    {
        if (!m_pair.areVertices(m_ids))
        {
            const AxisTest<T> test = m_pair.test(m_axis, m_ids);
            m_ids = test.ids;
            if (kGoal == SearchGoal::Boolean && test.along > m_pair.error())
                return false;
        }
        add(m_ids);
        return true;
    }

    CULLET_HOST_DEVICE void add(VertexIds ids)
    {
        const Vec<T> point = m_pair.point(ids);
        const T size2 = dot(point, point);
        m_size2 = size2 > m_size2 ? size2 : m_size2;
        m_simplex.add(point, ids);
    }

    CULLET_HOST_DEVICE SearchResult searchFrom(const PairSimplex& remembered)
    {
        CULLET_UNROLL
        for (int i = 0; i < 4; ++i)
        {
            const VertexIds ids = unpacked(remembered.vertices[i]);
            if (m_simplex.count() < 4 && m_pair.areVertices(ids) && !m_simplex.has(ids))
                add(ids);
        }
        if (m_simplex.count() == 0 && !addAxis())
            return SearchResult::Apart;
        return iterate();
    }

    CULLET_HOST_DEVICE SearchResult iterate()
    {
        T last2 = Flatness<T>::kFar2;
        for (int step = 0; step < kMostSteps; ++step)
        {
            const ClosestPoint<T> closest(m_simplex.points(), m_simplex.count());
            if (closest.isInside())
                return resultInside();
            m_simplex.keep(closest.members());
            const T length2 = closest.length2();
            if (!(length2 < last2))
                return resultOfBounds();
            if (!(length2 > kTouching2 * m_size2))
                return kIsFloat ? SearchResult::Doubtful : SearchResult::Overlapping;
            last2 = length2;
            const T scale = T(1) / rootOf(length2);
            m_axis = closest.closest() * scale;
            const AxisTest<T> test = m_pair.test(m_axis, m_ids);
            m_ids = test.ids;
            m_lower = test.along;
            m_upper = length2 * scale;
            if (isReached())
                return SearchResult::Apart;
            if (m_simplex.has(m_ids))
                return resultOfBounds();
            add(m_ids);
        }
        return SearchResult::Doubtful;
    }

    /// Whether the bounds by the last axis are the goal.
    CULLET_HOST_DEVICE bool isReached() const
    {
        if constexpr (kGoal == SearchGoal::Boolean)
            return m_lower > m_pair.error();
        else
            return m_upper - m_lower <= T(1e-9) * m_upper;
    }

    CULLET_HOST_DEVICE SearchResult resultInside() const
    {
        if constexpr (kIsFloat)
        {
            return isSurelyInside(m_simplex.points(), m_pair.error()) ? SearchResult::Overlapping
                                                                      : SearchResult::Doubtful;
        }
        else
            return SearchResult::Overlapping;
    }

    /// The answer where the bounds of the distance shrink no more: they decide if they agree to 1e-7 of the size.
    CULLET_HOST_DEVICE SearchResult resultOfBounds() const
    {
        if (kIsFloat || !(m_upper - m_lower <= T(1e-7) * rootOf(m_size2)))
            return SearchResult::Doubtful;
        return m_lower > T(0) ? SearchResult::Apart : SearchResult::Overlapping;
    }

    const PosedPair<T>& m_pair;
    Simplex<T> m_simplex;
    Vec<T> m_axis;
    VertexIds m_ids;
    T m_lower = T(0), m_upper = T(INFINITY);  ///< of the distance, by the last axis
    T m_size2 = T(0);                         ///< largest squared length of a point of the simplex so far
};
}  // namespace cullet::convex
