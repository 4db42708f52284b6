// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"

#include <array>
#include <cstdint>
#include <utility>

namespace cullet
{
/// Maps unique ids, which only grow, to table rows.
///
/// Ids are stored in pages of 1,024. A page without live ids is freed, so that memory is proportional to the live ids:
/// 4 bytes per id of a page in use, 8 bytes per 1,024 ids ever allocated. A search costs two loads.
class UniqueIdMap
{
public:
    static constexpr std::uint32_t kNoRow = ~std::uint32_t{0};

    UniqueIdMap() = default;
    ~UniqueIdMap() { freePages(); }
    UniqueIdMap(const UniqueIdMap&) = delete;
    UniqueIdMap& operator=(const UniqueIdMap&) = delete;
    UniqueIdMap(UniqueIdMap&& other) noexcept : m_pages(std::move(other.m_pages)) {}
    UniqueIdMap& operator=(UniqueIdMap&& other) noexcept
    {
        m_pages.swap(other.m_pages);
        return *this;
    }

    std::uint32_t find(std::uint32_t uniqueId) const noexcept
    {
        const std::uint32_t page = uniqueId >> kPageShift;
        if (page >= m_pages.size() || m_pages[page] == nullptr)
            return kNoRow;
        return m_pages[page]->rows[uniqueId & kPageMask];
    }

    /// Prefetches what find() reads. The list of pages is small enough to be cached.
    [[gnu::always_inline]] void prefetch(std::uint32_t uniqueId) const noexcept
    {
        const std::uint32_t page = uniqueId >> kPageShift;
        if (page < m_pages.size() && m_pages[page] != nullptr)
            __builtin_prefetch(&m_pages[page]->rows[uniqueId & kPageMask]);
    }

    /// @pre the id is not in the map
    void insert(std::uint32_t uniqueId, std::uint32_t row)
    {
        const std::uint32_t page = uniqueId >> kPageShift;
        if (page >= m_pages.size())
            m_pages.resize(page + 1);
        if (m_pages[page] == nullptr)
            m_pages[page] = new Page;
        m_pages[page]->rows[uniqueId & kPageMask] = row;
        ++m_pages[page]->liveCount;
    }

    /// @pre the id is in the map
    void erase(std::uint32_t uniqueId) noexcept
    {
        Page*& page = m_pages[uniqueId >> kPageShift];
        page->rows[uniqueId & kPageMask] = kNoRow;
        if (--page->liveCount == 0)
            delete std::exchange(page, nullptr);
    }

    void clear() noexcept
    {
        freePages();
        Array<Page*>().swap(m_pages);
    }

    std::uint64_t bytes() const noexcept
    {
        std::uint64_t pageCount = 0;
        for (const Page* page : m_pages)
            pageCount += page != nullptr;
        return m_pages.capacity() * sizeof(m_pages[0]) + pageCount * sizeof(Page);
    }

private:
    static constexpr std::uint32_t kPageShift = 10;
    static constexpr std::uint32_t kPageMask = (1u << kPageShift) - 1;

    struct Page
    {
        Page() noexcept { rows.fill(kNoRow); }
        std::uint32_t liveCount = 0;
        std::array<std::uint32_t, 1u << kPageShift> rows;
    };

    void freePages() noexcept
    {
        for (Page* page : m_pages)
            delete page;
    }

    Array<Page*> m_pages;  ///< owned
};
}  // namespace cullet
