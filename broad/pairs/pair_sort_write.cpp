// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Writes sorted keys as pairs, without the keys that occur twice.
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/pairs/pair_sort.h"

namespace cullet
{
struct PairSort::Piece
{
    const std::uint64_t* begin;
    const std::uint64_t* end;
    const std::uint64_t* first;  ///< begin of all keys in order, not only of this piece
    const std::uint64_t* last;
    bool areUnique;  ///< no key occurs twice

    bool isUnique(const std::uint64_t* key) const
    {
        return (key == first || key[-1] != *key) && (key + 1 == last || key[1] != *key);
    }

    /// Number of keys that differ from both neighbours.
    std::size_t countUnique() const
    {
        if (areUnique)
            return static_cast<std::size_t>(end - begin);
        std::size_t count = 0;
        for (const std::uint64_t* key = begin; key != end; ++key)
            count += isUnique(key) ? 1u : 0u;
        return count;
    }

    /// Writes the keys that differ from both neighbours; returns the end of the output.
    Pair* writeUnique(Pair* to) const
    {
        if (areUnique)
            return std::transform(begin, end, to, pairOfKey);
        for (const std::uint64_t* key = begin; key != end; ++key)
        {
            if (isUnique(key))
                *to++ = pairOfKey(*key);
        }
        return to;
    }
};

/// Returns all keys in order: the lists themselves if they are sorted, else pieces of a sorted copy.
std::vector<PairSort::Piece> PairSort::sortedPieces(ParallelLoops& workers, std::vector<KeyList>& lists)
{
    std::vector<Piece> pieces;
    if (areInOrder(lists))
    {
        for (const KeyList& list : lists)
            pieces.push_back({list.begin(), list.end(), list.begin(), list.end(), true});
        return pieces;
    }
    sort(workers, lists, m_sorted);
    const std::uint64_t* const first = m_sorted.data();
    const unsigned tasks = workers.tasksFor(m_sorted.size(), kWriteGrain);
    for (unsigned task = 0; task < tasks; ++task)
    {
        const TaskRange range(m_sorted.size(), task, tasks);
        pieces.push_back({first + range.begin, first + range.end, first, first + m_sorted.size(), false});
    }
    return pieces;
}

void PairSort::write(ParallelLoops& workers, std::vector<KeyList>& lists, Pairs& pairs)
{
    const std::vector<Piece> pieces = sortedPieces(workers, lists);
    const std::size_t count = countOf(lists);
    if (workers.tasksFor(count, kWriteGrain) == 1)
    {
        pairs.resize(count);
        Pair* to = pairs.data();
        for (const Piece& piece : pieces)
            to = piece.writeUnique(to);
        pairs.resize(static_cast<std::size_t>(to - pairs.data()));
    }
    else
    {
        writeParallel(workers, pieces, pairs);
    }
    trim(count);
}

/// Frees what a rare large update needed, where this one has so many keys.
void PairSort::trim(std::size_t count)
{
    for (PairKeys* keys : {&m_distributed, &m_sorted})
    {
        keys->resizeForOverwrite(std::min(keys->size(), count));
        trimCapacity(*keys);
    }
}

void PairSort::writeParallel(ParallelLoops& workers, const std::vector<Piece>& pieces, Pairs& pairs)
{
    const auto tasks = static_cast<unsigned>(pieces.size());
    std::vector<std::size_t> ends(pieces.size());
    workers.run(tasks, [&](unsigned task) { ends[task] = pieces[task].countUnique(); });
    for (unsigned task = 1; task < tasks; ++task)
        ends[task] += ends[task - 1];
    pairs.resize(ends.back());
    workers.run(tasks, [&](unsigned task)
                { pieces[task].writeUnique(pairs.data() + (task == 0 ? 0 : ends[task - 1])); });
}
}  // namespace cullet
