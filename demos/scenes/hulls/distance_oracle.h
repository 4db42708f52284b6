// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

/// Reference distance of two posed hulls, in long double and independent of the library's simplex solver and searches.
namespace cullet
{
using LongVector = Eigen::Matrix<long double, 3, 1>;

/// Distance with proof: a plane with a gap of `lower` between the shapes, and two points at distance `upper`. 0, 0 if
/// they overlap; then `inner` is the radius of the largest ball around the origin found inside a tetrahedron of A - B.
struct Bounds
{
    long double lower = 0.0L;
    long double upper = std::numeric_limits<long double>::infinity();
    bool isInside = false;
    LongVector axis = LongVector::Zero();
};

/// GJK over vertex lists with all subsets of the simplex solved by Cramer's rule (Johnson's distance algorithm).
class DistanceOracle
{
public:
    template <class S>
    DistanceOracle(const PosedHull<S>& a, const PosedHull<S>& b)
    {
        const LongVector shift =
            b.origin().template cast<long double>() - a.origin().template cast<long double>();
        place(a, LongVector::Zero(), m_a);
        place(b, shift, m_b);
    }

    Bounds solve() const
    {
        Bounds bounds;
        std::vector<LongVector> simplex = {m_a.front() - m_b.front()};
        LongVector v = simplex.front();
        for (int i = 0; i < 500; ++i)
        {
            bounds.upper = std::min(bounds.upper, v.norm());
            const LongVector w = support(v);
            const long double lower = v.dot(w) / v.norm();
            if (lower > bounds.lower)
            {
                bounds.lower = lower;
                bounds.axis = v / v.norm();
            }
            // 1e-17: a fiftieth of the resolution that the tests need, per unit of size.
            if (bounds.upper - bounds.lower <= 1e-17L)
                break;
            simplex.push_back(w);
            const long double before = v.squaredNorm();
            if (!reduce(simplex, v))
            {
                bounds.isInside = true;
                bounds.lower = bounds.upper = 0.0L;
                return bounds;
            }
            if (!(v.squaredNorm() < before))
                break;
        }
        return bounds;
    }

    /// Support of A - B against v: the smallest v.w, by brute force.
    LongVector support(const LongVector& v) const
    {
        return *std::min_element(m_a.begin(), m_a.end(),
                                 [&v](const auto& l, const auto& r) { return v.dot(l) < v.dot(r); }) -
               *std::max_element(m_b.begin(), m_b.end(),
                                 [&v](const auto& l, const auto& r) { return v.dot(l) < v.dot(r); });
    }

    /// Largest extent of A - B along a direction of any length.
    long double extent(const LongVector& direction) const
    {
        return direction.dot(support(-direction)) / direction.norm();
    }

private:
    template <class S>
    static void place(const PosedHull<S>& posed, const LongVector& shift, std::vector<LongVector>& out)
    {
        const Eigen::Matrix<long double, 3, 3> basis = posed.basis().template cast<long double>();
        for (std::int32_t v = 0; v < posed.hull().vertexCount(); ++v)
            out.push_back(basis * posed.hull().vertex(v).template cast<long double>() + shift);
    }

    static bool solveSubset(const std::vector<LongVector>& p, unsigned subset, LongVector& point)
    {
        std::vector<LongVector> q;
        for (std::size_t i = 0; i < p.size(); ++i)
        {
            if ((subset >> i & 1u) != 0)
                q.push_back(p[i]);
        }
        if (q.size() == 1)
        {
            point = q[0];
            return true;
        }
        if (q.size() == 2)
        {
            const LongVector e = q[1] - q[0];
            const long double t = -q[0].dot(e) / e.squaredNorm();
            point = q[0] + t * e;
            return t > 0.0L && t < 1.0L;
        }
        const LongVector e = q[1] - q[0], f = q[2] - q[0], n = e.cross(f);
        const long double area2 = n.squaredNorm();
        const long double s = n.dot(f.cross(q[0])) / area2, t = n.dot(q[0].cross(e)) / area2;
        point = n * (q[0].dot(n) / area2);
        return s > 0.0L && t > 0.0L && s + t < 1.0L;
    }

    static bool contains(const std::vector<LongVector>& p)
    {
        const LongVector a = p[0] - p[3], b = p[1] - p[3], c = p[2] - p[3];
        const long double volume = a.dot(b.cross(c));
        const long double wa = -p[3].dot(b.cross(c)) / volume, wb = -p[3].dot(c.cross(a)) / volume,
                          wc = -p[3].dot(a.cross(b)) / volume;
        return wa >= 0.0L && wb >= 0.0L && wc >= 0.0L && wa + wb + wc <= 1.0L;
    }

    /// @return false if the origin is inside; else v is the closest point and the simplex its smallest subset
    static bool reduce(std::vector<LongVector>& simplex, LongVector& v)
    {
        if (simplex.size() == 4 && contains(simplex))
            return false;
        unsigned bestSubset = 0;
        long double best = std::numeric_limits<long double>::infinity();
        for (unsigned subset = 1; subset < (1u << simplex.size()); ++subset)
        {
            LongVector point;
            if (subset != 15u && solveSubset(simplex, subset, point) && point.squaredNorm() < best)
            {
                best = point.squaredNorm();
                bestSubset = subset;
                v = point;
            }
        }
        std::vector<LongVector> kept;
        for (std::size_t i = 0; i < simplex.size(); ++i)
        {
            if ((bestSubset >> i & 1u) != 0)
                kept.push_back(simplex[i]);
        }
        simplex = std::move(kept);
        return true;
    }

    std::vector<LongVector> m_a, m_b;
};
}  // namespace cullet
