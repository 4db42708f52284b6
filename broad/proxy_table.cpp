// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/proxy_table.h"

#include <algorithm>
#include <cstring>

namespace cullet
{
namespace
{
/// Calls visit(row) for every non-zero byte in [begin, end), ascending; eight clean rows cost one load.
template <class Visit>
void forEachSetByte(const std::uint8_t* bytes, std::uint32_t begin, std::uint32_t end, Visit visit)
{
    for (std::uint32_t row = begin; row < end;)
    {
        std::uint64_t word = 0;
        const std::uint32_t width = std::min<std::uint32_t>(8, end - row);
        std::memcpy(&word, bytes + row, width);
        if (word != 0)
        {
            for (std::uint32_t i = 0; i < width; ++i)
            {
                if (bytes[row + i] != 0)
                    visit(row + i);
            }
        }
        row += width;
    }
}
}  // namespace

void ProxyTable::mark(ProxyId row, std::uint8_t bits) noexcept
{
    m_changes[row] = static_cast<std::uint8_t>(m_changes[row] | bits);
    m_queryChanges[row] = 1;
    // Blocks are shared between rows, hence atomics; relaxed, because update and query start after all setBox() calls.
    const std::uint32_t block = row >> kBlockShift;
    if (m_dirtyBlocks[block].load(std::memory_order_relaxed) == 0)
        m_dirtyBlocks[block].store(1, std::memory_order_relaxed);
    if (m_queryBlocks[block].load(std::memory_order_relaxed) == 0)
        m_queryBlocks[block].store(1, std::memory_order_relaxed);
    if (!m_queryDirty.load(std::memory_order_relaxed))
        m_queryDirty.store(true, std::memory_order_relaxed);
}

void ProxyTable::growBlocks()
{
    const std::size_t needed = (m_boxes.size() >> kBlockShift) + 1;
    if (needed <= m_dirtyBlocks.size())
        return;
    // std::atomic does not move, so the blocks are copied by hand.
    std::vector<std::atomic<std::uint8_t>> dirty(needed * 2);
    std::vector<std::atomic<std::uint8_t>> query(needed * 2);
    for (std::size_t i = 0; i < m_dirtyBlocks.size(); ++i)
    {
        dirty[i].store(m_dirtyBlocks[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
        query[i].store(m_queryBlocks[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    }
    m_dirtyBlocks.swap(dirty);
    m_queryBlocks.swap(query);
}

ProxyId ProxyTable::create(const Aabb& box, std::uint32_t uniqueId, Filter filter)
{
    ProxyId row = 0;
    if (!m_free.empty())
    {
        row = m_free.back();
        m_free.pop_back();
    }
    else
    {
        row = size();
        m_boxes.push_back(kEmptyAabb);
        m_uniqueIds.push_back(0);
        m_filters.push_back({});
        m_changes.push_back(kRowUnchanged);
        m_queryChanges.push_back(0);
        growBlocks();
    }
    m_boxes[row] = isValid(box) ? box : kEmptyAabb;
    m_uniqueIds[row] = uniqueId;
    m_filters[row] = filter;
    ++m_liveCount;
    mark(row, kRowCreated);
    return row;
}

void ProxyTable::destroy(ProxyId row)
{
    m_boxes[row] = kEmptyAabb;
    m_quarantine.push_back(row);
    --m_liveCount;
    mark(row, kRowDestroyed);
}

void ProxyTable::setBox(ProxyId row, const Aabb& box) noexcept
{
    m_boxes[row] = isValid(box) ? box : kEmptyAabb;
    mark(row, kRowMoved);
}

void ProxyTable::setFilter(ProxyId row, Filter filter) noexcept
{
    if (m_filters[row].group == filter.group && m_filters[row].mask == filter.mask)
        return;
    m_filters[row] = filter;
    mark(row, kRowRefiltered);
}

ProxyView ProxyTable::beginUpdate(float margin, bool useFilter)
{
    m_dirty.clear();
    for (std::uint32_t begin = 0; begin < size(); begin += 1u << kBlockShift)
    {
        if (m_dirtyBlocks[begin >> kBlockShift].load(std::memory_order_relaxed) == 0)
            continue;
        forEachSetByte(m_changes.data(), begin, std::min(size(), begin + (1u << kBlockShift)),
                       [this](std::uint32_t row) { m_dirty.push_back(row); });
    }
    ProxyView view;
    view.size = size();
    view.boxes = m_boxes.data();
    view.uniqueIds = m_uniqueIds.data();
    view.filters = useFilter ? m_filters.data() : nullptr;
    view.changes = m_changes.data();
    view.dirty = m_dirty.data();
    view.dirtyCount = static_cast<std::uint32_t>(m_dirty.size());
    view.margin = margin;
    return view;
}

void ProxyTable::endUpdate()
{
    for (const ProxyId row : m_dirty)
        m_changes[row] = kRowUnchanged;
    for (auto& block : m_dirtyBlocks)
        block.store(0, std::memory_order_relaxed);
    for (const ProxyId row : m_quarantine)
        m_uniqueIds[row] = 0;
    m_free.insert(m_free.end(), m_quarantine.begin(), m_quarantine.end());
    m_quarantine.clear();
    m_dirty.clear();
}

void ProxyTable::collectQueryChanges(std::vector<ProxyId>& rows)
{
    rows.clear();
    for (std::uint32_t begin = 0; begin < size(); begin += 1u << kBlockShift)
    {
        const std::uint32_t block = begin >> kBlockShift;
        if (m_queryBlocks[block].load(std::memory_order_relaxed) == 0)
            continue;
        m_queryBlocks[block].store(0, std::memory_order_relaxed);
        forEachSetByte(m_queryChanges.data(), begin, std::min(size(), begin + (1u << kBlockShift)),
                       [&](std::uint32_t row)
                       {
                           rows.push_back(row);
                           m_queryChanges[row] = 0;
                       });
    }
    // Released, so that whoever sees the table clean also sees what was made of the changes.
    m_queryDirty.store(false, std::memory_order_release);
}

void ProxyTable::clear()
{
    m_boxes.clear();
    m_uniqueIds.clear();
    m_filters.clear();
    m_changes.clear();
    m_queryChanges.clear();
    m_dirtyBlocks.clear();
    m_queryBlocks.clear();
    m_queryDirty.store(false, std::memory_order_relaxed);
    m_dirty.clear();
    m_free.clear();
    m_quarantine.clear();
    m_liveCount = 0;
}

std::uint64_t ProxyTable::bytes() const noexcept
{
    return m_boxes.capacity() * sizeof(Aabb) + m_uniqueIds.capacity() * sizeof(std::uint32_t) +
           m_filters.capacity() * sizeof(Filter) + m_changes.capacity() + m_queryChanges.capacity() +
           m_dirtyBlocks.size() + m_queryBlocks.size() +
           (m_dirty.capacity() + m_free.capacity() + m_quarantine.capacity()) * sizeof(ProxyId);
}
}  // namespace cullet
