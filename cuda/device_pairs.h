// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/delta_counts.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <memory>
#include <string>

struct CUstream_st;

namespace cullet
{
/// The pairs that DevicePairFinder found, in device memory. Rows of the box array, unordered, each pair once.
struct DevicePairs
{
    const RowPair* pairs = nullptr;
    std::uint64_t count = 0;
};

/// The addresses of the pairs that enqueue() will write, valid once the stream has run its work: for later work on
/// that stream, so that the CPU need not wait.
struct DevicePairsAhead
{
    const RowPair* pairs = nullptr;
    std::uint64_t room = 0;
    /// Device memory. Above `room` the pairs are void, and collect() makes room.
    const std::uint64_t* count = nullptr;
};

/// Finds all overlapping pairs of boxes that are in device memory already, and leaves them there. For programs without
/// a Bullet world.
///
/// enqueue() only puts work on the stream, and waits only where memory has to grow.
/// collect() waits for the work. In between the caller may put more work on the stream, but must not change the
/// boxes.
class CULLET_API DevicePairFinder
{
public:
    virtual ~DevicePairFinder() = default;

    /// @param boxes [count] device memory, aligned to 8 bytes, world-space boxes; invalid ones overlap nothing. The
    ///     same address and count as in the last call cost the CPU less time.
    /// @return Ok, or the reason of a failure; collect() then returns no pairs
    virtual Status enqueue(const Aabb* boxes, std::uint64_t count) = 0;

    /// Void after collect() or another enqueue().
    virtual DevicePairsAhead ahead() const = 0;

    /// Waits, repeats the last step with more room if the list was too short, and returns the address of the pairs.
    /// They stay valid until the next enqueue().
    virtual Status collect(DevicePairs& pairs) = 0;

    /// Bytes of device memory in use.
    virtual std::uint64_t bytes() const = 0;
};

/// The changes from one enqueue() of a DeviceDeltaFinder to the next, in device memory. Rows of the box arrays,
/// unordered, each pair once. The overlapping pairs are those that stay and those that enter.
struct DeviceDeltas
{
    const RowPair* kept = nullptr;
    std::uint64_t keptCount = 0;
    const RowPair* added = nullptr;
    std::uint64_t addedCount = 0;
    const RowPair* removed = nullptr;
    std::uint64_t removedCount = 0;
};

/// The addresses of the changes that enqueue() will write, valid once the stream has run its work: for later work on
/// that stream, so that the CPU need not wait.
struct DeviceDeltasAhead
{
    const RowPair* kept = nullptr;
    const RowPair* added = nullptr;
    std::uint64_t addedRoom = 0;
    const RowPair* removed = nullptr;
    /// Device memory. Where more pairs enter than there is room for, the changes are void, and collect() finds them.
    const DeltaCounts* counts = nullptr;
};

/// Keeps the overlapping pairs of boxes that are in device memory already, and writes there which enter and which
/// leave. Row i of the boxes is the same body in every enqueue(). The pairs of new rows enter, and the pairs of rows
/// that no longer exist leave.
///
/// Where boxes move short distances, a neighbour list is kept, and most sets need no search (PsapOptions::nearPairs);
/// the finder decides this itself. A set for which the list turns out to be incomplete is searched in collect() or
/// the next enqueue(); until then its changes are void.
///
/// Uses 120 bytes of device memory per box, 36 per pair and 14 per pair in the neighbour list, in addition to those
/// of the search; 64 per box and 36 per pair without the list. Nothing is sorted or compared pair by pair: the finder
/// keeps a copy of the boxes of the last enqueue(), or the neighbour list, which show what overlapped before.
class CULLET_API DeviceDeltaFinder
{
public:
    virtual ~DeviceDeltaFinder() = default;

    /// Puts work on the stream. Waits only for the work of the previous enqueue(), so that the CPU may be one set of
    /// boxes ahead, and where DevicePairFinder::enqueue() waits.
    ///
    /// @param boxes [count] as in DevicePairFinder::enqueue(); later work on the stream may change them
    /// @return Ok, or the reason of a failure; the state is then as after forget()
    virtual Status enqueue(const Aabb* boxes, std::uint64_t count) = 0;

    /// Void after collect() or another enqueue().
    virtual DeviceDeltasAhead ahead() const = 0;

    /// Waits, repeats the search with more room if the list was too short, and returns the addresses of the changes.
    /// They stay valid until the next enqueue(). Need not be called: the next enqueue() repeats the search by itself
    /// where necessary, and computes changes from the right pairs in any case.
    ///
    /// @return Ok, or the reason of a failure; the state is then as after forget()
    virtual Status collect(DeviceDeltas& deltas) = 0;

    /// Discards the pairs, so that all pairs of the next enqueue() enter.
    virtual void forget() = 0;

    /// Bytes of device memory in use.
    virtual std::uint64_t bytes() const = 0;
};

/// @param stream the caller's cudaStream_t on options.device; null: a stream of its own, which collect() waits for.
///     That one waits for no other stream: what writes the boxes must have ended before enqueue()
/// @return null, with the reason in `*why`, where makeCudaPsapBackend() returns null too
CULLET_API std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions& options,
                                                                  CUstream_st* stream, std::string* why);
CULLET_API std::unique_ptr<DeviceDeltaFinder> makeDeviceDeltaFinder(const PsapOptions& options,
                                                                    CUstream_st* stream, std::string* why);
}  // namespace cullet
