// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/support/cuda_table.h"

#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <numeric>

namespace cullet
{
namespace
{
constexpr std::uint64_t kCopiedBytes = 1u << 28;

/// Milliseconds of several copies from device memory, or from pinned CPU memory.
std::vector<double> timeCopies(bool isFromHost)
{
    void* from = nullptr;
    void* to = nullptr;
    checkCuda(isFromHost ? cudaMallocHost(&from, kCopiedBytes) : cudaMalloc(&from, kCopiedBytes));
    checkCuda(cudaMalloc(&to, kCopiedBytes));
    StreamTimer timer(nullptr);
    std::vector<double> times;
    for (int run = 0; run < 12; ++run)
    {
        timer.begin();
        checkCuda(cudaMemcpyAsync(to, from, kCopiedBytes,
                                  isFromHost ? cudaMemcpyHostToDevice : cudaMemcpyDeviceToDevice));
        timer.end();
        times.push_back(timer.milliseconds());
    }
    checkCuda(cudaFree(to));
    checkCuda(isFromHost ? cudaFreeHost(from) : cudaFree(from));
    return times;
}
}  // namespace

CudaRow rowFor(const FreshScene& scene, const std::string& variant, const std::string& question)
{
    CudaRow row;
    row.scene = scene.name;
    row.variant = variant;
    row.question = question;
    row.bodies = scene.bodies;
    return row;
}

void setTimes(CudaRow& row, double CudaRow::*median, const std::vector<double>& times)
{
    const Statistics statistics = summarise(times);
    row.*median = statistics.median;
    row.p90Ms = statistics.p90;
    row.maxMs = statistics.max;
}

void setMeans(CudaRow& row, double CudaRow::*mean, const std::vector<double>& times)
{
    setTimes(row, mean, times);
    row.*mean = std::accumulate(times.begin(), times.end(), 0.0) / static_cast<double>(times.size());
}

CudaTable::CudaTable(ResultFile& file) : m_file(file)
{
    int version = 0;
    checkCuda(cudaRuntimeGetVersion(&version));
    m_cuda = std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
    std::printf("%-6s %-28s %9s %10s %9s %13s %9s %9s %7s %9s  %s\n", "scene", "variant", "bodies", "pairs",
                "gpu_ms", "end_to_end_ms", "p90_ms", "max_ms", "x floor", "x uniform", "hash");
}

void CudaTable::addCopies()
{
    CudaRow device, bus;
    device.scene = bus.scene = "copy";
    device.variant = "device-to-device";
    bus.variant = "host-to-device";
    device.bytes = bus.bytes = kCopiedBytes;
    setTimes(device, &CudaRow::gpuMs, timeCopies(false));
    setTimes(bus, &CudaRow::gpuMs, timeCopies(true));
    add(device);
    add(bus);
    m_copies = {2 * kCopiedBytes / device.gpuMs, kCopiedBytes / bus.gpuMs};
}

double CudaTable::overUniform(const CudaRow& row)
{
    if (row.question != kFreshPairs || row.gpuMs <= 0)
        return 0;
    const std::string prefix = std::to_string(row.bodies) + " ";
    if (row.scene == "W1")
        m_uniformMs[prefix + row.variant] = row.gpuMs;
    std::string variant = row.variant;
    const bool isAlongAxis = variant.size() > 2 && variant[variant.size() - 2] == '-';
    if (isAlongAxis && m_uniformMs.count(prefix + variant) == 0)
        variant.resize(variant.size() - 2);
    const auto found = m_uniformMs.find(prefix + variant);
    return found == m_uniformMs.end() ? 0 : row.gpuMs / found->second;
}

void CudaTable::add(const CudaRow& row)
{
    const double ratio = overUniform(row);
    const double floorMs = m_copies.floorOf(row.moved);
    const double timesFloor = floorMs > 0 ? std::max(row.gpuMs, row.endToEndMs) / floorMs : 0;
    std::printf("%-6s %-28s %9" PRIu64 " %10" PRIu64 " %9.4f %13.4f %9.4f %9.4f %7.1f %9.2f  %s\n",
                row.scene.c_str(), row.variant.c_str(), row.bodies, row.pairs, row.gpuMs, row.endToEndMs,
                row.p90Ms, row.maxMs, timesFloor, ratio, toHex(row.hash).c_str());
    std::fflush(stdout);
    Json line = {{"benchmark", "cuda"},
                 {"scene", row.scene},
                 {"variant", row.variant},
                 {"bodies", row.bodies},
                 {"pairs", row.pairs},
                 {"gpu_ms", row.gpuMs},
                 {"end_to_end_ms", row.endToEndMs},
                 {"p90_ms", row.p90Ms},
                 {"max_ms", row.maxMs},
                 {"bytes", row.bytes}};
    if (floorMs > 0)
        line.update({{"bytes_moved", row.moved.all()}, {"floor_ms", floorMs}, {"times_floor", timesFloor}});
    if (ratio > 0)
        line["over_uniform"] = ratio;
    if (row.afterUpdateMs > 0)
        line["behind_ms"] = row.afterUpdateMs;
    if (row.overBest > 0)
        line["over_best"] = row.overBest;
    if (row.question == kFreshPairs)
        line["late_frames"] = row.lateFrames;
    line.update({{"hash", toHex(row.hash)}, {"cuda", m_cuda}});
    m_file.addRow(line);
    if (!row.question.empty())
        m_hashes.require(
            row.question + " of " + row.scene + " with " + std::to_string(row.bodies) + " bodies",
            row.variant, row.pairs, row.hash);
}
}  // namespace cullet
