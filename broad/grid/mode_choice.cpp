// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/mode_choice.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/verlet/skin.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Calm updates before resting mode begins: it has to last to be worth its refill.
constexpr std::uint32_t kCalmUpdates = 4;
constexpr std::uint32_t kAnchorSample = 256;
// One box in so many may begin to move in an update. More of them would fill the resting mode with awake boxes before
// it has paid for its refill.
constexpr std::uint32_t kFreshShare = 64;
}  // namespace

bool ModeChoice::shouldBeginResting(const ProxyView& view)
{
    if (!m_mayRest || m_mustRest)
        return m_mayRest;
    m_policy.countMoving();
    if (!m_policy.mayBegin())
        return false;
    if (view.dirtyCount < view.size / 8)
        return countFreshMovers(view) <= view.size / kFreshShare;
    return areCalm(view);
}

/// Whether nine of ten anchors have been near their boxes for some updates; else takes other anchors.
bool ModeChoice::areCalm(const ProxyView& view)
{
    const Skin skin = Skin::ofMargin(view.margin);
    std::uint32_t away = 0;
    for (std::size_t i = 0; i < m_anchors.size(); ++i)
    {
        const std::uint32_t row = static_cast<std::uint32_t>(i) * m_anchorStride;
        away += skin.contains(view.boxes[row], m_anchors[i]) ? 0u : 1u;
    }
    ++m_anchorAge;
    const bool isCalm = !m_anchors.empty() && away * 10 <= m_anchors.size();
    if (isCalm)
        return m_anchorAge >= kCalmUpdates;
    m_anchorAge = 0;
    m_anchorStride = view.size / kAnchorSample + 1;
    m_anchors.clear();
    for (std::uint32_t row = 0; row < view.size; row += m_anchorStride)
        m_anchors.push_back(view.boxes[row]);
    return false;
}

/// Number of rows that changed, and had not changed in the last count.
std::uint32_t ModeChoice::countFreshMovers(const ProxyView& view)
{
    m_moverStamps.resize(std::max<std::size_t>(m_moverStamps.size(), view.size), 0);
    const std::uint32_t before = m_moverStamp++;
    std::uint32_t fresh = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        std::uint32_t& stamp = m_moverStamps[view.dirty[i]];
        fresh += stamp != before ? 1u : 0u;
        stamp = m_moverStamp;
    }
    return fresh;
}

void ModeChoice::forgetRows()
{
    m_moverStamps.clear();
    m_anchors.clear();
}

std::uint64_t ModeChoice::bytes() const
{
    return bytesOf(m_anchors, m_moverStamps);
}
}  // namespace cullet
