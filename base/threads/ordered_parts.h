// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
/// Tasks that threads finish in any order, delivered in order in parts of several tasks: each part when all of its
/// tasks are finished.
class OrderedParts
{
public:
    /// Items of a part or a task.
    struct Range
    {
        std::uint64_t begin;
        std::uint64_t end;
    };

    OrderedParts(Range items, std::uint64_t itemsPerTask, unsigned tasksPerPart)
        : m_items(items),
          m_itemsPerTask(itemsPerTask),
          m_tasksPerPart(tasksPerPart),
          m_tasks(static_cast<unsigned>((items.end - items.begin + itemsPerTask - 1) / itemsPerTask)),
          m_parts((m_tasks + tasksPerPart - 1) / tasksPerPart),
          m_done(new std::atomic<unsigned>[m_parts])
    {
        for (unsigned part = 0; part < m_parts; ++part)
            m_done[part].store(0, std::memory_order_relaxed);
    }

    unsigned tasks() const { return m_tasks; }

    Range itemsOfTask(unsigned task) const { return itemsOfTasks(task, task + 1); }

    /// Reports a task as finished. Any thread.
    void finish(unsigned task) { m_done[task / m_tasksPerPart].fetch_add(1, std::memory_order_release); }

    /// Calls take(items, first task, end of tasks) for each finished part that has not been delivered, in order. One
    /// thread.
    template <class Take>
    void deliverReady(const Take& take)
    {
        for (; m_delivered < m_parts; ++m_delivered)
        {
            const unsigned first = m_delivered * m_tasksPerPart;
            const unsigned end = std::min(first + m_tasksPerPart, m_tasks);
            if (m_done[m_delivered].load(std::memory_order_acquire) != end - first)
                return;
            take(itemsOfTasks(first, end), first, end);
        }
    }

private:
    Range itemsOfTasks(unsigned first, unsigned end) const
    {
        return {m_items.begin + m_itemsPerTask * first,
                std::min(m_items.begin + m_itemsPerTask * end, m_items.end)};
    }

    Range m_items;
    std::uint64_t m_itemsPerTask;
    unsigned m_tasksPerPart;
    unsigned m_tasks;
    unsigned m_parts;
    unsigned m_delivered = 0;
    std::unique_ptr<std::atomic<unsigned>[]> m_done;  ///< finished tasks, by part
};
}  // namespace cullet
