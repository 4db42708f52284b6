// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>

// Mangled names of constructors and destructors, of complete objects (1) and of base classes (2), which have no
// address in C++.
#define CULLET_CONSTRUCT "_ZN16btDbvtBroadphaseC1EP22btOverlappingPairCache"
#define CULLET_CONSTRUCT_BASE "_ZN16btDbvtBroadphaseC2EP22btOverlappingPairCache"
#define CULLET_DELETE "_ZN16btDbvtBroadphaseD0Ev"
#define CULLET_DESTROY "_ZN16btDbvtBroadphaseD1Ev"
#define CULLET_DESTROY_BASE "_ZN16btDbvtBroadphaseD2Ev"
#define CULLET_CONSTRUCT_DISPATCHER "_ZN21btCollisionDispatcherC1EP24btCollisionConfiguration"
#define CULLET_CONSTRUCT_BASE_DISPATCHER "_ZN21btCollisionDispatcherC2EP24btCollisionConfiguration"

namespace cullet::preload
{
/// The functions of Bullet that the preloaded library interposes.
enum class Function
{
    Construct,
    ConstructBase,
    Delete,
    Destroy,
    DestroyBase,
    ConstructDispatcher,
    ConstructBaseDispatcher,
    CreateProxy,
    DestroyProxy,
    SetAabb,
    GetAabb,
    RayTest,
    AabbTest,
    CalculateOverlappingPairs,
    GetOverlappingPairCache,
    GetOverlappingPairCacheConst,
    GetBroadphaseAabb,
    PrintStats,
    ResetPool,
    Collide,
    Optimize,
    PerformDeferredRemoval,
    SetAabbForceUpdate,
    Count
};

inline constexpr std::size_t kFunctionCount = static_cast<std::size_t>(Function::Count);

/// Symbol names in the order of Function. They are the same in both precisions.
inline constexpr const char* kFunctionNames[kFunctionCount] = {
    CULLET_CONSTRUCT,
    CULLET_CONSTRUCT_BASE,
    CULLET_DELETE,
    CULLET_DESTROY,
    CULLET_DESTROY_BASE,
    CULLET_CONSTRUCT_DISPATCHER,
    CULLET_CONSTRUCT_BASE_DISPATCHER,
    "_ZN16btDbvtBroadphase11createProxyERK9btVector3S2_iPviiP12btDispatcher",
    "_ZN16btDbvtBroadphase12destroyProxyEP17btBroadphaseProxyP12btDispatcher",
    "_ZN16btDbvtBroadphase7setAabbEP17btBroadphaseProxyRK9btVector3S4_P12btDispatcher",
    "_ZNK16btDbvtBroadphase7getAabbEP17btBroadphaseProxyR9btVector3S3_",
    "_ZN16btDbvtBroadphase7rayTestERK9btVector3S2_R23btBroadphaseRayCallbackS2_S2_",
    "_ZN16btDbvtBroadphase8aabbTestERK9btVector3S2_R24btBroadphaseAabbCallback",
    "_ZN16btDbvtBroadphase25calculateOverlappingPairsEP12btDispatcher",
    "_ZN16btDbvtBroadphase23getOverlappingPairCacheEv",
    "_ZNK16btDbvtBroadphase23getOverlappingPairCacheEv",
    "_ZNK16btDbvtBroadphase17getBroadphaseAabbER9btVector3S1_",
    "_ZN16btDbvtBroadphase10printStatsEv",
    "_ZN16btDbvtBroadphase9resetPoolEP12btDispatcher",
    "_ZN16btDbvtBroadphase7collideEP12btDispatcher",
    "_ZN16btDbvtBroadphase8optimizeEv",
    "_ZN16btDbvtBroadphase22performDeferredRemovalEP12btDispatcher",
    "_ZN16btDbvtBroadphase18setAabbForceUpdateEP17btBroadphaseProxyRK9btVector3S4_P12btDispatcher",
};
}  // namespace cullet::preload
