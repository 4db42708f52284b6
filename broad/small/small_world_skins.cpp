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
    m_reference.clear();
    m_awake.clear();
    m_candidatePairs.clear();
}

bool SmallWorldSkins::isCalm(const ProxyView& view)
{
    if (++m_age < m_period || view.dirtyCount < view.size / 8 || !(view.margin > 0.0f))
        return false;
    m_age = 0;
    bool isCalm = m_reference.size() == view.size;
    if (isCalm)
    {
        std::uint32_t outsideCount = 0;
        for (std::uint32_t row = 0; row < view.size; ++row)
            outsideCount += isInsideSkin(view.boxes[row], m_reference[row], 0.5f * view.margin) ? 0u : 1u;
        isCalm = outsideCount * 10 <= view.size;
    }
    m_reference.assign(view.boxes, view.boxes + view.size);
    return isCalm;
}

void SmallWorldSkins::begin(const ProxyView& view)
{
    m_isOn = true;
    m_age = 0;
    m_awakeTests = 0;
    m_margin = view.margin;
    m_skin = 0.5f * view.margin;
    m_reference.assign(view.boxes, view.boxes + view.size);
    m_isAwake.assign(view.size, 0);
    m_awake.clear();
    m_candidatePairs.clear();
}

void SmallWorldSkins::addCandidate(const ProxyView& view, RowPair pair, bool isHeld)
{
    const float gap = gapOf(view.boxes[pair.a], view.boxes[pair.b]);
    if (!isHeld || gap > persistentGapOf(m_margin, m_skin))
        m_candidatePairs.push_back(pair);
}

bool SmallWorldSkins::update(const ProxyView& view)
{
    ++m_age;
    for (std::uint32_t row = static_cast<std::uint32_t>(m_reference.size()); row < view.size; ++row)
    {
        m_reference.push_back(kEmptyAabb);
        m_isAwake.push_back(0);
        wakeBox(row);
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        const bool hasOnlyMoved = view.changes[row] == kRowMoved;
        if (m_isAwake[row] == 0 && !(hasOnlyMoved && isInsideSkin(view.boxes[row], m_reference[row], m_skin)))
            wakeBox(row);
    }
    m_awakeTests += m_awake.size();
    return m_awakeTests <= 2 * std::uint64_t{view.size};
}

std::uint64_t SmallWorldSkins::bytes() const noexcept
{
    return m_reference.capacity() * sizeof(Aabb) + m_isAwake.capacity() +
           m_awake.capacity() * sizeof(std::uint32_t) + m_candidatePairs.capacity() * sizeof(RowPair);
}
}  // namespace cullet
