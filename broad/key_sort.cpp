// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/key_sort.h"

#include "broad/vector_room.h"

#include <array>

namespace cullet
{
namespace
{
constexpr std::size_t kFewKeys = 24;      // sorted by insertion
constexpr std::size_t kOneBucket = 1024;  // keys that are not distributed among threads
constexpr std::size_t kKeysPerBucket = 128;
constexpr std::size_t kWordsPerKey = 4;  // up to so many upper words each or few together get a bucket
constexpr std::size_t kMostListsOfWords = 8;
constexpr std::size_t kMostKeysOfWords = 1u << 17;  // of more, buckets of words are larger than a cache
constexpr std::uint32_t kMostBuckets = 2048;
constexpr std::uint32_t kMostDigits = 2048;

std::uint32_t powerOfTwoFrom(std::size_t value, std::uint32_t most)
{
    std::uint32_t power = 1;
    while (power < value && power < most)
        power *= 2;
    return power;
}

/// By how much values below or equal `range` are shifted to come below `count`, a power of two above 1.
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

/// Sorts the digits that got more keys than an insertion sort is for.
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
    std::uint32_t sum = 0;
    std::uint32_t most = 0;
    for (std::uint32_t digit = 0; digit < digits; ++digit)
    {
        const std::uint32_t size = offsets[digit];
        offsets[digit] = sum;
        sum += size;
        most = std::max(most, size);
    }
    for (std::size_t i = 0; i < count; ++i)
        to[offsets[(from[i] - lowest) >> shift]++] = from[i];
    if (most > kFewKeys)
        sortFullDigits(from, to, offsets.data(), digits);
    sortByInsertion(to, count);
}
}  // namespace

std::size_t KeySort::countOf(const std::vector<KeyList>& lists)
{
    std::size_t count = 0;
    for (const KeyList& list : lists)
        count += list.size();
    return count;
}

void KeyList::trim()
{
    constexpr std::size_t kSmall = 4096;
    if (m_keys.size() > kSmall && m_keys.size() / 8 > m_count)
        std::vector<std::uint64_t>(m_keys.begin(), m_keys.begin() + static_cast<std::ptrdiff_t>(m_count))
            .swap(m_keys);
}

bool KeySort::areInOrder(std::vector<KeyList>& lists)
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

KeySort::Cut KeySort::cutOf(std::vector<KeyList>& lists, std::size_t count)
{
    std::uint64_t lowest = ~std::uint64_t{0};
    std::uint64_t highest = 0;
    for (KeyList& list : lists)
    {
        list.measure();
        lowest = std::min(lowest, list.lowest());
        highest = std::max(highest, list.highest());
    }
    const std::uint64_t words = (highest >> 32) - (lowest >> 32) + 1;
    if (count <= kMostKeysOfWords && words < kWordsPerKey * count && lists.size() <= kMostListsOfWords)
    {
        // The calling thread adds up what each list has in each bucket: the fewer, the more lists there are.
        std::uint32_t shift = 32;
        while ((words >> (shift - 32)) * lists.size() * lists.size() > 2 * count)
            ++shift;
        const std::uint64_t first = lowest >> shift << shift;
        return {first, shift, static_cast<std::uint32_t>((highest - first) >> shift) + 1, true};
    }
    const std::uint32_t buckets =
        count < kOneBucket ? 1u : powerOfTwoFrom(count / kKeysPerBucket, kMostBuckets);
    return {lowest, count == 0 ? 0u : shiftFor(highest - lowest, buckets), buckets, false};
}

/// Brings the keys of all lists together by bucket; the last list's offsets are the ends of the buckets then.
///
/// @return keys of the fullest bucket
std::uint32_t KeySort::part(WorkerPool& workers, const std::vector<KeyList>& lists, const Cut& cut)
{
    const auto tasks = static_cast<unsigned>(lists.size());
    const auto forEachList = [&](auto visit)
    {
        workers.run(tasks, [&](unsigned task)
                    { visit(lists[task], m_offsets.data() + std::size_t{task} * cut.buckets); });
    };
    m_offsets.assign(lists.size() * cut.buckets, 0);
    forEachList(
        [&](const KeyList& keys, std::uint32_t* counts)
        {
            for (const std::uint64_t key : keys)
                ++counts[cut.bucketOf(key)];
        });
    std::uint32_t sum = 0;
    std::uint32_t most = 0;
    for (std::size_t bucket = 0; bucket < cut.buckets; ++bucket)
    {
        const std::uint32_t begin = sum;
        for (std::size_t list = 0; list < lists.size(); ++list)
        {
            std::uint32_t& slot = m_offsets[list * cut.buckets + bucket];
            const std::uint32_t size = slot;
            slot = sum;
            sum += size;
        }
        most = std::max(most, sum - begin);
    }
    forEachList(
        [&](const KeyList& keys, std::uint32_t* next)
        {
            for (const std::uint64_t key : keys)
                m_parted[next[cut.bucketOf(key)]++] = key;
        });
    return most;
}

