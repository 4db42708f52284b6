// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/tiles/tile_search.h"
#include "cullet/cuda/kernels/block_append.cuh"

#include <cub/block/block_scan.cuh>

#include <cstdint>

/// The kernels of the search with tiles: a block of threads processes some thousand boxes, or a tile. Their dynamic
/// shared memory depends on the plan.
namespace cullet::psap
{
/// Allocates from a block of shared memory, front to back.
class SharedMemory
{
public:
    __device__ explicit SharedMemory(unsigned char* bytes) : m_bytes(bytes) {}

    template <class T>
    __device__ T* allocate(std::uint32_t count)
    {
        T* begin = reinterpret_cast<T*>(m_bytes);
        m_bytes += bytesOf<T>(count);
        return begin;
    }

    template <class T>
    CULLET_HOST_DEVICE static std::uint32_t bytesOf(std::uint32_t count)
    {
        return (static_cast<std::uint32_t>(sizeof(T)) * count + 15) / 16 * 16;
    }

private:
    unsigned char* m_bytes;
};

/// Writes kThreads * kPerThread boxes into their tiles: ranks them by tile in shared memory, claims as many places in
/// each tile as necessary, and writes. First each box in the tile where it begins, after that the boxes that extend
/// into further tiles, distributed over all threads.
template <unsigned kThreads, unsigned kPerThread>
class TilePlacing
{
public:
    static constexpr std::uint32_t kBoxes = kThreads * kPerThread;
    static constexpr std::uint32_t kNowhere = 0xffffffffu;

    /// A record of a box in a tile where it does not begin.
    struct alignas(8) Extra
    {
        std::uint32_t place;  ///< tile, and rank in it
        std::uint32_t code;   ///< index in m_wide, and axes along which the box begins in the tile
    };

    static std::uint32_t sharedBytes(std::uint32_t tiles)
    {
        return SharedMemory::bytesOf<std::uint8_t>(kStepBytes) +
               2 * SharedMemory::bytesOf<std::uint32_t>(tiles) + SharedMemory::bytesOf<std::uint32_t>(2) +
               SharedMemory::bytesOf<Extra>(kBoxes) + SharedMemory::bytesOf<SortRecord>(kBoxes);
    }

    __device__ TilePlacing(const PlaceInTiles& placing, SharedMemory memory)
        : m_step(placing),
          m_ofStep(memory.allocate<std::uint8_t>(kStepBytes)),
          m_counts(memory.allocate<std::uint32_t>(placing.shape.tiles)),
          m_bases(memory.allocate<std::uint32_t>(placing.shape.tiles)),
          m_found(memory.allocate<std::uint32_t>(2)),
          m_extras(memory.allocate<Extra>(kBoxes)),
          m_wide(memory.allocate<SortRecord>(kBoxes))
    {
    }

    __device__ void operator()()
    {
        const TileSteps steps = m_step.plan->steps;
        const std::uint32_t tiles = m_step.shape.tiles;
        SortRecord records[kPerThread];
        bool isTaken[kPerThread];
        load(records, isTaken);
        for (std::uint32_t k = threadIdx.x; k < kStepBytes / 4; k += kThreads)
            reinterpret_cast<std::uint32_t*>(m_ofStep)[k] =
                reinterpret_cast<const std::uint32_t*>(m_step.plan->ofStep)[k];
        for (std::uint32_t tile = threadIdx.x; tile < tiles; tile += kThreads)
            m_counts[tile] = 0;
        if (threadIdx.x < 2)
            m_found[threadIdx.x] = 0;
        __syncthreads();

        std::uint32_t places[kPerThread];
        rank(steps, records, isTaken, places);
        __syncthreads();
        rankExtras(steps);
        __syncthreads();
        reserve(tiles);
        __syncthreads();
        store(records, places);
        storeExtras();
    }

private:
    static constexpr std::uint32_t kStepBytes = 3 * TileSteps::kPerAxis;
    static constexpr std::uint32_t kRankBits = 16;

    __device__ void load(SortRecord (&records)[kPerThread], bool (&isTaken)[kPerThread]) const
    {
#pragma unroll
        for (unsigned k = 0; k < kPerThread; ++k)
        {
            const std::uint64_t i = blockIdx.x * std::uint64_t{kBoxes} + k * kThreads + threadIdx.x;
            const Aabb box = loadBox(m_step.boxes, i < m_step.count ? i : m_step.count - 1);
            m_step.begin(i);
            const std::uint32_t mark = m_step.keepCopy(i, box);
            isTaken[k] = i < m_step.count && m_step.accepts(i, box);
            records[k] =
                recordOf(box, hideFromCompiler(m_step.plan->axes), static_cast<std::uint32_t>(i), mark);
        }
    }

