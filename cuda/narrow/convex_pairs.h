// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/pair_types.h"

#include <cstdint>
#include <memory>
#include <string>

struct CUstream_st;

namespace cullet
{
class HullSet;

/// The bodies and pairs of a query, in device memory.
struct DeviceBodies
{
    const BodyPose* poses = nullptr;  ///< [bodies], aligned to 16 bytes
    std::uint32_t bodies = 0;
};

/// What a query finds beside states and axes.
struct ConvexQuery
{
    /// The distances and closest points of pairs that are Apart by no more than this, in double: within 2e-7 of the
    /// size of the pair. 0 or more, or infinity; negative: none. The axis of a measured pair becomes the direction of
    /// its distance. Costs a test in double for each pair that is Apart, a search for those that are measured, and 32
    /// bytes for each pair.
    float maxDistance = -1.0f;
    /// The list of those that overlap. Costs two short passes over the states, and 4 bytes for each pair.
    bool listOverlaps = false;
    /// The depths of those that overlap; includes their list. Depths are proved to 1e-6 of the size, nearly all to 1e-7,
    /// but for those that ConvexPairCounts::unprovedDepths counts. Costs a search in double for each that overlaps, and
    /// 40 bytes for each of them.
    bool measureDepths = false;
    /// Contacts of those that overlap, of up to four points; includes their depths. The points are corners of the part
    /// of two faces that overlap along the normal, or the deepest point. Those farther apart than this are left out. 0
    /// or more; negative: none. Costs 80 bytes for each pair that overlaps.
    float contactMargin = -1.0f;
};

/// The answers of DeviceConvexPairs, in device memory and in the order of the pairs.
struct DevicePairAnswers
{
    const PairState* states = nullptr;        ///< [count]
    const PairAxis* axes = nullptr;           ///< [count], of pairs that are Apart
    const PairDistance* distances = nullptr;  ///< [count], or null if not asked for
    /// Places in the list of pairs of those that overlap, ascending; null if not asked for.
    const std::uint32_t* overlaps = nullptr;
    const std::uint32_t* overlapCount = nullptr;  ///< their number, in device memory
    std::uint64_t count = 0;
    /// [room] of the pair with place overlaps[k], at k; null if not asked for.
    const PairDepth* depths = nullptr;
    const PairContact* contacts = nullptr;  ///< likewise
    /// Depths and contacts that there is memory for. From collect() on at least *overlapCount; in ahead() later
    /// overlaps than these may still be without.
    std::uint64_t room = 0;
};

/// How many pairs had which outcome, and how they were answered.
struct ConvexPairCounts
{
    std::uint32_t overlapping = 0, undecided = 0, invalid = 0;  ///< all others are Apart
    std::uint32_t failed = 0;          ///< the axis of the last query did not separate them any more
    std::uint32_t remembered = 0;      ///< they overlapped in the last query, where their search began
    std::uint32_t doubtful = 0;        ///< float proved nothing: searched in double
    std::uint32_t largeDepths = 0;     ///< depths by polytopes of many vertices
    std::uint32_t examinedDepths = 0;  ///< depths that no polytope has found, by all faces of both hulls
    /// Depths known to PairDepth::gap only, which is more than 1e-6 of the size: a hull has no faces, and rounding has
    /// broken the polytope.
    std::uint32_t unprovedDepths = 0;
};

/// Tells for pairs of convex hulls in device memory whether they overlap, and finds an axis that separates those that
/// do not, or how far apart they are. What it learns of a pair is the start of its next query: pair k of the list is
/// meant to be the same pair of bodies from query to query. Another one, or a longer list, only costs time.
///
/// The hulls of a pair are the exact points of the HullSet, turned by the quaternions divided by their lengths and
/// moved by the positions, without rounding. Size is the sum of the reaches of both hulls and the distance between
/// their origins. A state is right where the distance, or the depth, is at least 1e-6 of the size; below that rounding
/// may decide, also differently than isaGjk() does. A pair is tested in float, with a bound of all rounding errors;
/// where that proves nothing, it is searched in double.
///
/// The same sequence of queries gives the same states and axes, bit by bit, on every device and on the CPU
/// (convex::PairQueries<convex::HostPairExec>). Depths and contacts depend on shapes and poses alone. No list has a
/// capacity.
///
/// enqueue() only puts work on the stream, and waits only where memory has to grow. collect() waits for the work. In
/// between the caller may put more work on the stream, but must not change poses and pairs.
///
/// Uses 57 bytes of device memory for each pair of the longest list, and what a ConvexQuery asks for. Depths take up to
/// 310 MB more for polytopes, by the number of pairs that overlap and of multiprocessors (132 of them here).
class CULLET_API DeviceConvexPairs
{
public:
    virtual ~DeviceConvexPairs() = default;

    /// @param pairs [count] device memory, aligned to 8 bytes: rows of the poses, in any order. The same addresses and
    ///     counts as in the last call cost the CPU less time
    /// @param count less than 2^32
    /// @return Ok, or the reason of a failure; all pairs are then forgotten, and the next enqueue() starts anew
    virtual Status enqueue(const DeviceBodies& bodies, const RowPair* pairs, std::uint64_t count,
                           const ConvexQuery& query) = 0;
    Status enqueue(const DeviceBodies& bodies, const RowPair* pairs, std::uint64_t count)
    {
        return enqueue(bodies, pairs, count, {});
    }

    /// The addresses that enqueue() will write, valid once the stream has run its work: for later work on that stream,
    /// so that the CPU need not wait. Valid until the next enqueue(), forget() or failure; those of depths and contacts
    /// until collect(), too, which measures once more where more pairs overlap than there was memory for.
    virtual DevicePairAnswers ahead() const = 0;

    /// Waits for the last enqueue().
    ///
    /// @param answers [out] as ahead(); none after a failure
    virtual Status collect(DevicePairAnswers& answers, ConvexPairCounts& counts) = 0;

    /// Copies what collect() has found for the first pairs that overlap to the CPU's memory, and waits.
    ///
    /// @param places, depths, contacts [out, count] null: not copied
    /// @param count no more than the pairs that overlap
    /// @pre the last query has asked for what is copied
    virtual Status copyContacts(std::uint32_t* places, PairDepth* depths, PairContact* contacts,
                                std::uint64_t count) = 0;

    /// Forgets all pairs, so that the next query of each begins between the origins of its bodies.
    virtual void forget() = 0;

    /// Bytes of device memory in use.
    virtual std::uint64_t bytes() const = 0;
};

/// Copies the hulls to a device.
///
/// @param hulls  need not outlive the call
/// @param device CUDA device ordinal
/// @param stream the caller's cudaStream_t on that device; null: a stream of its own, which collect() waits for. That
///     one waits for no other stream: what writes poses and pairs must have ended before enqueue()
/// @return null, with the reason in words in `*why`, which may be null: no device, driver too old, out of memory, built
///     without CUDA
CULLET_API std::unique_ptr<DeviceConvexPairs> makeDeviceConvexPairs(const HullSet& hulls, int device,
                                                                    CUstream_st* stream, std::string* why);
}  // namespace cullet
