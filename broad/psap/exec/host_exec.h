// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/exec/buffer.h"
#include "cullet/broad/psap/exec/host_emitters.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// Memory of the HostExec.
struct HostMemory
{
    // Whole cache lines, two for what indices count.
    static constexpr std::size_t kAlignment = 128;

    static void* take(std::uint64_t bytes) { return ::operator new(bytes, std::align_val_t(kAlignment)); }
    static void giveBack(void* memory) noexcept { ::operator delete(memory, std::align_val_t(kAlignment)); }
};
template <class T>
using HostBuffer = ExecutorBuffer<T, HostMemory>;

/// Runs the steps of a pipeline on the CPU: index by index, in shuffled order, or on threads.
///
/// What it does not imitate: the lanes of a warp that advance together, and memory that is apart from the CPU's.
class HostExec
{
public:
    template <class T>
    using Buffer = HostBuffer<T>;
    template <class T>
    using Staging = HostBuffer<T>;

    /// Held during an update; a GPU's executor makes its device the current one.
    struct Use
    {
        explicit Use(const HostExec&) {}
    };

    explicit HostExec(const PsapOptions& options)
        : m_order(options.executor),
          m_random(options.seed),
          m_workers(options.executor == PsapExecutor::Threads ? options.threads : 1),
          m_isTiming(options.timeStages)
    {
    }

    /// Makes room for at least `count` elements. What was there may be lost.
    template <class T>
    void reserve(HostBuffer<T>& buffer, std::uint64_t count)
    {
        if (count <= buffer.size())
            return;
        buffer.allocate(count, &m_bytes);
    }

    /// The same, but the first `used` elements stay.
    template <class T>
    void reserveKeeping(HostBuffer<T>& buffer, std::uint64_t count, std::uint64_t used)
    {
        if (count <= buffer.size())
            return;
        HostBuffer<T> larger;
        reserve(larger, std::max(count, buffer.size() + buffer.size() / 2));
        copy(larger.data(), buffer.data(), used);
        buffer = std::move(larger);
    }

    /// Gives memory back that nothing uses any more.
    template <class T>
    void release(HostBuffer<T>& buffer)
    {
        buffer.release();
    }

    template <class T>
    void copy(T* to, const T* from, std::uint64_t count)
    {
        if (count != 0)
            std::memcpy(to, from, count * sizeof(T));
    }
    template <class T>
    void upload(T* to, const T* from, std::uint64_t count)
    {
        copy(to, from, count);
    }
    /// Whether upload() may read that memory directly and download() write there, with nobody else changing it before the next
    /// wait().
    template <class T>
    bool canReach(const T*, std::uint64_t) const
    {
        return true;
    }
    /// Uploads in parts, the first of which may be used before the last is there: after awaitPart(its number).
    ///
    /// @pre nothing that was launched since the last wait() uses that memory
    template <class T>
    void uploadParts(T* to, const T* from, std::uint64_t count, std::uint64_t /*part*/)
    {
        copy(to, from, count);
    }
    void awaitPart(std::uint64_t) {}
    /// That memory as steps may read it, until the next wait(). For what canReach() agrees to, and Staging.
    template <class T>
    const T* mapped(const T* memory, std::uint64_t /*count*/) const
    {
        return memory;
    }
    /// The same for what steps write.
    template <class T>
    T* mappedForWriting(T* memory, std::uint64_t /*count*/ = 1) const
    {
        return memory;
    }
    template <class T>
    void uploadNow(T* to, const T* from, std::uint64_t count)
    {
        copy(to, from, count);
    }
    template <class T>
    void download(T* to, const T* from, std::uint64_t count)
    {
        copy(to, from, count);
    }
    template <class T>
    void clear(T* what, std::uint64_t count)
    {
        std::memset(static_cast<void*>(what), 0, count * sizeof(T));
    }
    void wait() {}
    /// awaitMark() waits for what was launched before mark(), and for nothing behind it.
    void mark() {}
    void awaitMark() {}

    /// Runs steps after what was there at the last fork(), and beside what follows; join() ends that.
    void fork() {}
    template <class Body>
    void aside(const Body& body)
    {
        body();
    }
    void join() {}
    bool isAsideDone() const { return true; }

    /// Waits for what a failed update has left behind.
    void drain() {}

    /// What follows belongs to the stage; null: to none.
    void beginStage(const char* name)
    {
        if (!m_isTiming)
            return;
        const Clock::time_point now = Clock::now();
        if (!m_stages.empty())
            m_stages.back().milliseconds =
                std::chrono::duration<double, std::milli>(now - m_stageBegin).count();
        m_stageBegin = now;
        if (name != nullptr)
            m_stages.push_back({name, 0});
    }

    /// Forgets the stages of an update that failed.
    void dropStages() { m_stages.clear(); }

