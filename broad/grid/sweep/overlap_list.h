// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/sweep/unswept_pairs.h"
#include "cullet/broad/grid/update/grid_core.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The held pairs that overlap, as keys of rows. They are listed only while boxes teleport, since a scan reports the
/// pairs that boxes moved apart, but not those of boxes that are far away at once.
class OverlapList
{
public:
    OverlapList(GridCore& core, UnsweptPairs& unswept)
        : m_core(core), m_unswept(unswept), m_threads(core.workers.threads())
    {
    }

    /// Forgets the list.
    void clear() { setPairs(State::None); }
    bool isListed() const { return m_state != State::None; }
    const PairKeys& pairs() const { return m_pairs; }

    /// Makes the list: clear(), add() for each pair, markListed().
    void add(std::uint64_t key) { m_pairs.push_back(key); }

    /// Begins to collect the next list.
    void beginUpdate();
    KeyList& found(unsigned worker) { return m_threads[worker].held; }

    /// Finds the pairs that cease to overlap where boxes teleported, so that a scan alone would miss them.
    void separate(const ProxyView& view);

    /// Takes over the pairs that the threads found; without `isListing` there are none, and the list ends.
    void merge(bool isListing);

    /// Ends an update in which most boxes teleported. Hardly a pair outlives it, so that comparing two sorted lists of
    /// pairs costs less than testing the previous and the current boxes of each pair. The pairs that overlap now are in
    /// GridCore::found.
    void replace(const ProxyView& view);
    /// To be called before the scan of such an update.
    void sort();

    std::uint64_t bytes() const;

private:
    enum class State : std::uint8_t
    {
        None,      ///< no list
        Unsorted,  ///< listed
        Sorted     ///< listed by row, the lower one first
    };

    struct alignas(64) ThreadPairs
    {
        KeyList held;                     ///< overlap and are held
        std::vector<std::uint64_t> kept;  ///< in replace(): overlap as before
    };

    void setPairs(State state)
    {
        m_pairs.clear();
        m_state = state;
    }
    std::uint32_t firstRowOf(const ProxyView& view, unsigned task, unsigned tasks) const;
    void compareLists(const ProxyView& view, std::uint32_t begin, std::uint32_t end, unsigned worker);
    void separateOldPairs(const ProxyView& view, const std::uint64_t* old, const std::uint64_t* end,
                          unsigned worker);
    void recordOldPair(const ProxyView& view, std::uint64_t key, bool isWithinMargin, unsigned worker);

    GridCore& m_core;
    UnsweptPairs& m_unswept;
    State m_state = State::None;
    PairKeys m_pairs;
    PairKeys m_next;  ///< the next list of replace()
    std::vector<ThreadPairs> m_threads;
};
}  // namespace cullet
