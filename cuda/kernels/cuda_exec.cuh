// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/cuda/kernels/launch.cuh"
#include "cullet/cuda/kernels/multi_list_kernels.cuh"
#include "cullet/cuda/kernels/scan_kernel.cuh"
#include "cullet/cuda/kernels/step_kernels.cuh"
#include "cullet/cuda/kernels/tile_kernels.cuh"
#include "cullet/cuda/runtime/chunked_upload.h"
#include "cullet/cuda/runtime/cub_scratch.cuh"
#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/device_buffer.h"
#include "cullet/cuda/runtime/event.h"
#include "cullet/cuda/runtime/pinned_pages.h"
#include "cullet/cuda/runtime/side_stream.h"
#include "cullet/cuda/runtime/stage_timer.h"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// The executor of a CUDA device. Every call of CUDA is checked.
class CudaExec
{
public:
    template <class T>
    using Buffer = DeviceBuffer<T>;
    template <class T>
    using Staging = PinnedBuffer<T>;

    static constexpr bool kRunsAtOnce = false;

    /// Makes the executor's device the current one of this thread, and restores the previous one.
    class DeviceGuard
    {
    public:
        explicit DeviceGuard(const CudaExec& exec)
        {
            CULLET_CUDA_TRY(cudaGetDevice(&m_before));
            if (m_before != exec.m_device)
                CULLET_CUDA_TRY(cudaSetDevice(exec.m_device));
        }
        DeviceGuard(const DeviceGuard&) = delete;
        DeviceGuard& operator=(const DeviceGuard&) = delete;
        ~DeviceGuard() { cudaSetDevice(m_before); }

    private:
        int m_before = 0;
    };

