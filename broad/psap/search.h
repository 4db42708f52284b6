// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/sorted/counting_search.h"
#include "cullet/broad/psap/sorted/fixed_bin_search.h"
#include "cullet/broad/psap/tiles/tile_search.h"

#include <cstdint>

namespace cullet::psap
{
/// The search that the options and the number of boxes choose.
template <class Exec>
class Search
{
public:
    explicit Search(const PsapOptions& options)
        : m_order(options.order),
          m_counting(options, sweepAxis(options)),
          m_bins(options, sweepAxis(options)),
          m_tiles(options, sweepAxis(options))
    {
    }

    /// Collects the results of the executor and adopts finished plans. To be called before each build() or
    /// repetition.
    void poll(Exec& exec)
    {
        m_counting.planner().poll(exec);
        m_bins.planner().poll(exec);
        m_tiles.planner().poll(exec);
    }

    /// Takes a step towards the next plan on the side stream. To be called after each emit() or repetition, before
    /// the boxes change.
    void advanceNextPlan(Exec& exec)
    {
        forEachPlanner(exec, [&](auto& planner) { planner.advanceNextPlan(exec, m_input); });
    }

    void build(Exec& exec, SearchInput input)
    {
        m_input = input;
        m_method = nextMethod(exec, input);
        if (m_method == Method::Tiles && !m_tiles.prepare(exec, input))
            m_method = Method::Counting;
        countUpdate();
        if (m_method != Method::Tiles && input.copies.now != nullptr)
            exec.forEach(input.count, CopyBox{input.boxes, input.copies});
        visit(*this, [&](auto& search) { search.build(exec, input); });
    }

    /// Repeats the search with a counting sort, where emit() reported kOverflowed.
    ///
    /// @param boxes the boxes of build(), possibly at another address
    void buildByCounting(Exec& exec, const Aabb* boxes)
    {
        m_input.boxes = boxes;
        // Where the plan of tiles was young, another one would fail too. An old plan was made for earlier boxes, so
        // that a new one may fit.
        const bool isWaiting = m_method == Method::Tiles ? m_tiles.recordOverflow() : true;
        m_updatesByCounting = m_order == PsapOrder::Automatic && isWaiting ? kUpdatesByCounting : 0;
        m_method = Method::Counting;
        // Boxes were added or have grown: with the old plan the search may take a thousand times as long.
        m_counting.planner().forget();
        m_counting.build(exec, m_input);
    }

    /// Discards all plans, since the next boxes have other sizes.
    void forgetPlans()
    {
        m_counting.planner().forget();
        m_bins.planner().forget();
        m_tiles.planner().giveUp();
        m_updatesByCounting = 0;
    }

    /// @param isNew EveryPair, or another entry test
    template <class IsNew>
    void emit(Exec& exec, const IsNew& isNew, const PairList& pairs)
    {
        visit(*this, [&](auto& search) { search.emit(exec, isNew, pairs); });
    }

    /// Whether the next build() of the same number of boxes makes the same launches as an earlier one with the same
    /// nextPhase(), without allocation or wait.
    bool isRepeatable(const Exec& exec, const SearchInput& input) const
    {
        const Method next = nextMethod(exec, input);
        if (!isSameMethod(next) || (next == Method::Tiles && !m_tiles.isRepeatable(input)))
            return false;
        return m_method == Method::Tiles ||
               (m_method == Method::Counting ? m_counting.isRepeatable(input) : m_bins.isRepeatable());
    }

    /// Counts an update that repeated recorded launches instead of calling build().
    void countRepeat()
    {
        countUpdate();
        if (m_method == Method::Bins)
            m_bins.countRepeat();
        else if (m_method == Method::Tiles)
            m_tiles.countRepeat();
    }

    static constexpr unsigned kPhases = 5;
    unsigned nextPhase() const
    {
        return m_method == Method::Counting ? 0
               : m_method == Method::Bins   ? 1 + m_bins.nextPhase()
                                            : 3 + m_tiles.nextPhase();
    }
    /// Changes when the launches of a phase change.
    std::uint32_t launches() const { return m_counting.launches() + m_tiles.launches(); }

    const std::uint32_t* unboundedCount() const
    {
        return visit(*this, [](const auto& search) { return search.unboundedCount(); });
    }
    std::uint64_t entryCount() const
    {
        return visit(*this, [](const auto& search) { return search.entryCount(); });
    }

private:
    enum class Method
    {
        Counting,
        Bins,
        Tiles  ///< or Counting, where no plan exists or none pays
    };

    /// Calls `body` with the search of this update and returns its result.
    template <class Self, class Body>
    static auto visit(Self& self, const Body& body)
    {
        switch (self.m_method)
        {
            case Method::Counting:
                return body(self.m_counting);
            case Method::Bins:
                return body(self.m_bins);
            default:
                return body(self.m_tiles);
        }
    }

    /// Calls body(planner) for each planner whose plan an update like the last one would use.
    template <class Body>
    void forEachPlanner(const Exec& exec, const Body& body)
    {
        if (m_method == Method::Counting)
            body(m_counting.planner());
        else if (m_method == Method::Bins)
            body(m_bins.planner());
        if (nextMethod(exec, m_input) == Method::Tiles)
            body(m_tiles.planner());
    }

    static constexpr std::uint64_t kMostBoxesInBins = 1u << 16;
    static constexpr std::uint64_t kMostWorkOfOneSize = 5u << 15;  // sum of boxes and pairs
    static constexpr std::uint64_t kMostWork = 1u << 15;
    // Updates with a counting sort after a bin or a tile was full: a failed attempt costs half an update.
    static constexpr std::uint32_t kUpdatesByCounting = 256;

    Method nextMethod(const Exec& exec, const SearchInput& input) const
    {
        if (isForTiles(exec, input) && TileSearch<Exec>::canHold(input.count))
            return Method::Tiles;
        const bool isChosen =
            m_order == PsapOrder::Bins || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                           isForBins(input) && m_updatesByCounting == 0);
        return isChosen && FixedBinSearch<Exec>::canHold(input.count) ? Method::Bins : Method::Counting;
    }

    bool isSameMethod(Method next) const
    {
        return m_method == next || (m_method == Method::Counting && next == Method::Tiles);
    }

    bool isForTiles(const Exec& exec, const SearchInput& input) const
    {
        return m_order == PsapOrder::Tiles || (m_order == PsapOrder::Automatic && exec.hasSpareLanes() &&
                                               input.count > kMostBoxesInBins && m_updatesByCounting == 0);
    }

    /// Whether bins of fixed room save more than they cost. They save steps, and cost cache for empty places and more
    /// bins around a box, above all with many pairs or many sizes.
    bool isForBins(const SearchInput& input) const
    {
        const std::uint32_t levels = m_method == Method::Bins ? m_bins.levelCount() : m_counting.levelCount();
        const bool isOfOneSize = levels <= 2;  // the last one is the overflow level
        return input.count <= kMostBoxesInBins &&
               input.count + input.expectedPairs <= (isOfOneSize ? kMostWorkOfOneSize : kMostWork);
    }

    void countUpdate()
    {
        if (m_method == Method::Counting && m_updatesByCounting != 0)
            --m_updatesByCounting;
    }

    PsapOrder m_order;
    SearchInput m_input{};
    Method m_method = Method::Counting;
    std::uint32_t m_updatesByCounting = 0;  ///< updates until bins or tiles are tried again
    CountingSearch<Exec> m_counting;
    FixedBinSearch<Exec> m_bins;
    TileSearch<Exec> m_tiles;
};
}  // namespace cullet::psap
