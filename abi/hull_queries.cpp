// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/hull_queries.h"

#include "cullet/abi/status.h"
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"

#include <Eigen/LU>

#include <algorithm>
#include <vector>

namespace cullet::abi
{
namespace
{
static_assert(static_cast<int>(GjkState::Separated) == CULLET_SEPARATED &&
              static_cast<int>(GjkState::Near) == CULLET_NEAR &&
              static_cast<int>(GjkState::Overlapping) == CULLET_OVERLAPPING &&
              static_cast<int>(GjkState::NotConverged) == CULLET_NOT_CONVERGED);
static_assert(static_cast<int>(HullQuery::Overlap) == CULLET_QUERY_OVERLAP &&
              static_cast<int>(HullQuery::Distance) == CULLET_QUERY_DISTANCE &&
              static_cast<int>(HullQuery::Penetration) == CULLET_QUERY_PENETRATION &&
              static_cast<int>(HullQuery::Contact) == CULLET_QUERY_CONTACT);

using Shape = PosedHull<double>;

constexpr std::uint32_t kMostPoints = 1u << 24;

std::vector<Eigen::Vector3d> readPoints(const double* points, std::size_t stride, std::uint32_t count)
{
    std::vector<Eigen::Vector3d> read(count);
    const auto* bytes = reinterpret_cast<const unsigned char*>(points);
    for (std::uint32_t i = 0; i < count; ++i)
        std::memcpy(read[i].data(), bytes + i * stride, 3 * sizeof(double));
    return read;
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

cullet_hull_result emptyResult(GjkState state)
{
    cullet_hull_result result{};
    result.state = static_cast<std::int32_t>(state);
    return result;
}

cullet_hull_result queryOverlap(const Shape& a, const Shape& b, GjkCache<double>& cache)
{
    const GjkResult<double> answer = isaGjk(a, b, 0.0, cache);
    cullet_hull_result result = emptyResult(answer.state);
    if (answer.state == GjkState::Separated || answer.state == GjkState::Near)
    {
        result.state = CULLET_SEPARATED;
        store(answer.axis, result.axis);
    }
    return result;
}

cullet_hull_result queryDistance(const Shape& a, const Shape& b, double maxDistance, GjkCache<double>& cache)
{
    const GjkResult<double> answer = gjkDistance(a, b, maxDistance, cache);
    cullet_hull_result result = emptyResult(answer.state);
    if (answer.state == GjkState::Near || answer.state == GjkState::Separated)
        store(answer.axis, result.axis);
    if (answer.state == GjkState::Near)
    {
        result.distance = answer.distance;
        storePoints(answer.pointA, answer.pointB, a.origin(), result);
    }
    return result;
}

cullet_hull_result queryPenetration(const Shape& a, const Shape& b, GjkCache<double>& cache)
{
    const PenetrationResult<double> answer = penetration(a, b, cache);
    if (answer.state == GjkState::NotConverged)
        return emptyResult(answer.state);
    if (answer.state != GjkState::Overlapping)
        return emptyResult(GjkState::Separated);
    cullet_hull_result result = emptyResult(answer.state);
    result.distance = -answer.depth;
    store(answer.axis, result.axis);
    storePoints(answer.pointA, answer.pointB, a.origin(), result);
    return result;
}

/// The depth where the distance is zero. Hulls that touch within rounding may overlap for one query only: then they touch.
cullet_hull_result queryContact(const Shape& a, const Shape& b, double maxDistance, GjkCache<double>& cache)
{
    const cullet_hull_result apart = queryDistance(a, b, maxDistance, cache);
    if (apart.state != CULLET_OVERLAPPING)
        return apart;
    const cullet_hull_result overlapping = queryPenetration(a, b, cache);
    return overlapping.state == CULLET_SEPARATED ? apart : overlapping;
}
}  // namespace

std::unique_ptr<cullet_hull> makeHullHandle(const double* points, std::size_t stride, std::uint32_t count)
{
    requirePointer(points, "points is NULL");
    require(count >= 1 && count <= kMostPoints, CULLET_ERROR_ARGUMENT, "1 to 2^24 points expected");
    constexpr std::size_t kPoint = 3 * sizeof(double);
    require(stride == 0 || stride >= kPoint, CULLET_ERROR_SIZE, "stride: at least 24 bytes expected");
    const std::size_t used = stride == 0 ? kPoint : stride;
    requireAddressable(kPoint, used, count);
    auto made = std::make_unique<cullet_hull>(cullet_hull{makeHull(readPoints(points, used, count))});
    require(made->hull.kind() != HullKind::NotFinite, CULLET_ERROR_NOT_FINITE,
            "a point is not finite, or beyond 1e60");
    return made;
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

cullet_hull_result queryHulls(HullQuery query, const PosedHull<double>& a, const PosedHull<double>& b,
                              double maxDistance, GjkCache<double>& cache)
{
    switch (query)
    {
        case HullQuery::Overlap:
            return queryOverlap(a, b, cache);
        case HullQuery::Distance:
            return queryDistance(a, b, maxDistance, cache);
        case HullQuery::Penetration:
            return queryPenetration(a, b, cache);
        case HullQuery::Contact:
            break;
    }
    return queryContact(a, b, maxDistance, cache);
}
}  // namespace cullet::abi
