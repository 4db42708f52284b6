// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include "demos/bench/cuda_bench.h"

#include "broad/backend.h"
#include "broad/box_memory.h"
#include "cuda/device_pairs.h"
#include "demos/program/exit_code.h"
#include "demos/program/interrupt.h"
#include "demos/program/statistics.h"
#include "demos/scenes/splitmix64.h"

#include <cuda_runtime_api.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
constexpr int kSets = 3;
constexpr int kWarmUps = 6;
constexpr int kHashedFrames = 11;  // at most kWarmUps and the fewest timed ones

void check(cudaError_t error)
{
    if (error != cudaSuccess)
        throw std::runtime_error(cudaGetErrorString(error));
}

Aabb cubeAround(float x, float y, float z, float half)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

/// W1: spheres of radius 1, constant density, about one pair per body.
std::vector<Aabb> uniformBoxes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::cbrt(32.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, y, z, 1);
    }
    return boxes;
}

/// W2: sides log-uniform from 0.1 to 100, just under five pairs per body.
std::vector<Aabb> manySizes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::cbrt(16457.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, y, z, 0.5f * std::pow(10.0f, random.uniform(-1, 2)));
    }
    return boxes;
}

/// W3: a heap of spheres, dense below, 7.6 pairs per body.
std::vector<Aabb> heap(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::sqrt(0.1055f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, -20 * std::log(1 - random.uniform(0, 1)), z, 1);
    }
    return boxes;
}

/// All boxes have the same extent along x.
std::vector<Aabb> flat(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::sqrt(16.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(0, y, z, 1);
    }
    return boxes;
}

struct Scene
{
    const char* name;
    std::uint32_t bodies;
    std::vector<Aabb> (*make)(std::uint32_t, std::uint64_t);
};

struct Row
{
    std::string scene, variant;
    std::uint64_t bodies = 0, pairs = 0, bytes = 0, hash = 0;
    double gpuMs = 0, endToEndMs = 0;
};

/// Milliseconds of a stream between two places.
class StreamTimer
{
public:
    explicit StreamTimer(cudaStream_t stream) : m_stream(stream)
    {
        check(cudaEventCreate(&m_begin));
        check(cudaEventCreate(&m_end));
    }
    StreamTimer(const StreamTimer&) = delete;
    StreamTimer& operator=(const StreamTimer&) = delete;
    ~StreamTimer()
    {
        cudaEventDestroy(m_begin);
        cudaEventDestroy(m_end);
    }

    void begin() { check(cudaEventRecord(m_begin, m_stream)); }
    void end() { check(cudaEventRecord(m_end, m_stream)); }
    /// Waits for the end.
    double milliseconds() const
    {
        check(cudaEventSynchronize(m_end));
        float ms = 0;
        check(cudaEventElapsedTime(&ms, m_begin, m_end));
        return ms;
    }

private:
    cudaStream_t m_stream;
    cudaEvent_t m_begin = nullptr, m_end = nullptr;
};

std::uint64_t hashOf(const DevicePairs& found)
{
    std::vector<IdPair> pairs(found.count);
    check(cudaMemcpy(pairs.data(), found.pairs, found.count * sizeof(IdPair), cudaMemcpyDeviceToHost));
    std::uint64_t hash = 0;
    for (const IdPair pair : pairs)
        hash += splitMix(pairKey(makePair(pair.a, pair.b)));
    return hash;
}

/// Boxes in device memory.
class DeviceBoxes
{
public:
    explicit DeviceBoxes(const std::vector<Aabb>& boxes)
    {
        check(cudaMalloc(reinterpret_cast<void**>(&m_data), boxes.size() * sizeof(Aabb)));
        check(cudaMemcpy(m_data, boxes.data(), boxes.size() * sizeof(Aabb), cudaMemcpyHostToDevice));
    }
    DeviceBoxes(const DeviceBoxes&) = delete;
    DeviceBoxes& operator=(const DeviceBoxes&) = delete;
    ~DeviceBoxes() { cudaFree(m_data); }
    const Aabb* data() const { return m_data; }

private:
    Aabb* m_data = nullptr;
};

void must(Status status)
{
    if (status != Status::Ok)
        throw std::runtime_error(status == Status::OutOfMemory ? "out of device memory"
                                                               : "the device failed");
}

