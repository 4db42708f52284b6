// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/drop_run.h"

#include "cullet/demos/drop/drop_audit.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"
#include "cullet/plugin/broadphase.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Steps of one world before the next world's turn. Long enough to warm the caches, short enough that all worlds run
/// under the same load of the machine.
constexpr std::uint32_t kBlock = 5;

/// A world and its results.
struct Contender
{
    std::unique_ptr<WorldScene> world;
    ContenderResult result;
    std::vector<WorldSnapshot> snapshots;  ///< of the last block
    bool isAudited = false;                ///< the last snapshot is of the last step
};

Contender makeContender(const DropOptions& options, DropPart part)
{
    Contender contender;
    contender.world = makeWorldScene(options.scene, optionsOf(part, options.world, options.fixedNarrow));
    contender.world->setTrace({options.trace, nameOf(part)});
    contender.result.part = part;
    return contender;
}

/// Takes a snapshot after each step to be audited, so that the comparison does not run between two steps.
void runBlock(const DropOptions& options, std::uint32_t steps, Contender& contender)
{
    contender.snapshots.clear();
    for (std::uint32_t i = 0; i < steps && !isInterrupted(); ++i)
    {
        contender.result.steps.push_back(contender.world->step());
        const std::size_t done = contender.result.steps.size();
        contender.isAudited =
            options.auditEvery != 0 && (done % options.auditEvery == 0 || done == options.steps);
        if (contender.isAudited)
            contender.snapshots.push_back(snapshotOf(*contender.world));
    }
}

void describeEnd(Contender& contender)
{
    WorldScene& world = *contender.world;
    ContenderResult& result = contender.result;
    const NamedBroadphase& broadphase = world.broadphase();
    result.title = titleOf(result.part, broadphase);
    result.isCullet = broadphase.cullet != nullptr;
    result.backend = result.isCullet ? broadphase.cullet->stats().backendName : broadphase.name;
    result.narrow = world.options().narrow;
    result.update = world.options().update;
    result.threads = broadphase.threads;
    result.pairs = world.pairCount();
    result.overlappingPairs = digestCache(world.world()).count;
    result.contactPairs = world.contactPairCount();
    result.stateHash = world.stateHash();
    result.lowestHeight = world.lowestHeight();
}

/// All worlds of a run, and the comparisons between them.
class DropRun
{
public:
    explicit DropRun(const DropOptions& options)
        : m_options(options), m_contenders(makeContenders(options)), m_lockStep(options, *shadowed().world)
    {
    }

    DropResult run()
    {
        Progress progress("stepping", m_options.steps, m_options.quiet);
        const std::size_t count = m_contenders.size();
        std::size_t first = 0;
        for (std::uint32_t done = 0; done < m_options.steps && !isInterrupted(); ++first)
        {
            const std::uint32_t block = std::min(kBlock, m_options.steps - done);
            for (std::size_t i = 0; i < count; ++i)
            {
                Contender& contender = m_contenders[(first + i) % count];
                runBlock(m_options, block, contender);
                audit(contender);
            }
            done += block;
            progress.show(done);
        }
        return finish();
    }

private:
    static std::vector<Contender> makeContenders(const DropOptions& options)
    {
        std::vector<Contender> contenders;
        for (const DropPart part : options.parts)
            contenders.push_back(makeContender(options, part));
        return contenders;
    }

    /// The first world with cullet's broad phase, if any: its boxes are given to both broad phases.
    Contender& shadowed()
    {
        const bool isStock = m_contenders.front().result.part == DropPart::Stock;
        return m_contenders[isStock && m_contenders.size() > 1 ? 1 : 0];
    }

    void audit(Contender& contender)
    {
        auditExact(contender.snapshots, contender.result.exact);
        if (&contender == &shadowed())
            m_lockStep.audit(contender.snapshots, m_result.lockStep);
    }

    /// Audits an interrupted run, except worlds that have not computed pairs yet.
    void auditInterrupted()
    {
        for (Contender& contender : m_contenders)
        {
            if (m_options.auditEvery == 0 || contender.isAudited || contender.result.steps.empty())
                continue;
            contender.snapshots = {snapshotOf(*contender.world)};
            audit(contender);
        }
    }

    void compareUpdates()
    {
        const ContenderResult* dispatcher = nullptr;
        for (const Contender& contender : m_contenders)
        {
            const ContenderResult& result = contender.result;
            if (result.part == DropPart::Dispatcher)
                dispatcher = &result;
            else if (result.part == DropPart::World && dispatcher != nullptr &&
                     dispatcher->steps.size() == result.steps.size())
                m_result.update.add(dispatcher->stateHash == result.stateHash);
        }
    }

    DropResult finish()
    {
        m_result.interrupted = isInterrupted();
        if (m_result.interrupted)
            auditInterrupted();
        m_result.bodies = m_contenders.front().world->options().bodies;
        for (Contender& contender : m_contenders)
            describeEnd(contender);
        compareUpdates();
        for (Contender& contender : m_contenders)
            m_result.contenders.push_back(std::move(contender.result));
        m_lockStep.measureMemory(m_result.contenders);
        return std::move(m_result);
    }

    const DropOptions& m_options;
    std::vector<Contender> m_contenders;
    LockStepAuditor m_lockStep;
    DropResult m_result;
};
}  // namespace

bool DropResult::agrees() const
{
    return lockStep.agrees() && update.agrees() &&
           std::all_of(contenders.begin(), contenders.end(),
                       [](const ContenderResult& contender) { return contender.exact.agrees(); });
}

DropResult runDrop(const DropOptions& options)
{
    return DropRun(options).run();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
