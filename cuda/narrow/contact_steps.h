// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/depth_steps.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/pair_patch.h"
#include "cullet/cuda/narrow/pair_steps.h"
#include "cullet/cuda/narrow/pair_types.h"

#include <cstdint>

namespace cullet::convex
{
/// Finds the points of contacts whose depths are known. Called for each lane.
struct MakeContacts
{
    PairReader reader;
    SurfaceTables surfaces;
    OverlapLists lists;
    float margin;  ///< points farther apart are left out
    std::uint32_t lanes;

    CULLET_HOST_DEVICE void operator()(std::uint64_t lane) const
    {
        for (std::uint64_t k = lane; k < lists.count(); k += lanes)
            lists.contacts[k] = contactOf(static_cast<std::uint32_t>(k));
    }

private:
    /// Closer points count as one, in units of the size.
    static constexpr double kLeastDistance = 1e-3;

    CULLET_HOST_DEVICE PairContact contactOf(std::uint32_t k) const
    {
        ReadPair bodies;
        reader.read(reader.input.pairs[lists.overlaps[k]], bodies);
        const PosedPair<double> posed = bodies.posed<double>();
        const PairDepth depth = lists.depths[k];
        const Vec<double> rounded = {double(depth.normal[0]), double(depth.normal[1]),
                                     double(depth.normal[2])};
        const Vec<double> normal = rounded * (1.0 / rootOf(dot(rounded, rounded)));
        const ContactFrame frame(normal);
        const TouchingFace a(surfaces, bodies.a.hull, posed.hullA(), posed.turnA(), frame, -1.0, {0, 0, 0});
        const TouchingFace b(surfaces, bodies.b.hull, posed.hullB(), posed.turnB(), frame, 1.0,
                             posed.offset());
        const PatchCorners corners(a, b, double(depth.depth), double(margin));
        const FramePoint onB =
            frame.coordinatesOf({double(depth.pointB[0]), double(depth.pointB[1]), double(depth.pointB[2])});
        const PatchChoice choice(corners, {onB.x, onB.y, onB.z, double(depth.depth)}, double(margin),
                                 kLeastDistance * posed.size());
        PairContact contact = {{depth.normal[0], depth.normal[1], depth.normal[2]}, choice.count(), {}};
        CULLET_UNROLL
        for (std::uint32_t i = 0; i < 4; ++i)
        {
            if (i >= choice.count())
                continue;
            const PatchPoint& p = choice.point(i);
            const Vec<double> world = frame.world({p.x, p.y, p.onB});
            contact.points[i] = {{float(world.x), float(world.y), float(world.z)}, float(p.depth)};
        }
        return contact;
    }
};
}  // namespace cullet::convex
