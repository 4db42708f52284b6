// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/pair_map.h"

#include "cullet/base/trim_capacity.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
std::uint32_t PairMap::find(Pair pair) const noexcept
{
    return m_hash.find(hashOfPair(pair), [&](std::uint32_t index) { return m_pairs[index] == pair; });
}

void PairMap::makeRoom()
{
    const std::size_t more = 2 * m_pairs.size() + 16;
    if (!m_hash.hasRoom())
        m_hash.grow(
            more, [this](std::uint32_t index) { return hashOfPair(m_pairs[index]); },
            [](std::uint32_t) { return true; });
    if (m_pairs.size() == m_links.capacity())
        m_links.reserve(more);
    growCapacity(m_pairs);
    growCapacity(m_tags);
}

void PairMap::insert(Pair pair, std::uint8_t tag)
{
    const std::uint32_t found = find(pair);
    if (found != kNone)
    {
        m_tags[found] = tag;
        return;
    }
    makeRoom();
    m_links.append(m_links.anchorsOf(pair));
    m_hash.insert(hashOfPair(pair), static_cast<std::uint32_t>(m_pairs.size()));
    m_pairs.push_back(pair);
    m_tags.push_back(tag);
}

void PairMap::eraseAt(std::uint32_t index) noexcept
{
    const auto last = static_cast<std::uint32_t>(m_pairs.size() - 1);
    m_hash.erase(hashOfPair(m_pairs[index]), index);
    m_links.detach(index, m_pairs[index]);
    if (index != last)
    {
        m_hash.replace(hashOfPair(m_pairs[last]), last, index);
        m_links.move(last, index);
        m_pairs[index] = m_pairs[last];
        m_tags[index] = m_tags[last];
    }
    m_links.popBack();
    m_pairs.pop_back();
    m_tags.pop_back();
}

bool PairMap::erase(Pair pair) noexcept
{
    // Usually there are none, and a batch of changes asks for each.
    const std::uint32_t index = m_pairs.empty() ? kNone : find(pair);
    if (index == kNone)
        return false;
    eraseAt(index);
    return true;
}

void PairMap::eraseAllOf(std::uint32_t id) noexcept
{
    for (std::uint32_t node = m_links.first(id); node != PairLinks::kNone; node = m_links.first(id))
        eraseAt(PairLinks::pairOf(node));
}

void PairMap::clear() noexcept
{
    m_pairs.clear();
    m_tags.clear();
    m_hash.clear();
    m_links = PairLinks();
}

std::uint64_t PairMap::bytes() const noexcept
{
    return m_pairs.capacity() * sizeof(Pair) + m_tags.capacity() + m_hash.bytes() + m_links.bytes();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
