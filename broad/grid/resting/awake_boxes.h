// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/pair_sinks.h"
#include "cullet/broad/grid/resting/neighbour_lists.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/verlet/verlet_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The boxes that left their skins in resting mode, and all their pairs: those with resting boxes in NeighbourLists, and
/// those with each other and with unbounded boxes, which are in no column, in a list with one skin for all. A second,
/// small grid finds the latter.
class AwakeBoxes
{
public:
    /// @param states by row; of the owner, which changes them
    AwakeBoxes(GridCore& core, const std::vector<RowState>& states)
        : m_core(core), m_states(states), m_grid(core.options, core.workers), m_lists(core, states)
    {
    }

    const std::vector<std::uint32_t>& rows() const { return m_lists.rows(); }

    void clear();

    /// Adds a box that just became awake, with its held pairs of `resting`, where they expire.
    void add(std::uint32_t row, VerletPairs& resting) { m_lists.add(row, resting); }

    /// @param skin       of resting boxes
    /// @param areSomeNew whether boxes became awake in this update
    void update(const ProxyView& view, Skin skin, bool areSomeNew);

    template <class Visit>
    void forEachHeld(Visit visit) const
    {
        m_pairs.forEachHeld(visit);
        m_lists.forEachHeld(visit);
    }

    void forEachCell(const CellVisitor& visit) const { m_grid.forEachCell(visit); }
    ColumnGrid::Work collectWork() { return m_grid.collectWork(); }
    std::uint64_t bytes() const;

private:
    void chooseSkin();
    void scan(const ProxyView& view, Skin restingSkin, CollectingSink& sink);
    void findPairsWithUnbounded(const ProxyView& view, Skin restingSkin, CollectingSink& sink) const;
    void rebuildPairs(const ProxyView& view, const CollectingSink& sink);

    GridCore& m_core;
    const std::vector<RowState>& m_states;
    ColumnGrid m_grid;  ///< awake boxes
    NeighbourLists m_lists;
    VerletPairs m_pairs;       ///< pairs of awake boxes with each other, and with unbounded boxes
    Skins m_skins;             ///< [rows(), at most] of m_pairs
    std::uint32_t m_age = 0;   ///< updates since m_pairs was made
    std::uint32_t m_wait = 0;  ///< updates until m_pairs gets a skin again
};
}  // namespace cullet
