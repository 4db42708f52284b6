// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pairs/update_held_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The held pairs of a backend that lists candidates in each update, and the steps that all such backends share.
///
/// In each update: begin(), test() for every candidate, finish(). A pair may be tested several times.
class CandidatePairs
{
public:
    /// See Backend::restart().
    void restart(const Pairs& known);

    void begin(const ProxyView& proxies);

    /// Tests the boxes of two rows. Pairs of rows neither of which changed may be left out.
    void test(const ProxyView& proxies, std::uint32_t a, std::uint32_t b)
    {
        ++m_testCount;
        if (overlaps(proxies.boxes[a], proxies.boxes[b]))
            addOverlap(proxies, a, b);
    }

    /// Applies the rules of Backend. O(held + overlapping log overlapping).
    void finish(const ProxyView& proxies, PairDelta& delta);

    std::uint64_t size() const { return m_held.size(); }
    std::uint64_t testCount() const { return m_testCount; }  ///< since begin()
    std::uint64_t bytes() const { return (m_held.capacity() + m_overlapping.capacity()) * sizeof(KeyedPair); }

private:
    void addOverlap(const ProxyView& proxies, std::uint32_t a, std::uint32_t b);

    Pairs m_known;                         ///< given to restart(), until the next update
    std::vector<KeyedPair> m_held;         ///< held pairs, sorted
    std::vector<KeyedPair> m_overlapping;  ///< overlapping pairs of this update
    std::uint64_t m_testCount = 0;
};
}  // namespace cullet
