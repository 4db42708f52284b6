// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/island_tasks.h"

#include <algorithm>
#include <functional>
#include <tuple>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Nanoseconds of a task that is worth taking from a list that all threads share.
constexpr double kLeastWork = 2e4;

/// Nanoseconds of the solver: for a body, and for a manifold and a joint each with no and with one more iteration.
constexpr double kCostOfBody = 150;
constexpr double kCostOfManifold = 700, kCostOfManifoldIteration = 100;
constexpr double kCostOfJoint = 1000, kCostOfJointIteration = 120;
}  // namespace

double IslandTasks::workOf(std::size_t bodies, std::size_t manifolds, std::size_t joints, int iterations)
{
    return kCostOfBody * double(bodies) +
           (kCostOfManifold + kCostOfManifoldIteration * iterations) * double(manifolds) +
           (kCostOfJoint + kCostOfJointIteration * iterations) * double(joints);
}

void IslandTasks::reserve(std::size_t groups, std::size_t sharedThings)
{
    m_sharedThings.reserve(sharedThings);
    m_parents.reserve(groups);
    m_workOfRoot.reserve(groups);
    m_items.reserve(groups);
    m_firstItem.reserve(groups + 1);
    m_taskWork.reserve(groups);
}

void IslandTasks::build(const IslandGroups& islands, const std::vector<IslandGroup>& groups, int iterations)
{
    m_parents.clear();
    for (std::uint32_t group = 0; group < groups.size(); ++group)
        m_parents.push_back(group);
    uniteSharing(islands);
    addUpWork(groups, iterations);
    cutTasks();
}

std::uint32_t IslandTasks::rootOf(std::uint32_t group)
{
    while (m_parents[group] != group)
        group = m_parents[group] = m_parents[m_parents[group]];
    return group;
}

void IslandTasks::unite(std::uint32_t a, std::uint32_t b)
{
    const std::uint32_t rootA = rootOf(a), rootB = rootOf(b);
    m_parents[std::max(rootA, rootB)] = std::min(rootA, rootB);
}

void IslandTasks::uniteSharing(const IslandGroups& islands)
{
    m_sharedThings = islands.sharedThings();
    // By address, which differs from run to run; what shares something does not.
    std::sort(m_sharedThings.begin(), m_sharedThings.end(),
              [](const auto& a, const auto& b) { return std::less<>()(a.thing, b.thing); });
    const void* thing = nullptr;
    std::uint32_t user = IslandGroups::kNoGroup;
    for (const IslandGroups::SharedThing& shared : m_sharedThings)
    {
        const std::uint32_t group = islands.groupOf(shared.island);
        if (group == IslandGroups::kNoGroup)
            continue;
        if (shared.thing == thing)
            unite(user, group);
        thing = shared.thing;
        user = group;
    }
}

void IslandTasks::addUpWork(const std::vector<IslandGroup>& groups, int iterations)
{
    m_workOfRoot.assign(groups.size(), 0);
    m_work = 0;
    m_items.clear();
    for (std::uint32_t group = 0; group < groups.size(); ++group)
    {
        const IslandGroup& counts = groups[group];
        const double work =
            workOf(counts.bodies.size(), counts.manifolds.size(), counts.joints.size(), iterations);
        m_workOfRoot[rootOf(group)] += work;
        m_work += work;
        m_items.push_back({0, rootOf(group), group});
    }
    for (Item& item : m_items)
        item.work = m_workOfRoot[item.root];
    std::sort(
        m_items.begin(), m_items.end(),
        [](const Item& a, const Item& b)
        { return std::make_tuple(-a.work, a.root, a.group) < std::make_tuple(-b.work, b.root, b.group); });
}

void IslandTasks::cutTasks()
{
    m_firstItem.assign(1, 0);
    m_taskWork.clear();
    m_sharingGroups = 0;
    double work = 0;
    for (std::size_t i = 0, end = 0; i < m_items.size(); i = end)
    {
        for (end = i; end < m_items.size() && m_items[end].root == m_items[i].root; ++end)
        {
        }
        m_sharingGroups += end - i > 1 ? static_cast<std::uint32_t>(end - i) : 0;
        work += m_items[i].work;
        if (work < kLeastWork && end < m_items.size())
            continue;
        m_firstItem.push_back(end);
        m_taskWork.push_back(work);
        work = 0;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
