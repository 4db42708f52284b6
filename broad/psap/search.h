// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/sorted/counting_search.h"
#include "cullet/broad/psap/sorted/fixed_bin_search.h"
#include "cullet/broad/psap/thesis/cell_search.h"
#include "cullet/broad/psap/tiles/tile_search.h"

#include <cstdint>

/// The order of the steps, for any executor.
///
/// An executor has: Buffer<T> with data() and size(); reserve(buffer, n), which may discard; upload, download, copy,
/// clear, wait, mark and awaitMark; forEach(n, functor); forEachEmitting(n, functor, list); forEachTogether(n, functor, list);
/// forEachParted(n, functor, list, list); forEachSent(n, functor, lists); forEachSifted(n, functor, lists); forEachGrouped(n, functor, list); forEachDealt<sharers>(bins, functor, list);
/// placeInTiles(functor); searchTiles(functor, list); canSearchTiles(shape); hasSpareLanes; scan; scanLargest; sortPairs;
/// sortKeys. Steps run one after the other, but for those of aside(body): they come after what was there at the last fork(), and
/// only what follows join(), or isAsideDone(), comes after them. HostExec and CudaExec are executors.
namespace cullet::psap
{
/// One of the searches, as the options and the number of boxes say.
template <class Exec>
class Search
{
public:
    explicit Search(const PsapOptions& options)
        : m_order(options.order),
          m_isLiteral(options.variant != PsapVariant::Rows),
          m_cells(options, resolve(options)),
          m_rows(options, axisOfRows(options)),
          m_bins(options, axisOfRows(options)),
          m_tiles(options, axisOfRows(options))
    {
    }

    /// To be called before each build() or repetition: what the executor has told until now counts, and plans that are ready
    /// are taken.
    void look(Exec& exec)
    {
        m_rows.planner().look(exec);
        m_bins.planner().look(exec);
        m_tiles.planner().look(exec);
    }

    /// To be called after each emit() or repetition, before the boxes change: works on the next plan beside it.
    void planAhead(Exec& exec)
    {
        forPlanners(exec, [&](auto& planner) { planner.planAhead(exec, m_input); });
    }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        m_way = nextWay(exec, input);
        if (m_way == Way::Tiles && !m_tiles.prepare(exec, input))
            m_way = Way::Rows;
        countUpdate();
        if (m_way != Way::Tiles && input.copies.now != nullptr)
            exec.forEach(input.count, CopyBox{input.boxes, input.copies});
        visit(*this, [&](auto& search) { search.build(exec, input); });
    }

    /// Again, where emit() found kSpilled pairs.
    ///
    /// @param boxes those of build(), which may lie somewhere else by now
    void buildByCounting(Exec& exec, const Aabb* boxes)
    {
        m_input.boxes = boxes;
        // The next plan of tiles knows better, but not what this one of some frames ago did not.
        const bool isWaiting = m_way == Way::Tiles ? m_tiles.noteSpill() : true;
        m_updatesByCounting = m_order == PsapOrder::Automatic && isWaiting ? kUpdatesByCounting : 0;
        m_way = Way::Rows;
        // Boxes have come or grown: a plan for those of before may take a thousand times as long.
        m_rows.planner().forget();
        m_rows.build(exec, m_input);
    }

    /// The next boxes are of other sizes.
    void forgetPlans()
    {
        m_rows.planner().forget();
        m_bins.planner().forget();
        m_tiles.planner().giveUp();
        m_updatesByCounting = 0;
    }

    /// @param isNew EveryPair, or another test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        visit(*this, [&](auto& search) { search.emit(exec, isNew, pairs); });
    }

    /// Whether the next build() of as many boxes makes the same launches as an earlier one of the same nextPhase(), without
    /// allocation or wait.
    bool isRepeatable(const Exec& exec, const SearchInput& input) const
    {
        const Way next = nextWay(exec, input);
        if (m_way == Way::Cells || !isSameWay(next) || (next == Way::Tiles && !m_tiles.isRepeatable(input)))
            return false;
        return m_way == Way::Tiles ||
               (m_way == Way::Rows ? m_rows.isRepeatable(input) : m_bins.isRepeatable());
    }

    /// Counts a repetition that happened without build().
    void countRepeat()
    {
        countUpdate();
        if (m_way == Way::Bins)
            m_bins.countRepeat();
        else if (m_way == Way::Tiles)
            m_tiles.countRepeat();
    }

    static constexpr unsigned kPhases = 5;
    unsigned nextPhase() const
    {
        return m_way == Way::Rows ? 0 : m_way == Way::Bins ? 1 + m_bins.nextPhase() : 3 + m_tiles.nextPhase();
    }
    /// Changes where what a phase launches is not what it did before.
    std::uint32_t launches() const { return m_rows.launches() + m_tiles.launches(); }

    const std::uint32_t* sideCount() const
    {
        return visit(*this, [](const auto& search) { return search.sideCount(); });
    }
    std::uint64_t entryCount() const
    {
        return visit(*this, [](const auto& search) { return search.entryCount(); });
    }
    std::uint64_t falsePairCount() const { return m_cells.falsePairCount(); }

