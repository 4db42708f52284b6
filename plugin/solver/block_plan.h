// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/solver_rows.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Constraints between pairs of bodies, by colour: no two of a colour move the same body, so that a colour is solved in
/// any order, in lanes and on threads, with the same result.
///
/// Each constraint gets the first colour that its bodies do not have yet, in the order of the constraints. Those of a
/// body with more than kColours come last, one block after the other. If there are many constraints, those of bodies with
/// near numbers are near each other within a colour.
class BlockPlan
{
public:
    static constexpr int kColours = 64;
    /// Kinds of constraints with most rows first; a colour's blocks contain those of a kind before the next kind's.
    static constexpr int kKinds = 8;

    struct Constraint
    {
        std::uint32_t a, b;  ///< the bodies that it moves; kFixedBody: none
        std::uint32_t kind;  ///< below kKinds
    };
    struct Block
    {
        std::uint32_t first;  ///< in order()
        std::uint32_t lanes;
        std::uint32_t shared;  ///< the body that all lanes move, each a part of it; kFixedBody: none
    };
    struct Colour
    {
        std::uint32_t begin, end;  ///< of blocks()
        bool isSerial;             ///< its blocks must be solved one after the other
    };
    /// Whether several lanes of a block of the last colour may each move a part of a body, beside one other body each.
    using MayShare = std::function<bool(std::uint32_t body, std::uint32_t other)>;

    /// @param bodies   number of bodies
    /// @param mayShare asked of constraints of the last colour only; null: its blocks have one lane
    void build(const std::vector<Constraint>& constraints, std::uint32_t bodies,
               const MayShare& mayShare = {});

    /// Indices of the constraints, block by block.
    const std::vector<std::uint32_t>& order() const { return m_order; }
    const std::vector<Block>& blocks() const { return m_blocks; }
    const std::vector<Colour>& colours() const { return m_colours; }

    /// Constraints of the blocks that must be solved one after the other.
    std::uint32_t serialConstraints() const
    {
        return m_colours.empty() || !m_colours.back().isSerial
                   ? 0
                   : static_cast<std::uint32_t>(m_order.size()) - m_blocks[m_colours.back().begin].first;
    }

private:
    std::uint32_t sharedBody(const Constraint& constraint, const MayShare& mayShare) const;
    bool fitsLastBlock(const std::vector<Constraint>& constraints, const Constraint& constraint,
                       std::uint32_t shared) const;
    void cutEqual(std::uint32_t begin, std::uint32_t end, std::uint32_t width);
    void cutShared(const std::vector<Constraint>& constraints, std::uint32_t begin, const MayShare& mayShare);
    std::uint32_t colourOf(const Constraint& constraint);
    void sortByBody(const std::vector<Constraint>& constraints, std::uint32_t bodies);
    void sortByColour(bool byBody);
    void cutBlocks(const std::vector<Constraint>& constraints, const MayShare& mayShare);

    std::vector<std::uint64_t> m_used;    ///< [body], a bit for each of its colours
    std::vector<std::uint32_t> m_last;    ///< constraints of the last colour
    std::vector<std::uint32_t> m_turns;   ///< [body that is shared] its turn in the last colour
    std::vector<std::uint64_t> m_byTurn;  ///< of the last colour: the turn, and the place in m_last
    std::vector<std::uint32_t> m_keys;    ///< [constraint], kKinds * colour + kind
    std::vector<std::uint32_t> m_byBody;  ///< constraints, roughly in the order of their bodies
    std::vector<std::uint32_t> m_order;
    std::vector<std::uint32_t> m_firsts;  ///< [key] in m_order, [range of bodies] in m_byBody
    std::vector<Block> m_blocks;
    std::vector<Colour> m_colours;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
