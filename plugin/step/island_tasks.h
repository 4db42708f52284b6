// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/step/island_groups.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Divides groups of islands into tasks that may run at the same time. Groups that share a body or a joint's feedback
/// are in one task, in Bullet's order. Large tasks come first, and small groups are put together.
class IslandTasks
{
public:
    /// Nanoseconds of one thread that the solver takes for a group of so many bodies, manifolds and joints.
    static double workOf(std::size_t bodies, std::size_t manifolds, std::size_t joints, int iterations);

    /// Reserves memory for as many groups. Throws std::bad_alloc.
    void reserve(std::size_t groups, std::size_t sharedThings);

    /// @param iterations of the solver, for the estimate of the work
    void build(const IslandGroups& islands, const std::vector<IslandGroup>& groups, int iterations);

    unsigned tasks() const { return static_cast<unsigned>(m_firstItem.size() - 1); }

    /// Calls solve(number of the group) for each group of a task.
    template <class Solve>
    void forEachGroup(unsigned task, const Solve& solve) const
    {
        for (std::size_t i = m_firstItem[task]; i < m_firstItem[task + 1]; ++i)
            solve(m_items[i].group);
    }

    /// Nanoseconds of one thread for a task.
    double taskWork(unsigned task) const { return m_taskWork[task]; }
    /// Nanoseconds of one thread for all tasks.
    double work() const { return m_work; }
    /// Nanoseconds of one thread for the largest task, which no number of threads makes shorter.
    double longestWork() const { return m_items.empty() ? 0 : m_items.front().work; }
    /// Groups that share something with another one.
    std::uint32_t sharingGroups() const { return m_sharingGroups; }

private:
    struct Item
    {
        double work;         ///< of all groups with the same root
        std::uint32_t root;  ///< the first group that shares something with this one, directly or not
        std::uint32_t group;
    };

    std::uint32_t rootOf(std::uint32_t group);
    void unite(std::uint32_t a, std::uint32_t b);
    void uniteSharing(const IslandGroups& islands);
    void addUpWork(const std::vector<IslandGroup>& groups, int iterations);
    void cutTasks();

    std::vector<IslandGroups::SharedThing> m_sharedThings;
    std::vector<std::uint32_t> m_parents;  ///< [group]
    std::vector<double> m_workOfRoot;      ///< [group]
    std::vector<Item> m_items;
    std::vector<std::size_t> m_firstItem;  ///< [task], and the end
    std::vector<double> m_taskWork;        ///< [task]
    double m_work = 0;
    std::uint32_t m_sharingGroups = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
