// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_order.h"

#include <array>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kDigitBits = 11;  // 2,048 counters fit into the first-level cache
constexpr std::uint32_t kDigits = 1u << kDigitBits;

/// The digit of an id; ids that are larger as int have smaller digits, for a descending order.
std::uint32_t digitOf(std::uint32_t id, int shift)
{
    constexpr std::uint32_t kAllButSign = 0x7fffffffu;
    return (id ^ kAllButSign) >> shift & (kDigits - 1);
}
}  // namespace

void PairOrder::reserve(std::size_t count)
{
    m_version = 0;
    m_entries.clear();
    m_entries.reserve(count);
    m_scratch.reserve(count);
}

void PairOrder::sort(std::uint64_t version) noexcept
{
    m_scratch.resize(m_entries.size());  // within the capacity
    for (std::uint32_t Pair::*id : {&Pair::second, &Pair::first})
    {
        std::uint32_t varying = 0;
        for (const Entry& entry : m_entries)
            varying |= entry.ids.*id ^ m_entries.front().ids.*id;
        for (int shift = 0; shift < 32; shift += kDigitBits)
        {
            if ((varying >> shift & (kDigits - 1)) != 0)
                scatter(id, shift);
        }
    }
    m_version = version;
}

/// Sorts the entries by one digit; stable.
void PairOrder::scatter(std::uint32_t Pair::*id, int shift)
{
    std::array<std::uint32_t, kDigits> place{};
    for (const Entry& entry : m_entries)
        ++place[digitOf(entry.ids.*id, shift)];
    std::uint32_t begin = 0;
    for (std::uint32_t& count : place)
    {
        const std::uint32_t end = begin + count;
        count = begin;
        begin = end;
    }
    for (const Entry& entry : m_entries)
        m_scratch[place[digitOf(entry.ids.*id, shift)]++] = entry;
    m_entries.swap(m_scratch);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
