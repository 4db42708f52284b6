// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/contact_set.h"

#include "cullet/base/threads/parallel_for_each.h"
#include "cullet/plugin/solver/point_source.h"
#include "cullet/plugin/step/prefetch_step.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Blocks and contacts for which a task pays.
constexpr std::size_t kContactBlockGrain = 64, kContactGrain = 2048;

/// Whether a part of a body is not lighter than the other body of a contact. Where it is, an iteration would take away an
/// eighth of their approach at worst: a plate would sink into the floor.
bool canSplit(const SolverBodies& bodies, std::uint32_t body, std::uint32_t other)
{
    return bodies.isMoved(body) && bodies.inverseMass(body) * kBlock <= bodies.inverseMass(other);
}
}  // namespace

void ContactSet::collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                         SolverBodies& bodies, ParallelLoops& loops)
{
    m_contacts.collect(info, manifolds, count, bodies, loops);
}

void ContactSet::plan(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops)
{
    m_constraints.resize(m_contacts.size());
    const auto moved = [&](std::uint32_t body) { return bodies.isMoved(body) ? body : kFixedBody; };
    parallelForEach(loops, m_contacts.size(), kContactGrain,
                    [&](std::uint32_t i)
                    {
                        const Contact& contact = m_contacts[i];
                        m_constraints[i] = {moved(contact.a), moved(contact.b), 4u - contact.points};
                    });
    for (std::uint32_t i = 0; step.isSoft && i < m_contacts.size(); ++i)
    {
        bodies.bind(m_contacts[i].a);
        bodies.bind(m_contacts[i].b);
    }
    m_plan.build(m_constraints, bodies.size(),
                 [&bodies](std::uint32_t body, std::uint32_t other)
                 { return canSplit(bodies, body, other); });
    splitBodies(bodies);
    layOut(step, bodies, loops);
}

void ContactSet::layOut(const SolverStep& step, const SolverBodies& bodies, ParallelLoops& loops)
{
    m_blocks.resize(m_plan.blocks().size());
    parallelForEach(loops, m_blocks.size(), kContactBlockGrain,
                    [&](std::uint32_t i) { fillBlock(bodies, i, m_blocks[i]); });
    std::uint32_t rows = 0, pushes = 0;
    for (ContactBlock& block : m_blocks)
    {
        for (int k = 0; k < block.points; ++k)
        {
            PointRows& point = block.rows[k];
            point.first = rows;
            point.push = step.isSoft || point.isDeep ? pushes++ : PointRows::kNoPush;
            rows += 1 + static_cast<unsigned>(step.slidingRows) + (point.turns ? 3 : 0);
        }
    }
    m_rows.allocate(rows);
    m_pushes.allocate(pushes);
    findDeepBlocks();
}

/// Few points are deep, so that the split impulse has blocks and colours of its own.
void ContactSet::findDeepBlocks()
{
    m_deepBlocks.clear();
    m_deepColours.clear();
    const auto isDeep = [](const PointRows& point) { return point.isDeep; };
    for (const BlockPlan::Colour& colour : m_plan.colours())
    {
        const auto begin = static_cast<std::uint32_t>(m_deepBlocks.size());
        for (std::uint32_t i = colour.begin; i < colour.end; ++i)
        {
            if (std::any_of(m_blocks[i].rows, m_blocks[i].rows + m_blocks[i].points, isDeep))
                m_deepBlocks.push_back(i);
        }
        const auto end = static_cast<std::uint32_t>(m_deepBlocks.size());
        if (begin != end)
            m_deepColours.push_back({begin, end, colour.isSerial});
    }
}

/// Divides the bodies that lanes share.
void ContactSet::splitBodies(SolverBodies& bodies)
{
    const std::vector<BlockPlan::Colour>& colours = m_plan.colours();
    const bool hasShared = !colours.empty() && colours.back().isSerial;
    m_firstShared = hasShared ? colours.back().begin : static_cast<std::uint32_t>(m_plan.blocks().size());
    m_sharedBodies.clear();
    for (std::uint32_t i = m_firstShared; i < m_plan.blocks().size(); ++i)
    {
        const std::uint32_t shared = m_plan.blocks()[i].shared;
        m_sharedBodies.push_back({shared, shared != kFixedBody ? bodies.split(shared) : kFixedBody});
    }
}

void ContactSet::spreadShared(std::uint32_t block, SolverMotion* motions) const
{
    const SharedBody& shared = m_sharedBodies[block - m_firstShared];
    if (shared.number != kFixedBody)
        SolverBodies::spread(shared.number, shared.firstPart, motions);
}

