// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/plan_sampling.h"
#include "cullet/broad/psap/tiles/tile_plan.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// Makes plans from samples of the boxes, and keeps each for some hundred updates. A plan is used from the first update on
/// that finds its shape on the CPU; nothing waits for it. One for other boxes is made at once, one for the same boxes in steps,
/// one an update and beside it.
template <class Exec>
class TilePlanner
{
public:
    static constexpr std::uint64_t kMostBoxes = std::uint64_t{TileShape::kMostTiles} * 2600;

    TilePlanner(const PsapOptions& options, PsapAxis axis)
        : m_axis(axis),
          m_isForced(options.order == PsapOrder::Tiles),
          m_mostRoom(std::clamp(kRoomOfCapacity * options.initialCapacity, 1.0, kMostRoom)),
          m_updatesPerPlan(options.updatesPerPlan != 0 ? options.updatesPerPlan : kUpdatesPerPlan)
    {
    }

    /// Looks whether the last plan's shape has come, and takes the plan where that is what launches are for. Not done by others,
    /// so that all that happens until the next call is as isSettled() says, and a search may be repeated.
    void look(Exec& exec)
    {
        m_word.look();
        if (m_next == Step::Take && hasNews() && !hasOtherShape())
            take(exec);
    }

    /// For one update.
    void prepare(Exec& exec, const SearchInput& input)
    {
        if (hasOtherShape())
            adopt();
        if (isForOthers(input))
            make(exec, input);
    }

    /// Whether prepare() would change nothing.
    bool isSettled(const SearchInput& input) const { return !isForOthers(input) && !hasOtherShape(); }

    /// Takes the next step towards the next plan. Once for each update, when all of it has been given to the executor.
    void planAhead(Exec& exec, const SearchInput& input)
    {
        ++m_age;
        switch (m_next)
        {
            case Step::Keep:
                if (m_plannedCount == 0 || m_age < m_updatesPerPlan)
                    break;
                m_sample.keep(exec, input, kBoxesInSample);
                m_statistics.reserveFor(exec, m_sample.boxes());
                m_next = Step::Sum;
                break;
            case Step::CountTiles:
                // All boxes, in the update's own time; but that should not wait for the step before.
                if (exec.isAsideDone())
                    countSome(exec, input);
                break;
            case Step::Take:  // look() or prepare() does
                break;
            default:
                // Not beside the search: they would take places of its last blocks.
                if (m_next != Step::Span && m_next != Step::Ready)
                    exec.fork();
                exec.aside([&] { goOn(exec); });
        }
    }

    /// The next prepare() makes a plan.
    ///
    /// @return whether the one of now was as good as new
    bool giveUp()
    {
        const bool isNew = m_age <= kNewUpdates;
        m_plannedCount = 0;
        m_shape = {};
        return isNew;
    }

