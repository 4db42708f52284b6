// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"

#include <algorithm>
#include <cstdint>

/// Memory in an executor that each update uses and clears for the next one.
namespace cullet::psap
{
/// The counters of an update, double-buffered: each update clears those of the next one.
template <class Exec>
class UpdateCounterBuffers
{
public:
    /// Begins an update. An update that ends without markNextEmpty() makes the next begin() clear both sets.
    void begin(Exec& exec)
    {
        exec.reserve(m_updateCounters, 2);
        if (!m_isNextEmpty)
            exec.clear(m_updateCounters.data(), 2);
        m_isNextEmpty = false;
        m_current = 1 - m_current;
    }
    /// Records that the update has cleared next().
    void markNextEmpty() { m_isNextEmpty = true; }

    UpdateCounters* current() const { return m_updateCounters.data() + m_current; }
    UpdateCounters* next() const { return m_updateCounters.data() + 1 - m_current; }

private:
    typename Exec::template Buffer<UpdateCounters> m_updateCounters;
    unsigned m_current = 0;
    bool m_isNextEmpty = false;
};

/// The look-up table of undecided held pairs. It is empty between two uses.
template <class Exec>
class UndecidedPairs
{
public:
    /// Makes room for so many pairs.
    void grow(Exec& exec, std::uint64_t pairs)
    {
        std::uint64_t slots = std::max<std::uint64_t>(m_slotCount, 2);
        while (slots < 2 * pairs)
            slots *= 2;
        m_isFree = m_isFree && slots == m_slotCount;
        exec.reserve(m_slots, slots);
        m_slotCount = slots;
    }

    /// Clears the slots, unless they are empty. The table is in use afterwards.
    void use(Exec& exec)
    {
        if (!m_isFree)
            exec.forEach(m_slotCount, FreeSlot{m_slots.data()});
        m_isFree = false;
    }
    /// Records whether all slots are empty: a step has cleared them, or none has inserted a pair.
    void setFree(bool isFree) { m_isFree = isFree; }

    /// @param count counter of the inserted pairs
    LookupTable table(std::uint64_t* count) const { return {m_slots.data(), m_slotCount - 1, count}; }

private:
    typename Exec::template Buffer<std::uint64_t> m_slots;
    std::uint64_t m_slotCount = 0;
    bool m_isFree = false;
};
}  // namespace cullet::psap
