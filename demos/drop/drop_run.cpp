// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/drop/drop_run.h"

#include "demos/program/interrupt.h"
#include "demos/program/progress.h"
#include "plugin/broadphase.h"

#include <algorithm>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Steps of one world before it is the other's turn. Long enough to warm the caches up, short enough for both to see
/// the same load of the machine.
constexpr std::uint32_t kBlock = 5;

NamedBroadphase makeContender(const DropOptions& options, const std::string& name)
{
    WorldSceneOptions world = options.world;
    world.backend = name;
    return makeNamedBroadphase(requestForScene(options.scene, world));
}

std::unique_ptr<WorldScene> makeContenderWorld(const DropOptions& options, const std::string& name)
{
    return makeWorldScene(options.scene, options.world, makeContender(options, name));
}

/// Compares the pairs of two worlds with each other and with the exact ones.
class Auditor
{
public:
    Auditor(const DropOptions& options, WorldScene& cullet, WorldScene& dbvt)
        : m_options(options), m_cullet(cullet), m_dbvt(dbvt)
    {
        makeShadows(collectProxies(cullet.world()));
    }

    void audit(AuditCounts& counts)
    {
        const std::vector<AuditedProxy> proxies = collectProxies(m_cullet.world());
        // Bodies have come, gone or changed places.
        if (!m_shadowCullet->fits(proxies))
            makeShadows(proxies);
        const PairDigest exact = digestExact(proxies);
        const PairDigest own = digestCache(m_cullet.world());
        ++counts.audits;
        counts.culletExact += own == exact ? 1 : 0;
        counts.dbvtExact +=
            digestCache(m_dbvt.world()) == digestExact(collectProxies(m_dbvt.world())) ? 1 : 0;
        counts.lockStep +=
            m_shadowDbvt->update(proxies) == own && m_shadowCullet->update(proxies) == own ? 1 : 0;
    }

    void measureMemory(DropResult& result)
    {
        result.cullet.bytes = m_shadowCullet->releaseAndMeasure();
        result.dbvt.bytes = m_shadowDbvt->releaseAndMeasure();
    }

private:
    void makeShadows(const std::vector<AuditedProxy>& proxies)
    {
        m_shadowCullet.emplace(makeContender(m_options, m_options.world.backend), proxies);
        m_shadowDbvt.emplace(makeContender(m_options, "dbvt"), proxies);
    }

    const DropOptions& m_options;
    WorldScene& m_cullet;
    WorldScene& m_dbvt;
    std::optional<ShadowBroadphase> m_shadowCullet;
    std::optional<ShadowBroadphase> m_shadowDbvt;
};

void runBlock(WorldScene& world, std::uint32_t steps, ContenderResult& result)
{
    for (std::uint32_t i = 0; i < steps && !isInterrupted(); ++i)
        result.steps.push_back(world.step());
}

void describeEnd(WorldScene& world, ContenderResult& result)
{
    const NamedBroadphase& broadphase = world.broadphase();
    result.name = broadphase.name;
    result.backend = broadphase.cullet != nullptr ? broadphase.cullet->stats().backendName : broadphase.name;
    result.threads = broadphase.threads;
    result.pairs = world.pairCount();
    result.overlappingPairs = digestCache(world.world()).count;
    result.contactPairs = world.contactPairCount();
    result.stateHash = world.stateHash();
    result.lowestHeight = world.lowestHeight();
}
}  // namespace

DropResult runDrop(const DropOptions& options)
{
    const std::unique_ptr<WorldScene> ownCullet = makeContenderWorld(options, options.world.backend);
    const std::unique_ptr<WorldScene> ownDbvt = makeContenderWorld(options, "dbvt");
    WorldScene& cullet = *ownCullet;
    WorldScene& dbvt = *ownDbvt;
    cullet.setTrace({options.trace, cullet.broadphase().name});
    dbvt.setTrace({options.trace, dbvt.broadphase().name});
    Auditor auditor(options, cullet, dbvt);
    DropResult result;
    Progress progress("stepping", options.steps, options.quiet);
    std::uint32_t lastAudit = 0;
    bool culletFirst = true;
    for (std::uint32_t done = 0; done < options.steps && !isInterrupted(); culletFirst = !culletFirst)
    {
        const std::uint32_t block = std::min(kBlock, options.steps - done);
        if (culletFirst)
            runBlock(cullet, block, result.cullet);
        runBlock(dbvt, block, result.dbvt);
        if (!culletFirst)
            runBlock(cullet, block, result.cullet);
        done += block;
        progress.show(done);
        const bool due = done - lastAudit >= options.auditEvery || done == options.steps;
        if (options.auditEvery == 0 || !due)
            continue;
        auditor.audit(result.audits);
        lastAudit = done;
    }
    result.interrupted = isInterrupted();
    // An interrupted run gets its comparison too, unless a world has not looked for pairs yet.
    const bool haveStepped = !result.cullet.steps.empty() && !result.dbvt.steps.empty();
    if (options.auditEvery != 0 && result.interrupted && haveStepped)
        auditor.audit(result.audits);
    result.bodies = cullet.options().bodies;
    describeEnd(cullet, result.cullet);
    describeEnd(dbvt, result.dbvt);
    auditor.measureMemory(result);
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
