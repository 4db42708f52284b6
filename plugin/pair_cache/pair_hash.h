// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/huge_vector.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#ifdef __SSE2__
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Hash value of a pair of ids, over all 64 bits of the pair.
///
/// ID1*p1 + ID2*p2 of Lesson 04 (docs/references.md) with odd 64-bit multipliers, then one xorshift-multiply round,
/// because the sum alone keeps the regularity of consecutive ids. The upper half selects the block, the lower the tag.
inline std::uint64_t hashOfPair(Pair ids) noexcept
{
    const std::uint64_t sum = ids.first * 0x9e3779b97f4a7c15u + ids.second * 0xc2b2ae3d27d4eb4fu;
    const std::uint64_t mixed = (sum ^ sum >> 32) * 0xd6e8feb86659fd93u;
    return mixed ^ mixed >> 32;
}

/// Open-addressing hash from pairs to their indices in an array; the caller supplies hash values and compares pairs
/// whose tags are equal.
///
/// A block is one cache line: ten indices, ten 16-bit tags (part of the hash value, compared all at once) and the
/// number of entries that overflowed to a later block because this one was full. A search ends at the first block
/// without overflow, almost always its first: one cache line, no unpredictable branch, and no access to a pair unless
/// the tag matches. Removing an entry decrements the counts it caused, so there are no tombstones.
/// Source of the layout: Bronson and Shi 2019, "Open-sourcing F14 for faster, more memory-efficient hash tables".
///
/// Load: at most 0.7, after growing at least 0.46: 9 to 14 bytes per entry. It never shrinks.
/// Threads: const methods may run concurrently.
class PairHash
{
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// The index with `matches(index)`, tested for those with this hash value (and rarely some others); or kNone.
    template <class Matches>
    std::uint32_t find(std::uint64_t hash, Matches matches) const
    {
        const Place place = locate(hash, matches);
        return place.slot >= 0 ? m_blocks[place.block].indices[place.slot] : kNone;
    }

    /// Prefetches the block in which a search begins.
    [[gnu::always_inline]] void prefetch(std::uint64_t hash) const noexcept
    {
        __builtin_prefetch(&m_blocks[homeBlock(hash)]);
    }

    /// The probable result of find(), from one block only; or kNone.
    std::uint32_t guess(std::uint64_t hash) const noexcept
    {
        const Block& block = m_blocks[homeBlock(hash)];
        const unsigned slots = block.slotsWith(tagOf(hash));
        return slots != 0 ? block.indices[__builtin_ctz(slots)] : kNone;
    }

    /// Changes the index of an entry. @pre there is an entry (hash, from)
    void replace(std::uint64_t hash, std::uint32_t from, std::uint32_t to) noexcept
    {
        const Place place = placeOf(hash, from);
        m_blocks[place.block].indices[place.slot] = to;
    }

    bool hasRoom() const noexcept { return m_count < m_limit; }
    std::size_t limit() const noexcept { return m_limit; }  ///< entries that fit without growing

    /// Makes room for `count` entries in all by moving the entries to a larger table: the first size() indices for
    /// which `isEntry(index)` is true, with the hash values `hashOf(index)`. May throw std::bad_alloc and then changes
    /// nothing.
    template <class HashOf, class IsEntry>
    void grow(std::size_t count, HashOf hashOf, IsEntry isEntry)
    {
        HugeVector<Block> blocks(count / kLimitPerBlock + 1);
        m_blocks.swap(blocks);
        m_limit = m_blocks.size() * kLimitPerBlock;
        ++m_rehashes;
        const auto entries = static_cast<std::uint32_t>(m_count);
        m_count = 0;
        for (std::uint32_t index = 0; m_count < entries; ++index)
        {
            if (isEntry(index))
                insert(hashOf(index), index);
        }
    }

    /// @pre hasRoom(); the pair is not in the table
    void insert(std::uint64_t hash, std::uint32_t index) noexcept
    {
        std::size_t block = homeBlock(hash);
        unsigned free = m_blocks[block].slotsWith(0);
        for (; free == 0; free = m_blocks[block].slotsWith(0))
        {
            ++m_blocks[block].overflowCount;
            block = nextBlock(block);
        }
        const int slot = __builtin_ctz(free);
        m_blocks[block].tags[slot] = tagOf(hash);
        m_blocks[block].indices[slot] = index;
        ++m_count;
    }

    /// @pre there is an entry (hash, index)
    void erase(std::uint64_t hash, std::uint32_t index) noexcept
    {
        const Place place = placeOf(hash, index);
        m_blocks[place.block].tags[place.slot] = 0;
        for (std::size_t block = homeBlock(hash); block != place.block; block = nextBlock(block))
        {
            --m_blocks[block].overflowCount;
        }
        --m_count;
    }

