// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/delta_counts.h"
#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/convex_pairs.h"

#include <cstdint>
#include <memory>
#include <string>

struct CUstream_st;

namespace cullet
{
/// What a DeviceContactFinder is asked for.
struct ContactQuery
{
    /// By how much the box of each body is grown, in the unit of the poses: pairs are found that are apart by up to twice
    /// that much along each axis. 0 or more.
    float margin = 0.0f;
    ConvexQuery pairs;  ///< asked of each pair
};

/// The pairs that a DeviceContactFinder has found, in device memory.
struct DeviceContacts
{
    /// [answers.count] rows of the poses, the lower one first; in ascending order.
    const RowPair* pairs = nullptr;
    DevicePairAnswers answers;  ///< of these pairs, in their order
};

/// The addresses that enqueue() will write, valid once the stream has run its work: for later work on that stream, so that
/// the CPU need not wait.
struct DeviceContactsAhead
{
    /// answers.count is the room of the lists. Beyond *count, pairs are {kNoRow, kNoRow} and their states Invalid.
    DeviceContacts contacts;
    /// Number of pairs, in device memory. 2^64 - 1 where a list was too short: all is void, and collect() repeats it.
    const std::uint64_t* count = nullptr;
};

/// How many pairs there are, which outcome they had, and how they changed.
struct ContactCounts
{
    ConvexPairCounts pairs;
    DeltaCounts changes = {0, 0, 0};  ///< of pairs since the last enqueue()
};

/// Finds the convex bodies near each other, and which of them overlap: all work is on a device, on one stream, from poses
/// to answers. Row i of the poses is the same body from call to call; bodies may come and go at the end.
///
/// A body has the box of its hull, at most 1e-5 of its size and its distance from the origin larger. Pairs are those whose
/// boxes overlap; DeviceDeltaFinder's search finds how they change. What DeviceConvexPairs remembers of a pair, to answer
/// it faster, goes with the pair as long as its boxes overlap, while other pairs come and go. Its answers, distances, depths
/// and contacts, and their tolerances, are those of DeviceConvexPairs.
///
/// The same sequence of calls gives the same pairs, in the same order, and the same answers, bit by bit, on every device
/// and on the CPU (contacts::ContactSearch<convex::HostPairExec>). No list has a capacity.
///
/// A body whose pose or hull is invalid (PairState::Invalid) has no pairs.
///
/// enqueue() only puts work on the stream. It waits for the work of the previous enqueue(), so that the CPU may be one set of
/// poses ahead, and where memory has to grow. The second call with the same poses, their number and query is recorded
/// in a graph, which later ones launch.
///
/// Uses, in addition to DeviceDeltaFinder's memory, 24 bytes for each body, 98 for each pair and 24 for each of the most pairs
/// that entered or left at once; and what a ConvexQuery asks for.
class CULLET_API DeviceContactFinder
{
public:
    virtual ~DeviceContactFinder() = default;

    /// @return Ok, or the reason of a failure; all pairs are then forgotten, and the next enqueue() starts anew.
    ///     OutOfMemory for 2^31 bodies or more
    virtual Status enqueue(const DeviceBodies& bodies, const ContactQuery& query) = 0;

    /// Void after collect() or another enqueue(). As with DeviceConvexPairs, overlaps beyond DevicePairAnswers::room have
    /// depths and contacts from collect() on.
    virtual DeviceContactsAhead ahead() const = 0;

    /// Waits for the last enqueue(). Where a list was too short, repeats it: the poses must not have changed until then.
    /// Need not be called: the next enqueue() has the right pairs in any case.
    ///
    /// @param contacts [out] valid until the next enqueue(), forget() or failure; none after a failure
    virtual Status collect(DeviceContacts& contacts, ContactCounts& counts) = 0;

    /// Forgets all pairs, so that all of the next enqueue() enter.
    virtual void forget() = 0;

    /// Bytes of device memory in use.
    virtual std::uint64_t bytes() const = 0;
};

/// Copies the hulls to a device.
///
/// @param hulls   need not outlive the call
/// @param options of the search for pairs, and the device
/// @param stream  the caller's cudaStream_t on that device; null: a stream of its own, which collect() waits for. That one
///     waits for no other stream: what writes the poses must have ended before enqueue()
/// @return null, with the reason in words in `*why`, which may be null: no device, driver too old, out of memory, built
///     without CUDA
CULLET_API std::unique_ptr<DeviceContactFinder> makeDeviceContactFinder(const HullSet& hulls,
                                                                        const PsapOptions& options,
                                                                        CUstream_st* stream,
                                                                        std::string* why);
}  // namespace cullet
