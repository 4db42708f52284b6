// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/verlet/verlet_pairs.h"

#include "cullet/base/trim_capacity.h"

#include <algorithm>
#include <limits>

namespace cullet
{
void VerletPairs::clear()
{
    m_pairs.clear();
    m_states.clear();
    m_offsets.clear();
    m_items.clear();
    m_firstChangeable = 0;
}

void VerletPairs::trim()
{
    trimCapacity(m_pairs);
    trimCapacity(m_states);
    trimCapacity(m_items);
}

void VerletPairs::add(RowPair pair, State state)
{
    m_pairs.push_back(pair);
    m_states.push_back(state);
    if (state == State::Persistent)
        m_firstChangeable = m_pairs.size();
}

void VerletPairs::finish(std::uint32_t rowCount)
{
    m_offsets.assign(rowCount + 1u, 0);
    for (const RowPair pair : m_pairs)
    {
        ++m_offsets[pair.a];
        ++m_offsets[pair.b];
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& offset : m_offsets)
    {
        sum += offset;
        offset = sum;
    }
    // Items are filled from the back, so that each offset ends at the begin of its row.
    m_items.resize(2 * m_pairs.size());
    trim();
    for (std::size_t i = m_pairs.size(); i-- > 0;)
    {
        m_items[--m_offsets[m_pairs[i].a]] = static_cast<std::uint32_t>(i);
        m_items[--m_offsets[m_pairs[i].b]] = static_cast<std::uint32_t>(i);
    }
}

std::size_t VerletPairs::changeableCount() const
{
    const auto first = m_states.begin() + static_cast<std::ptrdiff_t>(m_firstChangeable);
    return static_cast<std::size_t>(
        std::count_if(first, m_states.end(), [](State state) { return isChangeable(state); }));
}

PairStateSource VerletPairs::pairStateSource(const Aabb* boxes, float margin) const
{
    constexpr float kNever = std::numeric_limits<float>::infinity();
    PairStateSource source = {boxes,
                              m_pairs.data(),
                              reinterpret_cast<const std::uint8_t*>(m_states.data()),
                              static_cast<std::uint32_t>(m_pairs.size()),
                              {kNever, kNever, kNever, kNever},
                              static_cast<std::uint8_t>(State::Candidate)};
    source.limits[static_cast<int>(State::Candidate)] = 0.0f;
    source.limits[static_cast<int>(State::Overlapping)] = 2.0f * margin;
    return source;
}

std::uint64_t VerletPairs::bytes() const
{
    return m_pairs.capacity() * sizeof(RowPair) + m_states.capacity() +
           (m_offsets.capacity() + m_items.capacity()) * sizeof(std::uint32_t);
}
}  // namespace cullet
