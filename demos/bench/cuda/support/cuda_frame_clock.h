// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/support/cuda_timing.h"

#include <cstdint>

namespace cullet
{
// Delays of a CPU that wakes up late are shorter than this.
inline constexpr double kLateMs = 0.02;

/// Times the frames of a finder of boxes in device memory.
///
/// @tparam Found result of its collect()
template <class Finder, class Found>
class FrameClock
{
public:
    FrameClock(Finder& finder, cudaStream_t stream)
        : m_finder(finder), m_search(stream), m_collect(stream), m_collectAgain(stream)
    {
    }

    /// Milliseconds of the device. Where a bin was full or the list too short, collect() searches again, which shows as
    /// extra time compared with a second call, which does nothing.
    double time(const Aabb* boxes, std::uint64_t bodies, Found& found)
    {
        m_search.begin();
        requireOk(m_finder.enqueue(boxes, bodies));
        m_search.end();
        m_collect.begin();
        requireOk(m_finder.collect(found));
        m_collect.end();
        m_collectAgain.begin();
        requireOk(m_finder.collect(found));
        m_collectAgain.end();
        const double again = m_collectAgain.milliseconds();
        const double late = m_collect.milliseconds() - again;
        m_isLate = late > kLateMs;
        return m_search.milliseconds() + (m_isLate ? late : 0);
    }

    /// Whether the last frame was searched twice.
    bool isLate() const { return m_isLate; }

private:
    Finder& m_finder;
    StreamTimer m_search, m_collect, m_collectAgain;
    bool m_isLate = false;
};
}  // namespace cullet
