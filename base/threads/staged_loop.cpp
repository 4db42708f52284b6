// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/staged_loop.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace cullet
{
namespace
{
/// Pauses after which a thread runs the part of another one, about a microsecond: by then that one has seen that it can.
constexpr unsigned kPatience = 32;

void pauseBriefly(unsigned spins)
{
#if defined(__SSE2__)
    if (spins < 2 * kPatience)
    {
        _mm_pause();
        return;
    }
#endif
    ForkJoin::spinWait(spins < 2 * kPatience ? spins : spins - 2 * kPatience);
}
}  // namespace

void StagedLoop::reset(unsigned parts, unsigned stages)
{
    if (parts > m_capacity)
    {
        m_capacity = 0;
        m_parts.reset(new Part[parts]);
        m_capacity = parts;
    }
    m_count = parts;
    m_end = 2 * stages;
    for (unsigned part = 0; part < parts; ++part)
        m_parts[part].progress.store(0, std::memory_order_relaxed);
}

/// Waits until the thread of a part can run it, or that of one that others wait for; false when the part is finished.
bool StagedLoop::next(unsigned own, unsigned& spins, Turn& turn)
{
    for (;; pauseBriefly(spins++))
    {
        const std::uint32_t progress = m_parts[own].progress.load(std::memory_order_acquire);
        if (progress == m_end)
            return false;
        const unsigned behind = partBehind(progress / 2);
        if (behind == m_count)
        {
            if (take(own, turn))
                return true;
        }
        else if (spins >= kPatience && take(behind, turn))
        {
            return true;
        }
    }
}

/// The first part that has not done `stage` stages; m_count: all have.
unsigned StagedLoop::partBehind(std::uint32_t stage) const
{
    unsigned part = 0;
    while (part < m_count && m_parts[part].progress.load(std::memory_order_acquire) >= 2 * stage)
        ++part;
    return part;
}

/// Begins the next stage of a part, unless another thread runs it or other parts must come first.
bool StagedLoop::take(unsigned part, Turn& turn)
{
    std::uint32_t progress = m_parts[part].progress.load(std::memory_order_acquire);
    if (progress % 2 != 0 || progress == m_end || partBehind(progress / 2) != m_count)
        return false;
    turn = {part, progress / 2};
    return m_parts[part].progress.compare_exchange_strong(progress, progress + 1, std::memory_order_acq_rel,
                                                          std::memory_order_relaxed);
}
}  // namespace cullet
