// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/contact_jobs.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/convex/child_memory.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <optional>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Nanoseconds of a task: long beside the cost of taking it, short beside the wait for the last one.
constexpr double kWorkOfTask = 2e4;

/// Nanoseconds of the longest jobs.
constexpr double kMostWork = 8000;

/// Dispatches for which the work of the last jobs is remembered.
constexpr unsigned kMemory = 16;

/// Nanoseconds of a job.
double costOf(PairKind kind)
{
    switch (kind)
    {
        case PairKind::IsaGjk:
            return 1200;
        case PairKind::Boxes:
            return 300;
        case PairKind::Compound:
            return 3000;
        case PairKind::Mesh:
            return kMostWork;
        default:
            return 130;
    }
}
}  // namespace

void ContactJobs::Failure::keep(std::size_t place) noexcept
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    if (m_error != nullptr && m_place <= place)
        return;
    m_place = place;
    m_error = std::current_exception();
}

void ContactJobs::Failure::rethrow()
{
    if (m_error != nullptr)
        std::rethrow_exception(std::exchange(m_error, nullptr));
}

bool ContactJobs::tryAdd(const ContactJob& job, PairKind kind) noexcept
try
{
    add(job, kind);
    m_work += costOf(kind);
    return true;
}
catch (const std::exception&)
{
    return false;
}

void ContactJobs::add(const ContactJob& job, PairKind kind)
{
    if (kind != PairKind::Compound)
        return m_jobs.push_back({job, kNotRecorded});
    // If there is no memory for the job, an empty record is left.
    m_recorded.emplace_back();
    m_jobs.push_back({job, std::uint32_t(m_recorded.size() - 1)});
    m_recorded.back().before = std::exchange(m_ofPass, {});
    if (!m_passRecording)
        m_passRecording.emplace(m_dispatcher, m_ofPass, Recording::Of::Pass);
}

bool ContactJobs::areTooFew(std::uint64_t pairs)
{
    if (m_dispatches++ % kMemory == 0)
        m_workOfPair = kMostWork;
    return double(pairs) * m_workOfPair < 2 * ParallelLoops::workPerThread;
}

void ContactJobs::run(const btDispatcherInfo& info)
{
    if (m_jobs.empty())
        return;
    m_passRecording.reset();
    runAll(info);
    // An error of a job is the older one.
    try
    {
        repeatRecords();
    }
    catch (...)
    {
        m_failure.keep(~std::size_t(0));
    }
    m_failure.rethrow();
}

void ContactJobs::repeatRecords()
{
    for (Recorded& recorded : m_recorded)
    {
        recorded.before.replay(m_dispatcher);
        recorded.own.replay(m_dispatcher);
    }
    m_ofPass.replay(m_dispatcher);
    m_recorded.clear();
}

void ContactJobs::runAll(const btDispatcherInfo& info)
{
    const Clear afterwards{*this};
    m_stats.jobs += m_jobs.size();
    m_stats.jobsTotal += m_jobs.size();
    m_workOfPair = m_work / double(m_jobs.size());
    bool hasBegun = false;
    try
    {
        m_loops.runRegion(m_work,
                          [&]
                          {
                              hasBegun = true;
                              runOnAllThreads(info);
                          });
    }
    catch (const std::exception&)
    {
        if (hasBegun)
            m_failure.keep(0);
        else
            run(info, 0, m_jobs.size());
    }
}

void ContactJobs::run(const btDispatcherInfo& info, std::size_t begin, std::size_t end) noexcept
{
    for (std::size_t i = begin; i < end; ++i)
    {
        try
        {
            run(m_jobs[i], info);
        }
        catch (...)
        {
            m_failure.keep(i);
        }
    }
}

void ContactJobs::run(const Entry& entry, const btDispatcherInfo& info)
{
    if (entry.recorded == kNotRecorded)
        return entry.job.run(info);
    const Recording scope(m_dispatcher, m_recorded[entry.recorded].own, Recording::Of::Job);
    entry.job.run(info);
}

void ContactJobs::runOnAllThreads(const btDispatcherInfo& info)
{
    const std::size_t count = m_jobs.size();
    const unsigned tasks = m_loops.tasksFor(count, 1) > 1 ? taskCount() : 1;
    if (tasks == 1)
        return run(info, 0, count);
    m_stats.dividedTotal += count;
    std::atomic<std::uint64_t> helped{0};
    m_loops.run(tasks,
                [&](unsigned task, unsigned thread)
                {
                    const TaskRange range(count, task, tasks);
                    std::optional<ChildMemory> memory;
                    if (thread != 0)
                    {
                        memory.emplace();
                        helped.fetch_add(range.end - range.begin, std::memory_order_relaxed);
                    }
                    run(info, range.begin, range.end);
                });
    m_stats.helpedTotal += helped;
}

unsigned ContactJobs::taskCount() const
{
    const double wanted = m_work / std::min(kWorkOfTask, ParallelLoops::workPerThread);
    return static_cast<unsigned>(std::clamp(wanted, 1.0, double(m_jobs.size())));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