    void clear() noexcept
    {
        std::fill(m_blocks.begin(), m_blocks.end(), Block());
        m_count = 0;
    }

    /// Number of blocks that a search for the entry reads. @pre there is an entry (hash, index)
    std::size_t probesOf(std::uint64_t hash, std::uint32_t index) const noexcept
    {
        const std::size_t block = placeOf(hash, index).block;
        return (block + m_blocks.size() - homeBlock(hash)) % m_blocks.size() + 1;
    }

    /// Sum of all overflow counts, which is the sum of probesOf() - 1 over all entries. O(blocks).
    std::uint64_t totalOverflowCount() const noexcept
    {
        std::uint64_t count = 0;
        for (const Block& block : m_blocks)
            count += block.overflowCount;
        return count;
    }

    std::size_t size() const noexcept { return m_count; }
    std::size_t slotCount() const noexcept { return m_blocks.size() * kSlots; }
    std::uint64_t rehashes() const noexcept { return m_rehashes; }
    std::uint64_t bytes() const noexcept { return m_blocks.capacity() * sizeof(Block); }

private:
    static constexpr int kSlots = 10;
    static constexpr std::size_t kLimitPerBlock = 7;

    struct alignas(64) Block
    {
        std::uint16_t tags[kSlots];  // 0: the slot is free
        std::uint32_t
            overflowCount;  // entries in later blocks that this block would hold if it had not been full
        std::uint32_t indices[kSlots];

        /// Bit i: tags[i] == tag.
        unsigned slotsWith(std::uint16_t tag) const noexcept
        {
#ifdef __SSE2__
            // The second half extends beyond the tags into the rest of the block; the mask removes those lanes.
            const auto* halves = reinterpret_cast<const __m128i*>(this);
            const __m128i wanted = _mm_set1_epi16(static_cast<short>(tag));
            const __m128i first = _mm_cmpeq_epi16(_mm_load_si128(halves), wanted);
            const __m128i second = _mm_cmpeq_epi16(_mm_load_si128(halves + 1), wanted);
            return static_cast<unsigned>(_mm_movemask_epi8(_mm_packs_epi16(first, second))) &
                   ((1u << kSlots) - 1);
#elif defined(__aarch64__)
            constexpr uint16x8_t kWeights = {1, 2, 4, 8, 16, 32, 64, 128};
            const uint16x8_t first = vceqq_u16(vld1q_u16(tags), vdupq_n_u16(tag));
            return vaddvq_u16(vandq_u16(first, kWeights)) | static_cast<unsigned>(tags[8] == tag) << 8 |
                   static_cast<unsigned>(tags[9] == tag) << 9;
#else
            unsigned bits = 0;
            for (int slot = 0; slot < kSlots; ++slot)
                bits |= static_cast<unsigned>(tags[slot] == tag) << slot;
            return bits;
#endif
        }
    };
    static_assert(sizeof(Block) == 64, "a block is one cache line");

    struct Place
    {
        std::size_t block;
        int slot;  // -1: nowhere
    };

    static std::uint16_t tagOf(std::uint64_t hash) noexcept
    {
        const auto tag = static_cast<std::uint16_t>(hash);
        return tag != 0 ? tag : 1;
    }

    std::size_t homeBlock(std::uint64_t hash) const noexcept
    {
        return (hash >> 32) * m_blocks.size() >> 32;
    }
    std::size_t nextBlock(std::size_t block) const noexcept
    {
        return block + 1 < m_blocks.size() ? block + 1 : 0;
    }

    template <class Matches>
    Place locate(std::uint64_t hash, Matches matches) const
    {
        std::size_t at = homeBlock(hash);
        // At most once around the table: in a small one every block may have overflowed.
        for (std::size_t probed = 0; probed < m_blocks.size(); ++probed, at = nextBlock(at))
        {
            const Block& block = m_blocks[at];
            for (unsigned slots = block.slotsWith(tagOf(hash)); slots != 0; slots &= slots - 1)
            {
                const int slot = __builtin_ctz(slots);
                if (matches(block.indices[slot]))
                    return {at, slot};
            }
            if (block.overflowCount == 0)
                break;
        }
        return {0, -1};
    }

    Place placeOf(std::uint64_t hash, std::uint32_t index) const noexcept
    {
        return locate(hash, [index](std::uint32_t other) { return other == index; });
    }

    HugeVector<Block> m_blocks = HugeVector<Block>(1);
    std::size_t m_limit = 0;  // entries that the maximum load allows
    std::size_t m_count = 0;
    std::uint64_t m_rehashes = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
