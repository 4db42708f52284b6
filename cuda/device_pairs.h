// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/aabb.h"
#include "broad/api.h"
#include "broad/backend.h"
#include "broad/id_pair.h"

#include <cstdint>
#include <memory>
#include <string>

struct CUstream_st;

namespace cullet
{
/// The pairs that DevicePairFinder found, in device memory. Rows of the box array, unordered, each pair once.
struct DevicePairs
{
    const IdPair* pairs = nullptr;
    std::uint64_t count = 0;
};

/// Finds all overlapping pairs of boxes that are in device memory already, and leaves them there. For programs without
/// a Bullet world.
///
/// enqueue() only puts work on the stream (the literal variant waits once in the middle); collect() waits for it. In
/// between the caller may put more work on the stream, but must not change the boxes.
class CULLET_API DevicePairFinder
{
public:
    virtual ~DevicePairFinder() = default;

    /// @param boxes [count] device memory, world-space boxes; invalid ones overlap nothing
    /// @return Ok, or why not; collect() is then void
    virtual Status enqueue(const Aabb* boxes, std::uint64_t count) = 0;

    /// Waits, runs the last step again with more room if the list was too short, and tells where the pairs are. They
    /// stay until the next enqueue().
    virtual Status collect(DevicePairs& pairs) = 0;

    /// Device memory held, bytes.
    virtual std::uint64_t bytes() const = 0;
};

/// @param stream the caller's cudaStream_t on options.device; null: a stream of its own, which collect() waits for. That
///     one waits for no other stream: what writes the boxes has to have ended before enqueue()
/// @return null, with the reason in `*why`, where makeCudaPsapBackend() returns null too
CULLET_API std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions& options,
                                                                  CUstream_st* stream, std::string* why);
}  // namespace cullet
