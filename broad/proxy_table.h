// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/api.h"
#include "cullet/broad/array.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/box_memory.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
using ProxyId = std::uint32_t;

/// The authoritative table of all boxes: float boxes, unique ids, filter words and changes since the last update.
///
/// A row (ProxyId) never moves while its proxy lives. A destroyed row keeps its unique id and an empty box until
/// endUpdate(), because backends still hold its pairs; only then may the row be reused for another proxy.
///
/// Two independent readers collect the changes: the pair backend (beginUpdate / endUpdate) and the query index
/// (collectQueryChanges). Marking a row costs two byte stores.
///
/// Threads: setBox() and setBoxes() of *different* rows may run concurrently; everything else is for one thread at a
/// time.
class CULLET_API ProxyTable
{
public:
    /// Returns the row of the next create(), which then throws nothing. May throw std::bad_alloc and then changes
    /// nothing. Amortised O(1).
    ProxyId reserveRow();

    /// Adds a row. May throw std::bad_alloc and then changes nothing. Amortised O(1).
    ProxyId create(const Aabb& box, std::uint32_t uniqueId, Filter filter);

    /// Empties the row; it stays quarantined until endUpdate(). O(1).
    void destroy(ProxyId row) noexcept;

    /// Stores a box and marks the row as moved. Any box is legal; an inverted one or one with a NaN counts as empty.
    /// O(1), no allocation.
    void setBox(ProxyId row, const Aabb& box) noexcept { setValidBox(row, isValid(box) ? box : kEmptyAabb); }

    /// setBox() of a valid box, or of kEmptyAabb.
    void setValidBox(ProxyId row, const Aabb& box) noexcept
    {
        m_boxes[row] = box;
        mark(row, kRowMoved);
    }

    /// Sets the boxes of many rows; rows with unchanged boxes are not marked. O(count), no allocation. As with
    /// setBox(), several threads may set different rows.
    ///
    /// @param boxes row -> box
    /// @param rows  [count] each once
    void setBoxes(const Aabb* boxes, const ProxyId* rows, std::size_t count) noexcept;

    /// Stores filter words and marks the row as refiltered if they differ. O(1).
    void setFilter(ProxyId row, Filter filter) noexcept;

    std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(m_boxes.size()); }
    std::uint32_t liveCount() const noexcept { return m_liveCount; }
    const Aabb* boxes() const noexcept { return m_boxes.data(); }
    const Aabb& box(ProxyId row) const noexcept { return m_boxes[row]; }
    std::uint32_t uniqueId(ProxyId row) const noexcept { return m_uniqueIds[row]; }
    Filter filter(ProxyId row) const noexcept { return m_filters[row]; }
    std::uint8_t changes(ProxyId row) const noexcept { return m_changes[row]; }

    /// Collects the rows changed since endUpdate(), ascending. O(size / 128 + changed blocks).
    ///
    /// @param margin    copied into the view
    /// @param useFilter whether the backend may drop pairs by group and mask (false while a filter callback decides)
    ProxyView beginUpdate(float margin, bool useFilter);

    /// Clears the changes and frees the quarantined rows. To be called after every backend has read the view.
    void endUpdate() noexcept;

    /// Clears the changes without an update. @pre at most 128 rows, which have moved only
    void forgetMoves() noexcept
    {
        for (std::uint8_t& changes : m_changes)
            changes = kRowUnchanged;
        unmarkBlock(0, kBlockForUpdate);
        m_hasChanges.store(false, std::memory_order_relaxed);
    }

    /// True when a row changed since endUpdate(); safe to read while setBox() runs elsewhere.
    bool hasChanges() const noexcept { return m_hasChanges.load(std::memory_order_relaxed); }

    /// True when a row changed since the last collectQueryChanges(); safe to read while setBox() runs elsewhere.
    bool hasQueryChanges() const noexcept { return m_queryBlockCount.load(std::memory_order_acquire) != 0; }

    /// Moves the rows changed since the last call into `rows` (ascending, each once).
    ///
    /// Cost: 128 bytes read for each block of 128 rows with a change; with more than 64 such blocks, O(size / 128) too.
    void collectQueryChanges(Array<ProxyId>& rows);

    /// Removes all rows and changes: the table is as new.
    void clear();

    std::uint64_t bytes() const noexcept;

