// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/brute/brute_force_backend.h"

#include "cullet/broad/pairs/update_held_pairs.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <limits>
#include <new>

namespace cullet
{
namespace
{
// Boxes tested together; a constant, so that the compiler vectorises the loop.
constexpr std::size_t kScanBlock = 16;
}  // namespace

void BruteForceBackend::gatherValidBoxes(const ProxyView& proxies)
{
    m_rows.clear();
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        if (isValid(proxies.boxes[row]))
            m_rows.push_back(row);
    }
    const std::uint32_t* ids = proxies.uniqueIds;
    const auto byId = [ids](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; };
    if (!std::is_sorted(m_rows.begin(), m_rows.end(), byId))
        std::sort(m_rows.begin(), m_rows.end(), byId);

    m_ids.resize(m_rows.size());
    for (std::size_t i = 0; i < m_rows.size(); ++i)
        m_ids[i] = ids[m_rows[i]];
    const std::size_t padded = (m_rows.size() + kScanBlock - 1) / kScanBlock * kScanBlock;
    for (int axis = 0; axis < 3; ++axis)
    {
        // NaN rather than the empty box: the empty box's infinities would pass the test against an infinite box.
        m_min[axis].assign(padded, std::numeric_limits<float>::quiet_NaN());
        m_max[axis].assign(padded, std::numeric_limits<float>::quiet_NaN());
        for (std::size_t i = 0; i < m_rows.size(); ++i)
        {
            m_min[axis][i] = proxies.boxes[m_rows[i]].min[axis];
            m_max[axis][i] = proxies.boxes[m_rows[i]].max[axis];
        }
    }
}

void BruteForceBackend::findOverlapsOf(std::size_t index)
{
    const float minX = m_min[0][index], minY = m_min[1][index], minZ = m_min[2][index];
    const float maxX = m_max[0][index], maxY = m_max[1][index], maxZ = m_max[2][index];
    for (std::size_t begin = (index + 1) / kScanBlock * kScanBlock; begin < m_ids.size(); begin += kScanBlock)
    {
        const float* otherMin[3] = {&m_min[0][begin], &m_min[1][begin], &m_min[2][begin]};
        const float* otherMax[3] = {&m_max[0][begin], &m_max[1][begin], &m_max[2][begin]};
        std::int32_t hits[kScanBlock];
        std::int32_t any = 0;
        for (std::size_t k = 0; k < kScanBlock; ++k)
        {
            // overlaps(), with & instead of && to keep the loop free of branches.
            hits[k] = (minX <= otherMax[0][k]) & (otherMin[0][k] <= maxX) & (minY <= otherMax[1][k]) &
                      (otherMin[1][k] <= maxY) & (minZ <= otherMax[2][k]) & (otherMin[2][k] <= maxZ);
            any |= hits[k];
        }
        if (any == 0)
            continue;
        for (std::size_t k = 0; k < kScanBlock; ++k)
        {
            if (hits[k] != 0 && begin + k > index)
                m_overlapping.push_back({m_ids[index], m_ids[begin + k]});
        }
    }
}

void BruteForceBackend::findOverlaps()
{
    m_overlapping.clear();
    for (std::size_t index = 0; index < m_ids.size(); ++index)
        findOverlapsOf(index);
}

std::uint32_t BruteForceBackend::rowOf(std::uint32_t uniqueId) const
{
    const auto found = std::lower_bound(m_ids.begin(), m_ids.end(), uniqueId);
    if (found == m_ids.end() || *found != uniqueId)
        return kNoRow;
    return m_rows[static_cast<std::size_t>(found - m_ids.begin())];
}

Status BruteForceBackend::update(const ProxyView& proxies, PairDelta& delta)
try
{
    gatherValidBoxes(proxies);
    findOverlaps();
    const auto mayEnter = [&](Pair pair)
    {
        return proxies.filters == nullptr ||
               passesFilter(proxies.filters[rowOf(pair.first)], proxies.filters[rowOf(pair.second)]);
    };
    const auto mayStay = [&](Pair pair)
    {
        const std::uint32_t first = rowOf(pair.first);
        const std::uint32_t second = rowOf(pair.second);
        return first != kNoRow && second != kNoRow &&
               overlapsWithMargin(proxies.boxes[first], proxies.boxes[second], proxies.margin);
    };
    updateHeldPairs(m_pairs, m_overlapping, mayEnter, mayStay, delta);
    return Status::Ok;
}
catch (const std::bad_alloc&)
{
    delta.clear();
    return Status::OutOfMemory;
}

void BruteForceBackend::restart(const Pairs& known)
{
    m_pairs = known;
}

BackendStats BruteForceBackend::stats() const
{
    BackendStats stats;
    const std::uint64_t count = m_ids.size();
    stats.path = "all pairs";
    stats.pairs = m_pairs.size();
    stats.candidates = count == 0 ? 0 : count * (count - 1) / 2;
    stats.entries = count;
    stats.bytes = (m_pairs.capacity() + m_overlapping.capacity()) * sizeof(Pair) +
                  (m_rows.capacity() + m_ids.capacity()) * sizeof(std::uint32_t);
    for (int axis = 0; axis < 3; ++axis)
        stats.bytes += (m_min[axis].capacity() + m_max[axis].capacity()) * sizeof(float);
    return stats;
}

std::unique_ptr<Backend> makeBruteForceBackend()
{
    return std::make_unique<BruteForceBackend>();
}
}  // namespace cullet
