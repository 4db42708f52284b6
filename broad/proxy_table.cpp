// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"

#include "cullet/base/trim_capacity.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/limits.h"

#include <algorithm>
#include <array>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace cullet
{
namespace
{
// How many rows ahead boxes are prefetched.
constexpr std::size_t kRowsAhead = 16;
// Share of rows, one in so many, up to which the processor does not predict the order in which boxes are read.
constexpr std::size_t kFewShare = 4;

constexpr std::uint32_t kGroup = 64;

/// Returns a bit for each of 64 bytes: whether it is not zero.
///
/// @param any [in, out] receives the bitwise or of all bytes
std::uint64_t bitsOfSetBytes(const std::uint8_t* bytes, std::uint8_t& any)
{
    std::uint64_t bits = 0;
#if defined(__SSE2__)
    __m128i all = _mm_setzero_si128();
    for (std::uint32_t i = 0; i < kGroup; i += 16)
    {
        const __m128i sixteen = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + i));
        const int clean = _mm_movemask_epi8(_mm_cmpeq_epi8(sixteen, _mm_setzero_si128()));
        bits |= static_cast<std::uint64_t>(~clean & 0xffff) << i;
        all = _mm_or_si128(all, sixteen);
    }
    all = _mm_or_si128(all, _mm_srli_si128(all, 8));
    all = _mm_or_si128(all, _mm_srli_si128(all, 4));
    all = _mm_or_si128(all, _mm_srli_si128(all, 2));
    all = _mm_or_si128(all, _mm_srli_si128(all, 1));
    any = static_cast<std::uint8_t>(any | _mm_cvtsi128_si32(all));
#elif defined(__aarch64__)
    constexpr uint8x16_t kWeights = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    uint8x16_t sixteen[4];
    uint8x16_t set[4];
    for (int i = 0; i < 4; ++i)
    {
        sixteen[i] = vld1q_u8(bytes + 16 * i);
        set[i] = vandq_u8(vtstq_u8(sixteen[i], sixteen[i]), kWeights);
    }
    // Sums of neighbours: after three of them a byte has the bits of eight.
    const uint8x16_t sums = vpaddq_u8(vpaddq_u8(set[0], set[1]), vpaddq_u8(set[2], set[3]));
    bits = vgetq_lane_u64(vreinterpretq_u64_u8(vpaddq_u8(sums, sums)), 0);
    const uint64x2_t halves =
        vreinterpretq_u64_u8(vorrq_u8(vorrq_u8(sixteen[0], sixteen[1]), vorrq_u8(sixteen[2], sixteen[3])));
    std::uint64_t all = vgetq_lane_u64(halves, 0) | vgetq_lane_u64(halves, 1);
    all |= all >> 32;
    all |= all >> 16;
    all |= all >> 8;
    any = static_cast<std::uint8_t>(any | all);
#else
    for (std::uint32_t i = 0; i < kGroup; ++i)
    {
        bits |= static_cast<std::uint64_t>(bytes[i] != 0 ? 1 : 0) << i;
        any = static_cast<std::uint8_t>(any | bytes[i]);
    }
#endif
    return bits;
}

/// Writes the row of every non-zero byte in [begin, end), ascending; returns the end of the output.
std::uint32_t* listSetBytes(const std::uint8_t* bytes, std::uint32_t begin, std::uint32_t end,
                            std::uint32_t* to, std::uint8_t& any)
{
    std::uint32_t row = begin;
    for (; end - row >= kGroup; row += kGroup)
    {
        std::uint64_t set = bitsOfSetBytes(bytes + row, any);
        if (set == ~std::uint64_t{0})
        {
            for (std::uint32_t i = 0; i < kGroup; ++i)
                to[i] = row + i;
            to += kGroup;
            continue;
        }
        for (; set != 0; set &= set - 1)
            *to++ = row + static_cast<std::uint32_t>(__builtin_ctzll(set));
    }
    for (; row < end; ++row)
    {
        any = static_cast<std::uint8_t>(any | bytes[row]);
        if (bytes[row] != 0)
            *to++ = row;
    }
    return to;
}
}  // namespace

