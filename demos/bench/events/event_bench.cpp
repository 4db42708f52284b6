// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/events/event_scenes.h"
#include "cullet/demos/bench/events/event_trials.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/box_scene.h"

#include <algorithm>
#include <numeric>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Bodies between two readings of the clock.
constexpr std::uint32_t kChunk = 500;

bool isLate(const Stopwatch& watch, double deadlineMs)
{
    return watch.wallMs() > deadlineMs || isInterrupted();
}

Trial finish(Subject& subject, const Stopwatch& watch, const std::vector<Aabb>& boxes, std::uint32_t done,
             bool finished)
{
    Trial trial;
    if (finished)
        subject.findPairs();
    trial.milliseconds = watch.wallMs();
    trial.bodies = done;
    trial.finished = finished;
    subject.settle();
    trial.digest = subject.digest(boxes);
    return trial;
}

/// Unit cubes whose corners stand at `spacing` steps along x, from the origin.
std::vector<Aabb> makeRowOfBoxes(std::uint32_t count, float spacing)
{
    std::vector<Aabb> boxes(count);
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float x = static_cast<float>(i) * spacing;
        boxes[i] = {{x, 0, 0}, {x + 1, 1, 1}};
    }
    return boxes;
}

std::vector<std::uint32_t> allRows(std::uint32_t count)
{
    std::vector<std::uint32_t> rows(count);
    std::iota(rows.begin(), rows.end(), 0u);
    return rows;
}
}  // namespace

void runCreateBench(const BroadCase& benchCase, ResultFile& file)
{
    const std::vector<Aabb> boxes = makeRowOfBoxes(benchCase.bodies, 1.0f);
    const auto trial = [&](Subject& subject, double deadlineMs)
    {
        const Stopwatch watch;
        std::uint32_t done = 0;
        while (done < benchCase.bodies && !isLate(watch, deadlineMs))
        {
            const std::uint32_t count = std::min(kChunk, benchCase.bodies - done);
            subject.create(boxes.data() + done, count);
            done += count;
        }
        return finish(subject, watch, boxes, done, done == benchCase.bodies);
    };
    runTrials("broad.create", benchCase, boundsOf(boxes), trial, file);
}

void runSpotBench(const BroadCase& benchCase, ResultFile& file)
{
    const std::vector<Aabb> together = makeRowOfBoxes(benchCase.bodies, 0.0f);
    const std::vector<Aabb> apart = makeRowOfBoxes(benchCase.bodies, 2.0f);
    const std::vector<std::uint32_t> rows = allRows(benchCase.bodies);
    for (const bool pairsTogether : {false, true})
    {
        const auto trial = [&](Subject& subject, double)
        {
            const Stopwatch watch;
            subject.create(together.data(), together.size());
            if (pairsTogether)
                subject.findPairs();
            // The list of pairs is bookkeeping of the benchmark, but it needs every delta.
            if (pairsTogether)
                subject.settle();
            subject.setBoxes(apart, rows);
            return finish(subject, watch, apart, benchCase.bodies, true);
        };
        runTrials(pairsTogether ? "broad.spot.together" : "broad.spot", benchCase, boundsOf(apart), trial,
                  file);
    }
}

void runRemoveBench(const BroadCase& benchCase, ResultFile& file)
{
    const auto scene =
        findBoxScene("W1")->make({benchCase.bodies, benchCase.sortedIds, benchCase.options.seed});
    const auto trial = [&](Subject& subject, double deadlineMs)
    {
        std::vector<Aabb> boxes = scene->boxes();
        subject.create(boxes.data(), boxes.size());
        subject.findPairs();
        subject.settle();
        const std::uint32_t wanted = benchCase.bodies / 10;
        const Stopwatch watch;
        std::uint32_t done = 0;
        while (done < wanted && !isLate(watch, deadlineMs))
        {
            const std::uint32_t row = done * 10;
            subject.remove(row);
            boxes[row] = kEmptyAabb;
            ++done;
        }
        return finish(subject, watch, boxes, done, done == wanted);
    };
    runTrials("broad.remove", benchCase, boundsOf(scene->boxes()), trial, file);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