Row timePairs(const Scene& scene, const std::string& variant, const PsapOptions& options, int frames)
{
    cudaStream_t stream = nullptr;
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    Row row;
    {
        StreamTimer timer(stream);
        std::string why;
        const auto finder = makeDevicePairFinder(options, stream, &why);
        if (!finder)
            throw std::runtime_error(why);
        std::vector<std::unique_ptr<DeviceBoxes>> sets;
        for (int set = 0; set < kSets; ++set)
            sets.push_back(std::make_unique<DeviceBoxes>(scene.make(scene.bodies, 12345 + set)));
        Aabb* current = nullptr;
        check(cudaMalloc(reinterpret_cast<void**>(&current), scene.bodies * sizeof(Aabb)));
        DevicePairs found;
        std::vector<double> times;
        for (int frame = 0; frame < kWarmUps + frames; ++frame)
        {
            // One address, new content: as an engine that integrates on the device would have it.
            check(cudaMemcpyAsync(current, sets[frame % kSets]->data(), scene.bodies * sizeof(Aabb),
                                  cudaMemcpyDeviceToDevice, stream));
            check(cudaStreamSynchronize(stream));
            timer.begin();
            must(finder->enqueue(current, scene.bodies));
            timer.end();
            must(finder->collect(found));
            if (frame >= kWarmUps)
                times.push_back(timer.milliseconds());
            if (frame % kSets == 0 && frame >= kWarmUps && row.pairs == 0)
            {
                row.pairs = found.count;
                row.hash = hashOf(found);
            }
        }
        row.gpuMs = summarise(times).median;
        row.bytes = finder->bytes();
        cudaFree(current);
    }
    check(cudaStreamDestroy(stream));
    row.scene = scene.name;
    row.variant = variant;
    row.bodies = scene.bodies;
    return row;
}

/// update() with boxes that drift by 0.05, all of them or every tenth.
Row timeUpdates(const Scene& scene, const std::string& variant, std::unique_ptr<Backend> backend,
                std::uint32_t every, int frames, std::map<std::string, std::vector<double>>* stages = nullptr)
{
    const std::vector<Aabb> first = scene.make(scene.bodies, 12345);
    // As in a ProxyTable.
    std::vector<Aabb, BoxAllocator<Aabb>> boxes(first.begin(), first.end());
    std::vector<std::uint32_t> ids(scene.bodies), dirty;
    std::vector<std::uint8_t> changes(scene.bodies, kRowCreated);
    for (std::uint32_t body = 0; body < scene.bodies; ++body)
    {
        ids[body] = body + 1;
        dirty.push_back(body);
    }
    SplitMix64 random(7);
    PairDelta delta;
    std::vector<double> times;
    std::uint64_t hash = 0;
    Row row;
    for (int frame = 0; frame < kWarmUps + frames; ++frame)
    {
        ProxyView view;
        view.size = scene.bodies;
        view.boxes = boxes.data();
        view.lockableRows = boxes.capacity();
        view.uniqueIds = ids.data();
        view.changes = changes.data();
        view.dirty = dirty.data();
        view.dirtyCount = static_cast<std::uint32_t>(dirty.size());
        const auto begin = std::chrono::steady_clock::now();
        must(backend->update(view, delta));
        const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - begin;
        if (frame >= kWarmUps)
            times.push_back(passed.count());
        if (stages != nullptr && frame >= kWarmUps)
        {
            for (const StageTime& stage : backend->stats().stages)
                (*stages)[stage.name].push_back(stage.milliseconds);
        }
        // The same frames for every backend, however many are timed.
        for (std::size_t i = 0; frame < kHashedFrames && i < delta.added.size(); ++i)
            hash += splitMix(pairKey(delta.added[i]));
        for (std::size_t i = 0; frame < kHashedFrames && i < delta.removed.size(); ++i)
            hash -= splitMix(pairKey(delta.removed[i]));
        if (frame + 1 == kHashedFrames)
            row.pairs = backend->stats().pairs;
        dirty.clear();
        std::fill(changes.begin(), changes.end(), std::uint8_t{0});
        for (std::uint32_t body = frame % every; body < scene.bodies; body += every)
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                const float step = random.uniform(-0.05f, 0.05f);
                boxes[body].min[axis] += step;
                boxes[body].max[axis] += step;
            }
            dirty.push_back(body);
            changes[body] = kRowMoved;
        }
    }
    row.scene = scene.name;
    row.variant = variant;
    row.bodies = scene.bodies;
    row.bytes = backend->stats().bytes;
    row.hash = hash;
    row.endToEndMs = summarise(times).median;
    return row;
}

