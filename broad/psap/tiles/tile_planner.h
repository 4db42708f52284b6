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
    void poll(Exec& exec)
    {
        m_mailbox.poll();
        if (m_next == Step::Replace && hasResult() && !hasOtherShape())
            replacePlan(exec);
    }

    /// Prepares an update: adopts a plan with another shape, and makes a plan for another number of boxes.
    void prepare(Exec& exec, const SearchInput& input)
    {
        if (hasOtherShape())
            adopt();
        if (needsNewPlan(input))
            make(exec, input);
    }

    /// Whether prepare() would change nothing.
    bool isPlanCurrent(const SearchInput& input) const { return !needsNewPlan(input) && !hasOtherShape(); }

    /// Makes the next step towards the next plan. To be called once for each update, after all its launches.
    void advanceNextPlan(Exec& exec, const SearchInput& input)
    {
        ++m_age;
        switch (m_next)
        {
            case Step::Sample:
                if (m_plannedCount == 0 || m_age < m_updatesPerPlan)
                    break;
                m_sample.keep(exec, input, kBoxesInSample);
                m_statistics.reserveFor(exec, m_sample.boxes());
                m_next = Step::Sum;
                break;
            case Step::CountTiles:
                // Counts all boxes, which are valid only during the update, on the main stream, which should not wait
                // for the previous step.
                if (exec.isSideStreamDone())
                    countSome(exec, input);
                break;
            case Step::Replace:  // in poll() or prepare()
                break;
            default:
                // Not concurrently with the search, whose last blocks need the multiprocessors.
                if (m_next != Step::ChooseCounts && m_next != Step::PrepareNext)
                    exec.fork();
                exec.onSideStream([&] { runNextStep(exec); });
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
        Sample,  ///< a copy of the boxes, once the plan is old enough
        Sum,
        Reduce,
        ChooseCounts,
        Cut,
        CountTiles,
        ChooseRoom,
        PrepareNext,  ///< of the statistics of the plan after the next one
        Replace
    };

    static constexpr std::uint32_t kUpdatesPerPlan = 256;
    static constexpr std::uint32_t kNewUpdates = 16;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;
    // Several hundred boxes in each tile, so that the size of the fullest one is known well.
    static constexpr std::uint64_t kBoxesCounted = 1u << 22;
    static constexpr std::uint64_t kParts = 2;  ///< parts of the counted boxes, one per update

    bool needsNewPlan(const SearchInput& input) const
    {
        return input.count > m_plannedCount + m_plannedCount / 8 || 2 * input.count < m_plannedCount;
    }

    bool hasResult() const
    {
        return m_plansMade != m_adopted && ChooseTileRoom::isOf(m_mailbox.value(), m_plansMade);
    }
    bool hasOtherShape() const
    {
        return hasResult() && !fits(m_shape, ChooseTileRoom::shapeOf(m_mailbox.value()));
    }

    /// Whether launches for this shape also fit a plan of the next shape, which asks for about the same room.
    static bool fits(const TileShape& now, const TileShape& next)
    {
        return next.tiles == now.tiles && next.cells <= now.cells && 4 * next.cells >= 3 * now.cells &&
               20 * next.room <= 21 * now.room && 4 * next.room >= 3 * now.room;
    }

    void adopt()
    {
        m_shape = ChooseTileRoom::shapeOf(m_mailbox.value());
        m_adopted = m_plansMade;
        ++m_launches;
        m_current = 1 - m_current;
        m_age = 0;
        m_next = Step::Sample;
    }

    /// Copies the next plan over the one in use, so that recorded launches remain valid.
    void replacePlan(Exec& exec)
    {
        if (m_shape.tiles != 0)
            exec.copy(m_plans[m_current].data(), nextPlan(), 1);
        m_adopted = m_plansMade;
        m_age = 0;
        m_next = Step::Sample;
    }

    void make(Exec& exec, const SearchInput& input)
    {
        exec.join();
        reserve(exec);
        m_sample.keep(exec, input, kBoxesInSample);
        m_statistics.collectWithinWindow(exec, m_sample.boxes());
        chooseCounts(exec);
        cut(exec);
        countTiles(exec, input, 0, 1);
        chooseRoom(exec);
        exec.fork();
        exec.onSideStream([&] { m_statistics.prepareNext(exec); });
        m_plannedCount = input.count;
        m_age = 0;
        m_part = 0;
        m_next = Step::Replace;
    }

    /// Runs the next step, on boxes that have been copied already.
    void runNextStep(Exec& exec)
    {
        switch (m_next)
        {
            case Step::Sum:
                m_statistics.begin(exec, m_sample.boxes());
                m_next = Step::Reduce;
                break;
            case Step::Reduce:
                m_next = m_statistics.reduceStep(exec) ? Step::ChooseCounts : Step::Reduce;
                break;
            case Step::ChooseCounts:
                chooseCounts(exec);
                m_next = Step::Cut;
                break;
            case Step::Cut:
                cut(exec);
                m_next = Step::CountTiles;
                break;
            case Step::ChooseRoom:
                chooseRoom(exec);
                m_next = Step::PrepareNext;
                break;
            default:
                m_statistics.prepareNext(exec);
                m_next = Step::Replace;
        }
    }

    void chooseCounts(Exec& exec)
    {
        exec.clear(m_counts.data(), kStepCounts + kTileCounts);
        exec.forEach(1, ChooseTileCounts{m_statistics.moments(), m_statistics.sizes(), m_sample.stride(),
                                         m_axis, m_isForced, nextPlan()});
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
        m_next = m_part == 0 ? Step::ChooseRoom : Step::CountTiles;
    }

    void chooseRoom(Exec& exec)
    {
        exec.forEach(TileShape::kMostTiles, FindFullest{tiles(), nextPlan()});
        ++m_plansMade;
        exec.forEach(1, ChooseTileRoom{m_counted, static_cast<double>(m_strideOfCount), m_mostRoom,
                                       m_isForced, nextPlan(), m_plansMade, m_summary.data()});
        m_mailbox.request(exec, m_summary.data());
    }

    void reserve(Exec& exec)
    {
        if (m_mailbox.isReserved())
            return;
        reservePlans(exec, m_plans);
        exec.reserve(m_counts, kStepCounts + kTileCounts);
        exec.reserve(m_summary, 1);
        m_mailbox.reserve(exec);
    }

    /// The plan that is not in use.
    TilePlan* nextPlan() const { return m_plans[1 - m_current].data(); }
    std::uint32_t* steps() const { return m_counts.data(); }
    std::uint32_t* tiles() const { return m_counts.data() + kStepCounts; }

    static constexpr double kRoomOfCapacity = 64;  ///< boxes in a tile for each unit of the initial capacity
    static constexpr double kMostRoom = TileShape::kMostRoom;
    static constexpr std::uint64_t kStepCounts = 3 * TileSteps::kPerAxis;
    static constexpr std::uint64_t kTileCounts =
        std::uint64_t{TileShape::kMostTiles} * CountTiles::kCounterStride;

    PsapAxis m_axis;
    bool m_isForced;
    double m_mostRoom;
    std::uint32_t m_updatesPerPlan;
    std::uint32_t m_age = 0;           ///< updates since the plan in use was adopted
    std::uint64_t m_plannedCount = 0;  ///< 0: no plan
    std::uint64_t m_strideOfCount = 1;
    std::uint64_t m_counted = 0;    ///< boxes counted into tiles
    std::uint64_t m_part = 0;       ///< the part that is counted next
    std::uint32_t m_plansMade = 0;  ///< number of plans made
    std::uint32_t m_adopted = 0;    ///< number of the plan in use
    std::uint32_t m_launches = 0;   ///< number of shapes adopted
    TileShape m_shape{};
    unsigned m_current = 0;
    Step m_next = Step::Sample;
    Statistics<Exec> m_statistics;
    BoxSample<Exec> m_sample;
    Buffer<TilePlan> m_plans[2];
    Buffer<std::uint32_t> m_counts;
    Buffer<std::uint64_t> m_summary;
    ResultMailbox<Exec> m_mailbox;
};
}  // namespace cullet::psap
