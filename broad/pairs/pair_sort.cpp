// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pairs/pair_sort.h"

#include "cullet/base/exclusive_sum.h"
#include "cullet/broad/limits.h"

#include <array>

namespace cullet
{
namespace
{
constexpr std::size_t kFewKeys = 24;      // sorted by insertion
constexpr std::size_t kOneBucket = 1024;  // fewer keys are not distributed among threads
constexpr std::size_t kKeysPerBucket = 128;
constexpr std::size_t kWordsPerKey = 4;     // range of upper words, per key, up to which each word is counted
constexpr std::uint32_t kMostWords = 2048;  // upper words of a bucket
constexpr std::uint32_t kMostBuckets = 2048;
constexpr std::uint32_t kMostDigits = 2048;

std::uint32_t powerOfTwoFrom(std::size_t value, std::uint32_t most)
{
    std::uint32_t power = 1;
    while (power < value && power < most)
        power *= 2;
    return power;
}

/// Right shift that makes all values up to `range` smaller than `count`, a power of two above 1.
std::uint32_t shiftFor(std::uint64_t range, std::uint32_t count)
{
    std::uint32_t shift = 0;
    while (range >> shift >= count)
        ++shift;
    return shift;
}

void sortByInsertion(std::uint64_t* keys, std::size_t count)
{
    for (std::size_t i = 1; i < count; ++i)
    {
        const std::uint64_t key = keys[i];
        std::size_t j = i;
        for (; j > 0 && keys[j - 1] > key; --j)
            keys[j] = keys[j - 1];
        keys[j] = key;
    }
}

void sortKeys(std::uint64_t* from, std::uint64_t* to, std::size_t count);

/// Sorts the keys of each digit that has too many keys for an insertion sort.
void sortFullDigits(std::uint64_t* from, std::uint64_t* to, const std::uint32_t* ends, std::uint32_t digits)
{
    std::uint32_t begin = 0;
    for (std::uint32_t digit = 0; digit < digits; ++digit)
    {
        const std::uint32_t size = ends[digit] - begin;
        if (size > kFewKeys)
        {
            std::copy_n(to + begin, size, from + begin);
            sortKeys(from + begin, to + begin, size);
        }
        begin = ends[digit];
    }
}

/// Sorts `from` into `to`; `from` is overwritten.
void sortKeys(std::uint64_t* from, std::uint64_t* to, std::size_t count)
{
    std::uint64_t lowest = ~std::uint64_t{0};
    std::uint64_t highest = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        lowest = std::min(lowest, from[i]);
        highest = std::max(highest, from[i]);
    }
    if (count <= kFewKeys || lowest == highest)
    {
        std::copy_n(from, count, to);
        sortByInsertion(to, count);
        return;
    }
    const std::uint32_t digits = powerOfTwoFrom(count, kMostDigits);
    const std::uint32_t shift = shiftFor(highest - lowest, digits);
    std::array<std::uint32_t, kMostDigits> offsets;
    std::fill_n(offsets.begin(), digits, 0);
    for (std::size_t i = 0; i < count; ++i)
        ++offsets[(from[i] - lowest) >> shift];
    const std::uint32_t most = exclusiveSum(offsets.data(), digits);
    for (std::size_t i = 0; i < count; ++i)
        to[offsets[(from[i] - lowest) >> shift]++] = from[i];
    if (most > kFewKeys)
        sortFullDigits(from, to, offsets.data(), digits);
    sortByInsertion(to, count);
}

/// Sorts keys in place. Their upper words are in a range of `words` that begins at the upper word of `lowest`, about as
/// many words as keys: each word is a digit.
void sortByWord(std::uint64_t* keys, std::size_t count, std::uint64_t lowest, std::uint32_t words)
{
    std::uint64_t copy[kMostWords];
    std::uint32_t offsets[kMostWords];
    std::fill_n(offsets, words, 0);
    std::copy_n(keys, count, copy);
    for (std::size_t i = 0; i < count; ++i)
        ++offsets[(copy[i] - lowest) >> 32];
    const std::uint32_t most = exclusiveSum(offsets, words);
    for (std::size_t i = 0; i < count; ++i)
        keys[offsets[(copy[i] - lowest) >> 32]++] = copy[i];
    if (most > kFewKeys)
        sortFullDigits(copy, keys, offsets, words);
    sortByInsertion(keys, count);
}
}  // namespace