    /// The same axes, hidden from the compiler. It would otherwise generate a loop of thousands of instructions for
    /// each order of the axes.
    __device__ static Axes hideFromCompiler(Axes axes)
    {
        asm volatile("" : "+r"(axes.s), "+r"(axes.u), "+r"(axes.v));
        return axes;
    }

    __device__ void rank(const TileSteps& steps, const SortRecord (&records)[kPerThread],
                         const bool (&isTaken)[kPerThread], std::uint32_t (&places)[kPerThread])
    {
#pragma unroll
        for (unsigned k = 0; k < kPerThread; ++k)
        {
            places[k] = kNowhere;
            if (!isTaken[k])
                continue;
            const TileRange range = tilesOf(steps, m_ofStep, records[k]);
            places[k] = rankIn(range.home(steps));
            if (!range.isOne())
                m_wide[atomicAdd(&m_found[0], 1u)] = records[k];
        }
    }

    __device__ std::uint32_t rankIn(std::uint32_t tile)
    {
        return tile << kRankBits | atomicAdd(&m_counts[tile], 1u);
    }

    __device__ void rankExtras(const TileSteps& steps)
    {
        for (std::uint32_t wide = threadIdx.x; wide < m_found[0]; wide += kThreads)
            tilesOf(steps, m_ofStep, m_wide[wide])
                .forEach(steps,
                         [&](std::uint32_t tile, std::uint32_t begins)
                         {
                             if (begins == kBeginsThere)
                                 return;
                             const std::uint32_t extra = atomicAdd(&m_found[1], 1u);
                             if (extra < kBoxes)
                                 m_extras[extra] = {rankIn(tile), wide << 3 | begins};
                             else
                                 m_step.countOverflow();
                         });
    }

    __device__ void reserve(std::uint32_t tiles)
    {
#pragma unroll 4
        for (std::uint32_t tile = threadIdx.x; tile < tiles; tile += kThreads)
        {
            const std::uint32_t count = m_counts[tile];
            m_bases[tile] = count != 0 ? m_step.reserve(tile, count) : kNoPlace;
        }
    }

    __device__ std::uint32_t placeOf(std::uint32_t ranked) const
    {
        if (ranked == kNowhere)
            return kNoPlace;
        const std::uint32_t base = m_bases[ranked >> kRankBits];
        return base == kNoPlace ? kNoPlace : base + (ranked & ((1u << kRankBits) - 1));
    }

    __device__ void store(const SortRecord (&records)[kPerThread],
                          const std::uint32_t (&places)[kPerThread]) const
    {
#pragma unroll
        for (unsigned k = 0; k < kPerThread; ++k)
            storeRecord(m_step.records, placeOf(places[k]), records[k]);
    }

    __device__ void storeExtras() const
    {
        const std::uint32_t extras = m_found[1] < kBoxes ? m_found[1] : kBoxes;
        for (std::uint32_t k = threadIdx.x; k < extras; k += kThreads)
        {
            const Extra extra = m_extras[k];
            const std::uint32_t place = placeOf(extra.place);
            if (place == kNoPlace)
                continue;
            SortRecord record = m_wide[extra.code >> 3];
            record.back.bin = TileMark::with(record.back.bin, extra.code & kBeginsThere);
            m_step.records[place] = record;
        }
    }

    const PlaceInTiles& m_step;
    std::uint8_t* m_ofStep;   ///< copy of TilePlan::ofStep
    std::uint32_t* m_counts;  ///< [tiles] number of the block's records
    std::uint32_t* m_bases;   ///< [tiles] first place of the block's records
    std::uint32_t* m_found;   ///< number of boxes in several tiles, and of their further records
    Extra* m_extras;
    SortRecord* m_wide;  ///< boxes in several tiles
};

/// Warps per multiprocessor, which limits the registers. Turing's holds 32, later ones 48 and more.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
inline constexpr unsigned kTileWarps = 32;
#else
inline constexpr unsigned kTileWarps = 48;
#endif

extern __shared__ __align__(128) unsigned char tileMemory[];

template <unsigned kThreads, unsigned kPerThread, unsigned kBlocks>
__global__ void __launch_bounds__(kThreads, kBlocks) placeInTiles(const PlaceInTiles step)
{
    TilePlacing<kThreads, kPerThread>(step, SharedMemory(tileMemory))();
}

/// The block that sorts a tile (sortTile()).
///
/// @tparam kPerThread most numbers that a thread keeps, in registers
template <unsigned kThreads, unsigned kPerThread>
struct TileBlock
{
    using Scan = cub::BlockScan<std::uint32_t, kThreads, cub::BLOCK_SCAN_WARP_SCANS>;

