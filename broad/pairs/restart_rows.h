// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pairs/update_held_pairs.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Finds the rows of pairs given to Backend::restart(); kNoRow for ids without a valid box. O(rows + pairs); O(1)
/// without pairs.
std::vector<KeyedPair> findRowsOf(const Pairs& known, const ProxyView& proxies);

/// Splits pairs given to Backend::restart(): appends the rows of pairs of valid boxes to `held`, and the keys of the
/// other pairs to `expired`.
void splitKnown(const Pairs& known, const ProxyView& proxies, std::vector<RowPair>& held,
                std::vector<std::uint64_t>& expired);

/// Adds the pairs of the keys in `expired` to `removed`, and sorts it by unique ids.
void addExpired(const std::vector<std::uint64_t>& expired, Pairs& removed);
}  // namespace cullet
