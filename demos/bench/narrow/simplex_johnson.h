// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/simplex.h"

#include <array>
#include <limits>

namespace cullet
{
/// Johnson's distance algorithm with its backup procedure, the comparator of the Voronoi regions: Gilbert, Johnson and
/// Keerthi 1988, "A Fast Procedure for Computing the Distance Between Complex Objects", appendix.
///
/// Computes the cofactors of every subset by recursion over its points; of the subsets with positive weights the
/// closest is the answer.
inline ClosestOnSimplex closestByJohnson(const SimplexPoints& p, int count)
{
    std::array<std::array<double, 4>, 16> cofactor = {};
    ClosestOnSimplex best = nothingOnSimplex(p, count);
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
        ClosestOnSimplex candidate = {Eigen::Vector3d::Zero(), 0.0, subset, subset == 15u};
        for (int i = 0; i < count; ++i)
        {
            if ((subset >> i & 1u) == 0)
                continue;
            candidate.point += cofactor[subset][i] / sum * p[i];
        }
        candidate.length2 = candidate.point.squaredNorm();
        if (candidate.length2 < best.length2)
            best = candidate;
    }
    return best;
}
}  // namespace cullet
