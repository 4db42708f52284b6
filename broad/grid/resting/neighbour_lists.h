// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/pairs/sorted_pairs.h"
#include "cullet/broad/row_pair.h"
#include "cullet/broad/verlet/skin.h"
#include "cullet/broad/verlet/verlet_pairs.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Where a row is in resting mode.
enum class RowState : std::uint8_t
{
    Absent,   ///< no box, or none in the frozen grid
    Resting,  ///< inside its skin
    Awake     ///< left its skin, or was created
};

/// The awake boxes of resting mode, and for each of them its pairs with resting boxes that can enter or leave the pair
/// set while no face of the box is farther than a skin from where it was when the list was made.
///
/// These are Verlet lists (L. Verlet, Phys. Rev. 159, 98, 1967) with a skin of its own for each box. A query of the
/// frozen grid makes a list anew when its box has left the skin of the list.
class NeighbourLists
{
public:
    NeighbourLists(GridCore& core, const std::vector<RowState>& states) : m_core(core), m_states(states) {}

    const std::vector<std::uint32_t>& rows() const { return m_rows; }
    unsigned parts() const { return static_cast<unsigned>(m_parts.size()); }

    void clear();

    /// Adds a box that just became awake, with its held pairs of `resting`, where they expire.
    void add(std::uint32_t row, VerletPairs& resting);

    /// Whether many boxes have become awake, or have moved far, since the last order(); counts an update.
    bool needsOrder();

    /// Orders the awake boxes along the columns, and distributes them over the parts.
    void order(const ProxyView& view, unsigned parts);

    /// Updates the lists of a part, and reports the changes of their pairs. Different threads may update different
    /// parts.
    ///
    /// @param awake       whether a box has left these skins is recorded
    /// @param areSomeNew  whether boxes became awake in this update
    void update(const ProxyView& view, const Skins& awake, bool areSomeNew, unsigned part, unsigned worker);

    /// Pairs that update() tested.
    std::size_t testedCount() const;

    /// Whether update() found a box that has left its skin, or held pairs that no list has any more.
    bool haveLeftSkin() const;
    /// Calls visit(pair) for these held pairs.
    template <class Visit>
    void forEachUnlisted(Visit visit) const
    {
        for (const Part& part : m_parts)
            std::for_each(part.unlistedPairs.begin(), part.unlistedPairs.end(), visit);
    }

    template <class Visit>
    void forEachHeld(Visit visit) const
    {
        for (const Part& part : m_parts)
            part.pairs.forEachHeld(visit);
    }

    /// Mean skin of the lists.
    float meanSkin() const;

    std::uint64_t bytes() const;

private:
    class Sink;

    struct List
    {
        /// The skin of a list that has to be made; the list still holds its former pairs.
        static constexpr Skin kUnmade = {-1.0f};

        Aabb box;  ///< the box when the list was made
        Skin skin;
        std::uint32_t begin;  ///< [count] among the pairs of a Part
        std::uint32_t count;
    };

    /// The lists of some awake boxes, which one task at a time updates.
    struct alignas(64) Part
    {
        VerletPairs pairs;
        std::size_t expiredCount = 0;        ///< expired ones of `pairs`
        std::vector<RowPair> unlistedPairs;  ///< held pairs that this update added to no list
        bool hasLeftSkin = false;            ///< an awake box left its skin among those
        // Scratch:
        std::vector<std::uint32_t> stale;  ///< awake boxes whose lists have to be made
        std::vector<Aabb> queries;         ///< [stale]
        PairKeys keys;                     ///< held pairs of stale lists, ascending: index in `stale`, row
        SortedPairs held;                  ///< those of `keys` that the query has not found yet

        void beginUpdate();
        std::uint64_t bytes() const;
    };

    TaskRange rangeOf(unsigned part) const;
    void expireAwakePartners(Part& to) const;
    void prepareQuery(const ProxyView& view, std::uint32_t index, Part& to);
    void makeLists(const ProxyView& view, Part& to, unsigned worker);
    void compact(unsigned part);
    static void moveList(const VerletPairs& from, List& list, VerletPairs& to);

    GridCore& m_core;
    const std::vector<RowState>& m_states;
    std::vector<std::uint32_t> m_rows;
    std::vector<List> m_lists;  ///< [m_rows]
    std::vector<Part> m_parts = std::vector<Part>(1);
    std::size_t m_orderedCount = 0;  ///< awake boxes when they were ordered along the columns
    std::uint32_t m_orderedAge = 0;  ///< updates since
};
}  // namespace cullet