void ProxyTable::unmarkBlock(std::uint32_t block, std::uint8_t reader) noexcept
{
    const std::uint8_t marks = m_blocks[block].load(std::memory_order_relaxed);
    m_blocks[block].store(static_cast<std::uint8_t>(marks & ~reader), std::memory_order_relaxed);
}

/// Makes m_blocks cover one more row.
void ProxyTable::growBlocks()
{
    const std::uint32_t needed = (size() >> kBlockShift) + 1;
    if (needed <= m_blockCount)
        return;
    auto blocks = std::make_unique<std::atomic<std::uint8_t>[]>(2 * std::size_t{needed});
    // std::atomic cannot be moved, so the blocks are copied one by one.
    for (std::uint32_t i = 0; i < m_blockCount; ++i)
        blocks[i].store(m_blocks[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    m_blocks.swap(blocks);
    m_blockCount = 2 * needed;
}

ProxyId ProxyTable::reserveRow()
{
    if (!m_free.empty())
        return m_free.back();
    const std::uint32_t row = extendableRows(size());
    growCapacity(m_boxes);
    growCapacity(m_uniqueIds);
    growCapacity(m_filters);
    growCapacity(m_changes);
    growCapacity(m_queryChanges);
    growBlocks();
    m_free.reserve(m_boxes.capacity());
    m_quarantine.reserve(m_boxes.capacity());
    return row;
}

ProxyId ProxyTable::create(const Aabb& box, std::uint32_t uniqueId, Filter filter)
{
    const ProxyId row = reserveRow();
    if (row != size())
    {
        m_free.pop_back();
    }
    else
    {
        m_boxes.push_back(kEmptyAabb);
        m_uniqueIds.push_back(0);
        m_filters.push_back({});
        m_changes.push_back(kRowUnchanged);
        m_queryChanges.push_back(0);
    }
    m_boxes[row] = isValid(box) ? box : kEmptyAabb;
    m_uniqueIds[row] = uniqueId;
    m_filters[row] = filter;
    ++m_liveCount;
    mark(row, kRowCreated);
    return row;
}

void ProxyTable::destroy(ProxyId row) noexcept
{
    m_boxes[row] = kEmptyAabb;
    m_quarantine.push_back(row);
    --m_liveCount;
    mark(row, kRowDestroyed);
}

void ProxyTable::setBoxes(const Aabb* boxes, const ProxyId* rows, std::size_t count) noexcept
{
    Aabb* const to = m_boxes.data();
    std::uint8_t* const changes = m_changes.data();
    std::uint8_t* const queryChanges = m_queryChanges.data();
    const bool areFew = count < size() / kFewShare;
    std::uint32_t lastBlock = ~0u;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (areFew)
        {
            const ProxyId ahead = rows[std::min(i + kRowsAhead, count - 1)];
            prefetchBox(boxes + ahead);
            prefetchBox(to + ahead);
            __builtin_prefetch(changes + ahead, 1);
            __builtin_prefetch(queryChanges + ahead, 1);
        }
        const ProxyId row = rows[i];
        const Float4 front = loadFloat4(boxes[row].min);
        const Float4 back = loadFloat4(boxes[row].min + 2);
        if (isTrueInAll((front == loadFloat4(to[row].min)) & (back == loadFloat4(to[row].min + 2))))
            continue;
        const bool isBox =
            isTrueInAll(CULLET_SHUFFLE(front, front, 0, 1, 2, 2) <= CULLET_SHUFFLE(back, back, 1, 2, 3, 3));
        const Aabb& box = isBox ? boxes[row] : kEmptyAabb;
        std::memcpy(&to[row], &box, sizeof box);
        changes[row] = static_cast<std::uint8_t>(changes[row] | kRowMoved);
        queryChanges[row] = 1;
        if (row >> kBlockShift != lastBlock)
        {
            lastBlock = row >> kBlockShift;
            markBlock(lastBlock);
        }
    }
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
    if (m_dirty.size() < size())
        m_dirty.resize(m_boxes.capacity());
    ProxyId* to = m_dirty.data();
    std::uint8_t anyChanges = 0;
    const std::uint32_t rows = hasChanges() ? size() : 0;
    for (std::uint32_t begin = 0; begin < rows; begin += 1u << kBlockShift)
    {
        if (isBlockMarked(begin >> kBlockShift, kBlockForUpdate))
            to = listSetBytes(m_changes.data(), begin, std::min(rows, begin + (1u << kBlockShift)), to,
                              anyChanges);
    }
    m_dirtyCount = static_cast<std::uint32_t>(to - m_dirty.data());
    ProxyView view;
    view.size = size();
    view.boxes = m_boxes.data();
    view.lockableRows = m_boxes.capacity();
    view.uniqueIds = m_uniqueIds.data();
    view.filters = useFilter ? m_filters.data() : nullptr;
    view.changes = m_changes.data();
    view.dirty = m_dirty.data();
    view.dirtyCount = m_dirtyCount;
    view.anyChanges = anyChanges;
    view.lockableDirty = m_dirty.capacity();
    view.margin = margin;
    return view;
}

void ProxyTable::endUpdate() noexcept
{
    // No row has changed; a destroyed one has.
    if (!hasChanges())
        return;
    if (m_dirtyCount == size())
    {
        std::fill(m_changes.begin(), m_changes.end(), std::uint8_t{kRowUnchanged});
    }
    else
    {
        for (std::uint32_t i = 0; i < m_dirtyCount; ++i)
            m_changes[m_dirty[i]] = kRowUnchanged;
    }
    for (std::uint32_t block = 0; block < m_blockCount; ++block)
        unmarkBlock(block, kBlockForUpdate);
    m_hasChanges.store(false, std::memory_order_relaxed);
    for (const ProxyId row : m_quarantine)
        m_uniqueIds[row] = 0;
    m_free.insert(m_free.end(), m_quarantine.begin(), m_quarantine.end());
    m_quarantine.clear();
    m_dirtyCount = 0;
}

void ProxyTable::collectBlock(std::uint32_t block, Array<ProxyId>& rows)
{
    if (!isBlockMarked(block, kBlockForQueries))
        return;
    unmarkBlock(block, kBlockForQueries);
    const std::uint32_t begin = block << kBlockShift;
    std::array<ProxyId, 1u << kBlockShift> changed;
    std::uint8_t any = 0;
    const ProxyId* const end = listSetBytes(
        m_queryChanges.data(), begin, std::min(size(), begin + (1u << kBlockShift)), changed.data(), any);
    rows.insert(rows.end(), static_cast<const ProxyId*>(changed.data()), end);
    for (const ProxyId* row = changed.data(); row != end; ++row)
        m_queryChanges[*row] = 0;
}

void ProxyTable::collectQueryChanges(Array<ProxyId>& rows)
{
    rows.clear();
    const std::uint32_t count = m_queryBlockCount.load(std::memory_order_relaxed);
    if (count <= kFewBlocks)
    {
        std::array<std::uint32_t, kFewBlocks> blocks;
        for (std::uint32_t i = 0; i < count; ++i)
            blocks[i] = m_queryBlocks[i].load(std::memory_order_relaxed);
        std::sort(blocks.begin(), blocks.begin() + count);
        for (std::uint32_t i = 0; i < count; ++i)
            collectBlock(blocks[i], rows);
    }
    else
    {
        for (std::uint32_t block = 0; block << kBlockShift < size(); ++block)
            collectBlock(block, rows);
    }
    // Release: a thread that reads the table as clean also sees what the caller stored before.
    m_queryBlockCount.store(0, std::memory_order_release);
}

void ProxyTable::clear()
{
    m_boxes.clear();
    m_uniqueIds.clear();
    m_filters.clear();
    m_changes.clear();
    m_queryChanges.clear();
    m_blocks.reset();
    m_blockCount = 0;
    m_hasChanges.store(false, std::memory_order_relaxed);
    m_queryBlockCount.store(0, std::memory_order_relaxed);
    m_dirtyCount = 0;
    m_free.clear();
    m_quarantine.clear();
    m_liveCount = 0;
}

std::uint64_t ProxyTable::bytes() const noexcept
{
    return m_boxes.capacity() * sizeof(Aabb) + m_uniqueIds.capacity() * sizeof(std::uint32_t) +
           m_filters.capacity() * sizeof(Filter) + m_changes.capacity() + m_queryChanges.capacity() +
           m_blockCount +
           (m_dirty.capacity() + m_free.capacity() + m_quarantine.capacity()) * sizeof(ProxyId);
}
}  // namespace cullet