    std::uint32_t owned[kPerThread] = {};

    __device__ static std::uint32_t threads() { return kThreads; }
    __device__ static std::uint32_t thread() { return threadIdx.x; }
    __device__ static void sync() { __syncthreads(); }
    __device__ std::uint32_t exclusiveSum(std::uint32_t value)
    {
        __shared__ typename Scan::TempStorage scratch;
        std::uint32_t sum = 0;
        Scan(scratch).ExclusiveSum(value, sum);
        return sum;
    }
    template <class Body>
    __device__ void forEach(std::uint32_t count, const Body& body) const
    {
        for (std::uint32_t i = threadIdx.x; i < count; i += kThreads)
            body(i);
    }
    template <class Body>
    __device__ void forEachOwned(std::uint32_t count, const Body& body)
    {
#pragma unroll
        for (unsigned k = 0; k < kPerThread; ++k)
        {
            const std::uint32_t i = k * kThreads + threadIdx.x;
            if (i < count)
                body(i, owned[k]);
        }
    }
};

/// Searches a tile: sorts its boxes by cell in shared memory, and tests each against the boxes around it there. Pairs
/// that may overlap are queued by the warp, and tested exactly as soon as there is one for each lane.
template <class Step, unsigned kThreads, unsigned kPerThread>
class TileSearching
{
public:
    static constexpr unsigned kWarps = kThreads / 32;
    static constexpr std::uint32_t kMostRoom = kThreads * kPerThread;

    static std::uint32_t sharedBytes(const TileShape& shape)
    {
        return SharedMemory::bytesOf<std::uint16_t>(2 * SortedTile::twosFor(shape.cells)) +
               SharedMemory::bytesOf<TileBox>(shape.room) + SharedMemory::bytesOf<std::uint16_t>(shape.room) +
               SharedMemory::bytesOf<std::uint32_t>(kWarps * kWordsPerWarp) +
               SharedMemory::bytesOf<RowPair>(kWarps * BallotEmitter<>::kRoom);
    }

    __device__ TileSearching(const Step& searching, SharedMemory memory)
        : m_step(searching),
          m_tile{memory.allocate<std::uint16_t>(2 * SortedTile::twosFor(searching.shape.cells)),
                 memory.allocate<TileBox>(searching.shape.room),
                 memory.allocate<std::uint16_t>(searching.shape.room)},
          m_ranges(memory.allocate<std::uint32_t>(kWarps * kWordsPerWarp) + threadIdx.x / 32 * kWordsPerWarp),
          m_hits(m_ranges + kRangeWords),
          m_pairs(memory.allocate<RowPair>(kWarps * BallotEmitter<>::kRoom) +
                  threadIdx.x / 32 * BallotEmitter<>::kRoom),
          m_records(searching.recordsOf(blockIdx.x))
    {
    }

    __device__ void operator()(const PairList& list)
    {
        const std::uint32_t tile = blockIdx.x;
        BallotEmitter<> emit(m_pairs, list);
        if (threadIdx.x == 0)
            m_step.begin(tile);
        const auto counts = m_step.countsOf(tile);
        const TileFrame frame(*m_step.plan, tile);
        TileBlock<kThreads, kPerThread> block;
        sortTile(block, frame, m_records, counts.boxes, m_step.shape.cells, m_tile);
        search(frame, counts.boxes, emit);
        if (counts.unboundedCount != 0)
        {
            for (std::uint32_t k = threadIdx.x; k < counts.boxes; k += kThreads)
                m_step.testAgainstUnbounded(m_records[k], counts.unboundedCount, emit);
            if (threadIdx.x == 0)
                m_step.searchAmongUnbounded(tile, counts.unboundedCount, emit);
        }
        __syncwarp();
        emit.finish();
    }

private:
    static constexpr std::uint32_t kRangeWords = 32 * TileRanges::kCount;
    static constexpr std::uint32_t kHits = 64;  ///< 31 may remain, and each lane adds one
    static constexpr std::uint32_t kWordsPerWarp = kRangeWords + kHits;
    static constexpr unsigned kAll = 0xffffffffu;
    static_assert(kMostRoom <= TileShape::kMostRoom, "the ids of a SortedTile have no room for more");

