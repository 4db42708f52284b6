// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/resting/awake_boxes.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/grid/update/mode_policy.h"
#include "cullet/broad/verlet/verlet_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Resting mode of the grid, in which unmoved and slowly moving boxes are nearly free.
///
/// The columns of the last refill are frozen. Each box has a skin around its reference position; while it stays inside,
/// only its changeable pairs (VerletPairs) can change. A box that leaves its skin becomes *awake* (AwakeBoxes). When too
/// many boxes are awake, the whole grid has to be refilled.
class RestingMode
{
public:
    enum class Outcome : std::uint8_t
    {
        Done,
        Refill  ///< nothing was reported; refill everything
    };

    /// @param policy counts what the mode costs
    RestingMode(GridCore& core, ModePolicy& policy) : m_core(core), m_policy(policy), m_awake(core, m_states)
    {
    }

    /// Refills the columns, from any state, and reports the differences to the pairs held so far.
    void begin(const ProxyView& view, const std::vector<RowPair>& held);

    Outcome update(const ProxyView& view);

    /// Appends the held pairs.
    void collectHeld(std::vector<RowPair>& held) const;

    /// Ends the mode: forgets the pairs.
    void clear();
    /// Frees what many pairs needed. @pre clear()
    void trim() { m_pairs.trim(); }

    const AwakeBoxes& awake() const { return m_awake; }
    ColumnGrid::Work collectWork() { return m_awake.collectWork(); }

    /// To be called in each update, of either mode.
    void growRows(std::uint32_t rows) { m_states.resize(rows, RowState::Absent); }
    /// To be called after restart(), when the rows may be others.
    void forgetRows() { m_states.clear(); }

    std::uint64_t bytes() const;

private:
    /// Where the boxes that changed in an update are.
    struct SkinChanges
    {
        bool areFew = true;
        std::vector<std::uint32_t> inside;   ///< rows that moved inside their skin; filled if areFew
        std::size_t insideCount = 0;         ///< rows that moved inside their skin
        std::vector<std::uint32_t> outside;  ///< rows that left their skin
    };

    void classifyChangedBoxes(const ProxyView& view);
    std::uint32_t classifyFewChangedBoxes(const ProxyView& view);
    std::uint32_t classifyAllBoxes(const ProxyView& view);
    bool shouldRefill(const ProxyView& view);
    void updatePairs(const ProxyView& view);

    GridCore& m_core;
    ModePolicy& m_policy;
    std::vector<RowState> m_states;  ///< [rows]
    Skin m_skin;                     ///< half the margin
    float m_margin = 0;
    VerletPairs m_pairs;  ///< of resting boxes
    AwakeBoxes m_awake;
    SkinChanges m_changes;
    double m_wasted = 0;  ///< work spent on awake boxes that do not move any more
};
}  // namespace cullet