/// Calls solve(first, count) for the blocks of a range, before and after which a body that lanes share is divided and put
/// together.
template <class Solve>
void ContactSet::forBlocks(const BlockRange& range, SolverMotion* motions, const Solve& solve) const
{
    if (range.begin < m_firstShared)
        return solve(range.begin, range.end - range.begin);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
    {
        spreadShared(i, motions);
        solve(i, 1);
        const SharedBody& shared = m_sharedBodies[i - m_firstShared];
        if (shared.number != kFixedBody)
            SolverBodies::merge(shared.number, shared.firstPart, motions);
    }
}

/// Calls visit(block) as forBlocks() does.
template <class Visit>
void ContactSet::forEachBlock(const BlockRange& range, SolverMotion* motions, const Visit& visit) const
{
    forBlocks(range, motions,
              [&](std::uint32_t first, std::uint32_t count)
              {
                  for (std::uint32_t i = first; i < first + count; ++i)
                      visit(i);
              });
}

void ContactSet::fillBlock(const SolverBodies& bodies, std::uint32_t index, ContactBlock& block) const
{
    const BlockPlan::Block& planned = m_plan.blocks()[index];
    block.lanes = static_cast<std::uint8_t>(planned.lanes);
    block.isPlain = true;
    block.bodies.clear();
    unsigned deep = 0, turns = 0, points = 0;
    for (std::uint32_t lane = 0; lane < planned.lanes; ++lane)
    {
        const std::uint32_t manifold = m_plan.order()[planned.first + lane];
        const Contact& contact = m_contacts[manifold];
        block.manifolds[lane] = manifold;
        const auto bodyOf = [&](std::uint32_t number) -> BlockBodies::Body
        {
            const bool isShared = number != kFixedBody && number == planned.shared;
            return {isShared ? m_sharedBodies[index - m_firstShared].firstPart + lane : number,
                    bodies.isMoved(number)};
        };
        block.bodies.set(lane, bodyOf(contact.a), bodyOf(contact.b));
        block.isPlain = block.isPlain && contact.isPlain;
        deep |= contact.deep;
        turns |= contact.turns;
        points = std::max<unsigned>(points, contact.points);
    }
    block.points = static_cast<std::uint8_t>(points);
    for (unsigned k = 0; k < points; ++k)
    {
        block.rows[k].turns = (turns >> k & 1) != 0;
        block.rows[k].isDeep = (deep >> k & 1) != 0;
    }
}

void ContactSet::setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                       ColourLoops& colours, ParallelLoops& loops)
{
    const auto setUpBlocks = [&](const BlockRange& range)
    { forEachBlock(range, bodies.motions(), [&](std::uint32_t i) { setUpBlock(step, info, bodies, i); }); };
    colours.run({&m_plan.colours(), setUpBlocks}, loops);
}

void ContactSet::setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                            std::uint32_t index)
{
    if (index + 1 < m_blocks.size())
    {
        const ContactBlock& next = m_blocks[index + 1];
        for (int lane = 0; lane < next.lanes; ++lane)
            prefetchPointsOf(m_contacts[next.manifolds[lane]].manifold);
    }
    ContactBlock& block = m_blocks[index];
    BlockPoints points;
    points.lanes = block.lanes;
    points.isPlain = block.isPlain && !step.keepsSlides;
    for (int lane = 0; lane < block.lanes; ++lane)
    {
        const Contact& contact = m_contacts[block.manifolds[lane]];
        points.manifolds[lane] = contact.manifold;
        points.live[lane] = LivePoints(*contact.manifold, contact.live);
    }
    const RowKernels& kernels = rowKernels();
    PointSource sources[4];
    for (int k = 0; k < block.points; ++k)
    {
        points.choose(k, sources[k]);
        kernels.readPoints(step, sources[k]);
        readRarities(info, points, block.rows[k].turns, sources[k]);
    }
    kernels.setUp(step, bodies.states(), block, sources, m_rows.data(), m_pushes.data(), bodies.motions());
}

void ContactSet::addLoops(const SolverStep& step, int iterations, SolverBodies& bodies, btScalar* residuals,
                          std::vector<ColourLoop>& to)
{
    const auto add = [&](bool presses, bool rubs)
    {
        const auto solveBlocks =
            [this, &step, &bodies, presses, rubs, iterations, residuals](const BlockRange& range)
        {
            if (range.round >= iterations)
                return;
            btScalar& residual = residuals[range.thread];
            const auto solve = [&](std::uint32_t first, std::uint32_t count)
            {
                const RowKernels& kernels = rowKernels();
                const auto run = [&](auto kernel)
                {
                    residual = std::max(residual, kernel(step, m_blocks.data() + first, count, m_rows.data(),
                                                         bodies.motions()));
                };
                if (presses)
                    run(kernels.press);
                if (rubs)
                    run(kernels.rub);
            };
            forBlocks(range, bodies.motions(), solve);
        };
        to.push_back({&m_plan.colours(), solveBlocks});
    };
    if (step.interleaves)
        return add(true, true);
    // All normals first: a stack that friction shakes before its weight is carried does not come to rest.
    add(true, false);
    add(false, true);
}