std::size_t PairSort::countOf(const std::vector<KeyList>& lists)
{
    std::size_t count = 0;
    for (const KeyList& list : lists)
        count += list.size();
    return sortableCount(count);
}

void KeyList::trim()
{
    constexpr std::size_t kSmall = 4096;
    if (m_keys.size() > kSmall && m_keys.size() / 8 > m_count)
        PairKeys(m_keys.begin(), m_keys.begin() + m_count).swap(m_keys);
}

bool PairSort::areInOrder(std::vector<KeyList>& lists)
{
    std::uint64_t highest = 0;
    for (KeyList& list : lists)
    {
        list.measure();
        if (!list.isSorted() || (list.size() != 0 && list.lowest() <= highest))
            return false;
        highest = std::max(highest, list.highest());
    }
    return true;
}

PairSort::BucketMap PairSort::bucketMapOf(std::vector<KeyList>& lists, std::size_t count)
{
    std::uint64_t lowest = ~std::uint64_t{0};
    std::uint64_t highest = 0;
    for (KeyList& list : lists)
    {
        list.measure();
        lowest = std::min(lowest, list.lowest());
        highest = std::max(highest, list.highest());
    }
    return bucketMapOf(lowest, highest, count);
}

PairSort::BucketMap PairSort::bucketMapOf(std::uint64_t lowest, std::uint64_t highest, std::size_t count)
{
    const std::uint64_t words = (highest >> 32) - (lowest >> 32) + 1;
    if (words < kWordsPerKey * count && words / kMostBuckets < kMostWords / 2)
    {
        const std::uint64_t most = std::min<std::size_t>(count / kKeysPerBucket, kMostBuckets);
        std::uint32_t shift = 32;
        while (words >> (shift - 32) > most)
            ++shift;
        const std::uint64_t first = lowest >> shift << shift;
        return {first, shift, static_cast<std::uint32_t>((highest - first) >> shift) + 1, true};
    }
    const std::uint32_t buckets = powerOfTwoFrom(count / kKeysPerBucket, kMostBuckets);
    return {lowest, shiftFor(highest - lowest, buckets), buckets, false};
}

/// Distributes the keys of all lists over the buckets; afterwards, the offsets of the last list are the bucket ends.
void PairSort::distribute(ParallelLoops& workers, const std::vector<KeyList>& lists,
                          const BucketMap& bucketMap)
{
    const auto tasks = static_cast<unsigned>(lists.size());
    const auto forEachList = [&](auto visit)
    {
        workers.run(tasks, [&](unsigned task)
                    { visit(lists[task], m_offsets.data() + std::size_t{task} * bucketMap.buckets); });
    };
    m_offsets.assign(lists.size() * bucketMap.buckets, 0);
    forEachList(
        [bucketMap](const KeyList& keys, std::uint32_t* counts)
        {
            for (const std::uint64_t key : keys)
                ++counts[bucketMap.bucketOf(key)];
        });
    std::uint32_t sum = 0;
    for (std::size_t bucket = 0; bucket < bucketMap.buckets; ++bucket)
    {
        for (std::size_t list = 0; list < lists.size(); ++list)
        {
            std::uint32_t& slot = m_offsets[list * bucketMap.buckets + bucket];
            const std::uint32_t size = slot;
            slot = sum;
            sum += size;
        }
    }
    forEachList(
        [bucketMap, distributed = m_distributed.data()](const KeyList& keys, std::uint32_t* next)
        {
            for (const std::uint64_t key : keys)
            {
                std::uint64_t* const to = distributed + next[bucketMap.bucketOf(key)]++;
                __builtin_prefetch(to + 8, 1);
                *to = key;
            }
        });
}

