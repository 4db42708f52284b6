// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/resting/awake_boxes.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/grid/resting/classify_pairs.h"

#include <algorithm>

namespace cullet
{
namespace
{
constexpr std::size_t kQueryGrain = 1024;
constexpr unsigned kPartsPerThread = 4;
// Updates that a list of awake pairs has to last to be worth its size, and updates without one after it did not.
constexpr std::uint32_t kWorthUpdates = 3;
constexpr std::uint32_t kWait = 16;
}  // namespace

void AwakeBoxes::update(const ProxyView& view, Skin skin, bool areSomeNew)
{
    ParallelLoops& workers = m_core.workers;
    const auto count = static_cast<std::uint32_t>(rows().size());
    const bool isShared = workers.tasksFor(count, kQueryGrain) > 1;
    const bool isReordered = m_lists.needsOrder();
    if (isReordered)
        m_lists.order(view, isShared ? kPartsPerThread * workers.threads() : 1);
    const bool isNew = isReordered || areSomeNew;
    if (isNew)
        chooseSkin();
    CollectingSink sink(workers.threads());
    // Few awake boxes are scanned by one thread while others update the lists, many by all threads.
    const unsigned scans = isNew && isShared && m_grid.isForOneThread(count) ? 1 : 0;
    workers.run(scans + m_lists.parts(),
                [&](unsigned task, unsigned worker)
                {
                    if (task < scans)
                        scan(view, skin, sink);
                    else
                        m_lists.update(view, m_skins, areSomeNew, task - scans, worker);
                });
    m_core.stats.candidates += m_lists.testedCount();
    if (!isNew && !m_lists.haveLeftSkin())
    {
        ++m_age;
        m_core.stats.candidates += m_pairs.size();
        m_pairs.updateChangeable(m_core.kernels, view, m_core.reference.data(), m_core.delta.reporter(view));
        return;
    }
    if (!isNew)
        chooseSkin();
    if (scans == 0)
        scan(view, skin, sink);
    rebuildPairs(view, sink);
}

/// Chooses the mean skin of the neighbour lists; none where the list would not last, since boxes become awake in
/// nearly every update or are fast.
void AwakeBoxes::chooseSkin()
{
    if (m_skins.skin.thickness > 0.0f)
        m_wait = m_age < kWorthUpdates ? kWait : 0;
    else if (m_wait != 0)
        --m_wait;
    m_skins.skin.thickness = m_wait == 0 ? m_lists.meanSkin() : 0.0f;
    m_age = 0;
}

/// Finds all pairs of awake boxes that can overlap while no awake box moves farther than the skin, and the pairs with
/// unbounded boxes.
void AwakeBoxes::scan(const ProxyView& view, Skin restingSkin, CollectingSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.proxyRows = rows().data();
    input.count = static_cast<std::uint32_t>(rows().size());
    input.grow = m_skins.skin.growth();
    m_grid.scan(input, sink, ColumnUse::Once);
    findPairsWithUnbounded(view, restingSkin, sink);
}

void AwakeBoxes::findPairsWithUnbounded(const ProxyView& view, Skin restingSkin, CollectingSink& sink) const
{
    const float skin = std::max(m_skins.skin.growth(), restingSkin.growth());
    for (const std::uint32_t large : m_core.grid.unbounded())
    {
        if (m_states[large] != RowState::Resting)
            continue;
        for (const std::uint32_t row : rows())
        {
            if (isValid(view.boxes[row]) && !areFarApart(view.boxes[row], view.boxes[large], skin))
                sink.add({row, large});
        }
    }
}

void AwakeBoxes::rebuildPairs(const ProxyView& view, const CollectingSink& sink)
{
    m_skins.references.resize(rows().size());
    std::transform(rows().begin(), rows().end(), m_skins.references.begin(),
                   [&](std::uint32_t row) { return view.boxes[row]; });
    std::vector<RowPair> held;
    const auto keep = [&](RowPair pair) { held.push_back(pair); };
    m_pairs.forEachHeld(keep);
    m_lists.forEachUnlisted(keep);
    m_pairs.clear();
    classifyPairs(m_core, view, sink, held, m_pairs);
}

void AwakeBoxes::clear()
{
    m_pairs.clear();
    m_skins.references.clear();
    m_skins.skin = {};
    m_lists.clear();
}

std::uint64_t AwakeBoxes::bytes() const
{
    return m_grid.bytes() + m_lists.bytes() + m_pairs.bytes() + bytesOf(m_skins.references);
}
}  // namespace cullet
