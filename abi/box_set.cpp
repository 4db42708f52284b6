// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/box_set.h"

#include "cullet/abi/status.h"
#include "cullet/base/float_rounding.h"
#include "cullet/broad/log.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

namespace cullet::abi
{
namespace
{
/// The caller's strides may leave numbers unaligned.
template <class Number>
Number readUnaligned(const unsigned char* from)
{
    Number number;
    std::memcpy(&number, from, sizeof(number));
    return number;
}
}  // namespace

double CornerArray::at(std::size_t index, int axis) const
{
    const unsigned char* from = first + static_cast<std::ptrdiff_t>(index) * rowStride + axis * axisStride;
    return isDouble ? readUnaligned<double>(from) : static_cast<double>(readUnaligned<float>(from));
}

Aabb BoxArray::at(std::size_t index) const
{
    if (m_packed != nullptr)
        return readUnaligned<Aabb>(reinterpret_cast<const unsigned char*>(m_packed) + index * m_stride);
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double min = m_min.at(index, axis), max = m_max.at(index, axis);
        // Rounded, an inverted box could be a thin one.
        if (!(min <= max))
            return kEmptyAabb;
        box.min[axis] = roundDownToFloat(min);
        box.max[axis] = roundUpToFloat(max);
    }
    return box;
}

BoxSet::BoxSet(std::unique_ptr<Backend> backend, int threads, float margin, std::uint32_t firstId)
    : m_backend(std::move(backend)), m_threads(threads), m_margin(margin), m_nextId(firstId)
{
}

bool BoxSet::add(const BoxArray& boxes, std::uint32_t count, std::uint32_t* ids)
{
    require(count <= kMostBoxes - std::min(m_table.size(), kMostBoxes), CULLET_ERROR_ARGUMENT,
            "more than 2^30 boxes");
    require(count <= ~std::uint32_t{0} - m_nextId, CULLET_ERROR_ARGUMENT, "no ids left");
    std::vector<ProxyId> rows;
    rows.reserve(count);
    bool areValid = true;
    try
    {
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const Aabb box = boxes.at(i);
            rows.push_back(m_table.create(box, m_nextId + i, {1, -1}));
            m_directory.insert(m_nextId + i, rows.back());
            areValid = areValid && isValid(box);
        }
    }
    catch (...)
    {
        for (const ProxyId row : rows)
        {
            if (m_directory.find(m_table.uniqueId(row)) == row)
                m_directory.erase(m_table.uniqueId(row));
            m_table.destroy(row);
        }
        m_nextId += count;  // the backend may already know some of the ids
        throw;
    }
    for (std::uint32_t i = 0; i < count; ++i)
        ids[i] = m_nextId++;
    return areValid;
}

void BoxSet::requireIds(const std::uint32_t* ids, std::uint32_t count) const
{
    for (std::uint32_t i = 0; i < count; ++i)
    {
        if (m_directory.find(ids[i]) == UniqueIdMap::kNoRow)
            throw Failure{CULLET_ERROR_ID, "no box with id " + std::to_string(ids[i])};
    }
}

bool BoxSet::move(const std::uint32_t* ids, const BoxArray& boxes, std::uint32_t count)
{
    requireIds(ids, count);
    bool areValid = true;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const Aabb box = boxes.at(i);
        const ProxyId row = m_directory.find(ids[i]);
        areValid = areValid && isValid(box);
        if (std::memcmp(&box, &m_table.box(row), sizeof(box)) != 0)
            m_table.setBox(row, box);
    }
    return areValid;
}

void BoxSet::setFilters(const std::uint32_t* ids, const cullet_filter* filters, std::uint32_t count)
{
    requireIds(ids, count);
    for (std::uint32_t i = 0; i < count; ++i)
        m_table.setFilter(m_directory.find(ids[i]), {filters[i].group, filters[i].mask});
}

void BoxSet::remove(const std::uint32_t* ids, std::uint32_t count)
{
    requireIds(ids, count);
    std::vector<std::uint32_t> sorted(ids, ids + count);
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end())
        throw Failure{CULLET_ERROR_ID, "id " + std::to_string(*twice) + " is named twice"};
    for (const std::uint32_t id : sorted)
    {
        m_table.destroy(m_directory.find(id));
        m_directory.erase(id);
    }
}

Status BoxSet::tryUpdate()
{
    return m_backend->update(m_table.beginUpdate(m_margin, true), m_delta);
}

void BoxSet::runBackend()
{
    Status status = tryUpdate();
    if (status != Status::Ok)
    {
        log(LogLevel::Warning, "a backend failed; the grid on the CPU goes on");
        GridOptions options;
        options.threads = m_threads;
        m_backend = makeGridBackend(options);
        m_backend->restart(m_pairs);
        ++m_fallbacks;
        status = tryUpdate();
    }
    if (status != Status::Ok)
        throw Failure{CULLET_ERROR_MEMORY, "out of memory in an update"};
}

void BoxSet::update()
{
    if (m_needsRestart)
        m_backend->restart(m_pairs);
    // Cleared at the end: after an exception the backend may hold pairs that m_pairs lacks. The table keeps its
    // changes, so that the next update finds everything that this one would have found.
    m_needsRestart = true;
    runBackend();
    reserveForDelta();
    m_table.endUpdate();
    applyDelta();
    m_needsRestart = false;
}

void BoxSet::reserveForDelta()
{
    if (m_delta.added.empty() && m_delta.removed.empty())
        return;
    m_merged.clear();
    m_merged.reserve(m_pairs.size() + m_delta.added.size());
}

/// Two passes over sorted arrays, cheap beside the tests that found the pairs. @pre reserveForDelta()
void BoxSet::applyDelta() noexcept
{
    if (m_delta.added.empty() && m_delta.removed.empty())
        return;
    const auto& [added, removed] = m_delta;
    m_pairs.erase(
        std::set_difference(m_pairs.begin(), m_pairs.end(), removed.begin(), removed.end(), m_pairs.begin()),
        m_pairs.end());
    std::merge(m_pairs.begin(), m_pairs.end(), added.begin(), added.end(), std::back_inserter(m_merged));
    m_pairs.swap(m_merged);
}

void BoxSet::fill(cullet_box_set_stats& stats) const
{
    stats.boxes = m_table.liveCount();
    stats.pairs = m_pairs.size();
    stats.fallbacks = m_fallbacks;
    stats.bytes = m_table.bytes() + m_directory.bytes() + m_backend->stats().bytes +
                  (m_pairs.capacity() + m_merged.capacity()) * sizeof(Pair);
    stats.backend = m_backend->name();
}
}  // namespace cullet::abi
