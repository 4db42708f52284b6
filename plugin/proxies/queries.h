// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/queries/query_index.h"
#include "cullet/broad/row_source.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What finds candidates for a query.
struct QuerySources
{
    const QueryIndex& index;
    const RowSource* rows;  ///< knows where all rows are; or null
    std::uint64_t update;   ///< number of the update that it has done
};

/// Reports the proxies that a ray, or a box swept along it, hits by Bullet's own test (btRayAabb2) on the exact boxes.
///
/// All hits are collected before the first is reported, so that the callback may change anything; proxies that it
/// destroys are not reported. Each hit is reported once, in ascending unique id. Safe to run concurrently and nested.
void testRay(const ProxyStore& store, const QuerySources& sources, const btVector3& from,
             const btVector3& boxMin, const btVector3& boxMax, btBroadphaseRayCallback& callback);

/// Reports the proxies whose exact box overlaps the box, with the same guarantees as testRay().
void testBox(const ProxyStore& store, const QuerySources& sources, const btVector3& boxMin,
             const btVector3& boxMax, btBroadphaseAabbCallback& callback);
}  // namespace CULLET_PRECISION
}  // namespace cullet
