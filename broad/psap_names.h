// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "broad/host_device.h"
#include "broad/id_pair.h"
#include "broad/pair.h"

#include <cstdint>

/// The changes of an update as the world outside knows them: named by unique ids, in order.
namespace cullet::psap
{
/// How a pair of unique ids makes one integer of Pair's order: no longer than the ids need, for the sake of sorting.
struct IdBits
{
    std::uint32_t bits;  ///< of an id

    static IdBits forIds(std::uint32_t largest)
    {
        std::uint32_t bits = 1;
        while (bits < 32 && largest >> bits != 0)
            ++bits;
        return {bits};
    }

    /// One bit more tells two kinds of pairs apart, where there is room for it.
    bool hasLaterKey() const { return bits < 32; }
    std::uint64_t laterKey() const { return hasLaterKey() ? 1ull << 2 * bits : 0; }
    int keyBits() const { return static_cast<int>(hasLaterKey() ? 2 * bits + 1 : 64); }

    CULLET_HOST_DEVICE Pair pairOf(std::uint64_t key) const
    {
        const std::uint64_t mask = (1ull << bits) - 1;
        return {static_cast<std::uint32_t>(key >> bits & mask), static_cast<std::uint32_t>(key & mask)};
    }
};

/// Names the rows of a pair by their unique ids.
struct MakeKey
{
    const IdPair* pairs;
    const std::uint32_t* uniqueIds;
    IdBits bits;
    std::uint64_t kind;  ///< 0, or IdBits::laterKey()
    std::uint64_t* keys;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t a = uniqueIds[pairs[i].a];
        const std::uint64_t b = uniqueIds[pairs[i].b];
        keys[i] = kind | (a < b ? a << bits.bits | b : b << bits.bits | a);
    }
};

/// Unpacks key i.
struct UnpackKey
{
    const std::uint64_t* keys;
    IdBits bits;
    Pair* pairs;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { pairs[i] = bits.pairOf(keys[i]); }
};

/// Finishes an order by kind and first id alone: unpacks key i at its place among those of the same first id.
struct OrderRun
{
    /// So many keys of one first id are too many.
    static constexpr std::uint64_t kLongest = 32;

    const std::uint64_t* keys;  ///< [count] ordered but for the second id
    std::uint64_t count;
    IdBits bits;
    Pair* ordered;            ///< [count, out] void where there is a longer run
    std::uint32_t* longRuns;  ///< their number

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t key = keys[i];
        std::uint64_t smaller = 0;
        std::uint64_t before = 0;
        for (; before < kLongest && before < i && isInRun(key, i - before - 1); ++before)
            smaller += keys[i - before - 1] < key ? 1 : 0;
        std::uint64_t behind = 1;
        for (; behind < kLongest && i + behind < count && isInRun(key, i + behind); ++behind)
            smaller += keys[i + behind] < key ? 1 : 0;
        if (before == kLongest)
            return;
        if (behind < kLongest)
            ordered[i - before + smaller] = bits.pairOf(key);
        else if (before == 0)
            fetchAdd(longRuns, 1u);
    }

private:
    CULLET_HOST_DEVICE bool isInRun(std::uint64_t key, std::uint64_t i) const
    {
        return keys[i] >> bits.bits == key >> bits.bits;
    }
};

/// Names pairs of rows, and sorts and fetches the names.
template <class Exec>
class ChangeNames
{
public:
    /// Pairs of rows in the executor's memory.
    struct Rows
    {
        const IdPair* pairs;
        std::uint64_t count;
    };

    /// Waits for the executor.
    ///
    /// @param uniqueIds by row, in the executor's memory
    /// @param delta [out]
    void fetch(Exec& exec, Rows added, Rows removed, const std::uint32_t* uniqueIds, std::uint32_t largestId,
               PairDelta& delta)
    {
        const IdBits bits = IdBits::forIds(largestId);
        m_added = added.count;
        m_count = added.count + removed.count;
        delta.added.clear();
        delta.removed.clear();
        if (m_count == 0)
            return;
        for (Buffer<std::uint64_t>& keys : m_keys)
            exec.reserve(keys, m_count);
        exec.reserve(m_ordered, m_count + 1);
        exec.reserve(m_staged, m_count + 1);
        exec.forEach(added.count, MakeKey{added.pairs, uniqueIds, bits, 0, m_keys[0].data()});
        exec.forEach(removed.count, MakeKey{removed.pairs, uniqueIds, bits, bits.laterKey(),
                                            m_keys[0].data() + added.count});
        if (!fetchByRuns(exec, bits))
        {
            sort(exec, 0, bits);
            exec.forEach(m_count, UnpackKey{m_keys[1].data(), bits, m_ordered.data()});
            exec.download(m_staged.data(), m_ordered.data(), m_count);
            exec.wait();
        }
        const Pair* pairs = m_staged.data();
        delta.added.assign(pairs, pairs + m_added);
        delta.removed.assign(pairs + m_added, pairs + m_count);
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // Fewer are sorted in one launch, whatever their length.
    static constexpr std::uint64_t kKeysForRuns = 4096;
    // A box that changed many pairs may do so in the next updates.
    static constexpr std::uint32_t kUpdatesToSkip = 15;

    /// Sorts by half of each key, and the few of the same first id by themselves: half of the passes of a radix sort.
    ///
    /// @return false when there are too few pairs for that, or too many of one box
    bool fetchByRuns(Exec& exec, IdBits bits)
    {
        if (m_count < kKeysForRuns || !bits.hasLaterKey())
            return false;
        if (m_updatesToSkip > 0)
        {
            --m_updatesToSkip;
            return false;
        }
        sort(exec, static_cast<int>(bits.bits), bits);
        // All of it, since long runs leave places out; behind the pairs their number, so that one copy brings it too.
        exec.clear(m_ordered.data(), m_count + 1);
        exec.forEach(m_count, OrderRun{m_keys[1].data(), m_count, bits, m_ordered.data(),
                                       &m_ordered.data()[m_count].first});
        exec.download(m_staged.data(), m_ordered.data(), m_count + 1);
        exec.wait();
        if (m_staged.data()[m_count].first == 0)
            return true;
        m_updatesToSkip = kUpdatesToSkip;
        return false;
    }

    /// Sorts m_keys[0] into m_keys[1] from a bit on.
    void sort(Exec& exec, int firstBit, IdBits bits)
    {
        const std::uint64_t* keys = m_keys[0].data();
        std::uint64_t* sorted = m_keys[1].data();
        const std::uint64_t together = bits.hasLaterKey() ? m_count : m_added;
        exec.sortKeys(keys, sorted, together, firstBit, bits.keyBits());
        exec.sortKeys(keys + together, sorted + together, m_count - together, firstBit, bits.keyBits());
    }

    std::uint64_t m_added = 0, m_count = 0;
    std::uint32_t m_updatesToSkip = 0;
    Buffer<std::uint64_t> m_keys[2];  ///< as made, and sorted
    Buffer<Pair> m_ordered;
    typename Exec::template Staging<Pair> m_staged;
};
}  // namespace cullet::psap