/// Collects rows, and prints them.
class Table
{
public:
    explicit Table(ResultFile& file) : m_file(file)
    {
        int version = 0;
        check(cudaRuntimeGetVersion(&version));
        m_cuda = std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
        std::printf("%-6s %-28s %9s %10s %9s %13s  %s\n", "scene", "variant", "bodies", "pairs", "gpu_ms",
                    "end_to_end_ms", "hash");
    }

    void add(const Row& row)
    {
        std::printf("%-6s %-28s %9llu %10llu %9.4f %13.4f  %s\n", row.scene.c_str(), row.variant.c_str(),
                    number(row.bodies), number(row.pairs), row.gpuMs, row.endToEndMs,
                    toHex(row.hash).c_str());
        std::fflush(stdout);
        m_file.addRow({{"benchmark", "cuda"},
                       {"scene", row.scene},
                       {"variant", row.variant},
                       {"bodies", row.bodies},
                       {"pairs", row.pairs},
                       {"gpu_ms", row.gpuMs},
                       {"end_to_end_ms", row.endToEndMs},
                       {"bytes", row.bytes},
                       {"hash", toHex(row.hash)},
                       {"cuda", m_cuda}});
    }

private:
    static unsigned long long number(std::uint64_t value) { return value; }

    ResultFile& m_file;
    std::string m_cuda;
};

PsapOptions literal(PsapCells cells = PsapCells::Automatic, PsapAxis axis = PsapAxis::Variance)
{
    PsapOptions options;
    options.variant = PsapVariant::Literal;
    options.cells = cells;
    options.axis = axis;
    return options;
}

PsapOptions ordered(PsapOrder order)
{
    PsapOptions options;
    options.order = order;
    return options;
}

PsapOptions searched(PsapRowSearch search)
{
    PsapOptions options = ordered(PsapOrder::Counting);
    options.rowSearch = search;
    return options;
}

PsapOptions scaled(float cell, float bin)
{
    PsapOptions options;
    options.cellScale = cell;
    options.binScale = bin;
    return options;
}

void sweepScales(const Scene& scene, Table& table)
{
    for (const float cell : {0.5f, 0.7f, 1.0f, 1.4f, 2.0f})
    {
        for (const float bin : {0.25f, 0.5f, 1.0f, 2.0f, 4.0f})
        {
            char name[64];
            std::snprintf(name, sizeof(name), "rows-%.1f-%.2f", cell, bin);
            table.add(timePairs(scene, name, scaled(cell, bin), 9));
        }
    }
}

/// What each part of the design is worth.
void timeAblation(const Scene& scene, int frames, Table& table)
{
    table.add(timePairs(scene, "rows-radix", ordered(PsapOrder::Radix), frames));
    if (scene.bodies > 4u << 20)
    {
        table.add(timePairs(scene, "rows-counting", ordered(PsapOrder::Counting), frames));
        table.add(timePairs(scene, "rows-tiles", ordered(PsapOrder::Tiles), frames));
        table.add(timePairs(scene, "literal", literal(), 3));
        return;
    }
    PsapOptions bits = literal();
    bits.bitStrings = true;
    PsapOptions split = literal();
    split.splitWork = true;
    const bool isSmall = scene.bodies <= 1u << 16;
    table.add(timePairs(scene, "rows-counting", ordered(PsapOrder::Counting), frames));
    table.add(timePairs(scene, "rows-tiles", ordered(PsapOrder::Tiles), frames));
    table.add(timePairs(scene, "rows-alone", searched(PsapRowSearch::Alone), frames));
    table.add(timePairs(scene, "rows-grouped", searched(PsapRowSearch::Grouped), frames));
    table.add(timePairs(scene, "literal", literal(), frames));
    table.add(timePairs(scene, "literal-bits", bits, frames));
    table.add(timePairs(scene, "literal-split", split, frames));
    table.add(
        timePairs(scene, "literal-principal", literal(PsapCells::Automatic, PsapAxis::Principal), frames));
    // One cell for 64,000 boxes: a sweep over many boxes in each.
    if (isSmall)
        table.add(timePairs(scene, "literal-thesis-cells", literal(PsapCells::Thesis), 3));
}

void timeCrossover(Table& table)
{
    for (std::uint32_t bodies = 512; bodies <= 1u << 15; bodies *= 2)
    {
        const Scene scene = {"W1", bodies, uniformBoxes};
        GridOptions oneThread;
        oneThread.threads = 1;
        for (const std::uint32_t every : {1u, 10u})
        {
            const std::string suffix = every == 1 ? "-all-move" : "-tenth-moves";
            table.add(timeUpdates(scene, "rows-update" + suffix, makeCudaPsapBackend(), every, 60));
            table.add(timeUpdates(scene, "grid-update" + suffix, makeGridBackend(oneThread), every, 60));
            table.add(timeUpdates(scene, "grid-threads-update" + suffix, makeGridBackend(), every, 60));
        }
    }
}

