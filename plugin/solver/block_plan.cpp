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
/// Constraints that are worth an order by bodies.
constexpr std::size_t kMany = 512;
constexpr std::uint32_t kRanges = 512;  ///< of bodies that are near each other
}  // namespace

void BlockPlan::build(const std::vector<Constraint>& constraints, std::uint32_t bodies,
                      const MayShare& mayShare)
{
    m_used.assign(bodies, 0);
    m_keys.resize(constraints.size());
    for (std::size_t i = 0; i < constraints.size(); ++i)
        m_keys[i] = kKinds * colourOf(constraints[i]) + constraints[i].kind;
    if (constraints.size() >= kMany)
        sortByBody(constraints, bodies);
    sortByColour(constraints.size() >= kMany);
    cutBlocks(constraints, mayShare);
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

/// Sorts constraints by ranges of bodies; those without a colour stay in their order.
void BlockPlan::sortByBody(const std::vector<Constraint>& constraints, std::uint32_t bodies)
{
    unsigned shift = 0;
    while (bodies >> shift > kRanges)
        ++shift;
    const auto rangeOf = [&](std::uint32_t i)
    {
        const Constraint& constraint = constraints[i];
        const std::uint32_t body = constraint.a != kFixedBody ? constraint.a : constraint.b;
        return m_keys[i] >= kKinds * kColours ? kRanges : body >> shift;
    };
    m_firsts.assign(kRanges + 2, 0);
    for (std::uint32_t i = 0; i < constraints.size(); ++i)
        ++m_firsts[rangeOf(i) + 1];
    for (std::uint32_t range = 0; range <= kRanges; ++range)
        m_firsts[range + 1] += m_firsts[range];
    m_byBody.resize(constraints.size());
    for (std::uint32_t i = 0; i < constraints.size(); ++i)
        m_byBody[m_firsts[rangeOf(i)]++] = i;
}

/// @param byBody whether in the order of m_byBody
void BlockPlan::sortByColour(bool byBody)
{
    m_firsts.assign(kKeys + 1, 0);
    for (std::uint32_t key : m_keys)
        ++m_firsts[key + 1];
    for (std::uint32_t key = 0; key < kKeys; ++key)
        m_firsts[key + 1] += m_firsts[key];
    m_order.resize(m_keys.size());
    std::vector<std::uint32_t>& next = m_firsts;
    for (std::uint32_t k = 0; k < m_keys.size(); ++k)
    {
        const std::uint32_t i = byBody ? m_byBody[k] : k;
        m_order[next[m_keys[i]]++] = i;
    }
    // Each entry has become the end of its key, which is where the next key begins.
}

void BlockPlan::cutBlocks(const std::vector<Constraint>& constraints, const MayShare& mayShare)
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
        const auto firstBlock = static_cast<std::uint32_t>(m_blocks.size());
        if (isSerial && mayShare)
            cutShared(constraints, begin, mayShare);
        else
            cutEqual(begin, end, isSerial ? 1 : kBlock);
        m_colours.push_back({firstBlock, static_cast<std::uint32_t>(m_blocks.size()), isSerial});
        begin = end;
    }
}

void BlockPlan::cutEqual(std::uint32_t begin, std::uint32_t end, std::uint32_t width)
{
    for (; begin < end; begin += m_blocks.back().lanes)
        m_blocks.push_back({begin, std::min(width, end - begin), kFixedBody});
}

/// The one of a constraint's bodies that several lanes may move, the one with more colours if both are; else the fixed one.
std::uint32_t BlockPlan::sharedBody(const Constraint& constraint, const MayShare& mayShare) const
{
    const auto colours = [&](std::uint32_t body) { return __builtin_popcountll(m_used[body]); };
    const std::uint32_t a = mayShare(constraint.a, constraint.b) ? constraint.a : kFixedBody;
    const std::uint32_t b = mayShare(constraint.b, constraint.a) ? constraint.b : kFixedBody;
    return colours(b) > colours(a) ? b : a;
}

/// Sorts the constraints from a place in the order on by the body that they share, and cuts them into blocks. Bodies follow
/// each other as in the order, since their numbers depend on other islands.
void BlockPlan::cutShared(const std::vector<Constraint>& constraints, std::uint32_t begin,
                          const MayShare& mayShare)
{
    constexpr std::uint32_t kNoTurn = ~std::uint32_t{0};
    m_last.assign(m_order.begin() + begin, m_order.end());
    m_turns.assign(m_used.size(), kNoTurn);
    m_byTurn.clear();
    std::uint32_t bodies = 0;
    for (std::uint32_t i = 0; i < m_last.size(); ++i)
    {
        std::uint32_t& turn = m_turns[sharedBody(constraints[m_last[i]], mayShare)];
        turn = turn == kNoTurn ? bodies++ : turn;
        m_byTurn.push_back(std::uint64_t{turn} << 32 | i);
    }
    std::sort(m_byTurn.begin(), m_byTurn.end());
    for (std::uint32_t i = 0; i < m_last.size(); ++i)
    {
        const std::uint32_t index = m_last[static_cast<std::uint32_t>(m_byTurn[i])];
        m_order[begin + i] = index;
        const std::uint32_t shared = sharedBody(constraints[index], mayShare);
        if (i == 0 || !fitsLastBlock(constraints, constraints[index], shared))
            m_blocks.push_back({begin + i, 0, shared});
        ++m_blocks.back().lanes;
    }
    for (std::size_t i = m_blocks.size(); i-- > 0 && m_blocks[i].first >= begin;)
        m_blocks[i].shared = m_blocks[i].lanes > 1 ? m_blocks[i].shared : kFixedBody;
}

/// Whether a constraint may join the last block: it shares the same body, and no other lane moves its other one.
bool BlockPlan::fitsLastBlock(const std::vector<Constraint>& constraints, const Constraint& constraint,
                              std::uint32_t shared) const
{
    const Block& block = m_blocks.back();
    if (shared == kFixedBody || block.shared != shared || block.lanes == kBlock)
        return false;
    const auto otherOf = [shared](const Constraint& of) { return of.a == shared ? of.b : of.a; };
    for (std::uint32_t lane = 0; lane < block.lanes; ++lane)
    {
        if (otherOf(constraint) != kFixedBody &&
            otherOf(constraint) == otherOf(constraints[m_order[block.first + lane]]))
            return false;
    }
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
