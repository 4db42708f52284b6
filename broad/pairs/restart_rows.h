// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/broad/pairs/pair_diff.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace cullet
{
inline constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();

/// The rows of pairs given to Backend::restart(); kNoRow for ids without a valid box. O(rows + pairs), none: O(1).
std::vector<KeyedPair> findRowsOf(const Pairs& known, const ProxyView& proxies);

/// The same in two parts: appends the rows of pairs of valid boxes to `held`, and the keys of the others, which have
/// left, to `gone`.
void splitKnown(const Pairs& known, const ProxyView& proxies, std::vector<RowPair>& held,
                std::vector<std::uint64_t>& gone);

/// Adds those that have left to other removed pairs, by unique id.
void addGone(const std::vector<std::uint64_t>& gone, Pairs& removed);
}  // namespace cullet
