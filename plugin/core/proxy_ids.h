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
/// Of a proxy; Bullet has it as int.
inline std::uint32_t uniqueIdOf(const btBroadphaseProxy* proxy) noexcept
{
    return static_cast<std::uint32_t>(proxy->m_uniqueId);
}

/// The ids of both proxies in Pair's order, which is not that of btBroadphasePair where one is 2^31 or more.
inline Pair pairOf(const btBroadphasePair& pair) noexcept
{
    return makePair(uniqueIdOf(pair.m_pProxy0), uniqueIdOf(pair.m_pProxy1));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