/// Buckets are shared out by their keys: upper words are the lower of two ids, so that most have a low one.
std::uint32_t KeySort::firstBucketOf(const Cut& cut, const std::uint32_t* ends, unsigned task, unsigned tasks)
{
    if (task == tasks)
        return cut.buckets;
    const std::size_t keysBefore = std::size_t{ends[cut.buckets - 1]} * task / tasks;
    return static_cast<std::uint32_t>(std::lower_bound(ends, ends + cut.buckets, keysBefore) - ends);
}

/// Sorts inside buckets of nearly no keys each, by insertion, and inside the full ones.
///
/// @param sorted [in, out] by bucket
void KeySort::sortFineBuckets(WorkerPool& workers, const Cut& cut, const std::uint32_t* ends, bool hasFull,
                              std::vector<std::uint64_t>& sorted)
{
    const unsigned tasks = workers.tasksFor(sorted.size(), kWriteGrain);
    workers.run(tasks,
                [&](unsigned task)
                {
                    const std::uint32_t firstBucket = firstBucketOf(cut, ends, task, tasks);
                    const std::uint32_t endBucket = firstBucketOf(cut, ends, task + 1, tasks);
                    const std::uint32_t first = firstBucket == 0 ? 0 : ends[firstBucket - 1];
                    const std::uint32_t last = endBucket == 0 ? 0 : ends[endBucket - 1];
                    std::uint32_t begin = first;
                    for (std::uint32_t bucket = firstBucket; bucket < endBucket && hasFull; ++bucket)
                    {
                        const std::uint32_t size = ends[bucket] - begin;
                        if (size > kFewKeys)
                        {
                            std::copy_n(sorted.data() + begin, size, m_parted.data() + begin);
                            sortKeys(m_parted.data() + begin, sorted.data() + begin, size);
                        }
                        begin = ends[bucket];
                    }
                    sortByInsertion(sorted.data() + first, last - first);
                });
}

void KeySort::sort(WorkerPool& workers, std::vector<KeyList>& lists, std::vector<std::uint64_t>& sorted)
{
    const std::size_t count = countOf(lists);
    sorted.resize(count);
    m_parted.resize(count);
    if (count < kOneBucket)
    {
        auto to = m_parted.begin();
        for (const KeyList& list : lists)
            to = std::copy(list.begin(), list.end(), to);
        sortKeys(m_parted.data(), sorted.data(), count);
        return;
    }
    const Cut cut = cutOf(lists, count);
    const std::uint32_t most = part(workers, lists, cut);
    const std::uint32_t* const ends = m_offsets.data() + (lists.size() - 1) * cut.buckets;
    if (cut.isFine)
    {
        sorted.swap(m_parted);
        sortFineBuckets(workers, cut, ends, most > kFewKeys, sorted);
        trimRoom(m_parted);
        return;
    }
    const unsigned tasks = std::min(cut.buckets, workers.threads() == 1 ? 1 : 8 * workers.threads());
    workers.run(tasks,
                [&](unsigned task)
                {
                    const TaskRange range(cut.buckets, task, tasks);
                    std::uint32_t begin = range.begin == 0 ? 0 : ends[range.begin - 1];
                    for (std::uint32_t bucket = range.begin; bucket < range.end; ++bucket)
                    {
                        sortKeys(m_parted.data() + begin, sorted.data() + begin, ends[bucket] - begin);
                        begin = ends[bucket];
                    }
                });
    trimRoom(m_parted);
}

void KeySort::write(std::vector<std::uint64_t>& keys, std::vector<Pair>& pairs)
{
    m_sorted.resize(keys.size());
    sortKeys(keys.data(), m_sorted.data(), keys.size());
    pairs.resize(keys.size());
    std::transform(m_sorted.begin(), m_sorted.end(), pairs.begin(), pairOfKey);
    trimRoom(m_sorted);
}
}  // namespace cullet
