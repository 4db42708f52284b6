// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/thesis/principal_axis.h"

#include <Eigen/Eigenvalues>

namespace cullet::psap
{
Directions principalDirections(const CentreSums& sums)
{
    constexpr Directions kWorldAxes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const double n = sums.count == 0 ? 1.0 : static_cast<double>(sums.count);
    const Eigen::Vector3d mean = Eigen::Vector3d(sums.sum[0], sums.sum[1], sums.sum[2]) / n;
    Eigen::Matrix3d covariance;
    for (int axis = 0; axis < 3; ++axis)
    {
        const int next = (axis + 1) % 3;
        covariance(axis, axis) = sums.product[axis] / n - mean[axis] * mean[axis];
        covariance(axis, next) = covariance(next, axis) =
            sums.product[axis + 3] / n - mean[axis] * mean[next];
    }
    if (!covariance.allFinite())
        return kWorldAxes;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    if (solver.info() != Eigen::Success)
        return kWorldAxes;
    Directions directions;
    for (int k = 0; k < 3; ++k)
    {
        // Eigen sorts eigenvalues ascending.
        const Eigen::Vector3f direction = solver.eigenvectors().col(2 - k).cast<float>();
        for (int axis = 0; axis < 3; ++axis)
            directions.along[k][axis] = direction[axis];
    }
    return directions;
}
}  // namespace cullet::psap