    /// The stages since the last call; all have ended.
    void takeStages(Array<StageTime>& stages)
    {
        stages.swap(m_stages);
        m_stages.clear();
    }

    /// Calls step(i) for i in [0, count).
    template <class Step>
    void forEach(std::uint64_t count, const Step& step)
    {
        forEachFrom(0, count, step);
    }

    /// Calls step(i) for i in [begin, end).
    template <class Step>
    void forEachFrom(std::uint64_t begin, std::uint64_t end, const Step& step)
    {
        run(begin, end, [&step] { return [&step](std::uint64_t i) { step(i); }; });
    }

    /// Calls step(i, emit) for i in [0, count); emit.push(pair) appends to the list.
    template <class Step>
    void forEachEmitting(std::uint64_t count, const Step& step, const PairList& list)
    {
        run(0, count,
            [&] {
                return [&step, emit = HostEmitter{list, &m_tests, 0}](std::uint64_t i) mutable
                { step(i, emit); };
            });
    }

    /// Calls step(i, true, emit) for i in [0, count). On a GPU the lanes of a warp do so together, with false for those that
    /// have no index, and have to be together in emit.any(), which asks all of them, and in emit.append(). emit.keep(record) keeps a number for
    /// the index, unless emit.isFull(), until emit.dropKept().
    template <class Step>
    void forEachTogether(std::uint64_t count, const Step& step, const PairList& list)
    {
        run(0, count,
            [&] {
                return [&step, emit = HostEmitter{list, &m_tests, 0}](std::uint64_t i) mutable
                { step(i, true, emit); };
            });
    }

    /// Calls step(step.read(i), first, second) for i in [0, count), where each of both appends to a list of its own, as above.
    /// For a step so short that a lane of a GPU had better take several indices; it reads the next while it does one.
    template <class Step>
    void forEachParted(std::uint64_t count, const Step& step, const DepthList& first, const PairList& second)
    {
        run(0, count,
            [&]
            {
                return [&step, toFirst = HostDepthEmitter{first},
                        toSecond = HostEmitter{second, &m_tests, 0}](std::uint64_t i) mutable
                { step(step.read(i), toFirst, toSecond); };
            });
    }

    /// For i in [0, count) reads an item with step.read(i), has it judged by step(item), whose verdict says in `sent` to which lists
    /// a pair goes, and calls step.keep(i, item, verdict). Apart, so that what many items need can be asked for together.
    template <class Step, std::uint32_t kLists>
    void forEachSent(std::uint64_t count, const Step& step, const PairLists<kLists>& lists)
    {
        forEach(count,
                [&](std::uint64_t i)
                {
                    const auto item = step.read(i);
                    const auto verdict = step(item);
                    step.keep(i, item, verdict);
                    lists.push(verdict.sent);
                });
    }

    /// For i in [0, count) reads an item with step.read(i) and, unless step.isOpen(item), calls step.keep(i, item); for the others
    /// step.look(step.open(i, item)) tells as a SentPair what becomes of a pair. Apart, so that a GPU can collect those that
    /// take longer, where they are few.
    template <class Step, std::uint32_t kLists>
    void forEachSifted(std::uint64_t count, const Step& step, const PairLists<kLists>& lists)
    {
        forEach(count,
                [&](std::uint64_t i)
                {
                    const auto item = step.read(i);
                    if (step.isOpen(item))
                        lists.push(step.look(step.open(i, item)));
                    else
                        step.keep(i, item);
                });
    }

    /// As forEachTogether() for a step whose indices work in groups: those of the lanes of a warp on a GPU, here each alone. They share
    /// emit.room(), a Step::Room, between two emit.sync(). All of a group have to be together in each call of emit:
    /// ballot() tells whose lanes say yes, from() what another lane has, sum() and least() what comes of all; appendEach() appends
    /// the pair of each bit that is set.
    template <class Step>
    void forEachGrouped(std::uint64_t count, const Step& step, const PairList& list)
    {
        run(0, count,
            [&]
            {
                return [&step, emit = HostGroupEmitter<typename Step::Room>(HostEmitter{list, &m_tests, 0})](
                           std::uint64_t i) mutable { step(i, true, emit); };
            });
    }

    /// For each bin in [0, bins) calls step.clear(bin), step.begin(bin, emit), then step(bin, slot, share, true, emit) for each of
    /// its step.countOf(bin) slots and each of kSharers shares. On a GPU a block deals out the slots of some bins among its
    /// lanes, which are together as in forEachTogether(); clear() may come before the launch ahead of this one is over.
    template <std::uint32_t kSharers, class Step>
    void forEachDealt(std::uint64_t bins, const Step& step, const PairList& list)
    {
        run(0, bins,
            [&]
            {
                return [&step, emit = HostEmitter{list, &m_tests, 0}](std::uint64_t index) mutable
                {
                    const auto bin = static_cast<std::uint32_t>(index);
                    step.clear(bin);
                    step.begin(bin, emit);
                    const std::uint32_t count = step.countOf(bin);
                    for (std::uint32_t k = 0; k < count * kSharers; ++k)
                        step(bin, k / kSharers, k % kSharers, true, emit);
                };
            });
    }

