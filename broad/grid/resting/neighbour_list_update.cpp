// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Resting mode: the neighbour lists of awake boxes, which hold resting boxes.
#include "cullet/broad/boxes/prefetch_box.h"
#include "cullet/broad/grid/column_grid_backend.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cullet
{
namespace
{
// Boxes are prefetched so many iterations early.
constexpr std::uint32_t kPrefetch = 32;
// Skin of a list, as a share of the shortest edge of its box: a list lasts some eleven updates in W3, with two and a
// half times as many neighbours as overlapping boxes.
constexpr float kListSkinShare = 0.35f;
// A box that moved farther than so many skins of its list is too fast for lists.
constexpr float kSlowShare = 2.0f;
// Expired pairs stay in memory until there are so many more of them than others.
constexpr std::size_t kMaxExpired = 256;

/// Skin of the list of a box.
float listSkinOf(const Aabb& box)
{
    float edge = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        edge = std::min(edge, box.max[axis] - box.min[axis]);
    return std::isfinite(edge) ? kListSkinShare * edge : 0.0f;
}
}  // namespace

/// Adds the boxes that a query finds to the lists of the queried boxes.
class ColumnGridBackend::NeighbourSink final : public PairSink
{
public:
    NeighbourSink(ColumnGridBackend& backend, const ProxyView& view, NeighbourPart& part)
        : m_backend(backend), m_view(view), m_part(part)
    {
    }

    void take(unsigned /*worker*/, const PairBuffer& found) override
    {
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const RowPair pair = found.pair(i);
            if (m_backend.m_states[pair.b] == RowState::Resting)
                add(pair.a, pair.b);
        }
    }

private:
    void add(std::uint32_t query, std::uint32_t row)
    {
        const std::uint32_t index = m_part.stale[query];
        const RowPair pair = {m_backend.m_awake[index], row};
        const bool wasHeld = m_part.held.erase(std::uint64_t{query} << 32 | row);
        if (!wasHeld && !mayEnter(m_view, pair))
            return;
        NeighbourList& list = m_backend.m_lists[index];
        if (list.count == 0)
            list.begin = static_cast<std::uint32_t>(m_part.pairs.size());
        ++list.count;
        m_part.pairs.add(pair, wasHeld ? VerletPairs::State::Overlapping : VerletPairs::State::Candidate);
    }

    ColumnGridBackend& m_backend;
    const ProxyView& m_view;
    NeighbourPart& m_part;
};

/// The awake boxes of a part. Boxes that became awake since the last ordering are in the last part.
TaskRange ColumnGridBackend::rangeOf(unsigned part) const
{
    const auto parts = static_cast<unsigned>(m_parts.size());
    TaskRange range(m_orderedCount, part, parts);
    if (part + 1 == parts)
        range.end = static_cast<std::uint32_t>(m_awake.size());
    return range;
}

/// Updates the lists of a part, and reports the changes of their pairs.
void ColumnGridBackend::updateLists(const ProxyView& view, unsigned part, unsigned worker)
{
    NeighbourPart& to = m_parts[part];
    to.beginUpdate();
    const TaskRange range = rangeOf(part);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
    {
        prefetchBox(view.boxes + m_awake[std::min(i + kPrefetch, range.end - 1)]);
        const Aabb& box = view.boxes[m_awake[i]];
        const NeighbourList& list = m_lists[i];
        if (list.skin < 0.0f || !isInsideSkin(box, list.box, list.skin))
            to.stale.push_back(i);
        to.hasLeftSkin |=
            i >= m_awakePairsBoxes.size() || !isInsideSkin(box, m_awakePairsBoxes[i], m_awakePairsSkin);
    }
    if (!m_outsideSkin.empty())
        expireAwakePartners(to);
    makeLists(view, part, worker);
    updateChangeablePairs(view, to.pairs, worker);
    if (2 * to.expiredCount > to.pairs.size() + kMaxExpired)
        compactLists(part);
}

/// Expires the pairs whose resting box became awake; the held ones move to m_awakePairs.
void ColumnGridBackend::expireAwakePartners(NeighbourPart& to) const
{
    for (std::size_t i = 0; i < to.pairs.size(); ++i)
    {
        const RowPair pair = to.pairs.pair(i);
        if (m_states[pair.b] == RowState::Resting || to.pairs.state(i) == VerletPairs::State::Expired)
            continue;
        if (to.pairs.state(i) == VerletPairs::State::Overlapping)
            to.unlistedPairs.push_back(pair);
        to.pairs.setState(i, VerletPairs::State::Expired);
        ++to.expiredCount;
    }
}

