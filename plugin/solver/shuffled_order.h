// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
/// Sorts things by hashes of theirs, equal ones in the order in which they were, in linear time.
///
/// Iterations converge by the order of contacts. One that follows space or creation has a side that comes first in each
/// iteration, so that errors add up; a shuffled one that stays the same in all steps has none.
template <class Thing>
class ShuffledOrder
{
public:
    /// @param sorted gets the things
    /// @param hashOf 32 bits of a thing
    template <class HashOf>
    void sort(const std::vector<Thing>& things, std::vector<Thing>& sorted, ParallelLoops& loops,
              const HashOf& hashOf)
    {
        m_shift = 32;
        while (m_shift > 8 && (things.size() >> (32 - m_shift)) != 0)
            --m_shift;
        sorted.resize(things.size());
        const unsigned tasks = loops.tasksFor(things.size(), kGrain);
        if (m_next.size() < tasks)
            m_next.resize(tasks);
        loops.run(tasks, [&](unsigned task) { sortBuckets(things, task, tasks, hashOf, sorted); });
    }

private:
    /// Things for which a task pays.
    static constexpr std::size_t kGrain = 2048;

    /// Each task reads all hashes, and sorts what falls into its buckets.
    template <class HashOf>
    void sortBuckets(const std::vector<Thing>& things, unsigned task, unsigned tasks, const HashOf& hashOf,
                     std::vector<Thing>& sorted)
    {
        const TaskRange range(std::size_t{1} << (32 - m_shift), task, tasks);
        const std::uint32_t count = range.end - range.begin;
        // Buckets before the first one count as above the last.
        const auto bucketOf = [&](const Thing& thing)
        { return static_cast<std::uint32_t>(std::uint64_t{hashOf(thing)} >> m_shift) - range.begin; };
        std::vector<std::uint32_t>& next = m_next[task];
        next.assign(count + 1, 0);
        std::uint32_t first = 0;
        for (const Thing& thing : things)
        {
            const std::uint32_t bucket = bucketOf(thing);
            if (bucket < count)
                ++next[bucket + 1];
            else
                first += static_cast<std::int32_t>(bucket) < 0 ? 1 : 0;
        }
        next[0] = first;
        for (std::uint32_t bucket = 0; bucket < count; ++bucket)
            next[bucket + 1] += next[bucket];
        const std::uint32_t end = next[count];
        for (const Thing& thing : things)
        {
            const std::uint32_t bucket = bucketOf(thing);
            if (bucket < count)
                sorted[next[bucket]++] = thing;
        }
        // The buckets are in order; few things are not alone in theirs.
        for (std::size_t i = first + std::size_t{1}; i < end; ++i)
        {
            for (std::size_t k = i; k > first && hashOf(sorted[k]) < hashOf(sorted[k - 1]); --k)
                std::swap(sorted[k], sorted[k - 1]);
        }
    }

    unsigned m_shift = 32;
    std::vector<std::vector<std::uint32_t>> m_next;  ///< [task][bucket] place of its next thing
};
}  // namespace cullet
