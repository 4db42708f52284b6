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
/// The unique id of a proxy, which Bullet stores as int.
inline std::uint32_t uniqueIdOf(const btBroadphaseProxy* proxy) noexcept
{
    return static_cast<std::uint32_t>(proxy->m_uniqueId);
}

/// The ids of both proxies in Pair's order, which differs from that of btBroadphasePair if one is 2^31 or more.
inline Pair pairOf(const btBroadphasePair& pair) noexcept
{
    return makePair(uniqueIdOf(pair.m_pProxy0), uniqueIdOf(pair.m_pProxy1));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
