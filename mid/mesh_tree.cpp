// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/mesh_tree.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/threads/parallel_for_each.h"
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/base/trees/wide_tree_order.h"

#include <algorithm>
#include <cfloat>

namespace cullet
{
namespace
{
/// Nodes for which a thread of its own pays.
constexpr std::size_t kGrain = 4096;
/// Nanoseconds per item.
constexpr double kBuildWork = 250.0, kRefitWork = 10.0;

bool isBefore(std::uint32_t a, std::uint32_t b)
{
    return a < b;
}
bool isBefore(const MeshCandidate& a, const MeshCandidate& b)
{
    return a.item < b.item;
}

/// Appends what a kernel finds, in ascending order of the items.
template <class Found, class Step>
void collectSorted(const MeshTreeView& view, std::vector<Found>& found, const Step& step)
{
    MeshWalk walk;
    walk.start(view);
    Found batch[kMeshBatch];
    const std::size_t before = found.size();
    while (const std::uint32_t count = step(walk, batch))
        found.insert(found.end(), batch, batch + count);
    std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end(),
              [](const Found& a, const Found& b) { return isBefore(a, b); });
}
}  // namespace

void MeshTree::build(const MeshBox* boxes, std::uint32_t count, ParallelLoops* loops)
{
    m_view.levelCount = 0;
    ParallelLoops one(1);
    ParallelLoops& used = loops != nullptr ? *loops : one;
    std::vector<std::uint32_t> valid;
    valid.reserve(count);
    for (std::uint32_t item = 0; item < count; ++item)
    {
        if (isValid(boxes[item]))
            valid.push_back(item);
    }
    static_assert(sizeof(MeshBox) == sizeof(float[6]), "the same planes");
    const BoxesToOrder toOrder = {reinterpret_cast<const float(*)[6]>(boxes), valid.data(), valid.size()};
    used.runRegion(kBuildWork * count,
                   [&]
                   {
                       m_items = wideTreeOrder(toOrder, &used);
                       layOut();
                       fill(boxes, used);
                   });
}

void MeshTree::layOut()
{
    const int levels = layOutLevels(static_cast<std::uint32_t>(m_items.size() / 8), m_levelStart);
    m_nodes = std::vector<WideNode>(m_levelStart[levels], nodeOf(kEmptyMeshBox));
    for (int level = 0; level < levels; ++level)
        m_view.levels[level] = m_nodes.data() + m_levelStart[level];
    m_view.items = m_items.data();
    m_view.levelCount = levels;
}

void MeshTree::fill(const MeshBox* boxes, ParallelLoops& loops)
{
    for (int level = 0; level < m_view.levelCount; ++level)
    {
        parallelForEach(loops, nodeCount(level), kGrain,
                        [&](std::uint32_t index)
                        {
                            if (level == 0)
                                fillLeaf(index, boxes);
                            setBounds(level, index, boundsOfLanes<MeshBox>(node(level, index)));
                        });
    }
}

void MeshTree::fillLeaf(std::uint32_t leaf, const MeshBox* boxes) noexcept
{
    for (std::uint32_t lane = 0; lane < 8; ++lane)
    {
        const std::uint32_t item = m_items[8 * leaf + lane];
        setLane(node(0, leaf), lane, item == kEmptySlot ? kEmptyMeshBox : boxes[item]);
    }
}

/// Stores the box around a node in its parent.
void MeshTree::setBounds(int level, std::uint32_t index, const MeshBox& box) noexcept
{
    if (level + 1 < m_view.levelCount)
        setLane(node(level + 1, index / 8), index % 8, box);
}

void MeshTree::refit(const MeshBox* boxes, ParallelLoops* loops)
{
    ParallelLoops one(1);
    ParallelLoops& used = loops != nullptr ? *loops : one;
    used.runRegion(kRefitWork * static_cast<double>(m_items.size()), [&] { fill(boxes, used); });
}

void MeshTree::findOverlaps(const MeshBox& box, std::vector<std::uint32_t>& items) const
{
    const MeshBox finite = finitePart(box);
    collectSorted(m_view, items,
                  [&](MeshWalk& walk, std::uint32_t* batch)
                  { return m_kernels->overlaps(m_view, finite, walk, batch); });
}

bool MeshTree::findOnPath(const SweptBox& box, double limit, std::vector<MeshCandidate>& found) const
{
    SweptQuery query;
    if (!box.prepare(query))
        return false;
    query.limit = sweptLimit(limit);
    collectSorted(m_view, found,
                  [&](MeshWalk& walk, MeshCandidate* batch)
                  { return m_kernels->onPath(m_view, query, walk, batch); });
    return true;
}

std::uint64_t MeshTree::bytes() const noexcept
{
    return bytesOf(m_nodes, m_items);
}
}  // namespace cullet
