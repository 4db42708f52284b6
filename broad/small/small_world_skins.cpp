// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/small_world_skins.h"

#include <algorithm>

namespace cullet
{
void SmallWorldSkins::turnOff() noexcept
{
    if (m_isOn)
        m_period = m_age < 4 * kShortestPeriod ? std::min(2 * m_period, kLongestPeriod) : kShortestPeriod;
    m_isOn = false;
    m_age = 0;
    m_skins.references.clear();
    m_awake.clear();
    m_pairs.clear();
}

bool SmallWorldSkins::isCalm(const ProxyView& view)
{
    if (++m_age < m_period || view.dirtyCount < view.size / 8 || !canBeMade(view.margin))
        return false;
    m_age = 0;
    m_skins.skin = Skin::ofMargin(view.margin);
    bool isCalm = m_skins.references.size() == view.size;
    if (isCalm)
    {
        std::uint32_t outsideCount = 0;
        for (std::uint32_t row = 0; row < view.size; ++row)
            outsideCount += m_skins.contain(view.boxes[row], row) ? 0u : 1u;
        isCalm = outsideCount * 10 <= view.size;
    }
    m_skins.references.assign(view.boxes, view.boxes + view.size);
    return isCalm;
}

void SmallWorldSkins::begin(const ProxyView& view)
{
    m_isOn = true;
    m_age = 0;
    m_awakeTests = 0;
    m_skins.skin = Skin::ofMargin(view.margin);
    m_skins.references.assign(view.boxes, view.boxes + view.size);
    m_isAwake.assign(view.size, 0);
    m_awake.clear();
    m_pairs.clear();
    m_pairs.setPersistentGap(m_skins.skin.persistentGap(view.margin));
}

bool SmallWorldSkins::update(const ProxyView& view)
{
    ++m_age;
    const std::size_t awakeBefore = m_awake.size();
    for (auto row = static_cast<std::uint32_t>(m_skins.references.size()); row < view.size; ++row)
    {
        m_skins.references.push_back(kEmptyAabb);
        m_isAwake.push_back(0);
        wakeBox(row);
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        const bool hasOnlyMoved = view.changes[row] == kRowMoved;
        if (m_isAwake[row] == 0 && !(hasOnlyMoved && m_skins.contain(view.boxes[row], row)))
            wakeBox(row);
    }
    if (m_awake.size() != awakeBefore)
        m_pairs.expireIf([this](RowPair pair) { return (m_isAwake[pair.a] | m_isAwake[pair.b]) != 0; });
    m_awakeTests += m_awake.size();
    return m_awakeTests <= 2 * std::uint64_t{view.size};
}

std::uint64_t SmallWorldSkins::bytes() const noexcept
{
    return m_skins.references.capacity() * sizeof(Aabb) + m_isAwake.capacity() +
           m_awake.capacity() * sizeof(std::uint32_t) + m_pairs.bytes();
}
}  // namespace cullet
