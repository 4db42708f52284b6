// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/tests/support/fnv1a.h"

#include <cstdint>
#include <vector>

namespace cullet::test
{
/// 64-bit fingerprint of a sequence of deltas: FNV-1a over little-endian 32-bit words, low byte first.
///
/// Each delta contributes: count of added, then first and second of each; count of removed, then first and second of
/// each. Empty deltas count, too, so a change reported one update late changes the hash.
class PairStreamHash
{
public:
    void add(const PairDelta& delta)
    {
        addList(delta.added);
        addList(delta.removed);
    }

    std::uint64_t value() const { return m_hash.value(); }

private:
    void addList(const Pairs& pairs)
    {
        addWord(static_cast<std::uint32_t>(pairs.size()));
        for (const Pair pair : pairs)
        {
            addWord(pair.first);
            addWord(pair.second);
        }
    }

    void addWord(std::uint32_t word) { m_hash.add(word, sizeof(word)); }

    Fnv1a m_hash;
};
}  // namespace cullet::test
