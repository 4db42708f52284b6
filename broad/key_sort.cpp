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
constexpr std::uint32_t kWidestDigit = 12;  // 16 KiB of offsets for a pass

std::uint32_t bitsOf(std::uint64_t value)
{
    return value == 0 ? 1u : 64u - static_cast<std::uint32_t>(__builtin_clzll(value));
}
}  // namespace

/// Sorts by the lowest `bits` bits, least significant digit first; all digits are counted in one pass.
void KeySort::sortByRadix(std::vector<std::uint64_t>& keys, std::uint32_t bits)
{
    const std::uint32_t passes = (bits + kWidestDigit - 1) / kWidestDigit;
    const std::uint32_t width = (bits + passes - 1) / passes;
    const std::uint64_t mask = (std::uint64_t{1} << width) - 1;
    m_swap.resize(keys.size());
    m_offsets.assign(std::size_t{passes} << width, 0);
    for (std::uint64_t key : keys)
    {
        for (std::uint32_t pass = 0; pass < passes; ++pass, key >>= width)
            ++m_offsets[(std::size_t{pass} << width) + (key & mask)];
    }
    for (std::uint32_t pass = 0; pass < passes; ++pass)
    {
        std::uint32_t* const offsets = m_offsets.data() + (std::size_t{pass} << width);
        std::uint32_t sum = 0;
        for (std::uint64_t digit = 0; digit <= mask; ++digit)
        {
            const std::uint32_t size = offsets[digit];
            offsets[digit] = sum;
            sum += size;
        }
        for (const std::uint64_t key : keys)
            m_swap[offsets[key >> (pass * width) & mask]++] = key;
        keys.swap(m_swap);
    }
}

void KeySort::sort(std::vector<std::uint64_t>& keys)
{
    if (std::is_sorted(keys.begin(), keys.end()))
        return;
    if (keys.size() < kFewKeys)
    {
        std::sort(keys.begin(), keys.end());
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
    for (std::uint64_t& key : keys)
        key = key >> bits << 32 | (key & mask);
    trimRoom(m_swap);
}

void KeySort::write(std::vector<std::uint64_t>& keys, std::vector<Pair>& pairs)
{
    sort(keys);
    pairs.resize(keys.size());
    std::transform(keys.begin(), keys.end(), pairs.begin(), pairOfKey);
}
}  // namespace cullet