/// First bucket of a task. Tasks get equal numbers of keys, not of buckets: the upper word is the lower of two ids, so
/// low buckets have most keys.
std::uint32_t PairSort::firstBucketOf(const BucketMap& bucketMap, const std::uint32_t* ends, unsigned task,
                                      unsigned tasks)
{
    if (task == tasks)
        return bucketMap.buckets;
    const std::size_t keysBefore = std::size_t{ends[bucketMap.buckets - 1]} * task / tasks;
    return static_cast<std::uint32_t>(std::lower_bound(ends, ends + bucketMap.buckets, keysBefore) - ends);
}

/// Sorts inside the buckets.
void PairSort::sortBuckets(ParallelLoops& workers, const BucketMap& bucketMap, const std::uint32_t* ends,
                           PairKeys& sorted)
{
    const unsigned tasks = workers.tasksFor(sorted.size(), kWriteGrain);
    workers.run(tasks,
                [&](unsigned task)
                {
                    const std::uint32_t endBucket = firstBucketOf(bucketMap, ends, task + 1, tasks);
                    std::uint32_t bucket = firstBucketOf(bucketMap, ends, task, tasks);
                    std::uint32_t begin = bucket == 0 ? 0 : ends[bucket - 1];
                    for (; bucket < endBucket; ++bucket)
                    {
                        std::uint64_t* const from = m_distributed.data() + begin;
                        std::uint64_t* const to = sorted.data() + begin;
                        const std::uint32_t size = ends[bucket] - begin;
                        if (bucketMap.hasWholeWords && size <= kMostWords)
                            sortByWord(to, size,
                                       bucketMap.lowest + (std::uint64_t{bucket} << bucketMap.shift),
                                       1u << (bucketMap.shift - 32));
                        else
                        {
                            if (bucketMap.hasWholeWords)
                                std::copy_n(to, size, from);
                            sortKeys(from, to, size);
                        }
                        begin = ends[bucket];
                    }
                });
}

void PairSort::sort(ParallelLoops& workers, std::vector<KeyList>& lists, PairKeys& sorted)
{
    const std::size_t count = countOf(lists);
    if (count < kOneBucket)
        sortFew(lists, count, sorted);
    else
        sortMany(workers, lists, bucketMapOf(lists, count), sorted);
}

void PairSort::sortRows(ParallelLoops& workers, const std::vector<KeyList>& lists, std::uint32_t rows,
                        PairKeys& sorted)
{
    const std::size_t count = countOf(lists);
    if (count < kOneBucket)
        sortFew(lists, count, sorted);
    else
        sortMany(workers, lists, bucketMapOf(0, (std::uint64_t{rows} << 32) - 1, count), sorted);
}

void PairSort::sortFew(const std::vector<KeyList>& lists, std::size_t count, PairKeys& sorted)
{
    sorted.resizeForOverwrite(count);
    m_distributed.resizeForOverwrite(count);
    std::uint64_t* to = m_distributed.data();
    for (const KeyList& list : lists)
        to = std::copy(list.begin(), list.end(), to);
    sortKeys(m_distributed.data(), sorted.data(), count);
}

void PairSort::sortMany(ParallelLoops& workers, const std::vector<KeyList>& lists, const BucketMap& bucketMap,
                        PairKeys& sorted)
{
    const std::size_t count = countOf(lists);
    sorted.resizeForOverwrite(count);
    m_distributed.resizeForOverwrite(count);
    distribute(workers, lists, bucketMap);
    if (bucketMap.hasWholeWords)
        sorted.swap(m_distributed);
    sortBuckets(workers, bucketMap, m_offsets.data() + (lists.size() - 1) * bucketMap.buckets, sorted);
}

void PairSort::write(std::vector<std::uint64_t>& keys, Pairs& pairs)
{
    // As in most updates of a small world.
    if (keys.empty())
        return pairs.clear();
    pairs.resize(sortableCount(keys.size()));
    // As where all rows of a small world were tested one after the other.
    const bool areSorted = std::is_sorted(keys.begin(), keys.end());
    m_sorted.resizeForOverwrite(areSorted ? 0 : keys.size());
    if (!areSorted)
        sortKeys(keys.data(), m_sorted.data(), keys.size());
    const std::uint64_t* const sorted = areSorted ? keys.data() : m_sorted.data();
    std::transform(sorted, sorted + keys.size(), pairs.begin(), pairOfKey);
    trim(keys.size());
}
}  // namespace cullet
