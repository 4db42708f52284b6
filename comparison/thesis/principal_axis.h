// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/scene_statistics.h"

#include <cstdint>

/// The sweep direction of Liu et al. 2010: the principal component of the centres, instead of a world axis.
///
/// Boxes are projected onto the principal directions. Cells and the sweep use the projections, the tests use the
/// boxes themselves. A projection is longer than its box, by up to a factor of sqrt(3), so that this pays only where
/// the scene is oblique to the world axes.
namespace cullet::psap
{
/// Sums over the centres of bounded boxes.
struct CentreSums
{
    double sum[3];
    double product[6];  ///< xx, yy, zz, xy, yz, zx
    std::uint64_t count;

    CULLET_HOST_DEVICE void reset()
    {
        for (int k = 0; k < 3; ++k)
            sum[k] = product[k] = product[k + 3] = 0;
        count = 0;
    }

    CULLET_HOST_DEVICE void add(const Aabb& box)
    {
        double centre[3];
        for (int axis = 0; axis < 3; ++axis)
        {
            centre[axis] = 0.5 * (static_cast<double>(box.min[axis]) + static_cast<double>(box.max[axis]));
            sum[axis] += centre[axis];
            product[axis] += centre[axis] * centre[axis];
        }
        for (int axis = 0; axis < 3; ++axis)
            product[axis + 3] += centre[axis] * centre[(axis + 1) % 3];
        ++count;
    }

    CULLET_HOST_DEVICE void add(const CentreSums& other)
    {
        for (int k = 0; k < 3; ++k)
        {
            sum[k] += other.sum[k];
            product[k] += other.product[k];
            product[k + 3] += other.product[k + 3];
        }
        count += other.count;
    }
};

/// Sums every `parts`-th box into one of `parts` partial sums, in an order that depends on the counts alone, so that
/// every executor gets the same bits.
struct SumCentres
{
    const Aabb* boxes;
    std::uint64_t count;
    std::uint64_t parts;
    CentreSums* sums;  ///< [parts]

    CULLET_HOST_DEVICE void operator()(std::uint64_t part) const
    {
        CentreSums own;
        own.reset();
        for (std::uint64_t i = part; i < count; i += parts)
        {
            const Aabb box = loadBox(boxes, i);
            if (isValid(box) && boundedExtent(box) <= kUnboundedExtent)
                own.add(box);
        }
        sums[part] = own;
    }
};

/// Adds all partial sums up. One index.
struct AddCentres
{
    const CentreSums* parts;
    std::uint64_t count;
    CentreSums* sum;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        CentreSums all;
        all.reset();
        for (std::uint64_t part = 0; part < count; ++part)
            all.add(parts[part]);
        *sum = all;
    }
};

/// Three directions of length one, perpendicular to each other; the first is the sweep direction.
struct Directions
{
    float along[3][3];
};

/// Eigenvectors of the covariance matrix, that of the largest eigenvalue first; the world axes if there is none.
Directions principalDirections(const CentreSums& sums);

/// Projects box i onto the directions.
///
/// Projections of overlapping boxes overlap exactly: both ends are sums of the same three products in the same order,
/// and rounding is monotone.
struct ProjectBox
{
    const Aabb* boxes;
    Directions directions;
    Aabb* projections;  ///< [boxes, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const Aabb box = loadBox(boxes, i);
        Aabb projection;
        for (int k = 0; k < 3; ++k)
        {
            const float(&direction)[3] = directions.along[k];
            projection.min[k] = projection.max[k] = 0;
            for (int axis = 0; axis < 3; ++axis)
            {
                const bool isForward = direction[axis] > 0;
                projection.min[k] += direction[axis] * (isForward ? box.min[axis] : box.max[axis]);
                projection.max[k] += direction[axis] * (isForward ? box.max[axis] : box.min[axis]);
            }
        }
        projections[i] = projection;
    }
};
}  // namespace cullet::psap
