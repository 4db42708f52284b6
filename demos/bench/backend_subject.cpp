// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/demos/bench/named_backends.h"
#include "cullet/demos/bench/subject.h"

#include <algorithm>
#include <stdexcept>
#include <thread>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::size_t kSetGrain = 8192;  // boxes that a thread sets at a time

/// Unique ids are rows + 1. Boxes are set by as many threads as the backend has.
class BackendSubject : public Subject
{
public:
    explicit BackendSubject(const SubjectRequest& request)
        : m_backend(makeBackend(request.name, request.threads)),
          m_margin(request.margin),
          m_threads(request.threads > 0 ? request.threads
                                        : static_cast<int>(std::thread::hardware_concurrency())),
          m_workers(m_threads)
    {
    }

    void create(const Aabb* boxes, std::size_t count) override
    {
        for (std::size_t i = 0; i < count; ++i)
            m_table.create(boxes[i], m_table.size() + 1, {1, -1});
    }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        const unsigned tasks = m_workers.tasksFor(rows.size(), kSetGrain);
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          const TaskRange range(rows.size(), task, tasks);
                          m_table.setBoxes(boxes.data(), rows.data() + range.begin, range.end - range.begin);
                      });
    }

    void remove(std::uint32_t row) override { m_table.destroy(row); }

    void findPairs() override
    {
        const Status status = m_backend->update(m_table.beginUpdate(m_margin, false), m_delta);
        m_table.endUpdate();
        if (status != Status::Ok)
            throw std::runtime_error(std::string("backend ") + m_backend->name() + " failed");
    }

    void settle() override
    {
        m_next.clear();
        m_next.reserve(m_pairs.size() + m_delta.added.size());
        std::set_difference(m_pairs.begin(), m_pairs.end(), m_delta.removed.begin(), m_delta.removed.end(),
                            std::back_inserter(m_next));
        const auto middle = static_cast<std::ptrdiff_t>(m_next.size());
        m_next.insert(m_next.end(), m_delta.added.begin(), m_delta.added.end());
        std::inplace_merge(m_next.begin(), m_next.begin() + middle, m_next.end());
        m_pairs.swap(m_next);
    }

    void releaseBookkeeping() override
    {
        m_pairs = {};
        m_next = {};
    }

    PairDigest digest(const std::vector<Aabb>& boxes) override
    {
        PairDigest digest;
        for (const Pair pair : m_pairs)
        {
            const Pair rows = {pair.first - 1, pair.second - 1};
            if (overlaps(boxes[rows.first], boxes[rows.second]))
                digest.add(rows);
        }
        return digest;
    }

    std::uint64_t heldPairs() override { return m_pairs.size(); }
    int threads() const override { return m_threads; }
    std::string path() const override { return m_backend->stats().path; }
    BackendStats counters() const override { return m_backend->stats(); }
    ComparisonStats comparisonCounters() const override { return comparisonStatsOf(*m_backend); }

private:
    std::unique_ptr<Backend> m_backend;
    float m_margin;
    int m_threads;
    ParallelLoops m_workers;
    ProxyTable m_table;
    PairDelta m_delta;
    Pairs m_pairs;
    Pairs m_next;
};
}  // namespace

std::unique_ptr<Subject> makeBackendSubject(const SubjectRequest& request)
{
    return std::make_unique<BackendSubject>(request);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