    /// @param stream stream for all work; null: a stream of its own
    explicit CudaExec(const PsapOptions& options, cudaStream_t stream = nullptr)
        : m_device(options.device),
          m_stream(stream),
          m_blockThreads(blockThreads(options.blockThreads)),
          m_stages(options.timeStages)
    {
        const DeviceGuard use(*this);
        int bytes = 0;
        CULLET_CUDA_TRY(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, m_device));
        m_sharedBytes = static_cast<std::uint32_t>(bytes);
        int multiprocessors = 0;
        CULLET_CUDA_TRY(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, m_device));
        m_multiprocessors = static_cast<std::uint32_t>(multiprocessors);
        m_canLaunchDependent = canLaunchDependent(m_device);
        if (m_stream == nullptr)
        {
            CULLET_CUDA_TRY(cudaStreamCreateWithFlags(&m_ownStream, cudaStreamNonBlocking));
            m_stream = m_ownStream;
        }
    }
    CudaExec(const CudaExec&) = delete;
    CudaExec& operator=(const CudaExec&) = delete;
    ~CudaExec()
    {
        if (m_ownStream != nullptr)
            cudaStreamDestroy(m_ownStream);
        cudaGetLastError();
    }

    cudaStream_t stream() const { return m_stream; }

    template <class T, class Memory>
    void reserve(ExecutorBuffer<T, Memory>& buffer, std::uint64_t count)
    {
        if (count <= buffer.size())
            return;
        // Grows by at least a half: worlds grow body by body. No stream may still use the old memory.
        const std::uint64_t room = std::max(count, buffer.size() + buffer.size() / 2);
        if (buffer.size() != 0)
        {
            wait();
            m_sideStream.wait();
        }
        buffer.allocate(room, &m_bytes);
    }

    template <class T>
    void reserveKeeping(DeviceBuffer<T>& buffer, std::uint64_t count, std::uint64_t used)
    {
        if (count <= buffer.size())
            return;
        DeviceBuffer<T> larger;
        reserve(larger, std::max(count, buffer.size() + buffer.size() / 2));
        copy(larger.data(), buffer.data(), used);
        wait();
        buffer = std::move(larger);
    }

    template <class T, class Memory>
    void release(ExecutorBuffer<T, Memory>& buffer)
    {
        wait();
        m_sideStream.wait();
        buffer.release();
    }

    template <class T>
    void copy(T* to, const T* from, std::uint64_t count)
    {
        transfer(to, from, count * sizeof(T), cudaMemcpyDeviceToDevice);
    }
    template <class T>
    void upload(T* to, const T* from, std::uint64_t count)
    {
        transfer(to, from, count * sizeof(T), cudaMemcpyHostToDevice);
        m_bytesMoved += count * sizeof(T);
    }
    template <class T>
    bool canAccessDirectly(const T* memory, std::uint64_t count) const
    {
        return lockPages(memory, count * sizeof(T));
    }
    template <class T>
    void uploadParts(T* to, const T* from, std::uint64_t count, std::uint64_t part)
    {
        m_chunkedUpload.begin(m_stream, count > part);
        for (std::uint64_t begin = 0; begin < count; begin += part)
        {
            const std::uint64_t end = std::min(begin + part, count);
            transfer(to + begin, from + begin, (end - begin) * sizeof(T), cudaMemcpyHostToDevice,
                     m_chunkedUpload.stream());
            m_chunkedUpload.end();
        }
        m_bytesMoved += count * sizeof(T);
    }
    template <class T>
    const T* mapped(const T* memory, std::uint64_t count)
    {
        return mappedForWriting(const_cast<T*>(memory), count);
    }
    template <class T>
    T* mappedForWriting(T* memory, std::uint64_t count = 1)
    {
        m_bytesMoved += count * sizeof(T);
        void* address = nullptr;
        CULLET_CUDA_TRY(cudaHostGetDevicePointer(&address, memory, 0));
        return static_cast<T*>(address);
    }
    void awaitPart(std::uint64_t part) { m_chunkedUpload.await(m_stream, part); }
    template <class T>
    void uploadAndWait(T* to, const T* from, std::uint64_t count)
    {
        upload(to, from, count);
        wait();
    }
    template <class T>
    void download(T* to, const T* from, std::uint64_t count)
    {
        transfer(to, from, count * sizeof(T), cudaMemcpyDeviceToHost);
        m_bytesMoved += count * sizeof(T);
    }
    template <class T>
    void clear(T* what, std::uint64_t count)
    {
        if (count != 0)
            CULLET_CUDA_TRY(cudaMemsetAsync(what, 0, count * sizeof(T), m_stream));
    }
    void wait() { CULLET_CUDA_TRY(cudaStreamSynchronize(m_stream)); }

    void fork() { m_sideStream.fork(m_stream); }
    template <class Body>
    void onSideStream(const Body& body)
    {
        const StreamSwitch elsewhere(m_stream, m_sideStream.stream());
        body();
    }
    void join() { m_sideStream.join(m_stream); }
    bool isSideStreamDone() const { return m_sideStream.isDone(); }

    void mark() { m_mark.record(m_stream); }
    void awaitMark() { m_mark.wait(); }

    /// Waits for the work of a failed update, so that it does not write into the next one.
    void drain() noexcept
    {
        cudaStreamSynchronize(m_stream);
        m_chunkedUpload.drain();
        m_sideStream.drain();
        cudaGetLastError();
    }

    void beginStage(const char* name) { m_stages.begin(name, m_stream); }
    void dropStages() noexcept { m_stages.drop(); }
    void collectStages(Array<StageTime>& stages) { m_stages.collect(stages); }

    template <class Step>
    void forEach(std::uint64_t count, const Step& step)
    {
        forEachFrom(0, count, step);
    }
    template <class Step>
    void forEachFrom(std::uint64_t begin, std::uint64_t end, const Step& step)
    {
        // Steps with few indices run beside others, and should use no more registers than necessary.
        if (begin < end)
            launch(runStep<Step>, end - begin, end - begin <= 32 ? 32 : m_blockThreads, begin, end, step);
    }
    template <class Step>
    void forEachAppend(std::uint64_t count, const Step& step, const PairList& list)
    {
        launch(runAppend<Step>, count, std::min(m_blockThreads, kEmitThreads), count, step, list);
    }

    template <std::uint32_t kSharers, class Step>
    void forEachBinSlot(std::uint64_t bins, const Step& step, const PairList& list)
    {
        const auto kernel = runBinSlots<kSharers, Step>;
        const auto count = static_cast<std::uint32_t>(bins);
        if (m_canLaunchDependent)
            launchDependent(m_stream, kernel, kSharers * bins, kEmitThreads, count, step, list);
        else
            launch(kernel, kSharers * bins, kEmitThreads, count, step, list);
    }

    bool hasSpareLanes() const { return true; }

    void placeInTiles(const PlaceInTiles& step)
    {
        // With more tiles, more boxes per block; in a small world enough blocks for the device.
        if (step.shape.tiles > kFewTiles)
            placeByBlocks<1024, 4, 1>(step);
        else if (step.count <= kFewBoxes)
            placeByBlocks<512, 2, 2>(step);
        else
            placeByBlocks<512, 4, 2>(step);
    }

    template <class Step>
    void searchTiles(const Step& step, const PairList& list)
    {
        if (step.shape.room <= SmallTiles<Step>::kMostRoom)
            launchShared(m_stream, psap::searchTiles<Step, 256, 4>, step.shape.tiles, 256,
                         SmallTiles<Step>::sharedBytes(step.shape), step, list);
        else
            launchShared(m_stream, psap::searchTiles<Step, 512, 6>, step.shape.tiles, 512,
                         LargeTiles<Step>::sharedBytes(step.shape), step, list);
    }

    bool canSearchTiles(const TileShape& shape) const
    {
        return LargeTiles<SearchTiles<EveryPair>>::sharedBytes(shape) + kStaticShared <= m_sharedBytes;
    }

    template <class Step>
    void forEachAppendWarp(std::uint64_t count, const Step& step, const PairList& list)
    {
        launch(runAppendWarp<Step>, count, kEmitThreads, count, step, list);
    }

    template <class Step>
    void forEachPartition(std::uint64_t count, const Step& step, const DepthList& first,
                          const PairList& second)
    {
        // Below this, one item per lane: latency counts, and there are idle multiprocessors.
        if (count < kFewestForSeveralPerLane)
            launch(runPartition<1, Step>, count, kEmitThreads, count, step, first, second);
        else
            launch(runPartition<kPerLanePartition, Step>, (count + kPerLanePartition - 1) / kPerLanePartition,
                   kEmitThreads, count, step, first, second);
    }

    template <class Step, std::uint32_t kLists>
    void forEachMultiAppend(std::uint64_t count, const Step& step, const PairLists<kLists>& lists)
    {
        if (count < kFewestForSeveralPerLane)
            launch(runMultiAppend<1, Step, kLists>, count, kEmitThreads, count, step, lists);
        else
            launch(runMultiAppend<kPerLaneMultiAppend, Step, kLists>,
                   (count + kPerLaneMultiAppend - 1) / kPerLaneMultiAppend, kEmitThreads, count, step, lists);
    }

    template <class Step>
    void forEachCompacted(std::uint64_t count, const Step& step, const PairLists<2>& lists)
    {
        // As many warps as the device holds at once: each queues its undecided items.
        const std::uint64_t lanes = (count + kPerLaneCompacted - 1) / kPerLaneCompacted;
        const std::uint64_t most = std::uint64_t{m_multiprocessors} * kCompactedBlocks * kCompactedThreads;
        launch(runCompacted<kPerLaneCompacted, Step>, std::min(lanes, most), kCompactedThreads, count, step,
               lists);
    }

    template <class Step>
    void forEachWarp(std::uint64_t count, const Step& step, const PairList& list)
    {
        launch(runWarp<Step>, count, kEmitThreads, count, step, list);
    }

    template <class T>
    void exclusiveSum(const T* in, T* out, std::uint64_t count)
    {
        if (count <= kMostInBlock)
        {
            auto* const kernel = count <= 4 * kScanThreads   ? scanInBlock<4, T>
                                 : count <= 8 * kScanThreads ? scanInBlock<8, T>
                                                             : scanInBlock<kMostPerThread, T>;
            launch(kernel, 1, kScanThreads, in, out, static_cast<unsigned>(count));
            return;
        }
        m_scratch.call<LongScan>(
            *this, count,
            [&](void* scratch, std::size_t& bytes, auto n)
            { return cub::DeviceScan::ExclusiveSum(scratch, bytes, in, out, n, m_stream); });
    }

    template <class Key>
    void sortPairs(Key* keys, Key* sortedKeys, std::uint32_t* values, std::uint32_t* sortedValues,
                   std::uint64_t count, int bits)
    {
        if (count == 0)
            return;
        m_scratch.call<std::uint64_t>(*this, count,
                                      [&](void* scratch, std::size_t& bytes, auto n)
                                      {
                                          return cub::DeviceRadixSort::SortPairs(
                                              scratch, bytes, keys, sortedKeys, values, sortedValues, n, 0,
                                              bits, m_stream);
                                      });
    }

    void sortKeys(const std::uint64_t* keys, std::uint64_t* sortedKeys, std::uint64_t count, int bits)
    {
        if (count == 0)
            return;
        m_scratch.call<std::uint64_t>(*this, count,
                                      [&](void* scratch, std::size_t& bytes, auto n) {
                                          return cub::DeviceRadixSort::SortKeys(
                                              scratch, bytes, keys, sortedKeys, n, 0, bits, m_stream);
                                      });
    }

    std::uint64_t bytes() const { return m_bytes; }
    std::uint64_t collectBytesMoved() { return std::exchange(m_bytesMoved, 0); }
    std::uint64_t collectTestCount() { return 0; }  ///< not counted here: it would cost time

