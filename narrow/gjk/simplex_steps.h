// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/hull_pair.h"
#include "cullet/narrow/math/simplex.h"

#include <array>
#include <cstdint>

namespace cullet
{
/// A few steps of GJK that search only for a separating axis: each axis is tested in the scalar of the hulls, with
/// proof, and its supports start at the vertices of the previous axis. Points are rounded to that scalar, which may
/// spoil a step but no answer; the solver works in double. The search in double does the same at twice the cost.
template <class S>
class SimplexSteps
{
public:
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// @param failed, another axes that do not prove the distance, whose support points belong to the first simplex;
    ///                `another` may be unknown
    SimplexSteps(const HullPair<S>& pair, S limit2, const AxisTest<S>& failed, const AxisTest<S>& another)
        : m_pair(pair), m_limit2(limit2), m_test(failed)
    {
        add(failed.vertexA, failed.vertexB);
        if (another.vertexA >= 0 && !has(another.vertexA, another.vertexB))
            add(another.vertexA, another.vertexB);
    }

    /// @return whether an axis proves the distance
    template <class C, class Observer>
    bool run(const GjkCache<C>& cache, Observer& observer)
    {
        addRemembered(cache);
        ClosestOnSimplex closest = closestOnSimplex(m_points, m_count);
        for (m_steps = 1; m_steps <= kLimit; ++m_steps)
        {
            // The shapes may be nearer than asked, or a coordinate is not finite.
            if (closest.isInside || !(closest.length2 > static_cast<double>(m_limit2)))
                return false;
            keep(closest.subset);
            m_axis = scaledAxis<S>(closest.point.template cast<S>());
            m_test = m_pair.test(m_axis, m_limit2, m_test.vertexA, m_test.vertexB);
            if (m_test.vertexA >= 0)
                observer(m_axis.template cast<double>(), static_cast<double>(m_test.along));
            if (m_test.isProved)
                return true;
            if (m_test.vertexA < 0 || has(m_test.vertexA, m_test.vertexB))
                return false;
            add(m_test.vertexA, m_test.vertexB);
            closest = closestOnSimplexNewest(m_points, m_count);
        }
        return false;
    }

    /// Simplices solved.
    std::int32_t steps() const { return m_steps; }
    /// The axis that proves the distance, and its test.
    const Vector& axis() const { return m_axis; }
    const AxisTest<S>& test() const { return m_test; }

    /// Stores the simplex whose closest point gave the axis.
    template <class C>
    void remember(GjkCache<C>& cache) const
    {
        cache.count = static_cast<std::uint8_t>(m_count);
        for (int i = 0; i < m_count; ++i)
        {
            cache.verticesA[i] = narrowId<C>(m_vertexA[i]);
            cache.verticesB[i] = narrowId<C>(m_vertexB[i]);
        }
    }

private:
    /// After so many steps the search in double continues.
    static constexpr std::int32_t kLimit = 8;

    template <class C>
    void addRemembered(const GjkCache<C>& cache)
    {
        for (int i = 0; i < cache.count && m_count < 4; ++i)
        {
            const std::int32_t vertexA = cache.verticesA[i], vertexB = cache.verticesB[i];
            if (vertexA < m_pair.a().vertexCount() && vertexB < m_pair.b().vertexCount() &&
                !has(vertexA, vertexB))
                add(vertexA, vertexB);
        }
    }

    bool has(std::int32_t vertexA, std::int32_t vertexB) const
    {
        for (int i = 0; i < m_count; ++i)
        {
            if (m_vertexA[i] == vertexA && m_vertexB[i] == vertexB)
                return true;
        }
        return false;
    }

    [[gnu::noinline]] void add(std::int32_t vertexA, std::int32_t vertexB)
    {
        m_points[m_count] = m_pair.point(vertexA, vertexB).template cast<double>();
        m_vertexA[m_count] = vertexA;
        m_vertexB[m_count] = vertexB;
        ++m_count;
    }

    void keep(unsigned subset)
    {
        int kept = 0;
        for (int i = 0; i < m_count; ++i)
        {
            if ((subset >> i & 1u) == 0)
                continue;
            m_points[kept] = m_points[i];
            m_vertexA[kept] = m_vertexA[i];
            m_vertexB[kept] = m_vertexB[i];
            ++kept;
        }
        m_count = kept;
    }

    const HullPair<S>& m_pair;
    S m_limit2;
    AxisTest<S> m_test;
    Vector m_axis = Vector::Zero();
    SimplexPoints m_points;
    std::array<std::int32_t, 4> m_vertexA, m_vertexB;
    int m_count = 0;
    std::int32_t m_steps = 0;
};
}  // namespace cullet
