// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/linked_pairs.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::uint32_t hashOf(Pair pair) noexcept
{
    return hashOfPair(pair.first, pair.second);
}
}  // namespace

std::uint32_t LinkedPairs::find(Pair pair) const noexcept
{
    const std::uint32_t hash = hashOf(pair);
    for (std::size_t position = m_slots.lowerBound(hash); m_slots.holds(position, hash); ++position)
    {
        const std::uint32_t index = m_slots.value(position);
        if (m_pairs[index] == pair)
            return index;
    }
    return kNone;
}

void LinkedPairs::insert(Pair pair, std::uint8_t tag)
{
    const std::uint32_t found = find(pair);
    if (found != kNone)
    {
        m_tags[found] = tag;
        return;
    }
    const auto index = static_cast<std::uint32_t>(m_pairs.size());
    m_slots.makeRoom(1);
    if (!m_links.hasRoom())
        m_links.reserve(m_pairs.size() + 1, 2 * (m_pairs.size() + 1));
    m_pairs.push_back(pair);
    m_tags.push_back(tag);
    m_links.append(pair);
    const std::uint32_t hash = hashOf(pair);
    m_slots.insert(m_slots.lowerBound(hash), hash, index);
}

void LinkedPairs::eraseAt(std::uint32_t index) noexcept
{
    const auto last = static_cast<std::uint32_t>(m_pairs.size() - 1);
    m_slots.erase(m_slots.positionOf(hashOf(m_pairs[index]), index));
    m_links.detach(index, m_pairs[index]);
    if (index != last)
    {
        m_slots.erase(m_slots.positionOf(hashOf(m_pairs[last]), last));
        const std::uint32_t hash = hashOf(m_pairs[last]);
        m_slots.insert(m_slots.lowerBound(hash), hash, index);
        m_links.move(last, index, m_pairs[last]);
        m_pairs[index] = m_pairs[last];
        m_tags[index] = m_tags[last];
    }
    m_links.popBack();
    m_pairs.pop_back();
    m_tags.pop_back();
}

bool LinkedPairs::erase(Pair pair) noexcept
{
    const std::uint32_t index = find(pair);
    if (index == kNone)
        return false;
    eraseAt(index);
    return true;
}

void LinkedPairs::eraseAllOf(std::uint32_t id) noexcept
{
    for (std::uint32_t node = m_links.first(id); node != PairLinks::kNone; node = m_links.first(id))
        eraseAt(PairLinks::pairOf(node));
}

void LinkedPairs::clear() noexcept
{
    m_pairs.clear();
    m_tags.clear();
    m_slots.clear();
    m_links.clear();
}

std::uint64_t LinkedPairs::bytes() const noexcept
{
    return m_pairs.capacity() * sizeof(Pair) + m_tags.capacity() + m_slots.bytes() + m_links.bytes();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