private:
    /// Replaces a stream by another one until the end of the scope.
    class StreamSwitch
    {
    public:
        StreamSwitch(cudaStream_t& stream, cudaStream_t other) : m_stream(stream), m_before(stream)
        {
            m_stream = other;
        }
        StreamSwitch(const StreamSwitch&) = delete;
        StreamSwitch& operator=(const StreamSwitch&) = delete;
        ~StreamSwitch() { m_stream = m_before; }

    private:
        cudaStream_t& m_stream;
        cudaStream_t m_before;
    };

    /// Threads of a block, in whole warps. @param asked requested number; 0: the most
    static unsigned blockThreads(std::uint32_t asked)
    {
        return asked == 0 ? kMostThreads : std::clamp(asked / 32 * 32, 32u, kMostThreads);
    }

    void transfer(void* to, const void* from, std::uint64_t bytes, cudaMemcpyKind kind)
    {
        transfer(to, from, bytes, kind, m_stream);
    }
    static void transfer(void* to, const void* from, std::uint64_t bytes, cudaMemcpyKind kind,
                         cudaStream_t stream)
    {
        if (bytes != 0)
            CULLET_CUDA_TRY(cudaMemcpyAsync(to, from, bytes, kind, stream));
    }

    template <class... Parameters, class... Arguments>
    void launch(void (*kernel)(Parameters...), std::uint64_t indices, unsigned threads,
                const Arguments&... arguments)
    {
        psap::launch(m_stream, kernel, indices, threads, arguments...);
    }

    template <class Step>
    using SmallTiles = TileSearching<Step, 256, 4>;
    template <class Step>
    using LargeTiles = TileSearching<Step, 512, 6>;

    static constexpr unsigned kPerLanePartition = 6, kPerLaneMultiAppend = 2, kPerLaneCompacted = 2;
    static constexpr std::uint64_t kFewestForSeveralPerLane = 1u << 18;
    static constexpr std::uint32_t kFewTiles = 2048;
    static constexpr std::uint64_t kFewBoxes = 3u << 16;
    static constexpr std::uint32_t kStaticShared = 1024;  ///< static shared memory of a kernel, at most

    template <unsigned kThreads, unsigned kPerThread, unsigned kBlocks>
    void placeByBlocks(const PlaceInTiles& step)
    {
        using Placing = TilePlacing<kThreads, kPerThread>;
        const std::uint32_t bytes = Placing::sharedBytes(step.shape.tiles);
        if (bytes + kStaticShared > m_sharedBytes)
            forEach(step.count, step);
        else
            launchShared(m_stream, psap::placeInTiles<kThreads, kPerThread, kBlocks>,
                         (step.count + Placing::kBoxes - 1) / Placing::kBoxes, kThreads, bytes, step);
    }

    int m_device;
    cudaStream_t m_stream;
    cudaStream_t m_ownStream = nullptr;
    unsigned m_blockThreads;
    std::uint32_t m_sharedBytes = 0;  ///< most shared memory of a block
    std::uint32_t m_multiprocessors = 0;
    bool m_canLaunchDependent = false;
    std::uint64_t m_bytes = 0;
    std::uint64_t m_bytesMoved = 0;
    CubScratch m_scratch;
    ChunkedUpload m_chunkedUpload;
    SideStream m_sideStream;
    EventMark m_mark;
    StageTimer m_stages;
};
}  // namespace cullet::psap
