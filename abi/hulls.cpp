// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface for queries of convex hulls; all in double.
#include "cullet/abi/status.h"
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

using namespace cullet;
using namespace cullet::abi;

struct cullet_hull
{
    Hull<double> hull;
};

struct cullet_hull_cache
{
    GjkCache<double> cache;
};

namespace
{
constexpr std::uint32_t kMostPoints = 1u << 24;

std::vector<Eigen::Vector3d> readPoints(const double* points, std::size_t stride, std::uint32_t count)
{
    std::vector<Eigen::Vector3d> read(count);
    const auto* bytes = reinterpret_cast<const unsigned char*>(points);
    for (std::uint32_t i = 0; i < count; ++i)
        std::memcpy(read[i].data(), bytes + i * stride, 3 * sizeof(double));
    return read;
}

PosedHull<double> place(const cullet_hull* hull, const cullet_pose* pose)
{
    requirePointer(hull, "a hull is NULL");
    if (pose == nullptr)
        return {hull->hull, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    const Eigen::Matrix3d basis = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose->basis);
    const Eigen::Vector3d origin = Eigen::Map<const Eigen::Vector3d>(pose->origin);
    require(basis.allFinite() && origin.allFinite(), CULLET_ERROR_NOT_FINITE, "a pose is not finite");
    require(basis.determinant() != 0.0, CULLET_ERROR_ARGUMENT, "the basis of a pose cannot be inverted");
    return {hull->hull, basis, origin};
}

/// The cache of the caller, or a temporary one.
GjkCache<double>& chooseCache(cullet_hull_cache* cache, GjkCache<double>& temporary)
{
    return cache != nullptr ? cache->cache : temporary;
}

void requireAnswer(GjkState state)
{
    require(state != GjkState::NotConverged, CULLET_ERROR_NOT_CONVERGED,
            "the hulls are degenerate beyond double precision");
}

void store(const Eigen::Vector3d& vector, double* out)
{
    std::copy_n(vector.data(), 3, out);
}

/// @param origin of A, to which the points are relative
void storePoints(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& origin,
                 cullet_hull_result& result)
{
    store(a + origin, result.point_a);
    store(b + origin, result.point_b);
}
}  // namespace

cullet_status cullet_hull_create(const double* points, size_t stride, uint32_t count, cullet_hull** hull)
{
    return guarded(
        [&]
        {
            requirePointer(hull, "hull is NULL");
            requirePointer(points, "points is NULL");
            require(count >= 1 && count <= kMostPoints, CULLET_ERROR_ARGUMENT, "1 to 2^24 points expected");
            constexpr std::size_t kPoint = 3 * sizeof(double);
            require(stride == 0 || stride >= kPoint, CULLET_ERROR_SIZE, "stride: at least 24 bytes expected");
            const std::size_t used = stride == 0 ? kPoint : stride;
            requireAddressable(kPoint, used, count);
            const auto read = readPoints(points, used, count);
            auto made = std::make_unique<cullet_hull>(cullet_hull{makeHull(read)});
            require(made->hull.kind() != HullKind::NotFinite, CULLET_ERROR_NOT_FINITE,
                    "a point is not finite, or beyond 1e60");
            *hull = made.release();
            return CULLET_OK;
        });
}

uint32_t cullet_hull_vertex_count(const cullet_hull* hull)
{
    return hull == nullptr ? 0 : static_cast<uint32_t>(hull->hull.vertexCount());
}

void cullet_hull_destroy(cullet_hull* hull)
{
    delete hull;
}

cullet_status cullet_hull_cache_create(cullet_hull_cache** cache)
{
    return guarded(
        [&]
        {
            requirePointer(cache, "cache is NULL");
            *cache = new cullet_hull_cache{};
            return CULLET_OK;
        });
}

void cullet_hull_cache_destroy(cullet_hull_cache* cache)
{
    delete cache;
}

cullet_status cullet_hull_overlap(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                  const cullet_pose* pose_b, cullet_hull_cache* cache, int32_t* overlaps,
                                  double* axis)
{
    return guarded(
        [&]
        {
            requirePointer(overlaps, "overlaps is NULL");
            const PosedHull<double> placedA = place(a, pose_a), placedB = place(b, pose_b);
            GjkCache<double> temporary;
            GjkCache<double>& used = chooseCache(cache, temporary);
            const GjkResult<double> answer = isaGjk(placedA, placedB, 0.0, used);
            requireAnswer(answer.state);
            *overlaps = answer.state == GjkState::Overlapping;
            if (axis != nullptr)
                store(*overlaps ? Eigen::Vector3d::Zero() : answer.axis, axis);
            return CULLET_OK;
        });
}

cullet_status cullet_hull_distance(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                   const cullet_pose* pose_b, double max_distance, cullet_hull_cache* cache,
                                   cullet_hull_result* result)
{
    return guarded(
        [&]
        {
            requireResult<sizeof(cullet_hull_result)>(result);
            require(max_distance >= 0, CULLET_ERROR_ARGUMENT,
                    "max_distance: not negative and no NaN expected");
            const PosedHull<double> placedA = place(a, pose_a), placedB = place(b, pose_b);
            GjkCache<double> temporary;
            GjkCache<double>& used = chooseCache(cache, temporary);
            const GjkResult<double> answer = gjkDistance(placedA, placedB, max_distance, used);
            requireAnswer(answer.state);
            cullet_hull_result known{};
            known.state = static_cast<std::int32_t>(answer.state);
            store(answer.axis, known.axis);
            if (answer.state == GjkState::Near)
            {
                known.distance = answer.distance;
                storePoints(answer.pointA, answer.pointB, placedA.origin(), known);
            }
            writeResult(known, result);
            return CULLET_OK;
        });
}

cullet_status cullet_hull_penetration(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                      const cullet_pose* pose_b, cullet_hull_cache* cache,
                                      cullet_hull_result* result)
{
    return guarded(
        [&]
        {
            requireResult<sizeof(cullet_hull_result)>(result);
            const PosedHull<double> placedA = place(a, pose_a), placedB = place(b, pose_b);
            GjkCache<double> temporary;
            GjkCache<double>& used = chooseCache(cache, temporary);
            const PenetrationResult<double> answer = penetration(placedA, placedB, used);
            requireAnswer(answer.state);
            cullet_hull_result known{};
            known.state = CULLET_SEPARATED;
            if (answer.state == GjkState::Overlapping)
            {
                known.state = CULLET_OVERLAPPING;
                known.distance = -answer.depth;
                store(answer.axis, known.axis);
                storePoints(answer.pointA, answer.pointB, placedA.origin(), known);
            }
            writeResult(known, result);
            return CULLET_OK;
        });
}
