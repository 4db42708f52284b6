// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <cstdint>

namespace cullet
{
/// What some algorithms of the lecture and of the thesis count in an update, besides BackendStats.
struct ComparisonStats
{
    std::uint64_t cellsTouched = 0;      ///< hierarchical grid: cells that an id was added to or removed from
    std::uint64_t mostTests = 0;         ///< Le Grand's grid: box tests in the fullest cell
    std::uint64_t falsePairs = 0;        ///< shifted sweep and prune: found by rounding alone, and dropped
    std::uint64_t swaps[3] = {0, 0, 0};  ///< sweep and prune: swaps of neighbouring endpoints, by axis
};

/// Second interface of a backend that counts some of these.
class ComparisonSource
{
public:
    virtual ComparisonStats comparisonStats() const = 0;

protected:
    ~ComparisonSource() = default;
};

/// What a backend has counted in its last update; zeros if it counts none of these.
inline ComparisonStats comparisonStatsOf(const Backend& backend)
{
    const auto* const source = dynamic_cast<const ComparisonSource*>(&backend);
    return source != nullptr ? source->comparisonStats() : ComparisonStats{};
}
}  // namespace cullet
