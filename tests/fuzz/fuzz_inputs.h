// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/choices.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace cullet::test
{
/// Makes fuzz inputs: random ones and changed ones of a corpus. The same seed, index and corpus give the same input.
class FuzzInputs
{
public:
    using Bytes = std::vector<std::uint8_t>;

    FuzzInputs(std::vector<Bytes> corpus, std::uint32_t maxOperations)
        : m_corpus(std::move(corpus)), m_maxOperations(std::max(maxOperations, 1u))
    {
    }

    Bytes make(std::uint32_t seed, std::uint64_t index)
    {
        std::seed_seq words{seed, static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32)};
        m_engine.seed(words);
        if (m_corpus.empty() || !oneIn(4))
            return random();
        Bytes bytes = m_corpus[below(m_corpus.size())];
        for (std::size_t changes = 1 + below(8); changes > 0; --changes)
            change(bytes);
        bytes.resize(std::min(bytes.size(), m_maxOperations * kOperationBytes));
        return bytes;
    }

private:
    std::size_t below(std::size_t count) { return count == 0 ? 0 : m_engine() % count; }
    bool oneIn(std::size_t count) { return below(count) == 0; }
    std::uint8_t byte() { return static_cast<std::uint8_t>(m_engine()); }

    /// As many short inputs as long ones.
    std::size_t operationCount()
    {
        std::size_t limit = m_maxOperations;
        while (limit > 4 && oneIn(2))
            limit /= 2;
        return 1 + below(limit);
    }

    Bytes randomBlock()
    {
        Bytes block(kOperationBytes);
        const bool isSparse = oneIn(4);
        for (std::uint8_t& value : block)
            value = isSparse && !oneIn(4) ? std::uint8_t{0} : byte();
        return block;
    }

    /// Most inputs draw the first bytes of their operations from a few values: many of few kinds reach what a few of each
    /// kind do not.
    Bytes random()
    {
        Bytes firsts(1 + below(12));
        for (std::uint8_t& value : firsts)
            value = byte();
        const bool hasFewKinds = !oneIn(4);
        const std::size_t count = operationCount();
        Bytes bytes = randomBlock();
        while (bytes.size() < count * kOperationBytes)
        {
            Bytes block = randomBlock();
            if (oneIn(8))
                block = blocksOf(bytes, 1);
            else if (hasFewKinds)
                block[0] = firsts[below(firsts.size())];
            bytes.insert(bytes.end(), block.begin(), block.end());
        }
        return bytes;
    }

    /// A run of up to `count` blocks of an input.
    Bytes blocksOf(const Bytes& bytes, std::size_t count)
    {
        const std::size_t first = below(bytes.size() / kOperationBytes) * kOperationBytes;
        const std::size_t last = std::min(first + count * kOperationBytes, bytes.size());
        return {bytes.begin() + static_cast<std::ptrdiff_t>(first),
                bytes.begin() + static_cast<std::ptrdiff_t>(last)};
    }

    void insert(Bytes& bytes, const Bytes& blocks)
    {
        const std::size_t place = below(bytes.size() / kOperationBytes + 1) * kOperationBytes;
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(place), blocks.begin(), blocks.end());
    }

    void change(Bytes& bytes)
    {
        const std::size_t kind = below(8);
        if (kind == 0)
            insert(bytes, randomBlock());
        else if (kind == 1 && !bytes.empty())
            insert(bytes, blocksOf(bytes, 1 + below(16)));
        else if (kind == 2)
            insert(bytes, blocksOf(m_corpus[below(m_corpus.size())], 1 + below(64)));
        else if (kind == 3 && !bytes.empty())
            eraseBlocks(bytes);
        else if (!bytes.empty())
            bytes[below(bytes.size())] = kind == 4 ? std::uint8_t{0} : byte();
    }

    void eraseBlocks(Bytes& bytes)
    {
        const std::size_t first = below(bytes.size() / kOperationBytes) * kOperationBytes;
        const std::size_t last = std::min(first + (1 + below(8)) * kOperationBytes, bytes.size());
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(first),
                    bytes.begin() + static_cast<std::ptrdiff_t>(last));
    }

    std::vector<Bytes> m_corpus;
    std::size_t m_maxOperations;
    std::mt19937 m_engine;
};
}  // namespace cullet::test
