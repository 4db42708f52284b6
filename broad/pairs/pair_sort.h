// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/bytes_of.h"
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/pairs/pair_keys.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Keys of pairs (pairKey(), rowKey()) from one thread, in any order.
class alignas(64) KeyList
{
public:
    void clear()
    {
        m_count = 0;
        m_measured = 0;
        m_lowest = ~std::uint64_t{0};
        m_highest = 0;
        m_isSorted = true;
    }

    /// Reserves memory for `count` calls of pushIf().
    void makeRoom(std::size_t count)
    {
        if (m_count + count < m_keys.size())
            return;
        const std::size_t room = 2 * m_keys.size() + count + 64;
        m_keys.resizeForOverwrite(m_count);  // moves no others
        m_keys.resizeForOverwrite(room);
    }

    /// Appends the key if `isWanted`, without a branch: the key is written in any case.
    void pushIf(std::uint64_t key, bool isWanted)
    {
        m_keys[m_count] = key;
        m_count += isWanted ? 1u : 0u;
    }

    /// Updates lowest(), highest() and isSorted() by the keys added since the last call. PairSort calls it; the thread
    /// that added the keys may call it earlier, while they are in its cache.
    void measure()
    {
        std::uint64_t lowest = m_lowest;
        std::uint64_t highest = m_highest;
        bool isSorted = m_isSorted;
        for (std::size_t i = m_measured; i < m_count; ++i)
        {
            const std::uint64_t key = m_keys[i];
            isSorted &= key > highest;
            lowest = std::min(lowest, key);
            highest = std::max(highest, key);
        }
        m_measured = m_count;
        m_lowest = lowest;
        m_highest = highest;
        m_isSorted = isSorted;
    }

    void push(std::uint64_t key)
    {
        makeRoom(1);
        pushIf(key, true);
    }

    /// Appends keys and keeps the end in a local pointer: a count in memory would be reloaded after each key.
    class Writer
    {
    public:
        /// @param most keys to append at most; the list must not be used while the writer lives
        Writer(KeyList& list, std::size_t most) : m_list(list)
        {
            list.makeRoom(most);
            m_to = list.m_keys.data() + list.m_count;
        }
        ~Writer() { m_list.m_count = static_cast<std::size_t>(m_to - m_list.m_keys.data()); }
        Writer(const Writer&) = delete;
        Writer& operator=(const Writer&) = delete;

        void pushIf(std::uint64_t key, bool isWanted)
        {
            *m_to = key;
            m_to += isWanted ? 1 : 0;
        }

    private:
        KeyList& m_list;
        std::uint64_t* m_to;
    };

    const std::uint64_t* begin() const { return m_keys.data(); }
    const std::uint64_t* end() const { return m_keys.data() + m_count; }
    std::size_t size() const { return m_count; }
    // Of the keys up to the last call of measure():
    std::uint64_t lowest() const { return m_lowest; }    ///< without keys: the largest number
    std::uint64_t highest() const { return m_highest; }  ///< without keys: 0
    bool isSorted() const { return m_isSorted; }         ///< ascending, unique

    /// Frees the memory if little of it is used.
    void trim();
    std::uint64_t bytes() const { return m_keys.capacity() * sizeof(std::uint64_t); }

private:
    PairKeys m_keys;
    std::size_t m_count = 0;
    std::size_t m_measured = 0;
    std::uint64_t m_lowest = ~std::uint64_t{0};
    std::uint64_t m_highest = 0;
    bool m_isSorted = true;
};

/// Sorts keys of pairs: distributes them evenly by value, over buckets in parallel and then inside each bucket, until
/// an insertion sort completes the order. Where about as many rows as keys occur, a bucket is one row or a few. The
/// result does not depend on the number of threads or lists.
///
/// Cost: O(keys), also for clustered values. Lists that are sorted, each above the one before, are only copied. Memory
/// is kept between calls, until write() has much fewer keys.
class PairSort
{
public:
    /// @param sorted [out] overwritten with all keys of the lists
    void sort(ParallelLoops& workers, std::vector<KeyList>& lists, PairKeys& sorted);

    /// Sorts keys whose words are below `rows`: their range need not be measured.
    void sortRows(ParallelLoops& workers, const std::vector<KeyList>& lists, std::uint32_t rows,
                  PairKeys& sorted);

    /// Writes the sorted keys as pairs; a key that occurs twice in the lists is omitted altogether.
    ///
    /// @param pairs [out] overwritten
    void write(ParallelLoops& workers, std::vector<KeyList>& lists, Pairs& pairs);

    /// Writes the sorted keys as pairs, in the calling thread; keeps duplicates. Keys that are in order are only copied.
    ///
    /// @param keys  [in, out] contents are lost
    /// @param pairs [out] overwritten
    void write(std::vector<std::uint64_t>& keys, Pairs& pairs);

    std::uint64_t bytes() const { return bytesOf(m_distributed, m_sorted, m_offsets); }

private:
    /// Maps keys to buckets.
    struct BucketMap
    {
        std::uint64_t lowest;
        std::uint32_t shift;
        std::uint32_t buckets;
        bool hasWholeWords;  ///< a bucket covers whole upper words, up to kMostWords

        std::size_t bucketOf(std::uint64_t key) const
        {
            return static_cast<std::size_t>((key - lowest) >> shift);
        }
    };

    struct Piece;  ///< a range of sorted keys

    void trim(std::size_t count);

    static constexpr std::size_t kWriteGrain = 8192;  ///< keys per task, at least

    std::vector<Piece> sortedPieces(ParallelLoops& workers, std::vector<KeyList>& lists);
    static void writeParallel(ParallelLoops& workers, const std::vector<Piece>& pieces, Pairs& pairs);
    static BucketMap bucketMapOf(std::vector<KeyList>& lists, std::size_t count);
    static BucketMap bucketMapOf(std::uint64_t lowest, std::uint64_t highest, std::size_t count);
    void sortFew(const std::vector<KeyList>& lists, std::size_t count, PairKeys& sorted);
    void sortMany(ParallelLoops& workers, const std::vector<KeyList>& lists, const BucketMap& bucketMap,
                  PairKeys& sorted);
    static std::size_t countOf(const std::vector<KeyList>& lists);
    static bool areInOrder(std::vector<KeyList>& lists);
    void distribute(ParallelLoops& workers, const std::vector<KeyList>& lists, const BucketMap& bucketMap);
    static std::uint32_t firstBucketOf(const BucketMap& bucketMap, const std::uint32_t* ends, unsigned task,
                                       unsigned tasks);
    void sortBuckets(ParallelLoops& workers, const BucketMap& bucketMap, const std::uint32_t* ends,
                     PairKeys& sorted);

    PairKeys m_distributed;  // keys by bucket
    PairKeys m_sorted;
    std::vector<std::uint32_t> m_offsets;  // [lists][buckets] index of the next key, finally the end
};
}  // namespace cullet