    const TilePlan* plan() const { return m_plans[m_current].data(); }
    const TileShape& shape() const { return m_shape; }
    /// Changes with the shape.
    std::uint32_t launches() const { return m_launches; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Towards the next plan.
    enum class Step
    {
        Keep,  ///< a sample, when it is time for one
        Sum,
        AddUp,
        Span,
        Cut,
        CountTiles,
        Close,
        Ready,  ///< for the statistics of the one behind it
        Take
    };

    static constexpr std::uint32_t kUpdatesPerPlan = 256;
    static constexpr std::uint32_t kNewUpdates = 16;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;
    // Some hundred in each tile, so that the fullest is known well.
    static constexpr std::uint64_t kBoxesCounted = 1u << 22;
    static constexpr std::uint64_t kParts = 2;  ///< of those, an update for each

    bool isForOthers(const SearchInput& input) const
    {
        return input.count > m_plannedCount + m_plannedCount / 8 || 2 * input.count < m_plannedCount;
    }

    bool hasNews() const { return m_made != m_taken && CloseTiles::isOf(m_word.seen(), m_made); }
    bool hasOtherShape() const { return hasNews() && !fits(m_shape, CloseTiles::shapeOf(m_word.seen())); }

    /// Whether launches for this shape do for a plan of the next one, with nearly the room that it asks for and little too much.
    static bool fits(const TileShape& now, const TileShape& next)
    {
        return next.tiles == now.tiles && next.cells <= now.cells && 4 * next.cells >= 3 * now.cells &&
               20 * next.room <= 21 * now.room && 4 * next.room >= 3 * now.room;
    }

    void adopt()
    {
        m_shape = CloseTiles::shapeOf(m_word.seen());
        m_taken = m_made;
        ++m_launches;
        m_current = 1 - m_current;
        m_age = 0;
        m_next = Step::Keep;
    }

    /// Into the place of the one in use, so that launches with it stay the same.
    void take(Exec& exec)
    {
        if (m_shape.tiles != 0)
            exec.copy(m_plans[m_current].data(), nextPlan(), 1);
        m_taken = m_made;
        m_age = 0;
        m_next = Step::Keep;
    }

    void make(Exec& exec, const SearchInput& input)
    {
        exec.join();
        reserve(exec);
        m_sample.keep(exec, input, kBoxesInSample);
        m_statistics.collectMost(exec, m_sample.boxes());
        span(exec);
        cut(exec);
        countTiles(exec, input, 0, 1);
        close(exec);
        exec.fork();
        exec.aside([&] { m_statistics.ready(exec); });
        m_plannedCount = input.count;
        m_age = 0;
        m_part = 0;
        m_next = Step::Take;
    }

    /// With what is known of the boxes.
    void goOn(Exec& exec)
    {
        switch (m_next)
        {
            case Step::Sum:
                m_statistics.begin(exec, m_sample.boxes());
                m_next = Step::AddUp;
                break;
            case Step::AddUp:
                m_next = m_statistics.addUp(exec) ? Step::Span : Step::AddUp;
                break;
            case Step::Span:
                span(exec);
                m_next = Step::Cut;
                break;
            case Step::Cut:
                cut(exec);
                m_next = Step::CountTiles;
                break;
            case Step::Close:
                close(exec);
                m_next = Step::Ready;
                break;
            default:
                m_statistics.ready(exec);
                m_next = Step::Take;
        }
    }

    void span(Exec& exec)
    {
        exec.clear(m_counts.data(), kStepCounts + kTileCounts);
        exec.forEach(1, SpanTiles{m_statistics.moments(), m_statistics.sizes(), m_sample.stride(), m_axis,
                                  m_isForced, nextPlan()});
    }

    void cut(Exec& exec)
    {
        exec.forEach(m_sample.boxes().count, CountSteps{{m_sample.boxes().boxes, 1}, nextPlan(), steps()});
        exec.forEach(3, CutTiles{steps(), nextPlan()});
    }

    /// @param part of `parts` that all boxes are counted in
    void countTiles(Exec& exec, const SearchInput& input, std::uint64_t part, std::uint64_t parts)
    {
        m_strideOfCount = BoxSample<Exec>::strideFor(input, kBoxesCounted);
        m_counted = samplesOf(input, m_strideOfCount);
        exec.forEachFrom(m_counted * part / parts, m_counted * (part + 1) / parts,
                         CountTiles{{input.boxes, m_strideOfCount}, nextPlan(), tiles()});
    }
    void countSome(Exec& exec, const SearchInput& input)
    {
        countTiles(exec, input, m_part, kParts);
        m_part = (m_part + 1) % kParts;
        m_next = m_part == 0 ? Step::Close : Step::CountTiles;
    }

    void close(Exec& exec)
    {
        exec.forEach(TileShape::kMostTiles, FindFullest{tiles(), nextPlan()});
        ++m_made;
        exec.forEach(1, CloseTiles{m_counted, static_cast<double>(m_strideOfCount), m_mostRoom, m_isForced,
                                   nextPlan(), m_made, m_told.data()});
        m_word.ask(exec, m_told.data());
    }

    void reserve(Exec& exec)
    {
        if (m_word.isThere())
            return;
        reservePlans(exec, m_plans);
        exec.reserve(m_counts, kStepCounts + kTileCounts);
        exec.reserve(m_told, 1);
        m_word.reserve(exec);
    }

    /// The one that is not in use.
    TilePlan* nextPlan() const { return m_plans[1 - m_current].data(); }
    std::uint32_t* steps() const { return m_counts.data(); }
    std::uint32_t* tiles() const { return m_counts.data() + kStepCounts; }

    static constexpr double kRoomOfCapacity = 64;  ///< for each one of the initial capacity
    static constexpr double kMostRoom = TileShape::kMostRoom;
    static constexpr std::uint64_t kStepCounts = 3 * TileSteps::kPerAxis;
    static constexpr std::uint64_t kTileCounts = std::uint64_t{TileShape::kMostTiles} * CountTiles::kApart;

    PsapAxis m_axis;
    bool m_isForced;
    double m_mostRoom;
    std::uint32_t m_updatesPerPlan;
    std::uint32_t m_age = 0;           ///< updates since the plan in use was new
    std::uint64_t m_plannedCount = 0;  ///< 0: no plan
    std::uint64_t m_strideOfCount = 1;
    std::uint64_t m_counted = 0;   ///< boxes whose tiles are counted
    std::uint64_t m_part = 0;      ///< of those that is counted next
    std::uint32_t m_made = 0;      ///< plans
    std::uint32_t m_taken = 0;     ///< the plan in use
    std::uint32_t m_launches = 0;  ///< shapes
    TileShape m_shape{};
    unsigned m_current = 0;
    Step m_next = Step::Keep;
    Statistics<Exec> m_statistics;
    BoxSample<Exec> m_sample;
    Buffer<TilePlan> m_plans[2];
    Buffer<std::uint32_t> m_counts;
    Buffer<std::uint64_t> m_told;
    ToldWord<Exec> m_word;
};
}  // namespace cullet::psap
