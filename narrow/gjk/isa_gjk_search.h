// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/hull_pair.h"

#include <cstdint>

namespace cullet
{
/// How isaGjk() searches; the answer does not depend on it.
struct IsaGjkVariant
{
    GjkStart start = GjkStart::Memory;
    /// At most so many steps of Chung and Wang 1996, "Quick Collision Detection of Polytopes in Virtual Environments",
    /// are tried when the first axis has failed, before GJK, instead of the corner. They find only axes; if they fail,
    /// nothing is proved. Not with FourDirections.
    int reflections = 0;
};

/// ISA-GJK, the part after the cached axis: is the distance between two convex shapes larger than maxDistance?
template <class S, class A, class B, class Observer>
class IsaGjk
{
public:
    IsaGjk(const A& a, const B& b, double limit, GjkCache<S>& cache, Observer& observer,
           const IsaGjkVariant& variant)
        : m_search(a, b), m_limit2(limit * limit), m_cache(cache), m_observer(observer), m_variant(variant)
    {
    }

    /// @param test supports against the cached axis, if they are known
    template <class Shape>
    GjkResult<S> run(const AxisTest<Shape>& test)
    {
        if (m_variant.start == GjkStart::FourDirections)
            return runFromFour();
        const bool isRemembering = m_variant.start == GjkStart::Memory;
        const Eigen::Vector3d v(m_cache.axis[0], m_cache.axis[1], m_cache.axis[2]);
        if (isRemembering && m_cache.count == 4 && m_search.seed(m_cache, nullptr))
            return m_search.isInside() ? keepTetrahedron() : iterate();
        // The observer was called for this axis if its supports are known.
        const bool isKnown = test.vertexA >= 0 && test.vertexB >= 0;
        const Support first =
            isKnown ? m_search.supportOf(test.vertexA, test.vertexB)
                    : m_search.supportAgainst(v, startOf(m_cache.startA), startOf(m_cache.startB));
        if (!isKnown)
            m_observer(v, v.dot(first.w));
        if (isBeyond(v.dot(first.w), v.squaredNorm()))
            return finishOnAxis(v, first);
        Eigen::Vector3d reflected = v;
        Support last = first;
        if (reflect(reflected, last))
            return finishOnAxis(reflected, last);
        if (isRemembering)
            m_search.seed(m_cache, &first);
        else
            m_search.start(first);
        return iterate();
    }

private:
    using Search = GjkSearch<A, B>;
    using Support = typename Search::Support;

    GjkResult<S> runFromFour()
    {
        GjkResult<S> separated;
        const auto see = [&](const Eigen::Vector3d& v, const Support& s)
        {
            if (!separates(v, v.squaredNorm(), s))
                return true;
            separated = finishOnAxis(v, s);
            return false;
        };
        return m_search.startFromFour(see) ? iterate() : separated;
    }

    GjkResult<S> keepTetrahedron()
    {
        if (!m_search.isFinite())
            return fail();
        GjkResult<S> result;
        result.state = GjkState::Overlapping;
        return result;
    }

    static std::int32_t startOf(std::uint16_t id) { return id == GjkCache<S>::kUnknown ? -1 : id; }

    bool separates(const Eigen::Vector3d& v, double length2, const Support& s)
    {
        const double along = v.dot(s.w);
        m_observer(v, along);
        return isBeyond(along, length2);
    }

    bool isBeyond(double along, double length2) const
    {
        return along > 0.0 && along * along > m_limit2 * length2;
    }

    /// Chung and Wang's steps: mirrors v in the plane across the support point w, which turns v.w < 0 into -v.w.
    ///
    /// @return true if v separates now, with s its support; the steps need not converge
    bool reflect(Eigen::Vector3d& v, Support& s)
    {
        for (int i = 0; i < m_variant.reflections; ++i)
        {
            const double along = v.dot(s.w);
            // Positive: separated by less than maxDistance. A NaN makes the comparison false.
            if (!(along < 0.0))
                return false;
            v -= 2.0 * along / s.w.squaredNorm() * s.w;
            s = m_search.supportAgainst(v);
            if (separates(v, v.squaredNorm(), s))
                return true;
        }
        return false;
    }

    /// The cached simplex is kept: it is more likely near the next closest feature than the one point on the axis.
    GjkResult<S> finishOnAxis(const Eigen::Vector3d& v, const Support& s)
    {
        if (!m_search.isFinite())
            return fail();
        m_cache.state = GjkState::Separated;
        Search::rememberAxis(v, s.vertexA, s.vertexB, m_cache);
        return result(GjkState::Separated, v);
    }

    GjkResult<S> iterate()
    {
        for (; m_iterations < kGjkIterationLimit; ++m_iterations)
        {
            if (m_search.isTouching())
                return finish(GjkState::Overlapping, nullptr);
            const Support s = m_search.supportAgainst(m_search.closest());
            if (separates(m_search.closest(), m_search.length2(), s))
                return finish(GjkState::Separated, &s);
            const double along = m_search.closest().dot(s.w);
            if (along > 0.0 && m_search.length2() <= m_limit2)
                return finish(GjkState::Near, &s);
            if (m_search.has(s) || !m_search.advance(s))
                return finish(m_search.stalledState(along), &s);  // 0 or maxDistance lies between its bounds
        }
        return finish(GjkState::NotConverged, nullptr);
    }

    GjkResult<S> finish(GjkState state, const Support* along)
    {
        return m_search.rememberOutcome(state, along, m_cache) ? result(state, m_search.closest()) : fail();
    }

    GjkResult<S> fail()
    {
        m_cache = GjkCache<S>();
        return result(GjkState::NotConverged, Eigen::Vector3d::Zero());
    }

    GjkResult<S> result(GjkState state, const Eigen::Vector3d& v) const
    {
        GjkResult<S> out;
        out.state = state;
        out.iterations = m_iterations;
        out.axis = v.template cast<S>();
        return out;
    }

    Search m_search;
    double m_limit2;
    GjkCache<S>& m_cache;
    Observer& m_observer;
    IsaGjkVariant m_variant;
    std::int32_t m_iterations = 0;
};
}  // namespace cullet
