// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The unique id of a proxy as a number from 0 to 2^32 - 1, in the order in which a broad phase makes proxies.
///
/// Bullet stores and compares it as int: isLowerId().
inline std::uint32_t uniqueIdOf(const btBroadphaseProxy* proxy) noexcept
{
    return static_cast<std::uint32_t>(proxy->m_uniqueId);
}

/// Whether a proxy is the first of a pair with another one, by the order of btBroadphasePair's constructor.
inline bool isLowerId(const btBroadphaseProxy& proxy, const btBroadphaseProxy& other) noexcept
{
    return proxy.m_uniqueId < other.m_uniqueId;
}

/// The ids in the order of btBroadphasePair, which compares them as int.
inline Pair inBulletsOrder(Pair ids) noexcept
{
    return static_cast<std::int32_t>(ids.first) < static_cast<std::int32_t>(ids.second)
               ? ids
               : Pair{ids.second, ids.first};
}

/// The ids of both proxies in Pair's order, which differs from that of btBroadphasePair if one is 2^31 or more.
inline Pair pairOf(const btBroadphasePair& pair) noexcept
{
    return makePair(uniqueIdOf(pair.m_pProxy0), uniqueIdOf(pair.m_pProxy1));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
