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

/// Where they will be as soon as what enqueue() has put on the stream has run: for work behind it on that stream, so that
/// the CPU need not wait.
struct DevicePairsAhead
{
    const RowPair* pairs = nullptr;
    std::uint64_t room = 0;
    const std::uint64_t* count =
        nullptr;  ///< device memory; more than `room`: void, and collect() makes room
};

/// Finds all overlapping pairs of boxes that are in device memory already, and leaves them there. For programs without
/// a Bullet world.
///
/// enqueue() only puts work on the stream, and waits for nothing, but where memory has to grow, and in the literal variant.
/// collect() waits for the work. In between the caller may put more work on the stream, but must not change the boxes.
class CULLET_API DevicePairFinder
{
public:
    virtual ~DevicePairFinder() = default;

    /// @param boxes [count] device memory, aligned to 8 bytes, world-space boxes; invalid ones overlap nothing. To search
    ///     the same address and count as the last time takes the CPU less.
    /// @return Ok, or why not; collect() then finds nothing
    virtual Status enqueue(const Aabb* boxes, std::uint64_t count) = 0;

    /// Void after collect() or another enqueue().
    virtual DevicePairsAhead ahead() const = 0;

    /// Waits, runs the last step again with more room if the list was too short, and tells where the pairs are. They
    /// stay until the next enqueue().
    virtual Status collect(DevicePairs& pairs) = 0;

    /// Device memory held, bytes.
    virtual std::uint64_t bytes() const = 0;
};

/// What changed from one enqueue() of a DeviceDeltaFinder to the next, in device memory. Rows of the box arrays, unordered,
/// each pair once. The pairs that overlap now are those that stay and those that enter.
struct DeviceDeltas
{
    const RowPair* kept = nullptr;
    std::uint64_t keptCount = 0;
    const RowPair* added = nullptr;
    std::uint64_t addedCount = 0;
    const RowPair* removed = nullptr;
    std::uint64_t removedCount = 0;
};

/// Where they will be as soon as what enqueue() has put on the stream has run: for work behind it on that stream, so that
/// the CPU need not wait.
struct DeviceDeltasAhead
{
    const RowPair* kept = nullptr;
    const RowPair* added = nullptr;
    std::uint64_t addedRoom = 0;
    const RowPair* removed = nullptr;
    const DeltaCounts* counts =
        nullptr;  ///< device memory; more enter than there is room for: void, and collect() finds them
};

/// Keeps the overlapping pairs of boxes that are in device memory already, and tells there which enter and which leave.
/// Row i of the boxes is the same body in every enqueue(); rows that were not there before enter, and the pairs of rows
/// that are not there any more leave.
///
/// Where boxes go short ways, pairs that are near are kept, and most sets need no search (PsapOptions::nearPairs): the finder notices by itself.
/// A set that turns out to need one after all is searched when collect() or the next enqueue() finds out; until then its changes are void.
///
/// Takes 120 bytes of device memory a box, 36 a pair and 14 a near pair beside those of the search, 64 and 36 without near
/// pairs. Nothing is sorted or compared pair by pair: what overlapped before is told by the boxes of the last enqueue(), of
/// which the finder keeps a copy, or by the near pairs.
class CULLET_API DeviceDeltaFinder
{
public:
    virtual ~DeviceDeltaFinder() = default;

    /// Puts work on the stream, and waits only for the work of the enqueue() before, so that the CPU may be one set of boxes
    /// ahead, and where DevicePairFinder::enqueue() waits.
    ///
    /// @param boxes [count] as DevicePairFinder::enqueue() has it; may be changed by what comes behind on the stream
    /// @return Ok, or why not; then as after forget()
    virtual Status enqueue(const Aabb* boxes, std::uint64_t count) = 0;

    /// Void after collect() or another enqueue().
    virtual DeviceDeltasAhead ahead() const = 0;

    /// Waits, searches again with more room if the list was too short, and tells where the changes are. They stay until the
    /// next enqueue(). Need not be called: the next enqueue() finds out by itself whether the list was too short, and tells
    /// changes against the right pairs in any case.
    ///
    /// @return Ok, or why not; then as after forget()
    virtual Status collect(DeviceDeltas& deltas) = 0;

    /// All pairs of the next enqueue() enter.
    virtual void forget() = 0;

    /// Device memory held, bytes.
    virtual std::uint64_t bytes() const = 0;
};

/// @param stream the caller's cudaStream_t on options.device; null: a stream of its own, which collect() waits for. That
///     one waits for no other stream: what writes the boxes has to have ended before enqueue()
/// @return null, with the reason in `*why`, where makeCudaPsapBackend() returns null too
CULLET_API std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions& options,
                                                                  CUstream_st* stream, std::string* why);
CULLET_API std::unique_ptr<DeviceDeltaFinder> makeDeviceDeltaFinder(const PsapOptions& options,
                                                                    CUstream_st* stream, std::string* why);
}  // namespace cullet
