// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_grid_backend.h"
#include "broad/row_grid_sinks.h"

#include <algorithm>
#include <cstring>

namespace cullet
{
namespace
{
// Gaps and motions are rounded differences; the factors cover the roundings many times over. A pair that overlapped
// before its boxes moved by d each has a gap of at most 2 d, and shares a cell when the cells are reached by d more.
constexpr float kGapFactor = 2.0625f;
constexpr float kReachFactor = 1.0625f;
// Share of boxes that may move farther than the reach of the grid; their pairs are told from a list.
constexpr std::uint32_t kJumperShare = 64;
// Share of such boxes from which all pairs are found anew.
constexpr std::uint32_t kJumpedShare = 2;
// Updates with little motion until the reach shrinks.
constexpr std::uint32_t kPatience = 32;
constexpr std::size_t kCopyGrain = 16384;
// Pairs whose boxes are on their way from memory.
constexpr std::uint32_t kPrefetch = 12;

/// Largest float below 2^(octave - 127): all motions of lower octaves are within it.
float reachOf(std::uint32_t octave)
{
    const std::uint32_t bits = (octave << 23) - 1;
    float reach;
    std::memcpy(&reach, &bits, sizeof reach);
    return reach;
}

std::uint32_t countFrom(const GridMotion& motion, std::uint32_t octave)
{
    std::uint32_t count = 0;
    for (; octave < motion.octaves.size(); ++octave)
        count += motion.octaves[octave];
    return count;
}

/// Lowest octave that at most `few` boxes reach.
std::uint32_t octaveAbove(const GridMotion& motion, std::uint32_t few)
{
    auto octave = static_cast<std::uint32_t>(motion.octaves.size());
    for (std::uint32_t count = 0; octave > 1; --octave)
    {
        count += motion.octaves[octave - 1];
        if (count > few)
            break;
    }
    return octave;
}
}  // namespace

/// Tells from what the grid finds which pairs are new and which part, in the threads of the grid.
///
/// Before and after are compared box by box: no list of all pairs is kept, unless some boxes jump.
class RowGridBackend::MovingSink final : public PairSink
{
public:
    struct alignas(64) List
    {
        std::vector<IdPair> added;
        std::vector<IdPair> parted;     ///< held, do not overlap any more
        std::vector<float> partedGaps;  ///< of those
        std::vector<IdPair> despite;    ///< held although the filter words reject them
        std::vector<IdPair> held;       ///< when listing: overlap and are held
    };

    MovingSink(const RowGridBackend& backend, const ProxyView& view, unsigned workers, bool isListing)
        : m_backend(backend), m_view(view), m_isListing(isListing), m_lists(workers)
    {
    }

    void take(unsigned worker, const PairBuffer& found) override
    {
        const Aabb* const before = m_backend.m_reference.data();
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const IdPair ahead = found.pair(std::min(i + kPrefetch, found.count - 1));
            __builtin_prefetch(before + ahead.a);
            __builtin_prefetch(before + ahead.b);
            const IdPair pair = found.pair(i);
            const bool overlapped = overlapsBranchless(before[pair.a], before[pair.b]);
            if (m_isListing || overlapped != (found.gap[i] <= 0.0f))
                examine(m_lists[worker], pair, found.gap[i], overlapped);
        }
    }

    const std::vector<List>& lists() const { return m_lists; }

private:
    void examine(List& list, IdPair pair, float gap, bool overlapped)
    {
        const bool overlaps = gap <= 0.0f;
        if (overlapped && !m_backend.isHeld(m_view, pair))
            return;
        if (!overlaps)
        {
            list.parted.push_back(pair);
            list.partedGaps.push_back(gap);
            return;
        }
        if (!overlapped && !enter(list, pair))
            return;
        if (m_isListing)
            list.held.push_back(pair);
    }

    /// Whether a pair that begins to overlap is held from now on.
    bool enter(List& list, IdPair pair)
    {
        const bool passes = mayEnter(m_view, pair);
        const bool isKept = m_backend.m_separated.contains(PairSet::keyOf(pair.a, pair.b));
        if (isKept && !passes)
            list.despite.push_back(pair);
        if (!isKept && passes)
            list.added.push_back(pair);
        return isKept || passes;
    }

    const RowGridBackend& m_backend;
    const ProxyView& m_view;
    const bool m_isListing;
    std::vector<List> m_lists;
};

/// Whether a pair that overlapped in the last update was held then; nothing changed filter words since.
bool RowGridBackend::isHeld(const ProxyView& view, IdPair pair) const
{
    return mayEnter(view, pair) || m_despite.contains(PairSet::keyOf(pair.a, pair.b));
}

/// Pairs that overlapped in the last update and were held, by the boxes and filter words of then.
void RowGridBackend::listOverlapping(std::vector<IdPair>& held)
{
    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = m_reference.data();
    input.count = m_scannedRows;
    m_grid.scanAgain(input, sink);
    sink.forEach(
        [&](IdPair pair)
        {
            if (m_words.empty() || passesFilter(m_words[pair.a], m_words[pair.b]) ||
                m_despite.contains(PairSet::keyOf(pair.a, pair.b)))
                held.push_back(pair);
        });
}

