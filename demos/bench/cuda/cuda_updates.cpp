// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_updates.h"

#include "cullet/broad/box_memory.h"
#include "cullet/demos/bench/cuda/cuda_drift.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"

#include <algorithm>
#include <chrono>

namespace cullet
{
namespace
{
constexpr int kHashedFrames = 11;  // the smallest number of frames of any run

/// Drifting boxes in a ProxyTable.
class DriftingTable
{
public:
    DriftingTable(const std::vector<Aabb>& first, std::uint32_t every)
        : m_every(every),
          m_boxes(first.begin(), first.end()),
          m_drift(first.size()),
          m_ids(first.size()),
          m_changes(first.size(), kRowCreated)
    {
        for (std::uint32_t body = 0; body < first.size(); ++body)
        {
            m_ids[body] = body + 1;
            m_dirty.push_back(body);
        }
    }

    ProxyView view() const
    {
        ProxyView view;
        view.size = static_cast<std::uint32_t>(m_boxes.size());
        view.boxes = m_boxes.data();
        view.lockableRows = m_boxes.capacity();
        view.uniqueIds = m_ids.data();
        view.changes = m_changes.data();
        view.dirty = m_dirty.data();
        view.dirtyCount = static_cast<std::uint32_t>(m_dirty.size());
        view.lockableDirty = m_dirty.capacity();
        view.anyChanges = m_anyChanges;
        return view;
    }

    void step(std::uint32_t frame)
    {
        m_dirty.clear();
        m_anyChanges = kRowMoved;
        std::fill(m_changes.begin(), m_changes.end(), std::uint8_t{0});
        for (std::uint32_t body = frame % m_every; body < m_boxes.size(); body += m_every)
        {
            m_drift.move(m_boxes[body], body);
            m_dirty.push_back(body);
            m_changes[body] = kRowMoved;
        }
    }

private:
    std::uint32_t m_every;
    std::vector<Aabb, BoxAllocator<Aabb>> m_boxes;
    SteadyDrift m_drift;
    std::vector<std::uint32_t> m_ids;
    std::vector<std::uint32_t, BoxAllocator<std::uint32_t>> m_dirty;
    std::vector<std::uint8_t> m_changes;
    std::uint8_t m_anyChanges = kRowCreated;
};

/// Milliseconds that body() takes.
template <class Body>
double timeOf(const Body& body)
{
    const auto begin = std::chrono::steady_clock::now();
    body();
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - begin;
    return passed.count();
}

double timeUpdate(Backend& backend, const ProxyView& view, PairDelta& delta)
{
    return timeOf([&] { requireOk(backend.update(view, delta)); });
}

/// Milliseconds until the device has finished its work after an update.
double timeAfterUpdate()
{
    return timeOf([] { checkCuda(cudaDeviceSynchronize()); });
}

void addChanges(const PairDelta& delta, std::uint64_t& hash)
{
    for (const Pair pair : delta.added)
        hash += hashOf(pair);
    for (const Pair pair : delta.removed)
        hash -= hashOf(pair);
}

void addStages(const BackendStats& stats, const ProxyView& view, const PairDelta& delta,
               StageSamples& samples)
{
    for (const StageTime& stage : stats.stages)
        samples.times[stage.name].push_back(stage.milliseconds);
    samples.work = {view.size, view.dirtyCount, stats.pairs, delta.added.size() + delta.removed.size()};
}
}  // namespace

CudaRow timeUpdates(const FreshSets& sets, const std::string& variant, std::unique_ptr<Backend> backend,
                    std::uint32_t every, UpdateFrames frames, StageSamples* stages)
{
    DriftingTable boxes(sets.first(), every);
    CudaRow row = rowFor(sets.scene(), variant, "changes where one in " + std::to_string(every) + " moves,");
    PairDelta delta;
    std::vector<double> times;
    for (int frame = 0; frame < frames.warmUps + frames.timed; ++frame)
    {
        const ProxyView view = boxes.view();
        const double passed = timeUpdate(*backend, view, delta);
        const double behind = timeAfterUpdate();
        if (frame >= frames.warmUps)
        {
            times.push_back(passed);
            row.afterUpdateMs += behind / frames.timed;
        }
        if (frame >= frames.warmUps && stages != nullptr)
            addStages(backend->stats(), view, delta, *stages);
        if (frame < kHashedFrames)
            addChanges(delta, row.hash);
        if (frame + 1 == kHashedFrames)
            row.pairs = backend->stats().pairs;
        boxes.step(static_cast<std::uint32_t>(frame));
    }
    row.bytes = backend->stats().bytes;
    row.moved.bus = backend->stats().bytesMoved;
    setMeans(row, &CudaRow::endToEndMs, times);
    return row;
}

CudaRow timeGridPairs(const FreshSets& sets)
{
    const DriftingTable boxes(sets.first(), 1);
    const auto grid = makeGridBackend();
    CudaRow row = rowFor(sets.scene(), "grid-threads", kFreshPairs);
    PairDelta delta;
    std::vector<double> times;
    for (int run = 0; run < 3; ++run)
    {
        grid->restart({});
        times.push_back(timeUpdate(*grid, boxes.view(), delta));
    }
    // Ids count from one, rows from zero.
    for (const Pair pair : delta.added)
        row.hash += hashOf({pair.first - 1, pair.second - 1});
    row.pairs = delta.added.size();
    row.bytes = grid->stats().bytes;
    setTimes(row, &CudaRow::endToEndMs, times);
    return row;
}
}  // namespace cullet
