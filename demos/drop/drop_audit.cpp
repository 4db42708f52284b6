// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/drop_audit.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
NamedBroadphase makeShadow(const DropOptions& options, DropPart part)
{
    return makeNamedBroadphase(
        requestForScene(options.scene, optionsOf(part, options.world, options.fixedNarrow)));
}
}  // namespace

WorldSnapshot snapshotOf(WorldScene& world)
{
    return {collectProxies(world.world()), digestCache(world.world())};
}

void auditExact(const std::vector<WorldSnapshot>& snapshots, AuditCount& count)
{
    for (const WorldSnapshot& snapshot : snapshots)
        count.add(snapshot.pairs == digestExact(snapshot.proxies));
}

LockStepAuditor::LockStepAuditor(const DropOptions& options, WorldScene& world) : m_options(options)
{
    makeShadows(collectProxies(world.world()));
}

void LockStepAuditor::audit(const std::vector<WorldSnapshot>& snapshots, AuditCount& count)
{
    for (const auto& [proxies, pairs] : snapshots)
    {
        // Bodies were created, removed or renumbered.
        if (!m_cullet->fits(proxies))
            makeShadows(proxies);
        const bool isSame = m_dbvt->update(proxies) == pairs;
        count.add(m_cullet->update(proxies) == pairs && isSame);
    }
}

void LockStepAuditor::measureMemory(std::vector<ContenderResult>& contenders)
{
    const std::uint64_t cullet = m_cullet->releaseAndMeasure();
    const std::uint64_t dbvt = m_dbvt->releaseAndMeasure();
    for (ContenderResult& contender : contenders)
        contender.bytes = contender.part == DropPart::Stock ? dbvt : cullet;
}

void LockStepAuditor::makeShadows(const std::vector<AuditedProxy>& proxies)
{
    m_cullet.emplace(makeShadow(m_options, DropPart::Broadphase), proxies);
    m_dbvt.emplace(makeShadow(m_options, DropPart::Stock), proxies);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