    /// Calls step(i) for each box. On a GPU a block takes some thousand boxes and asks for their places at once.
    template <class Step>
    void placeInTiles(const Step& step)
    {
        forEach(step.count, step);
    }

    /// Calls step(tile, memory, emit) for each of the tiles. On a GPU a block does what that does.
    template <class Step>
    void searchTiles(const Step& step, const PairList& list)
    {
        run(0, step.shape.tiles,
            [&]
            {
                return [&step, memory = typename Step::Memory(step.shape),
                        emit = HostEmitter{list, &m_tests, 0}](std::uint64_t tile) mutable
                { step(static_cast<std::uint32_t>(tile), memory, emit); };
            });
    }

    /// Whether there is memory to sort a tile in.
    template <class Shape>
    bool canSearchTiles(const Shape&) const
    {
        return true;
    }

    /// Whether work on few boxes is better cut into smaller pieces: not here, but one order tests how it is done.
    bool hasSpareLanes() const { return m_order == PsapExecutor::Shuffled; }

    /// out[i] = sum of in[0 .. i-1].
    template <class T>
    void scan(const T* in, T* out, std::uint64_t count)
    {
        std::exclusive_scan(in, in + count, out, T{0});
    }

    /// out[i] = largest of in[0 .. i].
    template <class T>
    void scanLargest(const T* in, T* out, std::uint64_t count)
    {
        std::partial_sum(in, in + count, out, [](T a, T b) { return std::max(a, b); });
    }

    /// Sorts by key, stable: a radix sort of one byte per pass.
    template <class Key>
    void sortPairs(Key* keys, Key* sortedKeys, std::uint32_t* values, std::uint32_t* sortedValues,
                   std::uint64_t count, int bits)
    {
        std::vector<std::pair<Key, std::uint32_t>> from(count), to(count);
        for (std::uint64_t i = 0; i < count; ++i)
            from[i] = {keys[i], values[i]};
        for (int shift = 0; shift < bits; shift += 8)
        {
            std::uint64_t starts[257] = {};
            for (const auto& entry : from)
                ++starts[(entry.first >> shift & 255u) + 1];
            for (int digit = 0; digit < 256; ++digit)
                starts[digit + 1] += starts[digit];
            for (const auto& entry : from)
                to[starts[entry.first >> shift & 255u]++] = entry;
            from.swap(to);
        }
        for (std::uint64_t i = 0; i < count; ++i)
        {
            sortedKeys[i] = from[i].first;
            sortedValues[i] = from[i].second;
        }
    }

    /// Sorts by the bits from `firstBit` up to `endBit`, above which there are none.
    void sortKeys(const std::uint64_t* keys, std::uint64_t* sortedKeys, std::uint64_t count, int firstBit,
                  int /*endBit*/)
    {
        std::copy(keys, keys + count, sortedKeys);
        std::stable_sort(sortedKeys, sortedKeys + count,
                         [firstBit](std::uint64_t a, std::uint64_t b)
                         { return a >> firstBit < b >> firstBit; });
    }

    std::uint64_t bytes() const { return m_bytes; }
    std::uint64_t takeBytesMoved() const { return 0; }

    /// Box tests since the last call.
    std::uint64_t takeTestCount() { return m_tests.exchange(0); }

private:
    /// Calls body(i) for each index; makeBody() makes one body per task.
    template <class MakeBody>
    void run(std::uint64_t begin, std::uint64_t end, const MakeBody& makeBody)
    {
        if (end <= begin)
            return;
        if (m_order == PsapExecutor::Shuffled)
        {
            std::vector<std::uint64_t> indices(end - begin);
            std::iota(indices.begin(), indices.end(), begin);
            std::shuffle(indices.begin(), indices.end(), m_random);
            auto body = makeBody();
            for (const std::uint64_t i : indices)
                body(i);
            return;
        }
        const std::uint64_t count = end - begin;
        const unsigned tasks = m_workers.tasksFor(count, kGrain);
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          auto body = makeBody();
                          const std::uint64_t last = begin + count * (task + 1) / tasks;
                          for (std::uint64_t i = begin + count * task / tasks; i < last; ++i)
                              body(i);
                      });
    }

    static constexpr std::uint64_t kGrain = 64;

    PsapExecutor m_order;
    std::mt19937 m_random;
    ParallelLoops m_workers;
    std::atomic<std::uint64_t> m_tests{0};
    std::uint64_t m_bytes = 0;

    using Clock = std::chrono::steady_clock;
    bool m_isTiming;
    Clock::time_point m_stageBegin;
    Array<StageTime> m_stages;
};
}  // namespace cullet::psap
