// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/choices.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace cullet::test
{
/// Makes a failing input smaller: fewer operations, then more zeros.
class FuzzShrinker
{
public:
    using Bytes = std::vector<std::uint8_t>;

    /// @param fails       whether an input fails as the first one does
    /// @param maxAttempts calls of it
    FuzzShrinker(std::function<bool(const Bytes&)> fails, int maxAttempts)
        : m_fails(std::move(fails)), m_attemptsLeft(maxAttempts)
    {
    }

    Bytes shrink(Bytes bytes)
    {
        std::size_t before = 0;
        do
        {
            before = bytes.size();
            for (std::size_t blocks = bytes.size() / kOperationBytes / 2; blocks > 0; blocks /= 2)
                dropRuns(bytes, blocks * kOperationBytes);
            dropTail(bytes);
        } while (bytes.size() < before && m_attemptsLeft > 0);
        for (std::size_t length = kOperationBytes; length > 0; length /= 4)
            zeroRuns(bytes, length);
        return bytes;
    }

private:
    bool accept(Bytes& bytes, Bytes candidate)
    {
        if (m_attemptsLeft-- <= 0 || !m_fails(candidate))
            return false;
        bytes = std::move(candidate);
        return true;
    }

    /// From the end on, since what comes before makes the state for what comes after.
    void dropRuns(Bytes& bytes, std::size_t length)
    {
        for (std::size_t end = bytes.size() / kOperationBytes * kOperationBytes; end >= length;
             end -= kOperationBytes)
        {
            Bytes shorter(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(end - length));
            shorter.insert(shorter.end(), bytes.begin() + static_cast<std::ptrdiff_t>(end), bytes.end());
            if (accept(bytes, shorter))
                end = std::min(end, bytes.size() / kOperationBytes * kOperationBytes + kOperationBytes);
            if (end == 0)
                return;
        }
    }

    /// Missing bytes read as zero.
    void dropTail(Bytes& bytes)
    {
        while (!bytes.empty() && accept(bytes, Bytes(bytes.begin(), bytes.end() - 1)))
        {
        }
    }

    void zeroRuns(Bytes& bytes, std::size_t length)
    {
        for (std::size_t first = 0; first < bytes.size(); first += length)
        {
            Bytes plainer = bytes;
            const std::size_t last = std::min(first + length, bytes.size());
            std::fill(plainer.begin() + static_cast<std::ptrdiff_t>(first),
                      plainer.begin() + static_cast<std::ptrdiff_t>(last), std::uint8_t{0});
            if (plainer != bytes)
                accept(bytes, plainer);
        }
    }

    std::function<bool(const Bytes&)> m_fails;
    int m_attemptsLeft;
};
}  // namespace cullet::test
