// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/block_plan.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::uint32_t kKeys = (BlockPlan::kColours + 1) * BlockPlan::kKinds;
}

void BlockPlan::build(const std::vector<Constraint>& constraints, std::uint32_t bodies)
{
    m_used.assign(bodies, 0);
    m_keys.resize(constraints.size());
    for (std::size_t i = 0; i < constraints.size(); ++i)
        m_keys[i] = kKinds * colourOf(constraints[i]) + constraints[i].kind;
    sortByColour(constraints);
    cutBlocks();
}

std::uint32_t BlockPlan::colourOf(const Constraint& constraint)
{
    const std::uint64_t used = m_used[constraint.a] | m_used[constraint.b];
    if (~used == 0)
        return kColours;
    const std::uint64_t bit = ~used & (used + 1);
    m_used[constraint.a] |= bit;
    m_used[constraint.b] |= bit;
    m_used[kFixedBody] = 0;
    return static_cast<std::uint32_t>(__builtin_ctzll(bit));
}

void BlockPlan::sortByColour(const std::vector<Constraint>& constraints)
{
    m_firsts.assign(kKeys + 1, 0);
    for (std::uint32_t key : m_keys)
        ++m_firsts[key + 1];
    for (std::uint32_t key = 0; key < kKeys; ++key)
        m_firsts[key + 1] += m_firsts[key];
    m_order.resize(constraints.size());
    std::vector<std::uint32_t>& next = m_firsts;
    for (std::uint32_t i = 0; i < m_keys.size(); ++i)
        m_order[next[m_keys[i]]++] = i;
    // Each entry has become the end of its key, which is where the next key begins.
}

void BlockPlan::cutBlocks()
{
    m_blocks.clear();
    m_colours.clear();
    std::uint32_t begin = 0;
    for (int colour = 0; colour <= kColours; ++colour)
    {
        const std::uint32_t end = m_firsts[static_cast<std::size_t>(kKinds * colour + kKinds - 1)];
        if (begin == end)
            continue;
        const bool isSerial = colour == kColours;
        const std::uint32_t width = isSerial ? 1 : kBlock;
        const auto firstBlock = static_cast<std::uint32_t>(m_blocks.size());
        for (; begin < end; begin += m_blocks.back().lanes)
            m_blocks.push_back({begin, std::min(width, end - begin)});
        m_colours.push_back({firstBlock, static_cast<std::uint32_t>(m_blocks.size()), isSerial});
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