ColourLoop ContactSet::applyImpulses(const SolverStep& step, SolverBodies& bodies) const
{
    return {&m_plan.colours(), [this, &step, &bodies](const BlockRange& range)
            {
                forEachBlock(
                    range, bodies.motions(),
                    [&](std::uint32_t i)
                    { rowKernels().applyContacts(step, m_blocks[i], m_rows.data(), bodies.motions()); });
            }};
}

ColourLoop ContactSet::solveSoft(const SolverStep& step, const SoftStep& substep, SolverBodies& bodies)
{
    return {&m_plan.colours(), [this, &step, &substep, &bodies](const BlockRange& range)
            {
                for (std::uint32_t i = std::max(range.begin, m_firstShared); i < range.end; ++i)
                    spreadShared(i, bodies.pushes());
                forBlocks(range, bodies.motions(),
                          [&](std::uint32_t first, std::uint32_t count)
                          {
                              rowKernels().solveSoft(step, substep, m_blocks.data() + first, count,
                                                     m_rows.data(), m_pushes.data(), bodies.pushes(),
                                                     bodies.motions());
                          });
            }};
}

void ContactSet::bounce(SolverBodies& bodies, ColourLoops& colours, ParallelLoops& loops)
{
    if (!m_contacts.bounces())
        return;
    const auto bounceBlocks = [&](const BlockRange& range)
    {
        forEachBlock(range, bodies.motions(),
                     [&](std::uint32_t i)
                     { rowKernels().bounce(m_blocks[i], m_rows.data(), m_pushes.data(), bodies.motions()); });
    };
    colours.run({&m_plan.colours(), bounceBlocks}, loops);
}

ColourLoop ContactSet::push(SolverBodies& bodies, btScalar* residuals)
{
    return {&m_deepColours, [this, &bodies, residuals](const BlockRange& range)
            {
                btScalar& residual = residuals[range.thread];
                const auto pushBlock = [&](std::uint32_t block)
                {
                    residual = std::max(residual, rowKernels().push(m_blocks[block], m_rows.data(),
                                                                    m_pushes.data(), bodies.pushes()));
                };
                for (std::uint32_t i = range.begin; i < range.end; ++i)
                    forEachBlock({m_deepBlocks[i], m_deepBlocks[i] + 1, range.thread, range.round},
                                 bodies.pushes(), pushBlock);
            }};
}

void ContactSet::writeBack(const SolverStep& step, ParallelLoops& loops) const
{
    parallelForEach(loops, m_blocks.size(), kContactBlockGrain,
                    [&](std::uint32_t i)
                    {
                        if (i + 1 < m_blocks.size())
                            readAhead(m_blocks[i + 1]);
                        writeBlock(step, m_blocks[i]);
                    });
}

/// Prefetches the impulses of a block's points.
void ContactSet::readAhead(const ContactBlock& block) const
{
    for (int lane = 0; lane < block.lanes; ++lane)
    {
        const Contact& contact = m_contacts[block.manifolds[lane]];
        const LivePoints live(*contact.manifold, contact.live);
        for (int k = 0; k < live.count; ++k)
            prefetchByte(&live.points[k]->m_appliedImpulse, 0);
    }
}

void ContactSet::writeBlock(const SolverStep& step, const ContactBlock& block) const
{
    for (int lane = 0; lane < block.lanes; ++lane)
    {
        const Contact& contact = m_contacts[block.manifolds[lane]];
        const LivePoints live(*contact.manifold, contact.live);
        for (int k = 0; k < live.count; ++k)
        {
            const RowBlock* row = m_rows.data() + block.rows[k].first;
            btManifoldPoint& point = *live.points[k];
            // Of the whole step.
            point.m_appliedImpulse = step.isSoft ? m_pushes.data()[block.rows[k].push].impulse.lane[lane]
                                                 : row[0].impulse.lane[lane];
            point.m_appliedImpulseLateral1 = row[1].impulse.lane[lane] / step.share;
            if (step.slidingRows == 2)
                point.m_appliedImpulseLateral2 = row[2].impulse.lane[lane] / step.share;
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
