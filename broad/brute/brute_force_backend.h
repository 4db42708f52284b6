// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Tests every pair of valid boxes in every update, whatever changed: the simplest implementation of Backend.
///
/// Cost: O(n^2) box tests, several per instruction; about 5,000 tests, a few microseconds, for 100 boxes.
class BruteForceBackend final : public Backend
{
public:
    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "brute"; }
    BackendStats stats() const override;

private:
    void gatherValidBoxes(const ProxyView& proxies);
    void findOverlaps();
    void findOverlapsOf(std::size_t index);
    std::uint32_t rowOf(std::uint32_t uniqueId) const;

    Pairs m_pairs;                          ///< held pairs, sorted
    Pairs m_overlapping;                    ///< overlapping pairs of this update, sorted
    std::vector<std::uint32_t> m_rows;      ///< rows with a valid box by ascending id
    std::vector<std::uint32_t> m_ids;       ///< ids of m_rows
    std::vector<float> m_min[3], m_max[3];  ///< boxes of m_rows, padded with NaN to whole blocks
};
}  // namespace cullet
