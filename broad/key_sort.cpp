// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/key_sort.h"

#include "broad/vector_room.h"

#include <algorithm>

namespace cullet
{
namespace
{
constexpr std::size_t kFewKeys = 384;
constexpr std::uint32_t kWidestDigit = 11;

std::uint32_t bitsOf(std::uint64_t value)
{
    return value == 0 ? 1u : 64u - static_cast<std::uint32_t>(__builtin_clzll(value));
}
}  // namespace

/// Sorts by the lowest `bits` bits, least significant digit first.
void KeySort::sortByRadix(std::vector<std::uint64_t>& keys, std::uint32_t bits)
{
    const std::uint32_t passes = (bits + kWidestDigit - 1) / kWidestDigit;
    const std::uint32_t width = (bits + passes - 1) / passes;
    const std::uint64_t mask = (std::uint64_t{1} << width) - 1;
    m_swap.resize(keys.size());
    for (std::uint32_t shift = 0; shift < bits; shift += width)
    {
        m_offsets.assign(mask + 1, 0);
        for (const std::uint64_t key : keys)
            ++m_offsets[key >> shift & mask];
        std::uint32_t sum = 0;
        for (std::uint32_t& offset : m_offsets)
        {
            const std::uint32_t size = offset;
            offset = sum;
            sum += size;
        }
        for (const std::uint64_t key : keys)
            m_swap[m_offsets[key >> shift & mask]++] = key;
        keys.swap(m_swap);
    }
}

void KeySort::write(std::vector<std::uint64_t>& keys, std::vector<Pair>& pairs)
{
    pairs.resize(keys.size());
    if (keys.size() < kFewKeys)
    {
        std::sort(keys.begin(), keys.end());
        std::transform(keys.begin(), keys.end(), pairs.begin(), pairOfKey);
        return;
    }
    std::uint64_t ids = 0;
    for (const std::uint64_t key : keys)
        ids |= key | key >> 32;
    // Both ids packed without the bits that no id has.
    const std::uint32_t bits = bitsOf(ids & 0xffffffff);
    for (std::uint64_t& key : keys)
        key = key >> 32 << bits | (key & 0xffffffff);
    sortByRadix(keys, 2 * bits);
    const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
    std::transform(
        keys.begin(), keys.end(), pairs.begin(),
        [&](std::uint64_t key) {
            return Pair{static_cast<std::uint32_t>(key >> bits), static_cast<std::uint32_t>(key & mask)};
        });
    trimRoom(m_swap);
}
}  // namespace cullet
