// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pairs/restart_rows.h"

#include "cullet/base/key_table.h"

#include <algorithm>

namespace cullet
{
std::vector<KeyedPair> findRowsOf(const Pairs& known, const ProxyView& proxies)
{
    std::vector<KeyedPair> pairs;
    struct Slot
    {
        std::uint64_t key = kFreeKey;  ///< unique id
        std::uint32_t row = kNoRow;
    };
    KeyTable<Slot> rowOf;
    for (std::uint32_t row = 0; row < proxies.size && !known.empty(); ++row)
    {
        if (isValid(proxies.boxes[row]))
            rowOf.insert(proxies.uniqueIds[row]).row = row;
    }
    const auto find = [&](std::uint32_t id)
    {
        const Slot* const found = rowOf.find(id);
        return found != nullptr ? found->row : kNoRow;
    };
    for (const Pair pair : known)
        pairs.push_back({pair, find(pair.first), find(pair.second)});
    return pairs;
}

void splitKnown(const Pairs& known, const ProxyView& proxies, std::vector<RowPair>& held,
                std::vector<std::uint64_t>& expired)
{
    for (const KeyedPair& pair : findRowsOf(known, proxies))
    {
        if (pair.firstRow == kNoRow || pair.secondRow == kNoRow)
            expired.push_back(pairKey(pair.ids));
        else
            held.push_back({pair.firstRow, pair.secondRow});
    }
}

void addExpired(const std::vector<std::uint64_t>& expired, Pairs& removed)
{
    if (expired.empty())
        return;
    for (const std::uint64_t key : expired)
        removed.push_back(pairOfKey(key));
    std::sort(removed.begin(), removed.end());
}
}  // namespace cullet
