// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/gjk_search.h"
#include "narrow/gjk_types.h"

#include <cmath>
#include <cstdint>

namespace cullet
{
/// ISA-GJK: is the distance between two convex shapes larger than maxDistance?
template <class S, class A, class B, class Observer>
class IsaGjk
{
public:
    IsaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache, Observer& observer)
        : m_search(a, b),
          m_limit(maxDistance > S(0) ? static_cast<double>(maxDistance) : 0.0),
          m_cache(cache),
          m_observer(observer)
    {
    }

    GjkResult<S> run()
    {
        if (m_cache.state == GjkState::Overlapping && m_cache.count == 4)
        {
            // The tetrahedron of four remembered vertex pairs, at their new places: no support search.
            if (!m_search.seed(m_cache, nullptr))
                return startCold();
            return m_search.isInside() ? keepTetrahedron() : iterate();
        }
        return m_cache.axis == std::array<float, 3>{} ? startCold() : startFromAxis();
    }

private:
    using Search = GjkSearch<A, B>;
    using Support = typename Search::Support;

    GjkResult<S> keepTetrahedron()
    {
        if (!m_search.isFinite())
            return fail();
        GjkResult<S> result;
        result.state = GjkState::Overlapping;
        return result;
    }

    GjkResult<S> startCold()
    {
        const Eigen::Vector3d v = m_search.centreDifference();
        const Support first = m_search.supportAgainst(v);
        if (separates(v, first))
            return finishOnAxis(v, first);
        m_search.start(first);
        return iterate();
    }

    GjkResult<S> startFromAxis()
    {
        const Eigen::Vector3d v(m_cache.axis[0], m_cache.axis[1], m_cache.axis[2]);
        const Support first = m_search.supportAgainst(v, startOf(m_cache.startA), startOf(m_cache.startB));
        if (separates(v, first))
            return finishOnAxis(v, first);
        m_search.seed(m_cache, &first);
        m_startA = first.vertexA;
        m_startB = first.vertexB;
        return iterate();
    }

    static std::int32_t startOf(std::uint16_t id) { return id == GjkCache<S>::kUnknown ? -1 : id; }

    bool separates(const Eigen::Vector3d& v, const Support& s)
    {
        const double along = v.dot(s.w);
        m_observer(v, along);
        return along > 0.0 && along * along > m_limit * m_limit * v.squaredNorm();
    }

    /// The remembered simplex stays: it is more likely near the next closest feature than the one point on the axis.
    GjkResult<S> finishOnAxis(const Eigen::Vector3d& v, const Support& s)
    {
        if (!m_search.isFinite())
            return fail();
        m_cache.state = GjkState::Separated;
        Search::rememberAxis(v, s, m_cache);
        return result(GjkState::Separated, v);
    }

    GjkResult<S> iterate()
    {
        for (; m_iterations < kGjkIterationLimit; ++m_iterations)
        {
            if (m_search.isTouching())
                return finish(GjkState::Overlapping, nullptr);
            const Eigen::Vector3d v = m_search.closest();
            const Support s = m_search.supportAgainst(v, m_startA, m_startB);
            m_startA = m_startB = -1;
            if (separates(v, s))
                return finish(GjkState::Separated, &s);
            const double along = v.dot(s.w);
            if (along > 0.0 && m_search.length2() <= m_limit * m_limit)
                return finish(GjkState::Near, &s);
            if (m_search.has(s) || !m_search.advance(s))
                return finishStalled(s, along);
        }
        return finish(GjkState::NotConverged, nullptr);
    }

    /// |v| and v.w / |v| are as close to each other as rounding lets them be, with 0 or maxDistance between them.
    GjkResult<S> finishStalled(const Support& s, double along)
    {
        const double upper = std::sqrt(m_search.length2());
        const double lower = along > 0.0 ? along / upper : 0.0;
        // A NaN makes the comparison false.
        if (!(upper - lower <= kGjkAccuracy * std::sqrt(m_search.size2())))
            return finish(GjkState::NotConverged, nullptr);
        return finish(lower > 0.0 ? GjkState::Near : GjkState::Overlapping, &s);
    }

    GjkResult<S> finish(GjkState state, const Support* along)
    {
        if (state == GjkState::NotConverged || !m_search.isFinite())
            return fail();
        m_search.remember(state, m_cache);
        if (along != nullptr)
            Search::rememberAxis(m_search.closest(), *along, m_cache);
        return result(state, m_search.closest());
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
    double m_limit;
    GjkCache<S>& m_cache;
    Observer& m_observer;
    std::int32_t m_iterations = 0;
    std::int32_t m_startA = -1;
    std::int32_t m_startB = -1;
};

/// Tells whether two convex shapes are farther apart than maxDistance, by an axis that proves it.
///
/// Van den Bergen 1999, "A Fast and Robust GJK Implementation for Collision Detection of Convex Objects", section 5
/// (ISA-GJK), and the thesis, Algorithm 3. Differences: the cache starts the search from the last axis (two climbs of
/// one or two steps settle most pairs), from the last enclosing tetrahedron (no support at all), else from the last
/// simplex; the solver works in double; maxDistance > 0 asks for a gap instead of any axis.
///
/// @param maxDistance length unit of the world; 0, negative or NaN asks only whether the shapes overlap. The state is
///                    Separated if the distance is larger, Near if it is positive and not larger.
/// @param cache       of this pair in this order; a default-constructed one for a pair without history
/// @param observer    called after each support, see NoObserver
/// Cost: with a valid axis two coherent supports; else one support of each shape per simplex, 2 to 10 simplices.
/// Errors: NotConverged; never loops, since |v| strictly decreases, and never returns a NaN.
template <class S, class A, class B, class Observer>
GjkResult<S> isaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache, Observer& observer)
{
    return IsaGjk<S, A, B, Observer>(a, b, maxDistance, cache, observer).run();
}

template <class S, class A, class B>
GjkResult<S> isaGjk(const A& a, const B& b, S maxDistance, GjkCache<S>& cache)
{
    NoObserver observer;
    return isaGjk(a, b, maxDistance, cache, observer);
}
}  // namespace cullet
