// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/cuda/narrow/depth_steps.h"
#include "cullet/cuda/narrow/pair_distance.h"
#include "cullet/cuda/narrow/pair_steps.h"

#include <algorithm>
#include <cstdint>

namespace cullet::convex
{
/// Runs the steps of convex pairs on the CPU: in order, in shuffled order, or on threads.
class HostPairExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    /// Calls step(pair) for each pair, and appends it to the queue of its route.
    void testAxes(std::uint32_t count, const TestAxes& step, const PairQueues& queues)
    {
        forEach(count,
                [&](std::uint64_t i)
                {
                    const auto pair = static_cast<std::uint32_t>(i);
                    const PairRoute route = step(pair);
                    if (route == PairRoute::Failed)
                        queues.searched[fetchAdd(&queues.counts->failed, 1)] = pair;
                    else if (route == PairRoute::Remembered)
                        queues.searched[count - 1 - fetchAdd(&queues.counts->remembered, 1)] = pair;
                });
    }

    /// Calls step(pair, route) for each pair of the first queue, and appends the doubtful ones to the second.
    void searchInFloat(std::uint32_t count, const SearchInFloat& step, const PairQueues& queues)
    {
        const std::uint32_t failed = queues.counts->failed;
        const auto search = [&](std::uint32_t pair, PairRoute route)
        {
            if (!step(pair, route))
                queues.doubtful[fetchAdd(&queues.counts->doubtful, 1)] = pair;
        };
        forEach(failed, [&](std::uint64_t i) { search(queues.searched[i], PairRoute::Failed); });
        forEach(queues.counts->remembered,
                [&](std::uint64_t i) { search(queues.searched[count - 1 - i], PairRoute::Remembered); });
    }

    /// Calls step(0).
    template <class Step>
    void forOne(const Step& step)
    {
        forEach(1, step);
    }

    /// Calls step(pair) for each pair.
    void measureDistances(std::uint32_t count, const MeasureDistances& step) { forEach(count, step); }

    /// Lanes for steps whose number the CPU does not know: few, so that each has several.
    std::uint32_t lanesFor(std::uint32_t count, std::uint32_t mostOfProcessor) const
    {
        return std::min(count, std::min(mostOfProcessor, 64u));
    }

    /// Calls step(lane) for each lane.
    template <class Step>
    void forEachLane(std::uint32_t lanes, const Step& step)
    {
        forEach(lanes, step);
    }

    /// Finds the least bound of each queued pair by its lanes, and calls step.finish(index, bound).
    void examineDepths(std::uint32_t /*count*/, const ExamineDepths& step)
    {
        forEach(step.lists.counts->examined,
                [&](std::uint64_t index)
                {
                    LeastBound least;
                    for (std::uint32_t lane = 0; lane < ExamineDepths::kLanes; ++lane)
                        least.take(step.examine(index, lane));
                    step.finish(index, least);
                });
    }

    /// Calls step(pair) for each doubtful pair.
    void searchInDouble(std::uint32_t /*count*/, const SearchInDouble& step, const PairQueues& queues)
    {
        forEach(queues.counts->doubtful, [&](std::uint64_t i) { step(queues.doubtful[i]); });
    }
};
}  // namespace cullet::convex
