// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/simplex.h"

#include <array>
#include <limits>

namespace cullet::test
{
/// Johnson's distance algorithm with its backup procedure, the comparator of the Voronoi regions: Gilbert, Johnson and
/// Keerthi 1988, "A Fast Procedure for Computing the Distance Between Complex Objects", appendix.
///
/// Cofactors of every subset by the recursion over its points; of the subsets with positive weights the closest counts.
inline ClosestOnSimplex closestByJohnson(const SimplexPoints& p, int count)
{
    std::array<std::array<double, 4>, 16> cofactor = {};
    ClosestOnSimplex best;
    double bestLength2 = std::numeric_limits<double>::infinity();
    for (unsigned subset = 1; subset < (1u << count); ++subset)
    {
        double sum = 0.0;
        bool isPositive = true;
        for (int j = 0; j < count; ++j)
        {
            if ((subset >> j & 1u) == 0)
                continue;
            const unsigned rest = subset & ~(1u << j);
            int first = 0;
            while (rest != 0 && (rest >> first & 1u) == 0)
                ++first;
            double value = rest == 0 ? 1.0 : 0.0;
            for (int i = 0; i < count; ++i)
            {
                if ((rest >> i & 1u) != 0)
                    value += cofactor[rest][i] * p[i].dot(p[first] - p[j]);
            }
            cofactor[subset][j] = value;
            sum += value;
            isPositive = isPositive && value > 0.0;
        }
        if (!isPositive)
            continue;
        ClosestOnSimplex candidate = {Eigen::Vector3d::Zero(), {}, subset, subset == 15u};
        for (int i = 0; i < count; ++i)
        {
            if ((subset >> i & 1u) == 0)
                continue;
            candidate.weights[i] = cofactor[subset][i] / sum;
            candidate.point += candidate.weights[i] * p[i];
        }
        if (candidate.point.squaredNorm() < bestLength2)
        {
            best = candidate;
            bestLength2 = candidate.point.squaredNorm();
        }
    }
    return best;
}
}  // namespace cullet::test
