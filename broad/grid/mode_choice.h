// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/grid/update/mode_policy.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Chooses between sweep mode and resting mode.
class ModeChoice
{
public:
    explicit ModeChoice(const GridOptions& options)
        : m_mayRest(options.settles && options.rebuildFraction != 0.0f),
          m_mustRest(options.rebuildFraction >= 1.0f)
    {
    }

    /// Whether a refill with skins around the boxes will pay, to be asked in each update of sweep mode in which boxes
    /// changed: in a sample, few boxes left a skin around where they were some updates ago. Speed is no criterion,
    /// since a resting pile jitters fast without going anywhere.
    bool shouldBeginResting(const ProxyView& view);

    /// Ends a phase of resting mode; returns whether another one should follow.
    bool endResting()
    {
        m_policy.end();
        return m_policy.mayBegin() || m_mustRest;
    }

    /// Costs of the phases of resting mode.
    ModePolicy& policy() { return m_policy; }

    /// To be called after restart(), when the rows may be others.
    void forgetRows();

    std::uint64_t bytes() const;

private:
    std::uint32_t countFreshMovers(const ProxyView& view);
    bool areCalm(const ProxyView& view);

    bool m_mayRest;
    bool m_mustRest;
    ModePolicy m_policy;
    std::vector<Aabb> m_anchors;  ///< a sample of the boxes some updates ago
    std::uint32_t m_anchorStride = 1;
    std::uint32_t m_anchorAge = 0;
    std::vector<std::uint32_t>
        m_moverStamps;               ///< [rows] stamp of the last count in which each had changed, if few do
    std::uint32_t m_moverStamp = 1;  ///< stamp of the last count
};
}  // namespace cullet
