// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Why a dispatch computed its contacts on the calling thread, one pair after the other.
enum class SerialReason : std::uint8_t
{
    None,                ///< contacts of pairs with known algorithms were computed together
    OneThread,           ///< of DispatcherOptions::threads, or of the machine
    NearCallback,        ///< the application has a near callback
    ContinuousDispatch,  ///< DISPATCH_CONTINUOUS: one time of impact for all pairs
    DerivedDispatcher,   ///< a derived class may override needsCollision(), getNewManifold() and others
    ContactCallback,     ///< gContactAdded-, Processed-, Started-, Ended- or DestroyedCallback is set
    CombinedCallback,    ///< a gCalculateCombined...Callback is the application's
    ManifoldLimit,       ///< CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION: a pair may remain without a manifold
    SeparatingAxisTest,  ///< btDispatcherInfo::m_enableSatConvex: Bullet's test counts in global variables
    DepthSolver,         ///< the configuration's penetration depth solver is the application's
    UnknownPairCache,    ///< neither Bullet's nor cullet's: its passes may run other code between pairs
    FewPairs,            ///< so few in the last dispatch that waking a thread would not pay
    OutOfMemory          ///< for the list of pairs; those in the list were computed together
};
inline constexpr std::size_t kSerialReasons = std::size_t(SerialReason::OutOfMemory) + 1;

/// Where a Dispatcher has computed contacts. Pairs that are idle or asleep are not counted, and no pair is where all take
/// Bullet's near callback or one of the application: NearCallback, ContinuousDispatch, DerivedDispatcher.
struct ContactStats
{
    SerialReason reason = SerialReason::None;  ///< of the last dispatch
    std::uint64_t pairs = 0;                   ///< of the last dispatch whose contacts were computed
    std::uint64_t jobs = 0;                    ///< the part of them that was computed together
    std::uint64_t jobsTotal = 0;               ///< of all dispatches
    std::uint64_t dividedTotal = 0;   ///< the part of jobsTotal that was divided among several threads
    std::uint64_t helpedTotal = 0;    ///< the part of it that other threads ran; differs between runs
    std::uint64_t inOrderTotal = 0;   ///< pairs that were processed one by one
    std::uint64_t barriersTotal = 0;  ///< the part of it with an unknown algorithm, which waits for all jobs
    std::array<std::uint64_t, kSerialReasons> dispatchesTotal = {};  ///< dispatches by SerialReason
};
}  // namespace cullet
