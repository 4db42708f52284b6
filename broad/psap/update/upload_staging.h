// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/prefetch_box.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// Packs changed rows into memory of the CPU for an upload.
///
/// Several threads may pack different rows concurrently.
template <class Exec>
class UploadStaging
{
public:
    /// Properties of a set of changed rows.
    struct Summary
    {
        unsigned anyChanges = kRowUnchanged;  ///< RowChange bits that at least one row has
        unsigned allChanges = 0xffu;          ///< RowChange bits that all rows have
        std::uint32_t largestId = 0;          ///< largest unique id of the created rows

        /// Summary of rows that have moved and not changed otherwise.
        static Summary ofMoved() { return {kRowMoved, kRowMoved, 0}; }

        bool isUniform() const { return anyChanges == allChanges; }
        void add(const Summary& other)
        {
            anyChanges |= other.anyChanges;
            allChanges &= other.allChanges;
            largestId = std::max(largestId, other.largestId);
        }
    };

    void reserve(Exec& exec, std::uint64_t count, bool hasBoxes)
    {
        exec.reserve(m_rows, count);
        exec.reserve(m_changes, count);
        if (hasBoxes)
            exec.reserve(m_boxes, count);
    }

    const std::uint32_t* rows() const { return m_rows.data(); }
    const Aabb* boxes() const { return m_boxes.data(); }
    const std::uint8_t* changes() const { return m_changes.data(); }

    /// Packs rows of the table, all of which have changed.
    ///
    /// @param isFresh the executor has none of the rows yet
    Summary stageTable(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes,
                       bool isFresh)
    {
        if (packsBoxes)
            std::copy(view.boxes + begin, view.boxes + end, m_boxes.data() + begin);
        // Local pointers: the compiler has to assume that a store of a byte changes any member.
        std::uint8_t* changes = m_changes.data();
        const std::uint8_t* from = view.changes;
        const std::uint8_t fresh = isFresh ? kRowCreated : kRowUnchanged;
        // Accumulated in bytes, so that the loop vectorises with as many rows as possible.
        std::uint8_t any = 0;
        std::uint8_t all = 0xff;
        for (std::uint64_t row = begin; row < end; ++row)
        {
            const auto bits = static_cast<std::uint8_t>(from[row] | fresh);
            changes[row] = bits;
            any = static_cast<std::uint8_t>(any | bits);
            all = static_cast<std::uint8_t>(all & bits);
        }
        return withLargestId({any, all, 0}, view, nullptr, begin, end);
    }

    /// Packs the boxes of some of the rows that the dirty list names.
    void stageBoxes(const ProxyView& view, std::uint64_t begin, std::uint64_t end)
    {
        Aabb* boxes = m_boxes.data();
        const ProxyView from = view;
        for (std::uint64_t i = begin; i < end; ++i)
            boxes[i] = prefetchedBox(from, i, end);
    }

    /// Packs some of the rows that the dirty list names, without their boxes.
    Summary stageRows(const ProxyView& view, std::uint64_t begin, std::uint64_t end)
    {
        return stageListed<false>(view, begin, end);
    }
    Summary stageRowsAndBoxes(const ProxyView& view, std::uint64_t begin, std::uint64_t end)
    {
        return stageListed<true>(view, begin, end);
    }

private:
    template <class T>
    using HostMemory = typename Exec::template Staging<T>;

    template <bool kPacksBoxes>
    Summary stageListed(const ProxyView& view, std::uint64_t begin, std::uint64_t end)
    {
        Aabb* boxes = m_boxes.data();
        std::uint8_t* changes = m_changes.data();
        std::uint32_t* rows = m_rows.data();
        const ProxyView from = view;
        unsigned any = 0;
        unsigned all = 0xffu;
        for (std::uint64_t i = begin; i < end; ++i)
        {
            const std::uint32_t row = from.dirty[i];
            rows[i] = row;
            if constexpr (kPacksBoxes)
                boxes[i] = prefetchedBox(from, i, end);
            changes[i] = from.changes[row];
            any |= from.changes[row];
            all &= from.changes[row];
        }
        return withLargestId({any, all, 0}, view, view.dirty, begin, end);
    }

    /// The box of dirty row i. Prefetches the box sixteen rows ahead, which needs one or two cache lines.
    static const Aabb& prefetchedBox(const ProxyView& view, std::uint64_t i, std::uint64_t end)
    {
        prefetchBox(view.boxes + view.dirty[std::min(i + 16, end - 1)]);
        return view.boxes[view.dirty[i]];
    }

    /// @param rows null: 0, 1, 2, ...
    static Summary withLargestId(Summary summary, const ProxyView& view, const std::uint32_t* rows,
                                 std::uint64_t begin, std::uint64_t end)
    {
        if ((summary.anyChanges & kRowCreated) == 0)
            return summary;
        for (std::uint64_t i = begin; i < end; ++i)
            summary.largestId = std::max(summary.largestId, view.uniqueIds[rows != nullptr ? rows[i] : i]);
        return summary;
    }

    HostMemory<std::uint32_t> m_rows;
    HostMemory<Aabb> m_boxes;
    HostMemory<std::uint8_t> m_changes;
};
}  // namespace cullet::psap