/// How far boxes reach into the cells, so that no pair that parts is missed: a power of two that nearly all motions
/// are below. Boxes that move farther are told apart by a list of pairs.
void RowGridBackend::chooseReach(const GridMotion& motion, std::uint32_t rows)
{
    const std::uint32_t few = rows / kJumperShare;
    const std::uint32_t octave = std::max(kLeastReach, octaveAbove(motion, few));
    const bool isEnough = octave <= m_reachOctave;
    m_calmUpdates = isEnough && octave + 2 < m_reachOctave ? m_calmUpdates + 1 : 0;
    if (isEnough && m_calmUpdates < kPatience)
        return;
    if (reachOf(octave) < 0.125f * m_grid.finestWidth())
        m_reachOctave = octave;
    m_calmUpdates = 0;
}

void RowGridBackend::scanMoving(const ProxyView& view, const GridMotion& motion, bool isListing,
                                PairSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    input.reach = kReachFactor * reachOf(m_reachOctave);
    if (!isListing)
    {
        // What the grid was compared with may have been a shorter reach than the one chosen now.
        const bool isSame = m_comparedOctave == m_reachOctave;
        input.near = kGapFactor * (isSame ? motion.largest : reachOf(m_reachOctave));
        input.deep = -input.near;
    }
    if (follow(view, input, motion))
    {
        m_stats.path = "follow";
        m_grid.scanFollowed(input, sink);
    }
    else
    {
        m_stats.path = "rebuild";
        ++m_stats.rebuildsTotal;
        m_grid.scan(input, sink, RowUse::Follow);
    }
    m_scannedRows = view.size;
}

/// Brings the rows up to date if that is possible and expected to cost less than to refill them.
bool RowGridBackend::follow(const ProxyView& view, const GridInput& input, const GridMotion& motion)
{
    const std::size_t strays = motion.strays.size();
    const double following = SettlePolicy::kCostOfMoving * view.size + SettlePolicy::kCostOfStray * strays;
    const double refilling = SettlePolicy::kCostOfRefill * view.size;
    if (following > refilling || m_options.rebuildFraction == 0.0f)
    {
        decide("many boxes came into other cells", strays, refilling, following);
        return false;
    }
    if (!m_grid.follow(input, m_reference.data(), motion.strays))
    {
        decide("the rows could not be kept", strays, refilling, following);
        return false;
    }
    decide("few boxes came into other cells", strays, following, refilling);
    return true;
}

void RowGridBackend::updateMoving(const ProxyView& view)
{
    // The margin alone may have changed, so that held pairs that do not overlap are looked at even when nothing moved.
    if (view.dirtyCount == 0 && m_apart.empty())
    {
        m_stats.path = "idle";
        decide("nothing changed", 0, 0, 0);
        return;
    }
    m_comparedOctave = m_reachOctave;
    m_grid.compare(view.boxes, m_reference.data(), view.dirty, view.dirtyCount, reachOf(m_reachOctave),
                   m_motion);
    chooseReach(m_motion, view.size);
    const std::uint32_t jumpers = countFrom(m_motion, m_reachOctave);
    const bool isListing = jumpers != 0;
    if (isListing && !m_hasOverlapping)
        listOverlapping(m_overlapping);
    if (jumpers > view.size / kJumpedShare)
    {
        updateJumped(view);
    }
    else
    {
        MovingSink sink(*this, view, m_workers.threads(), isListing);
        scanMoving(view, m_motion, isListing, sink);
        takeMoving(view, isListing, sink);
    }
    const unsigned tasks = m_workers.tasksFor(view.dirtyCount, kCopyGrain);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const TaskRange range(view.dirtyCount, task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                          m_reference[view.dirty[i]] = remembered(view.boxes[view.dirty[i]]);
                  });
}

/// A held pair that does not overlap any more: stays while the margin allows it.
void RowGridBackend::part(const ProxyView& view, IdPair pair, bool isNear, std::vector<IdPair>& apart)
{
    if (!m_despite.isEmpty())
        m_despite.erase(PairSet::keyOf(pair.a, pair.b));
    if (isNear)
        apart.push_back(pair);
    else
        reportRemoved(view, pair);
}

void RowGridBackend::partUnlessOverlapping(const ProxyView& view, IdPair pair, std::vector<IdPair>& apart)
{
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool valid = isValid(a) && isValid(b);
    if (!valid || !overlapsBranchless(a, b))
        part(view, pair, valid && overlapsWithMargin(a, b, view.margin), apart);
}

void RowGridBackend::takeMoving(const ProxyView& view, bool isListing, const MovingSink& sink)
{
    std::vector<IdPair> apart;
    for (const IdPair pair : m_apart)
        partUnlessOverlapping(view, pair, apart);
    if (isListing)
    {
        for (const IdPair pair : m_overlapping)
            partUnlessOverlapping(view, pair, apart);
    }
    m_overlapping.clear();
    m_hasOverlapping = isListing;
    m_isOverlappingSorted = false;
    const float limit = 2.0f * view.margin;
    for (const MovingSink::List& list : sink.lists())
    {
        for (std::size_t i = 0; i < list.parted.size(); ++i)
            part(view, list.parted[i], list.partedGaps[i] <= limit, apart);
        for (const IdPair pair : list.despite)
            m_despite.insert(PairSet::keyOf(pair.a, pair.b));
        for (const IdPair pair : list.added)
            reportAdded(view, pair);
        m_overlapping.insert(m_overlapping.end(), list.held.begin(), list.held.end());
    }
    setApart(apart);
}

/// Replaces the held pairs that do not overlap.
void RowGridBackend::setApart(std::vector<IdPair>& apart)
{
    m_apart.swap(apart);
    m_separated.reset(m_apart.size());
    for (const IdPair pair : m_apart)
        m_separated.insert(PairSet::keyOf(pair.a, pair.b));
}
}  // namespace cullet