    __device__ void search(const TileFrame& frame, std::uint32_t count, BallotEmitter<>& emit)
    {
        const std::uint32_t reach[3] = {m_step.plan->reach[0], m_step.plan->reach[1], m_step.plan->reach[2]};
        const auto entryTest = m_step.partners.isNew.preloaded();
        const unsigned lane = threadIdx.x % 32;
        std::uint32_t bufferedCount = 0;
        for (std::uint32_t base = threadIdx.x - lane; base < count; base += kThreads)
        {
            const std::uint32_t slot = base + lane;
            const bool isBox = slot < count;
            const TileBox self = m_tile.boxes[isBox ? slot : count - 1];
            const TileRanges ranges(frame, reach, m_tile.starts, self, slot, isBox);
            const std::uint32_t* range = m_ranges + lane;
            const std::uint32_t* lastRange = range + 32 * keepFilled(ranges, lane);
            std::uint32_t k = 0;
            std::uint32_t end = 0;
            for (;;)
            {
                if (k >= end && range != lastRange)
                {
                    k = *range & 0xffffu;
                    end = *range >> 16;
                    range += 32;
                }
                const bool isTest = k < end;
                if (!emit.any(isTest))
                    break;
                keepHit(isTest && self.mayMeet(m_tile.boxes[k]), slot << 16 | k, bufferedCount);
                if (bufferedCount >= 32)
                {
                    report(32, entryTest, emit);
                    dropHits(bufferedCount);
                }
                ++k;
            }
        }
        if (emit.any(bufferedCount != 0))
            report(bufferedCount, entryTest, emit);
    }

    /// Stores the non-empty ranges of a lane.
    ///
    /// @return their number
    __device__ std::uint32_t keepFilled(const TileRanges& ranges, unsigned lane)
    {
        std::uint32_t filled = 0;
#pragma unroll
        for (int r = 0; r < TileRanges::kCount; ++r)
        {
            if (ranges.begin[r] < ranges.end[r])
                m_ranges[32 * filled++ + lane] = ranges.begin[r] | ranges.end[r] << 16;
        }
        return filled;
    }

    __device__ void keepHit(bool isHit, std::uint32_t hit, std::uint32_t& bufferedCount)
    {
        const unsigned lanes = __ballot_sync(kAll, isHit);
        if (isHit)
            m_hits[bufferedCount + __popc(lanes & ((1u << threadIdx.x % 32) - 1u))] = hit;
        bufferedCount += __popc(lanes);
    }

    /// Removes the first 32 hits.
    __device__ void dropHits(std::uint32_t& bufferedCount)
    {
        const unsigned lane = threadIdx.x % 32;
        bufferedCount -= 32;
        const std::uint32_t rest = lane < bufferedCount ? m_hits[32 + lane] : 0;
        __syncwarp();
        if (lane < bufferedCount)
            m_hits[lane] = rest;
        __syncwarp();
    }

    /// Appends the pairs among the first hits of the queue.
    template <class Test>
    __device__ void report(std::uint32_t hits, const Test& entryTest, BallotEmitter<>& emit) const
    {
        __syncwarp();
        const unsigned lane = threadIdx.x % 32;
        RowPair pair = {0, 0};
        bool isPair = false;
        if (lane < hits)
        {
            const std::uint32_t a = m_tile.ids[m_hits[lane] >> 16];
            const std::uint32_t b = m_tile.ids[m_hits[lane] & 0xffffu];
            if (SortedTile::isHome(a, b))
            {
                const SortRecord first = m_records[SortedTile::recordOf(a)];
                const SortRecord second = m_records[SortedTile::recordOf(b)];
                pair = {first.back.row, second.back.row};
                isPair = m_step.reports(first, second, entryTest);
            }
        }
        emit.append(isPair, pair);
        __syncwarp();
    }

    const Step& m_step;
    SortedTile m_tile;
    std::uint32_t* m_ranges;      ///< of the warp: kCount for each lane, 32 apart
    std::uint32_t* m_hits;        ///< of the warp: two slots each
    RowPair* m_pairs;             ///< of the warp
    const SortRecord* m_records;  ///< of the tile
};

template <class Step, unsigned kThreads, unsigned kPerThread>
__global__ void __launch_bounds__(kThreads, 32 * kTileWarps / kThreads)
    searchTiles(const Step step, const PairList list)
{
    TileSearching<Step, kThreads, kPerThread>(step, SharedMemory(tileMemory))(list);
}
}  // namespace cullet::psap
