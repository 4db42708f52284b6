// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/summary.h"

#include "cullet/preload/message.h"

#include <algorithm>
#include <cinttypes>
#include <map>
#include <mutex>
#include <string>

namespace cullet::preload
{
namespace
{
struct Totals
{
    std::mutex mutex;
    std::map<const BroadphaseCounts*, const Broadphase*> living;
    std::uint64_t broadphasesTotal = 0;
    BroadphaseCounts ended;
    std::string backend = "none";  ///< of the broad phase that ended last
    std::map<const btCollisionDispatcher*, const IsaGjkRegistration*> dispatchers;
    std::uint64_t dispatchersTotal = 0;
    IsaGjkStats replaced;
};

/// Never destroyed: the program may destroy its worlds after this library's statics.
Totals& totals()
{
    static auto& result = *new Totals;
    return result;
}

void add(const BroadphaseCounts& from, BroadphaseCounts& to)
{
    to.queries += from.queries;
    to.updates += from.updates;
    to.updateSeconds += from.updateSeconds;
    to.mostBodies = std::max(to.mostBodies, from.mostBodies);
    to.mostPairs = std::max(to.mostPairs, from.mostPairs);
}

void add(const IsaGjkStats& from, IsaGjkStats& to)
{
    to.separatedTotal += from.separatedTotal;
    to.touchingTotal += from.touchingTotal;
    to.depthsTotal += from.depthsTotal;
    to.notConvergedTotal += from.notConvergedTotal;
    to.delegatedTotal += from.delegatedTotal;
    to.exactTotal += from.exactTotal;
}

const char* precisionName()
{
    return sizeof(btScalar) == sizeof(float) ? "float" : "double";
}

void writeBroadphases(Totals& all)
{
    BroadphaseCounts sum;
    add(all.ended, sum);
    std::string backend = all.backend;
    for (const auto& [counts, broadphase] : all.living)
    {
        add(*counts, sum);
        backend = broadphase->stats().backendName;
    }
    printLine("broad phases: %" PRIu64 " (%s, %s); at most %" PRIu64 " bodies and %" PRIu64 " pairs; %" PRIu64
              " updates in %.3f ms, %" PRIu64 " queries",
              all.broadphasesTotal, precisionName(), backend.c_str(), sum.mostBodies, sum.mostPairs,
              sum.updates, 1e3 * sum.updateSeconds, sum.queries.load());
}

void writeIsaGjk(Totals& all)
{
    IsaGjkStats sum = all.replaced;
    for (const auto& [dispatcher, isaGjk] : all.dispatchers)
        add(isaGjk->stats(), sum);
    printLine("ISA-GJK in %" PRIu64 " dispatchers: %" PRIu64 " pairs found apart, %" PRIu64
              " touching, %" PRIu64 " without an answer, %" PRIu64 " left to Bullet",
              all.dispatchersTotal, sum.separatedTotal, sum.touchingTotal, sum.notConvergedTotal,
              sum.delegatedTotal);
}
}  // namespace

void begin(const BroadphaseCounts& counts, const Broadphase& broadphase)
{
    Totals& all = totals();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.living[&counts] = &broadphase;
    ++all.broadphasesTotal;
}

void end(const BroadphaseCounts& counts)
{
    Totals& all = totals();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto found = all.living.find(&counts);
    all.backend = found->second->stats().backendName;
    all.living.erase(found);
    add(counts, all.ended);
}

void beforeRegistration(const btCollisionDispatcher& dispatcher)
{
    Totals& all = totals();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto found = all.dispatchers.find(&dispatcher);
    if (found != all.dispatchers.end())
        add(found->second->stats(), all.replaced);
}

void afterRegistration(const btCollisionDispatcher& dispatcher, const IsaGjkRegistration& isaGjk)
{
    Totals& all = totals();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.dispatchers[&dispatcher] = &isaGjk;
    ++all.dispatchersTotal;
}

void writeSummary()
{
    Totals& all = totals();
    const std::lock_guard<std::mutex> lock(all.mutex);
    writeBroadphases(all);
    if (all.dispatchersTotal != 0)
        writeIsaGjk(all);
}
}  // namespace cullet::preload