private:
    static constexpr std::uint32_t kBlockShift = 7;  // 128 rows share one byte of marks

    static constexpr std::uint32_t kFewBlocks = 64;  // listed for queries; if more changed, all are read

    static constexpr std::uint8_t kBlockForUpdate = 1;
    static constexpr std::uint8_t kBlockForQueries = 2;

    void mark(ProxyId row, std::uint8_t bits) noexcept
    {
        m_changes[row] = static_cast<std::uint8_t>(m_changes[row] | bits);
        m_queryChanges[row] = 1;
        markBlock(row >> kBlockShift);
    }

    /// Blocks are shared between rows, hence atomics; relaxed, because readers start after all setBox() calls.
    void markBlock(std::uint32_t index) noexcept
    {
        std::atomic<std::uint8_t>& block = m_blocks[index];
        constexpr std::uint8_t kBoth = kBlockForUpdate | kBlockForQueries;
        const std::uint8_t marks = block.load(std::memory_order_relaxed);
        if (marks == kBoth)
            return;
        const bool isNewlyMarked = (marks & kBlockForQueries) == 0;
        block.store(kBoth, std::memory_order_relaxed);
        // Read first, as in listForQueries().
        if (!hasChanges())
            m_hasChanges.store(true, std::memory_order_relaxed);
        if (isNewlyMarked)
            listForQueries(index);
    }

    /// Two threads that mark a block at the same time may list it twice; it is collected once.
    void listForQueries(std::uint32_t index) noexcept
    {
        // Read first: an unconditional addition would take the cache line from other threads for each block.
        if (m_queryBlockCount.load(std::memory_order_relaxed) > kFewBlocks)
            return;
        const std::uint32_t at = m_queryBlockCount.fetch_add(1, std::memory_order_relaxed);
        if (at < kFewBlocks)
            m_queryBlocks[at].store(index, std::memory_order_relaxed);
    }

    bool isBlockMarked(std::uint32_t block, std::uint8_t reader) const noexcept
    {
        return (m_blocks[block].load(std::memory_order_relaxed) & reader) != 0;
    }
    void unmarkBlock(std::uint32_t block, std::uint8_t reader) noexcept;
    void growBlocks();
    void collectBlock(std::uint32_t block, Array<ProxyId>& rows);

    Array<Aabb, BoxAllocator<Aabb>> m_boxes;
    Array<std::uint32_t> m_uniqueIds;
    Array<Filter> m_filters;
    Array<std::uint8_t> m_changes;
    Array<std::uint8_t> m_queryChanges;
    /// For each 128 rows, the readers that have not collected their changes.
    std::unique_ptr<std::atomic<std::uint8_t>[]> m_blocks;
    std::uint32_t m_blockCount = 0;
    std::atomic<bool> m_hasChanges{false};            // a block is marked for the update
    std::atomic<std::uint32_t> m_queryBlockCount{0};  // blocks listed; above kFewBlocks, some are not listed
    std::array<std::atomic<std::uint32_t>, kFewBlocks> m_queryBlocks{};
    Array<ProxyId, BoxAllocator<ProxyId>> m_dirty;  // size for all rows, of which m_dirtyCount are in use
    std::uint32_t m_dirtyCount = 0;
    // Both have capacity for all rows, so that neither destroy() nor endUpdate() allocates.
    Array<ProxyId> m_free;
    Array<ProxyId> m_quarantine;
    std::uint32_t m_liveCount = 0;
};
}  // namespace cullet