private:
    enum class Way
    {
        Cells,
        Rows,
        Bins,
        Tiles  ///< or rows, where there is no plan, or none that is worth it
    };

    /// What `body` returns for the search of this update.
    template <class Self, class Body>
    static auto visit(Self& self, const Body& body)
    {
        switch (self.m_way)
        {
            case Way::Cells:
                return body(self.m_cells);
            case Way::Rows:
                return body(self.m_rows);
            case Way::Bins:
                return body(self.m_bins);
            default:
                return body(self.m_tiles);
        }
    }

    /// Calls body(planner) for those whose plans an update like the last one asks for.
    template <class Body>
    void forPlanners(const Exec& exec, const Body& body)
    {
        if (m_way == Way::Rows)
            body(m_rows.planner());
        else if (m_way == Way::Bins)
            body(m_bins.planner());
        if (nextWay(exec, m_input) == Way::Tiles)
            body(m_tiles.planner());
    }

    static constexpr std::uint64_t kMostBoxesInBins = 1u << 16;
    static constexpr std::uint64_t kMostWorkOfOneSize = 5u << 15;  // boxes and pairs
    static constexpr std::uint64_t kMostWork = 1u << 15;
    // After a bin or a tile was full: trying in vain costs half an update.
    static constexpr std::uint32_t kUpdatesByCounting = 256;

    Way nextWay(const Exec& exec, const SearchInput& input) const
    {
        if (m_isLiteral)
            return Way::Cells;
        if (isForTiles(exec, input) && TileSearch<Exec>::canHold(input.count))
            return Way::Tiles;
        const bool isChosen =
            m_order == PsapOrder::Bins || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                           isForBins(input) && m_updatesByCounting == 0);
        return isChosen && BinSearch<Exec>::canHold(input.count) ? Way::Bins : Way::Rows;
    }

    bool isSameWay(Way next) const { return m_way == next || (m_way == Way::Rows && next == Way::Tiles); }

    bool isForTiles(const Exec& exec, const SearchInput& input) const
    {
        return m_order == PsapOrder::Tiles || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                               input.count > kMostBoxesInBins && m_updatesByCounting == 0);
    }

    /// Whether the steps saved cost more than what bins of fixed room cost: cache for empty places, and more of them around
    /// a box, which is worst where there are many pairs or many sizes.
    bool isForBins(const SearchInput& input) const
    {
        const std::uint32_t levels = m_way == Way::Bins ? m_bins.levelCount() : m_rows.levelCount();
        const bool isOfOneSize = levels <= 2;  // the last one is empty
        return input.count <= kMostBoxesInBins &&
               input.count + input.expectedPairs <= (isOfOneSize ? kMostWorkOfOneSize : kMostWork);
    }

    void countUpdate()
    {
        if (m_way == Way::Rows && m_updatesByCounting != 0)
            --m_updatesByCounting;
    }

    static PsapAxis resolve(const PsapOptions& options)
    {
        constexpr PsapAxis kAxes[3] = {PsapAxis::X, PsapAxis::Y, PsapAxis::Z};
        return options.axis == PsapAxis::Random ? kAxes[(options.seed * 2654435761u >> 16) % 3]
                                                : options.axis;
    }

    static PsapAxis axisOfRows(const PsapOptions& options)
    {
        return resolve(options) == PsapAxis::Principal ? PsapAxis::Variance : resolve(options);
    }

    PsapOrder m_order;
    bool m_isLiteral;
    SearchInput m_input{};
    Way m_way = Way::Rows;
    std::uint32_t m_updatesByCounting = 0;  ///< before bins or tiles are tried again
    CellSearch<Exec> m_cells;
    RowSearch<Exec> m_rows;
    BinSearch<Exec> m_bins;
    TileSearch<Exec> m_tiles;
};
}  // namespace cullet::psap
