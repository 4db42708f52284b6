// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/resting/neighbour_lists.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/boxes/prefetch_box.h"
#include "cullet/broad/grid/resting/classify_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace cullet
{
namespace
{
// Boxes are prefetched so many iterations early.
constexpr std::uint32_t kNeighboursAhead = 32;
// Skin of a list, as a share of the shortest edge of its box: a list lasts some eleven updates in W3, with two and a
// half times as many neighbours as overlapping boxes.
constexpr float kListSkinShare = 0.35f;
// A box that moved farther than so many skins of its list is too fast for lists.
constexpr float kSlowShare = 2.0f;
// Expired pairs stay in memory until there are so many more of them than others.
constexpr std::size_t kMaxExpired = 256;
// Updates until awake boxes are ordered anew.
constexpr std::uint32_t kOrderedUpdates = 64;

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
class NeighbourLists::Sink final : public PairSink
{
public:
    Sink(NeighbourLists& lists, const ProxyView& view, Part& part)
        : m_lists(lists), m_view(view), m_part(part)
    {
    }

    void take(unsigned /*worker*/, const PairBuffer& found) override
    {
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const RowPair pair = found.pair(i);
            if (m_lists.m_states[pair.b] == RowState::Resting)
                add(pair.a, pair.b);
        }
    }

private:
    void add(std::uint32_t query, std::uint32_t row)
    {
        const std::uint32_t index = m_part.stale[query];
        const RowPair pair = {m_lists.m_rows[index], row};
        const bool wasHeld = m_part.held.erase(std::uint64_t{query} << 32 | row);
        if (!wasHeld && !mayEnter(m_view, pair))
            return;
        List& list = m_lists.m_lists[index];
        if (list.count == 0)
            list.begin = static_cast<std::uint32_t>(m_part.pairs.size());
        ++list.count;
        m_part.pairs.add(pair, wasHeld ? VerletPairs::State::Overlapping : VerletPairs::State::Candidate);
    }

    NeighbourLists& m_lists;
    const ProxyView& m_view;
    Part& m_part;
};

/// The awake boxes of a part. Boxes that became awake since the last ordering are in the last part.
TaskRange NeighbourLists::rangeOf(unsigned part) const
{
    const auto parts = static_cast<unsigned>(m_parts.size());
    TaskRange range(m_orderedCount, part, parts);
    if (part + 1 == parts)
        range.end = static_cast<std::uint32_t>(m_rows.size());
    return range;
}

void NeighbourLists::update(const ProxyView& view, const Skins& awake, bool areSomeNew, unsigned part,
                            unsigned worker)
{
    Part& to = m_parts[part];
    to.beginUpdate();
    const TaskRange range = rangeOf(part);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
    {
        prefetchBox(view.boxes + m_rows[std::min(i + kNeighboursAhead, range.end - 1)]);
        const Aabb& box = view.boxes[m_rows[i]];
        const List& list = m_lists[i];
        if (list.skin.thickness < 0.0f || !list.skin.contains(box, list.box))
            to.stale.push_back(i);
        to.hasLeftSkin |= i >= awake.references.size() || !awake.contain(box, i);
    }
    if (areSomeNew)
        expireAwakePartners(to);
    makeLists(view, to, worker);
    to.pairs.updateChangeable(m_core.kernels, view, m_core.reference.data(),
                              m_core.delta.reporter(view, worker));
    if (2 * to.expiredCount > to.pairs.size() + kMaxExpired)
        compact(part);
}

/// Expires the pairs whose resting box became awake; the held ones have no list.
void NeighbourLists::expireAwakePartners(Part& to) const
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
void NeighbourLists::prepareQuery(const ProxyView& view, std::uint32_t index, Part& to)
{
    const Aabb& box = view.boxes[m_rows[index]];
    const std::uint64_t query = to.queries.size();
    List& list = m_lists[index];
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
    list.skin = List::kUnmade;
    if (!isValid(box))
    {
        to.queries.push_back(kEmptyAabb);
        return;
    }
    const float skin = listSkinOf(box);
    const bool isSlow = isInsideSkin(box, list.box, kSlowShare * skin);
    list.skin.thickness = isSlow ? skin : 0.0f;
    list.box = box;
    to.queries.push_back(ColumnGrid::grown(box, Skin{list.skin.thickness + 2.0f * view.margin}.growth()));
}

void NeighbourLists::makeLists(const ProxyView& view, Part& to, unsigned worker)
{
    if (to.stale.empty())
        return;
    for (const std::uint32_t index : to.stale)
        prepareQuery(view, index, to);
    to.held.take(to.keys);
    Sink sink(*this, view, to);
    m_core.grid.query(to.queries.data(), static_cast<std::uint32_t>(to.queries.size()), worker, sink);
    to.held.forEach(
        [&](std::uint64_t key)
        {
            const RowPair pair = {m_rows[to.stale[key >> 32]], static_cast<std::uint32_t>(key)};
            const Aabb& box = view.boxes[pair.a];
            if (isValid(box) && overlapsWithMargin(box, view.boxes[pair.b], view.margin))
                to.unlistedPairs.push_back(pair);
            else
                m_core.delta.remove(view, pair, worker);
        });
}

void NeighbourLists::add(std::uint32_t row, VerletPairs& resting)
{
    Part& part = m_parts.back();
    const std::size_t begin = part.pairs.size();
    resting.forEachOf(
        row,
        [&](std::size_t index)
        {
            const RowPair pair = resting.pair(index);
            if (resting.state(index) != VerletPairs::State::Candidate)
                part.pairs.add({row, pair.a == row ? pair.b : pair.a}, VerletPairs::State::Overlapping);
            resting.setState(index, VerletPairs::State::Expired);
        });
    m_lists.push_back({m_core.reference[row], List::kUnmade, static_cast<std::uint32_t>(begin),
                       static_cast<std::uint32_t>(part.pairs.size() - begin)});
    m_rows.push_back(row);
}

/// Appends the pairs of a list that have not expired.
void NeighbourLists::moveList(const VerletPairs& from, List& list, VerletPairs& to)
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

void NeighbourLists::compact(unsigned part)
{
    VerletPairs pairs;
    const TaskRange range = rangeOf(part);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
        moveList(m_parts[part].pairs, m_lists[i], pairs);
    m_parts[part].pairs = std::move(pairs);
    m_parts[part].expiredCount = 0;
}

void NeighbourLists::order(const ProxyView& view, unsigned parts)
{
    std::vector<std::uint32_t> partOf(m_rows.size());
    for (unsigned part = 0; part < m_parts.size(); ++part)
    {
        const TaskRange range = rangeOf(part);
        std::fill(partOf.begin() + range.begin, partOf.begin() + range.end, part);
    }
    const std::vector<std::uint32_t> places = m_core.grid.orderAlongColumns(view.boxes, m_rows);
    const std::vector<Part> from = std::exchange(m_parts, std::vector<Part>(parts));
    const std::vector<std::uint32_t> awake = m_rows;
    const std::vector<List> lists = m_lists;
    m_orderedCount = m_rows.size();
    m_orderedAge = 0;
    for (unsigned part = 0; part < parts; ++part)
    {
        const TaskRange range = rangeOf(part);
        for (std::uint32_t i = range.begin; i < range.end; ++i)
        {
            m_rows[i] = awake[places[i]];
            m_lists[i] = lists[places[i]];
            moveList(from[partOf[places[i]]].pairs, m_lists[i], m_parts[part].pairs);
        }
    }
}

bool NeighbourLists::needsOrder()
{
    return m_rows.size() > m_orderedCount + m_orderedCount / 8 || ++m_orderedAge > kOrderedUpdates;
}

std::size_t NeighbourLists::testedCount() const
{
    std::size_t count = 0;
    for (const Part& part : m_parts)
        count += part.pairs.size() - part.expiredCount;
    return count;
}

bool NeighbourLists::haveLeftSkin() const
{
    return std::any_of(m_parts.begin(), m_parts.end(),
                       [](const Part& part) { return part.hasLeftSkin || !part.unlistedPairs.empty(); });
}

float NeighbourLists::meanSkin() const
{
    double sum = 0;
    for (const List& list : m_lists)
        sum += std::max(list.skin.thickness, 0.0f);
    return static_cast<float>(sum / static_cast<double>(m_lists.size()));
}

void NeighbourLists::clear()
{
    m_rows.clear();
    m_lists.clear();
    m_parts.resize(1);
    m_parts[0].pairs.clear();
    m_parts[0].expiredCount = 0;
    m_parts[0].beginUpdate();
    m_orderedCount = 0;
}

void NeighbourLists::Part::beginUpdate()
{
    unlistedPairs.clear();
    hasLeftSkin = false;
    stale.clear();
    queries.clear();
    keys.clear();
}

std::uint64_t NeighbourLists::Part::bytes() const
{
    return pairs.bytes() + held.bytes() + bytesOf(unlistedPairs, stale, queries, keys);
}

std::uint64_t NeighbourLists::bytes() const
{
    std::uint64_t sum = bytesOf(m_rows, m_lists, m_parts);
    for (const Part& part : m_parts)
        sum += part.bytes();
    return sum;
}
}  // namespace cullet
