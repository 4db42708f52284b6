// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/host_device.h"
#include "cullet/broad/pair.h"
#include "cullet/cuda/device_pairs.h"

#include <cstdint>
#include <ostream>

namespace cullet::test
{
/// Number of pairs of a set, and a fingerprint independent of their order.
struct PairSum
{
    std::uint64_t count = 0;
    std::uint64_t hash = 0;

    CULLET_HOST_DEVICE void add(std::uint32_t a, std::uint32_t b)
    {
        ++count;
        hash += a < b ? mix(std::uint64_t{a} << 32 | b) : mix(std::uint64_t{b} << 32 | a);
    }

private:
    /// The finaliser of MurmurHash3.
    CULLET_HOST_DEVICE static std::uint64_t mix(std::uint64_t key)
    {
        key = (key ^ key >> 33) * 0xff51afd7ed558ccdull;
        key = (key ^ key >> 33) * 0xc4ceb9fe1a85ec53ull;
        return key ^ key >> 33;
    }
};

inline bool operator==(const PairSum& a, const PairSum& b)
{
    return a.count == b.count && a.hash == b.hash;
}

inline void PrintTo(const PairSum& sum, std::ostream* out)
{
    *out << sum.count << " pairs, " << std::hex << sum.hash << std::dec;
}

/// Tests every box against every other on the device. O(n^2): half a second or so for a million.
///
/// @param boxes [count] device memory; invalid ones overlap nothing
PairSum sumOfBruteForce(const Aabb* boxes, std::uint32_t count);

/// The sum of pairs in device memory.
PairSum sumOf(const DevicePairs& pairs);
}  // namespace cullet::test
