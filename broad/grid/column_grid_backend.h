// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/cell_visitor.h"
#include "cullet/broad/grid/mode_choice.h"
#include "cullet/broad/grid/resting/resting_mode.h"
#include "cullet/broad/grid/sweep/sweep_mode.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/row_source.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The production CPU backend: a column grid in one of two modes, SweepMode and RestingMode, between which ModeChoice
/// chooses. Both are exact: the pair set is that of Backend's definition, bit for bit.
class ColumnGridBackend final : public Backend, public CellSource, public RowSource
{
public:
    explicit ColumnGridBackend(const GridOptions& options);

    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "grid"; }
    BackendStats stats() const override;
    void forEachCell(const CellVisitor& visit) const override;
    std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const override;
    std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const override;

    /// The pairs held, or those given to restart() if there was no update since; sorted.
    ///
    /// @param view of the coming update, in which destroyed rows still have their ids
    Pairs heldPairs(const ProxyView& view);

private:
    ///  restart(), failure               ModeChoice            too many awake boxes, margin changed
    ///  ------> Restarted --> Sweep <----------------> Resting ---> either, by a refill
    enum class Mode : std::uint8_t
    {
        Restarted,  ///< the next update reads all rows; the pairs held are m_known
        Sweep,
        Resting
    };

    void updateOrThrow(const ProxyView& view);
    void prepareRows(const ProxyView& view, std::uint8_t changes);
    void refill(const ProxyView& view, bool rests);
    void collectHeld(std::vector<RowPair>& held);
    void collectKnown(const ProxyView& view, std::vector<RowPair>& held);
    void countWork();
    bool knowsPlaces() const;
    void takeAwake(const Aabb* boxes, RowSink& sink) const;

    GridCore m_core;
    ModeChoice m_choice;
    SweepMode m_sweep;
    RestingMode m_resting;
    Mode m_mode = Mode::Restarted;
    bool m_hadFilter = false;
    Pairs m_known;  ///< pairs handed over by restart()
};
}  // namespace cullet
