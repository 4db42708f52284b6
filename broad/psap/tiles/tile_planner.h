// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/plan_sampling.h"
#include "cullet/broad/psap/tiles/tile_plan.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// Makes plans from samples of the boxes, and uses each for several hundred updates. A plan is adopted by the first
/// update that reads its shape on the CPU; no update waits for it. A plan for another number of boxes is made at
/// once, one for the same number in steps, one step per update on the side stream.
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

    /// Polls for the shape of the last plan, and replaces the plan in use where recorded launches fit that shape. No
    /// other function does this, so that isPlanCurrent() stays valid until the next call, and a search may be
    /// repeated.
    void look(Exec& exec)
    {
        m_word.look();
        if (m_next == Step::Take && hasNews() && !hasOtherShape())
            take(exec);
    }

    /// Prepares an update: adopts a plan with another shape, and makes a plan for another number of boxes.
    void prepare(Exec& exec, const SearchInput& input)
    {
        if (hasOtherShape())
            adopt();
        if (isForOthers(input))
            make(exec, input);
    }

    /// Whether prepare() would change nothing.
    bool isSettled(const SearchInput& input) const { return !isForOthers(input) && !hasOtherShape(); }

    /// Makes the next step towards the next plan. To be called once for each update, after all its launches.
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
                // Counts all boxes, which are valid only during the update, on the main stream, which should not wait
                // for the previous step.
                if (exec.isAsideDone())
                    countSome(exec, input);
                break;
            case Step::Take:  // in poll() or prepare()
                break;
            default:
                // Not concurrently with the search, whose last blocks need the multiprocessors.
                if (m_next != Step::Span && m_next != Step::Ready)
                    exec.fork();
                exec.aside([&] { goOn(exec); });
        }
    }

    /// Makes the next prepare() make a plan.
    ///
    /// @return whether the discarded plan was nearly new
    bool giveUp()
    {
        const bool isNew = m_age <= kNewUpdates;
        m_plannedCount = 0;
        m_shape = {};
        return isNew;
    }

    const TilePlan* plan() const { return m_plans[m_current].data(); }
    const TileShape& shape() const { return m_shape; }
    /// Changes with the shape of the tiles.
    std::uint32_t launches() const { return m_launches; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Steps towards the next plan.
    enum class Step
    {
        Keep,  ///< a copy of the boxes, once the plan is old enough
        Sum,
        AddUp,
        Span,
        Cut,
        CountTiles,
        Close,
        Ready,  ///< of the statistics of the plan after the next one
        Take
    };

    static constexpr std::uint32_t kUpdatesPerPlan = 256;
    static constexpr std::uint32_t kNewUpdates = 16;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;
    // Several hundred boxes in each tile, so that the size of the fullest one is known well.
    static constexpr std::uint64_t kBoxesCounted = 1u << 22;
    static constexpr std::uint64_t kParts = 2;  ///< parts of the counted boxes, one per update

    bool isForOthers(const SearchInput& input) const
    {
        return input.count > m_plannedCount + m_plannedCount / 8 || 2 * input.count < m_plannedCount;
    }

    bool hasNews() const { return m_made != m_taken && CloseTiles::isOf(m_word.seen(), m_made); }
    bool hasOtherShape() const { return hasNews() && !fits(m_shape, CloseTiles::shapeOf(m_word.seen())); }

    /// Whether launches for this shape also fit a plan of the next shape, which asks for about the same room.
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

    /// Copies the next plan over the one in use, so that recorded launches remain valid.
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

    /// Runs the next step, on boxes that have been copied already.
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

    /// @param part which of `parts` parts of the boxes is counted
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

    /// The plan that is not in use.
    TilePlan* nextPlan() const { return m_plans[1 - m_current].data(); }
    std::uint32_t* steps() const { return m_counts.data(); }
    std::uint32_t* tiles() const { return m_counts.data() + kStepCounts; }

    static constexpr double kRoomOfCapacity = 64;  ///< boxes in a tile for each unit of the initial capacity
    static constexpr double kMostRoom = TileShape::kMostRoom;
    static constexpr std::uint64_t kStepCounts = 3 * TileSteps::kPerAxis;
    static constexpr std::uint64_t kTileCounts = std::uint64_t{TileShape::kMostTiles} * CountTiles::kApart;

    PsapAxis m_axis;
    bool m_isForced;
    double m_mostRoom;
    std::uint32_t m_updatesPerPlan;
    std::uint32_t m_age = 0;           ///< updates since the plan in use was adopted
    std::uint64_t m_plannedCount = 0;  ///< 0: no plan
    std::uint64_t m_strideOfCount = 1;
    std::uint64_t m_counted = 0;   ///< boxes counted into tiles
    std::uint64_t m_part = 0;      ///< the part that is counted next
    std::uint32_t m_made = 0;      ///< number of plans made
    std::uint32_t m_taken = 0;     ///< number of the plan in use
    std::uint32_t m_launches = 0;  ///< number of shapes adopted
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
