// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/exec/executor.h"
#include "cullet/cuda/host/host_emitters.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// Memory of the HostExec.
struct HostMemory
{
    // Whole cache lines, two for shared counters.
    static constexpr std::size_t kAlignment = 128;

    static void* allocateBytes(std::uint64_t bytes)
    {
        return ::operator new(bytes, std::align_val_t(kAlignment));
    }
    static void deallocate(void* memory) noexcept { ::operator delete(memory, std::align_val_t(kAlignment)); }
};
template <class T>
using HostBuffer = ExecutorBuffer<T, HostMemory>;

/// The executor of the CPU: runs steps index by index, in shuffled order, or on threads.
///
/// It does not imitate warps, whose lanes advance together, nor memory that is separate from the CPU's.
class HostExec
{
public:
    template <class T>
    using Buffer = HostBuffer<T>;
    template <class T>
    using Staging = HostBuffer<T>;

    static constexpr bool kRunsAtOnce = true;

    struct DeviceGuard
    {
        explicit DeviceGuard(const HostExec&) {}
    };

    explicit HostExec(const PsapOptions& options)
        : m_order(options.executor),
          m_random(options.seed),
          m_workers(options.executor == PsapExecutor::Threads ? options.threads : 1),
          m_isTiming(options.timeStages)
    {
    }

    template <class T>
    void reserve(HostBuffer<T>& buffer, std::uint64_t count)
    {
        if (count <= buffer.size())
            return;
        buffer.allocate(count, &m_bytes);
    }

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
    template <class T>
    bool canAccessDirectly(const T*, std::uint64_t) const
    {
        return true;
    }
    template <class T>
    void uploadParts(T* to, const T* from, std::uint64_t count, std::uint64_t /*part*/)
    {
        copy(to, from, count);
    }
    void awaitPart(std::uint64_t) {}
    template <class T>
    const T* mapped(const T* memory, std::uint64_t /*count*/) const
    {
        return memory;
    }
    template <class T>
    T* mappedForWriting(T* memory, std::uint64_t /*count*/ = 1) const
    {
        return memory;
    }
    template <class T>
    void uploadAndWait(T* to, const T* from, std::uint64_t count)
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
    void mark() {}
    void awaitMark() {}

    void fork() {}
    template <class Body>
    void onSideStream(const Body& body)
    {
        body();
    }
    void join() {}
    bool isSideStreamDone() const { return true; }

    void drain() {}

    /// Begins a stage, which all later work belongs to; null: no stage.
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

    /// Discards the stages of a failed update.
    void dropStages() { m_stages.clear(); }

    /// The stages since the last call; all of them have ended.
    void collectStages(Array<StageTime>& stages)
    {
        stages.swap(m_stages);
        m_stages.clear();
    }

    template <class Step>
    void forEach(std::uint64_t count, const Step& step)
    {
        forEachFrom(0, count, step);
    }

    template <class Step>
    void forEachFrom(std::uint64_t begin, std::uint64_t end, const Step& step)
    {
        run(begin, end, [&step] { return [&step](std::uint64_t i) { step(i); }; });
    }

    template <class Step>
    void forEachAppend(std::uint64_t count, const Step& step, const PairList& list)
    {
        runEmitting(count, emitterOf(list), step);
    }

    template <class Step>
    void forEachAppendWarp(std::uint64_t count, const Step& step, const PairList& list)
    {
        runEmitting(count, emitterOf(list),
                    [&step](std::uint64_t i, HostEmitter& emit) { step(i, true, emit); });
    }

    template <class Step>
    void forEachWarp(std::uint64_t count, const Step& step, const PairList& list)
    {
        using Emitter = HostWarpEmitter<typename Step::Scratch>;
        runEmitting(count, Emitter(emitterOf(list)),
                    [&step](std::uint64_t i, Emitter& emit) { step(i, true, emit); });
    }

    template <class Step>
    void forEachPartition(std::uint64_t count, const Step& step, const DepthList& first,
                          const PairList& second)
    {
        HostDepthEmitter toFirst{first};
        runEmitting(count, emitterOf(second),
                    [&step, &toFirst](std::uint64_t i, HostEmitter& toSecond)
                    { step(step.read(i), toFirst, toSecond); });
    }

