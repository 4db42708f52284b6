// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/sweep/unswept_pairs.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/boxes/prefetch_box.h"
#include "cullet/broad/grid/sweep/pair_loop.h"

#include <algorithm>

namespace cullet
{
void UnsweptPairs::clear()
{
    m_exempt.reset(0);
    m_hysteresisPairs.clear();
}

void UnsweptPairs::beginUpdate(const ProxyView& view)
{
    for (ThreadDelta& delta : m_threads)
    {
        delta.hysteresis.clear();
        delta.newlyExempt.clear();
        delta.noLongerExempt.clear();
    }
    forEachPair(
        m_core.workers, view.boxes, m_hysteresisPairs.size(),
        [&](std::size_t i) { return m_hysteresisPairs[i]; },
        [&](RowPair pair, unsigned worker)
        {
            if (!isOverlapping(view, pair))
                separate(view, pair, isWithinMargin(view, pair), worker);
            else if (mayEnter(view, pair))
                m_core.delta.add(view, pair, worker);
            else
                m_threads[worker].newlyExempt.push_back(rowKey(pair));
        });
    for (const ThreadDelta& delta : m_threads)
    {
        for (const std::uint64_t key : delta.newlyExempt)
            m_exempt.insert(key);
    }
}

void UnsweptPairs::separate(const ProxyView& view, RowPair pair, bool isWithinMargin, unsigned worker)
{
    if (hasExempt() && isExempt(rowKey(pair)))
        recordEndOfExemption(rowKey(pair), worker);
    if (isWithinMargin)
        recordHysteresis(pair, worker);
    else
        m_core.delta.remove(view, pair, worker);
}

void UnsweptPairs::merge()
{
    m_hysteresisPairs.clear();
    for (ThreadDelta& delta : m_threads)
    {
        m_hysteresisPairs.insert(m_hysteresisPairs.end(), delta.hysteresis.begin(), delta.hysteresis.end());
        for (const std::uint64_t key : delta.noLongerExempt)
            m_exempt.erase(key);
        trimCapacity(delta.hysteresis);
    }
    trimCapacity(m_hysteresisPairs);
}

std::uint64_t UnsweptPairs::bytes() const
{
    std::uint64_t sum = m_exempt.bytes() + bytesOf(m_hysteresisPairs, m_threads);
    for (const ThreadDelta& delta : m_threads)
        sum += bytesOf(delta.hysteresis, delta.newlyExempt, delta.noLongerExempt);
    return sum;
}
}  // namespace cullet
