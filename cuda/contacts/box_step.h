// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/hull_view.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/posed_pair.h"
#include "cullet/cuda/narrow/turn.h"

#include <cmath>
#include <cstdint>

namespace cullet::contacts
{
/// Writes the box of a body: at least its hull, and no more than 1e-5 of its size larger; grown by a margin. Empty for a
/// body with an invalid pose or hull.
struct BoxOfBody
{
    convex::HullTables hulls;
    const BodyPose* poses;
    float margin;  ///< 0 or more
    Aabb* boxes;

    CULLET_HOST_DEVICE void operator()(std::uint64_t body) const
    {
        const BodyPose pose = poses[body];
        boxes[body] = convex::isUsable(pose) && pose.hull < hulls.hulls ? boxOf(pose) : kEmptyAabb;
    }

private:
    CULLET_HOST_DEVICE Aabb boxOf(const BodyPose& pose) const
    {
        const convex::HullView hull(hulls, pose.hull);
        if (hull.vertexCount() == 0)
            return kEmptyAabb;
        const float reach = hull.reach();
        // Elsewhere products may underflow or overflow.
        const bool isRounded = reach > 1e-6f && reach < 1e6f;
        const convex::Turn<float> turn =
            convex::turnOf(pose.rotation[0], pose.rotation[1], pose.rotation[2], pose.rotation[3]);
        Aabb box;
        for (int axis = 0; axis < 3; ++axis)
        {
            const convex::Vec<float> up = {float(axis == 0), float(axis == 1), float(axis == 2)};
            const float at = pose.position[axis];
            // A turned axis is off by 37 units of rounding, products by 3, sums by 2 each.
            const float error = convex::kRounding<float> * (72.0f * reach + 4.0f * fabsf(at) + 4.0f * margin);
            const float grown = margin + error;
            const convex::Vec<float> direction = turn.back(up);
            box.min[axis] = at - ((isRounded ? hull.support(-direction, -1).height : reach) + grown);
            box.max[axis] = at + ((isRounded ? hull.support(direction, -1).height : reach) + grown);
        }
        return box;
    }
};
}  // namespace cullet::contacts