    template <class Step, std::uint32_t kLists>
    void forEachMultiAppend(std::uint64_t count, const Step& step, const PairLists<kLists>& lists)
    {
        forEach(count,
                [&](std::uint64_t i)
                {
                    const auto item = step.read(i);
                    const auto verdict = step(item);
                    step.keep(i, item, verdict);
                    lists.push(verdict.routed);
                });
    }

    template <class Step, std::uint32_t kLists>
    void forEachCompacted(std::uint64_t count, const Step& step, const PairLists<kLists>& lists)
    {
        forEach(count,
                [&](std::uint64_t i)
                {
                    const auto item = step.read(i);
                    if (step.isUndecided(item))
                        lists.push(step.classify(step.undecided(i, item)));
                    else
                        step.keep(i, item);
                });
    }

    template <std::uint32_t kSharers, class Step>
    void forEachBinSlot(std::uint64_t bins, const Step& step, const PairList& list)
    {
        runEmitting(bins, emitterOf(list),
                    [&step](std::uint64_t index, HostEmitter& emit)
                    {
                        const auto bin = static_cast<std::uint32_t>(index);
                        step.clear(bin);
                        step.begin(bin, emit);
                        const std::uint32_t count = step.countOf(bin);
                        for (std::uint32_t k = 0; k < count * kSharers; ++k)
                            step(bin, k / kSharers, k % kSharers, true, emit);
                    });
    }

    template <class Step>
    void placeInTiles(const Step& step)
    {
        forEach(step.count, step);
    }

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

    template <class Shape>
    bool canSearchTiles(const Shape&) const
    {
        return true;
    }

    /// Split work does not pay on a CPU, but the shuffled order tests the split.
    bool hasSpareLanes() const { return m_order == PsapExecutor::Shuffled; }

    template <class T>
    void exclusiveSum(const T* in, T* out, std::uint64_t count)
    {
        std::exclusive_scan(in, in + count, out, T{0});
    }

    /// A radix sort of one byte per pass.
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

    void sortKeys(const std::uint64_t* keys, std::uint64_t* sortedKeys, std::uint64_t count, int /*bits*/)
    {
        std::copy(keys, keys + count, sortedKeys);
        std::sort(sortedKeys, sortedKeys + count);
    }

    std::uint64_t bytes() const { return m_bytes; }
    std::uint64_t collectBytesMoved() const { return 0; }

    /// Number of box tests since the last call.
    std::uint64_t collectTestCount() { return m_tests.exchange(0); }

private:
    /// Calls body(i) for each index; makeBody() makes one body per task.
    template <class MakeBody>
    void run(std::uint64_t begin, std::uint64_t end, const MakeBody& makeBody)
    {
        if (end <= begin)
            return;
        if (m_order == PsapExecutor::Shuffled)
        {
            auto body = makeBody();
            for (const std::uint64_t i : shuffled(begin, end))
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

    HostEmitter emitterOf(const PairList& list) { return {list, &m_tests, 0}; }

    /// Calls body(i, emit) for each index, with a copy of the emitter for each task.
    template <class Emitter, class Body>
    void runEmitting(std::uint64_t count, const Emitter& emitter, const Body& body)
    {
        run(0, count, [&] { return [&body, emit = emitter](std::uint64_t i) mutable { body(i, emit); }; });
    }

    /// The indices from `begin` up to `end` in an order that depends on the seed and on the calls before. Tests shuffle
    /// billions of indices, so a draw is one multiplication; that it is a little uneven does no harm.
    std::vector<std::uint64_t> shuffled(std::uint64_t begin, std::uint64_t end)
    {
        std::vector<std::uint64_t> indices(end - begin);
        std::iota(indices.begin(), indices.end(), begin);
        for (std::uint64_t left = indices.size(); left > 1; --left)
        {
            m_random = m_random * 6364136223846793005u + 1442695040888963407u;
            // Of a linear congruence the upper bits are the random ones.
            std::swap(indices[left - 1], indices[((m_random >> 32) * left) >> 32]);
        }
        return indices;
    }

    static constexpr std::uint64_t kGrain = 64;

    PsapExecutor m_order;
    std::uint64_t m_random;  ///< state of Knuth's MMIX generator
    ParallelLoops m_workers;
    std::atomic<std::uint64_t> m_tests{0};
    std::uint64_t m_bytes = 0;

    using Clock = std::chrono::steady_clock;
    bool m_isTiming;
    Clock::time_point m_stageBegin;
    Array<StageTime> m_stages;
};
}  // namespace cullet::psap
