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
    m_active.clear();
    m_watched.clear();
}

bool SmallWorldSkins::isCalm(const ProxyView& view)
{
    if (++m_age < m_period || view.dirtyCount < view.size / 8 || !(view.margin > 0.0f))
        return false;
    m_age = 0;
    bool isCalm = m_reference.size() == view.size;
    if (isCalm)
    {
        std::uint32_t away = 0;
        for (std::uint32_t row = 0; row < view.size; ++row)
            away += isInsideShell(view.boxes[row], m_reference[row], 0.5f * view.margin) ? 0u : 1u;
        isCalm = away * 10 <= view.size;
    }
    m_reference.assign(view.boxes, view.boxes + view.size);
    return isCalm;
}

void SmallWorldSkins::begin(const ProxyView& view)
{
    m_isOn = true;
    m_age = 0;
    m_spent = 0;
    m_margin = view.margin;
    m_slack = 0.5f * view.margin;
    m_reference.assign(view.boxes, view.boxes + view.size);
    m_isActive.assign(view.size, 0);
    m_active.clear();
    m_watched.clear();
}

void SmallWorldSkins::watch(const ProxyView& view, RowPair pair, bool isHeld)
{
    const float gap = gapOf(view.boxes[pair.a], view.boxes[pair.b]);
    if (!isHeld || gap > sureGapOf(m_margin, m_slack))
        m_watched.push_back(pair);
}

bool SmallWorldSkins::update(const ProxyView& view)
{
    ++m_age;
    for (std::uint32_t row = static_cast<std::uint32_t>(m_reference.size()); row < view.size; ++row)
    {
        m_reference.push_back(kEmptyAabb);
        m_isActive.push_back(0);
        activate(row);
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        const bool hasOnlyMoved = view.changes[row] == kRowMoved;
        if (m_isActive[row] == 0 &&
            !(hasOnlyMoved && isInsideShell(view.boxes[row], m_reference[row], m_slack)))
            activate(row);
    }
    m_spent += m_active.size();
    return m_spent <= 2 * std::uint64_t{view.size};
}

std::uint64_t SmallWorldSkins::bytes() const noexcept
{
    return m_reference.capacity() * sizeof(Aabb) + m_isActive.capacity() +
           m_active.capacity() * sizeof(std::uint32_t) + m_watched.capacity() * sizeof(RowPair);
}
}  // namespace cullet
