// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

/// The concept of an executor: memory, transfers and launches on one stream. HostExec runs on the CPU, CudaExec on a
/// GPU. A search is the same source for both; its steps are function objects, which are copied to where they run.
///
/// Launches run one after the other. The CPU waits for them in wait(), uploadAndWait(), awaitMark() and drain(), and
/// where a buffer changes its size. What fails throws ExecutorFailure or std::bad_alloc. A DeviceGuard, which makes the
/// device the current one, lives during an update.
///
/// **Memory.** Buffer<T> is for steps, Staging<T> for transfers; both have data() and size().
///
///   reserve(buffer, n)                 makes room for n elements; may discard the contents
///   reserveKeeping(buffer, n, used)    as reserve(), but preserves the first `used` elements
///   release(buffer)                    frees memory that no later launch uses
///
/// **Transfers.** Elements are copied as bytes. Memory of the CPU must not change before the next wait().
///
///   copy, upload, download(to, from, n), clear(what, n)
///   uploadAndWait(to, from, n)         from any memory of the CPU
///   uploadParts(to, from, n, part)     concurrently with launches, which do not use that memory since the last wait();
///                                      part k may be used after awaitPart(k)
///   canAccessDirectly(memory, n)       whether upload() may read that memory, and download() write it
///   mapped(memory, n)                  address at which steps may read such memory, or Staging, until the next wait()
///   mappedForWriting(memory, n)        address at which they may write it
///   wait()                             for all launches
///   mark(), awaitMark()                for those before mark(), and for no others
///   fork(), onSideStream(body), join() body() launches after all that was launched before the last fork(), concurrently
///                                      with what follows until join(), or until isSideStreamDone() is true
///   drain()                            waits after a failure
///
/// **Launches** call step(i, ...) for i in [0, n), in any order. `emit` appends pairs to a list: emit.push(pair), or
/// emit.append(isMine, pair), which the lanes of a warp call together, as they do emit.any(isMine), the disjunction.
/// emit.tested(n) counts box tests. Lanes without an index are called with isIndex = false. In the words of CUB:
///
///   forEach(n, step)                   DeviceFor: step(i)
///   forEachFrom(begin, end, step)      the same for i in [begin, end)
///   forEachAppend(n, step, list)       step(i, emit), each index by itself
///   forEachAppendWarp(n, step, list)   step(i, isIndex, emit), in warps. emit.keep(number) stores a number in the buffer
///                                      of an index, unless emit.isFull(); emit.dropKept() empties that buffer
///   forEachWarp(n, step, list)         as forEachAppendWarp(), for lanes that cooperate: they share emit.scratch(), a
///                                      Step::Scratch, between two emit.sync(), and call the other functions of emit
///                                      together. ballot() returns the lanes whose argument is true, from() the value
///                                      of another lane, sum() and least() combine the values of all lanes, and
///                                      appendEach() appends a pair for each bit
///   forEachPartition(n, step, a, b)    DevicePartition: step(step.read(i), toA, toB), which append to one list each.
///                                      For short steps: a lane loads the next item while it processes one
///   forEachMultiAppend(n, step, lists) step.keep(i, item, step(item)) for item = step.read(i); the result has a pair and
///                                      the lists that it goes to. All items of a lane are loaded before one is used
///   forEachCompacted(n, step, lists)   DeviceSelect: step.keep(i, item), unless step.isUndecided(item). The undecided
///                                      items need more time and are compacted: step.classify(step.undecided(i, item))
///                                      returns a pair and the lists that it goes to
///   forEachBinSlot<s>(n, step, list)   for each bin step.clear(bin), which may run before the last launch is complete,
///                                      step.begin(bin, emit), and step(bin, slot, share, isIndex, emit) for each of its
///                                      step.countOf(bin) slots and each of s shares, distributed over a block
///   placeInTiles(step)                 step(i) for each box, or what does the same for a block of boxes
///   searchTiles(step, list)            step(tile, memory, emit) for each tile, or what does the same with a block
///   exclusiveSum(in, out, n)           DeviceScan
///   sortPairs(...), sortKeys(...)      DeviceRadixSort; stable
///
/// hasSpareLanes(): whether work on few boxes pays to be split. canSearchTiles(shape): whether a tile fits into the
/// memory in which it is sorted. kRunsAtOnce: a step has run when its call returns. beginStage(name) begins a stage of
/// the time table, to which later launches belong; null ends the last one.
namespace cullet::psap
{
/// Owns memory of an executor and stores its size in elements. Movable.
///
/// @tparam Memory has allocateBytes(bytes), which may throw, deallocate(memory), which does not, and kAlignment
template <class T, class Memory>
class ExecutorBuffer
{
public:
    ExecutorBuffer() = default;
    ExecutorBuffer(const ExecutorBuffer&) = delete;
    ExecutorBuffer& operator=(const ExecutorBuffer&) = delete;
    ExecutorBuffer(ExecutorBuffer&& other) noexcept
        : m_data(std::exchange(other.m_data, nullptr)),
          m_size(std::exchange(other.m_size, 0)),
          m_account(std::exchange(other.m_account, nullptr))
    {
    }
    ExecutorBuffer& operator=(ExecutorBuffer&& other) noexcept
    {
        std::swap(m_data, other.m_data);
        std::swap(m_size, other.m_size);
        std::swap(m_account, other.m_account);
        return *this;
    }
    ~ExecutorBuffer() { release(); }

    T* data() const { return m_data; }
    std::uint64_t size() const { return m_size; }

    /// Throws what Memory throws, also for more bytes than 64 bits count; the buffer is then empty.
    ///
    /// @param account counter that includes the bytes while the buffer owns them; null: none
    void allocate(std::uint64_t size, std::uint64_t* account = nullptr)
    {
        release();
        constexpr std::uint64_t kMostBytes = ~std::uint64_t{0} >> 1;  // more than any memory has
        const bool isCountable = size <= kMostBytes / sizeof(T);
        m_data = static_cast<T*>(Memory::allocateBytes(isCountable ? size * sizeof(T) : kMostBytes));
        m_size = size;
        m_account = account;
        if (m_account != nullptr)
            *m_account += m_size * sizeof(T);
    }

    void release() noexcept
    {
        if (m_data != nullptr)
            Memory::deallocate(m_data);
        if (m_account != nullptr)
            *m_account -= m_size * sizeof(T);
        m_data = nullptr;
        m_size = 0;
        m_account = nullptr;
    }

private:
    static_assert(std::is_trivially_copyable_v<T>, "copied as bytes");
    static_assert(alignof(T) <= Memory::kAlignment, "the memory is not aligned for this");

    T* m_data = nullptr;
    std::uint64_t m_size = 0;
    std::uint64_t* m_account = nullptr;
};
}  // namespace cullet::psap