/// Prepares the query for the neighbours of a box, and collects its held pairs.
void ColumnGridBackend::prepareListQuery(const ProxyView& view, std::uint32_t index, NeighbourPart& to)
{
    const Aabb& box = view.boxes[m_awake[index]];
    const std::uint64_t query = to.queries.size();
    NeighbourList& list = m_lists[index];
    const auto first = static_cast<std::ptrdiff_t>(to.keys.size());
    for (std::uint32_t i = list.begin; i < list.begin + list.count; ++i)
    {
        if (to.pairs.state(i) == VerletPairs::State::Overlapping)
            to.keys.push_back(query << 32 | to.pairs.pair(i).b);
        to.expiredCount += to.pairs.state(i) == VerletPairs::State::Expired ? 0u : 1u;
        to.pairs.setState(i, VerletPairs::State::Expired);
    }
    std::sort(to.keys.begin() + first, to.keys.end());

    list.count = 0;
    list.skin = NeighbourList::kUnmade;
    if (!isValid(box))
    {
        to.queries.push_back(kEmptyAabb);
        return;
    }
    const float skin = listSkinOf(box);
    list.skin = isInsideSkin(box, list.box, kSlowShare * skin) ? skin : 0.0f;
    list.box = box;
    to.queries.push_back(ColumnGrid::grown(box, kGrowFactor * (list.skin + 2.0f * view.margin)));
}

void ColumnGridBackend::makeLists(const ProxyView& view, unsigned part, unsigned worker)
{
    NeighbourPart& to = m_parts[part];
    if (to.stale.empty())
        return;
    for (const std::uint32_t index : to.stale)
        prepareListQuery(view, index, to);
    to.held.take(to.keys);
    NeighbourSink sink(*this, view, to);
    m_grid.query(to.queries.data(), static_cast<std::uint32_t>(to.queries.size()), worker, sink);
    to.held.forEach(
        [&](std::uint64_t key)
        {
            const RowPair pair = {m_awake[to.stale[key >> 32]], static_cast<std::uint32_t>(key)};
            const Aabb& box = view.boxes[pair.a];
            if (isValid(box) && overlapsWithMargin(box, view.boxes[pair.b], view.margin))
                to.unlistedPairs.push_back(pair);
            else
                m_removed[worker].push(idsOf(view, pair));
        });
}

/// Begins the list of a box that just became awake, with its held pairs of m_restingPairs.
void ColumnGridBackend::beginList(std::uint32_t row)
{
    NeighbourPart& part = m_parts.back();
    const std::size_t begin = part.pairs.size();
    m_restingPairs.forEachOf(
        row,
        [&](std::size_t index)
        {
            const RowPair pair = m_restingPairs.pair(index);
            if (m_restingPairs.state(index) != VerletPairs::State::Candidate)
                part.pairs.add({row, pair.a == row ? pair.b : pair.a}, VerletPairs::State::Overlapping);
            m_restingPairs.setState(index, VerletPairs::State::Expired);
        });
    m_lists.push_back({m_reference[row], NeighbourList::kUnmade, static_cast<std::uint32_t>(begin),
                       static_cast<std::uint32_t>(part.pairs.size() - begin)});
}

/// Appends the pairs of a list that have not expired.
void ColumnGridBackend::moveList(const VerletPairs& from, NeighbourList& list, VerletPairs& to)
{
    const std::size_t begin = to.size();
    for (std::uint32_t i = list.begin; i < list.begin + list.count; ++i)
    {
        if (from.state(i) != VerletPairs::State::Expired)
            to.add(from.pair(i), from.state(i));
    }
    list.begin = static_cast<std::uint32_t>(begin);
    list.count = static_cast<std::uint32_t>(to.size() - begin);
}

void ColumnGridBackend::compactLists(unsigned part)
{
    VerletPairs pairs;
    const TaskRange range = rangeOf(part);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
        moveList(m_parts[part].pairs, m_lists[i], pairs);
    m_parts[part].pairs = std::move(pairs);
    m_parts[part].expiredCount = 0;
}

/// Orders awake boxes along the columns, and distributes them over the parts.
void ColumnGridBackend::orderAwake(const ProxyView& view, unsigned parts)
{
    std::vector<std::uint32_t> partOf(m_awake.size());
    for (unsigned part = 0; part < m_parts.size(); ++part)
    {
        const TaskRange range = rangeOf(part);
        std::fill(partOf.begin() + range.begin, partOf.begin() + range.end, part);
    }
    const std::vector<std::uint32_t> order = m_grid.orderAlongColumns(view.boxes, m_awake);
    const std::vector<NeighbourPart> from = std::exchange(m_parts, std::vector<NeighbourPart>(parts));
    const std::vector<std::uint32_t> awake = m_awake;
    const std::vector<NeighbourList> lists = m_lists;
    m_orderedCount = m_awake.size();
    m_orderedAge = 0;
    for (unsigned part = 0; part < parts; ++part)
    {
        const TaskRange range = rangeOf(part);
        for (std::uint32_t i = range.begin; i < range.end; ++i)
        {
            m_awake[i] = awake[order[i]];
            m_lists[i] = lists[order[i]];
            moveList(from[partOf[order[i]]].pairs, m_lists[i], m_parts[part].pairs);
        }
    }
}
}  // namespace cullet
