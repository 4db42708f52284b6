// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/overlap_steps.h"
#include "cullet/cuda/narrow/pair_distance.h"
#include "cullet/cuda/narrow/pair_steps.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace cullet::convex
{
/// What a query does beside telling overlap.
struct QueryExtras
{
    bool isMeasured = false;  ///< launchDistances()
    bool isListed = false;    ///< launchList()
    bool isDeep = false;      ///< ContactQueries::launchDepths()
    bool hasPoints = false;   ///< ContactQueries::launchContacts()
};

/// Answers the pairs of a list, query after query, on an executor.
///
/// @tparam Exec HostPairExec or CudaPairExec
template <class Exec>
class PairQueries
{
public:
    /// Copies the hulls, which need not outlive the call, to the executor.
    PairQueries(Exec& exec, const HullSet& hulls)
    {
        const HullTables from = hulls.tables();
        copyTo(exec, m_rows, from.rows, hulls.size());
        copyTo(exec, m_lanes, from.lanes, hulls.blockCount() * kBlockLanes);
        copyTo(exec, m_starts, from.starts, std::uint64_t{hulls.size()} * kStarts);
        m_tables = {m_rows.data(), m_lanes.data(), m_starts.data(), hulls.size()};
    }

    /// Makes room for a query, and remembers nothing of pairs that were in no list before. Waits where memory has to
    /// grow.
    ///
    /// @param extras what else is asked for
    void prepare(Exec& exec, std::uint32_t count, const QueryExtras& extras)
    {
        reserve(exec, count);
        if (extras.isMeasured)
            exec.reserve(m_distances, std::max(count, 1u));
        if (extras.isListed)
        {
            exec.reserve(m_overlaps, std::max(count, 1u));
            exec.reserve(m_inChunk, std::uint64_t{chunksOf(count)} + 1);
            exec.reserve(m_beforeChunk, std::uint64_t{chunksOf(count)} + 1);
        }
        if (!std::exchange(m_areCountsClear, true))
            exec.clear(m_counts.data(), 1);
        m_fetchedOnDevice = exec.mappedForWriting(m_fetched.data());
    }

    /// Launches a query. Allocates nothing, so that the launches can be recorded.
    ///
    /// @pre prepare()
    void launch(Exec& exec, const PairInput& input)
    {
        const PairQueues queues = {m_searched.data(), m_doubtful.data(), m_counts.data()};
        exec.testAxes(input.count, {readerOf(input), memory(), m_counts.data()}, queues);
        exec.searchInFloat(input.count, {{readerOf(input), memory(), m_counts.data()}}, queues);
        exec.searchInDouble(input.count, {{readerOf(input), memory(), m_counts.data()}}, queues);
        exec.forOne(HandOverCounts{m_counts.data(), m_fetchedOnDevice});
    }

    /// Launches the measurement of pairs that are no farther apart than that.
    ///
    /// @pre launch() with the same input
    void launchDistances(Exec& exec, const PairInput& input, float most)
    {
        exec.measureDistances(input.count, {readerOf(input), memory(), m_distances.data(), most});
    }

    /// Launches the list of overlapping pairs.
    ///
    /// @pre launch() with as many pairs
    void launchList(Exec& exec, std::uint32_t count)
    {
        const std::uint64_t chunks = chunksOf(count);
        exec.forEach(chunks + 1, CountOverlaps{m_states.data(), count, m_inChunk.data()});
        exec.exclusiveSum(m_inChunk.data(), m_beforeChunk.data(), chunks + 1);
        exec.forEach(chunks, ListOverlaps{m_states.data(), count, m_beforeChunk.data(), m_overlaps.data()});
    }

    /// Exchanges what is remembered of all pairs with the other memory: that of the list before, for callers whose pairs
    /// change places.
    void swapMemory()
    {
        std::swap(m_axes, m_otherAxes);
        std::swap(m_heights, m_otherHeights);
        std::swap(m_simplices, m_otherSimplices);
        std::swap(m_states, m_otherStates);
        m_remembered = 0;
    }
    /// @return memory for the next query, which the caller's launches write: all of it
    PairMemory memoryFor(Exec& exec, std::uint32_t count)
    {
        m_remembered = 0;
        reserveMemory(exec, count);
        m_remembered = count;
        return memory();
    }
    /// What was remembered before the last swapMemory(), as long as that list was.
    PairMemory otherMemory() const
    {
        return {m_otherAxes.data(), m_otherHeights.data(), m_otherSimplices.data(), m_otherStates.data()};
    }

    /// Forgets all pairs, also after a failure.
    void forget()
    {
        m_remembered = 0;
        m_areCountsClear = false;
    }

    /// What steps read of a query's input.
    PairReader readerOf(const PairInput& input) const { return {m_tables, input}; }
    /// In the executor's memory.
    const HullTables& hulls() const { return m_tables; }

    const PairState* states() const { return m_states.data(); }
    const PairAxis* axes() const { return m_axes.data(); }
    /// Of launchList(), in the executor's memory: pairs, and their number.
    const std::uint32_t* overlaps() const { return m_overlaps.data(); }
    const std::uint32_t* overlapCount(std::uint32_t count) const
    {
        return m_beforeChunk.data() + chunksOf(count);
    }
    /// Of launchDistances().
    const PairDistance* distances() const { return m_distances.data(); }
    /// Of the last query. @pre it has run
    const PairCounts& counts() const { return *m_fetched.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    template <class Element>
    static void copyTo(Exec& exec, Buffer<Element>& to, const Element* from, std::uint64_t count)
    {
        exec.reserve(to, std::max<std::uint64_t>(count, 1));
        exec.uploadAndWait(to.data(), from, count);
    }

    PairMemory memory() const
    {
        return {m_axes.data(), m_heights.data(), m_simplices.data(), m_states.data()};
    }

    void reserve(Exec& exec, std::uint32_t count)
    {
        const std::uint64_t room = std::max(count, 1u), known = m_remembered;
        exec.reserve(m_counts, 1);
        exec.reserve(m_fetched, 1);
        exec.reserve(m_searched, room);
        exec.reserve(m_doubtful, room);
        reserveMemory(exec, count);
        if (count <= known)
            return;
        exec.clear(m_axes.data() + known, count - known);
        exec.clear(m_heights.data() + known, count - known);
        exec.clear(m_simplices.data() + known, count - known);
        exec.clear(m_states.data() + known, count - known);
        m_remembered = count;
    }

    void reserveMemory(Exec& exec, std::uint32_t count)
    {
        const std::uint64_t room = std::max(count, 1u);
        exec.reserveKeeping(m_axes, room, m_remembered);
        exec.reserveKeeping(m_heights, room, m_remembered);
        exec.reserveKeeping(m_simplices, room, m_remembered);
        exec.reserveKeeping(m_states, room, m_remembered);
    }

    HullTables m_tables;
    std::uint64_t m_remembered = 0;  ///< pairs that have a memory
    bool m_areCountsClear = false;
    Buffer<HullRow> m_rows;
    Buffer<HullLane> m_lanes;
    Buffer<std::uint16_t> m_starts;
    Buffer<PairAxis> m_axes;
    Buffer<PairHeights> m_heights;
    Buffer<PairSimplex> m_simplices;
    Buffer<PairState> m_states;
    Buffer<PairAxis> m_otherAxes;  ///< as swapMemory()
    Buffer<PairHeights> m_otherHeights;
    Buffer<PairSimplex> m_otherSimplices;
    Buffer<PairState> m_otherStates;
    Buffer<PairDistance> m_distances;
    Buffer<std::uint32_t> m_overlaps, m_inChunk, m_beforeChunk;
    Buffer<std::uint32_t> m_searched, m_doubtful;
    Buffer<PairCounts> m_counts;
    typename Exec::template Staging<PairCounts> m_fetched;
    PairCounts* m_fetchedOnDevice = nullptr;
};
}  // namespace cullet::convex