/// How fast this device copies: what bytes are compared with. `bytes` are read, and as many written.
Row timeCopy(const char* variant, cudaMemcpyKind kind)
{
    constexpr std::uint64_t kBytes = 1u << 28;
    void* from = nullptr;
    void* to = nullptr;
    check(kind == cudaMemcpyHostToDevice ? cudaMallocHost(&from, kBytes) : cudaMalloc(&from, kBytes));
    check(cudaMalloc(&to, kBytes));
    StreamTimer timer(nullptr);
    std::vector<double> times;
    for (int run = 0; run < 12; ++run)
    {
        timer.begin();
        check(cudaMemcpyAsync(to, from, kBytes, kind));
        timer.end();
        times.push_back(timer.milliseconds());
    }
    check(cudaFree(to));
    check(kind == cudaMemcpyHostToDevice ? cudaFreeHost(from) : cudaFree(from));
    Row row;
    row.scene = "copy";
    row.variant = variant;
    row.gpuMs = summarise(times).median;
    row.bytes = kBytes;
    return row;
}

/// The stages of update() on the device, a row for each.
void timeStages(const Scene& scene, std::uint32_t every, const std::string& suffix, Table& table)
{
    PsapOptions options;
    options.timeStages = true;
    std::map<std::string, std::vector<double>> times;
    const Row whole =
        timeUpdates(scene, "rows-update" + suffix, makeCudaPsapBackend(options), every, 20, &times);
    for (const auto& [stage, values] : times)
    {
        Row row = whole;
        row.variant += "/" + stage;
        row.gpuMs = summarise(values).median;
        row.endToEndMs = 0;
        table.add(row);
    }
}

void runScene(const Scene& scene, const CudaBenchOptions& options, Table& table)
{
    const bool isQuick = options.quick;
    table.add(timePairs(scene, "rows", {}, isQuick ? 9 : 30));
    if (!options.rowsOnly)
        timeAblation(scene, isQuick ? 3 : 20, table);
    if (options.sweep && scene.bodies <= 1u << 20)
        sweepScales(scene, table);
    if (scene.bodies > 1u << 20 || options.pairsOnly)
        return;
    for (const std::uint32_t every : {1u, 10u})
    {
        const std::string suffix = every == 1 ? "-all-move" : "-tenth-moves";
        table.add(timeUpdates(scene, "rows-update" + suffix, makeCudaPsapBackend(), every, isQuick ? 5 : 20));
        GridOptions oneThread;
        oneThread.threads = 1;
        if (!isQuick)
            table.add(timeUpdates(scene, "grid-update" + suffix, makeGridBackend(oneThread), every, 5));
        if (!isQuick && scene.bodies == 1u << 20)
            timeStages(scene, every, suffix, table);
    }
}

void measure(const CudaBenchOptions& options, Table& table)
{
    const Scene scenes[] = {{"W1", 1u << 14, uniformBoxes}, {"W1", 1u << 16, uniformBoxes},
                            {"W1", 1u << 20, uniformBoxes}, {"W2", 1u << 20, manySizes},
                            {"W3", 1u << 20, heap},         {"flat", 1u << 20, flat},
                            {"W1", 1u << 24, uniformBoxes}};
    if (options.crossover)
        return timeCrossover(table);
    table.add(timeCopy("device-to-device", cudaMemcpyDeviceToDevice));
    table.add(timeCopy("host-to-device", cudaMemcpyHostToDevice));
    for (const Scene& scene : scenes)
    {
        const std::string name = std::string(scene.name) + "-" + std::to_string(scene.bodies);
        if (name.find(options.only) != std::string::npos && !isInterrupted())
            runScene(scene, options, table);
    }
}
}  // namespace

void runCudaBench(const CudaBenchOptions& options, ResultFile& file)
{
    std::string why;
    if (makeDevicePairFinder({}, nullptr, &why) == nullptr)
        throw ProgramError(kExitUnavailable, why);
    try
    {
        Table table(file);
        measure(options, table);
    }
    catch (const std::runtime_error& error)
    {
        throw ProgramError(kExitUnavailable, error.what());
    }
}
}  // namespace cullet
