// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/narrow/hull_set.h"

#include "cullet/narrow/hull/hull.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <type_traits>
#include <vector>

namespace cullet
{
using convex::HullLane;
using convex::HullRow;
using convex::kBlockLanes;
using convex::kStarts;

struct HullSet::Arrays
{
    std::vector<HullRow> rows;
    std::vector<HullLane> lanes;
    std::vector<std::uint16_t> starts;
};

namespace
{
/// Calls body(index) for every block of a hull with neighbours.
template <class Body>
void forEachBlock(const Hull<float>& hull, const Body& body)
{
    for (std::int32_t vertex = 0; vertex < hull.blockCount(); ++vertex)
    {
        for (std::int32_t index = vertex; index >= 0; index = hull.block(index).id[0])
            body(index);
    }
}

std::uint64_t blocksOf(const Hull<float>& hull)
{
    if (!hull.hasNeighbours())
        return (static_cast<std::uint64_t>(hull.vertexCount()) + kBlockLanes - 1) / kBlockLanes;
    std::int32_t last = 0;
    forEachBlock(hull, [&](std::int32_t index) { last = std::max(last, index); });
    return static_cast<std::uint64_t>(last) + 1;
}

/// @param lanes [8 blocksOf(hull)]
void fillLanes(const Hull<float>& hull, HullLane* lanes)
{
    const auto fillBlock = [&](std::int32_t index)
    {
        const NeighbourBlock<float>& block = hull.block(index);
        HullLane* const to = lanes + static_cast<std::size_t>(index) * kBlockLanes;
        for (std::size_t k = 0; k < kBlockLanes; ++k)
            to[k] = {block.x[k], block.y[k], block.z[k], block.id[k]};
    };
    if (hull.hasNeighbours())
        forEachBlock(hull, fillBlock);
    else
    {
        for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
            lanes[i] = {hull.x()[i], hull.y()[i], hull.z()[i], i};
    }
}
}  // namespace

HullSet::HullSet() : m_arrays(std::make_unique<Arrays>()) {}
HullSet::HullSet(HullSet&&) noexcept = default;
HullSet& HullSet::operator=(HullSet&&) noexcept = default;
HullSet::~HullSet() = default;

std::uint32_t HullSet::add(const Hull<float>& given)
{
    const Hull<float>& hull = given.corners();
    static_assert(std::tuple_size_v<std::decay_t<decltype(hull.startTable())>> == kStarts, "the same cube");
    Arrays& arrays = *m_arrays;
    const std::uint64_t first = blockCount(), blocks = blocksOf(hull);
    if (first + blocks > std::numeric_limits<std::uint32_t>::max())
        throw std::bad_alloc();
    // What may throw comes before what changes the set.
    arrays.rows.reserve(arrays.rows.size() + 1);
    arrays.starts.reserve(arrays.starts.size() + kStarts);
    arrays.lanes.resize(arrays.lanes.size() + blocks * kBlockLanes);
    fillLanes(hull, arrays.lanes.data() + first * kBlockLanes);
    const auto count = static_cast<std::uint32_t>(hull.vertexCount());
    arrays.rows.push_back({static_cast<std::uint32_t>(first),
                           count | (hull.hasNeighbours() ? HullRow::kClimbable : 0u), hull.reach(),
                           hull.tieBand()});
    arrays.starts.insert(arrays.starts.end(), hull.startTable().begin(), hull.startTable().end());
    return size() - 1;
}

std::uint32_t HullSet::size() const
{
    return static_cast<std::uint32_t>(m_arrays->rows.size());
}

std::uint64_t HullSet::blockCount() const
{
    return m_arrays->lanes.size() / kBlockLanes;
}

convex::HullTables HullSet::tables() const
{
    return {m_arrays->rows.data(), m_arrays->lanes.data(), m_arrays->starts.data(), size()};
}
}  // namespace cullet
