// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/update/grid_core.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/pairs/pair_tests.h"

#include <algorithm>

namespace cullet
{
void GridCore::sortHeldBefore(const std::vector<RowPair>& pairs)
{
    for (KeyList& list : found)
        list.clear();
    found[0].makeRoom(pairs.size());
    for (const RowPair pair : pairs)
        found[0].pushIf(rowKey(pair), true);
    delta.sorter().sort(workers, found, m_keys);
    found[0].clear();
    found[0].trim();
    heldBefore.take(m_keys);
    // The former keys.
    m_keys.resizeForOverwrite(std::min(m_keys.size(), pairs.size()));
    trimCapacity(m_keys);
}

void GridCore::freeHeldBefore()
{
    heldBefore = SortedPairs();
    PairKeys().swap(m_keys);
}

std::uint64_t GridCore::bytes() const
{
    std::uint64_t sum = grid.bytes() + delta.bytes() + heldBefore.bytes() + bytesOf(reference, found, m_keys);
    for (const KeyList& list : found)
        sum += list.bytes();
    return sum;
}
}  // namespace cullet
