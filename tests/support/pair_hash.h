// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"

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

    std::uint64_t value() const { return m_hash; }

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

    void addWord(std::uint32_t word)
    {
        for (int shift = 0; shift < 32; shift += 8)
        {
            m_hash ^= word >> shift & 0xffu;
            m_hash *= 1099511628211ull;
        }
    }

    std::uint64_t m_hash = 14695981039346656037ull;
};
}  // namespace cullet::test
