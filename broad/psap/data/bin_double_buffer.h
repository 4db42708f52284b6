// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bins.h"

#include <cstdint>

namespace cullet::psap
{
/// Two sets of bins or tiles. An update fills and searches one; its search clears the other one for the next update.
template <class Exec>
class BinDoubleBuffer
{
public:
    /// @param count number of bins; smaller than before only where forget() follows
    void reserve(Exec& exec, std::uint64_t count)
    {
        m_count = count;
        for (int which = 0; which < 2; ++which)
        {
            exec.reserve(m_counts[which], count);
            exec.reserve(m_totals[which], 1);
        }
    }

    /// Marks both sets as not cleared.
    void forget() { m_isClear = false; }

    /// Makes the cleared set the current one.
    void begin(Exec& exec)
    {
        swap();
        if (!m_isClear)
            clear(exec);
        m_isClear = false;
    }

    /// Records that the other set has been cleared.
    void markOtherClear() { m_isClear = true; }
    /// In place of begin(), for an update that ran without it.
    void swap() { m_current = 1 - m_current; }

    BinSet current() const { return set(m_current); }
    BinSet other() const { return set(1 - m_current); }
    const std::uint32_t* unboundedCount() const { return &m_totals[m_current].data()->unboundedCount; }
    /// Index of the set of launches that the next update uses, of two.
    unsigned nextPhase() const { return 1 - m_current; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    BinSet set(unsigned which) const { return {m_counts[which].data(), m_totals[which].data()}; }

    void clear(Exec& exec)
    {
        for (int which = 0; which < 2; ++which)
        {
            exec.clear(m_counts[which].data(), m_count);
            exec.clear(m_totals[which].data(), 1);
        }
    }

    std::uint64_t m_count = 0;
    unsigned m_current = 0;
    bool m_isClear = false;  ///< the set that the next update uses
    Buffer<std::uint32_t> m_counts[2];
    Buffer<BinTotals> m_totals[2];
};
}  // namespace cullet::psap
