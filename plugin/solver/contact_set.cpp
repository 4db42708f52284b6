// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/contact_set.h"

#include "cullet/plugin/solver/colour_loops.h"
#include "cullet/plugin/solver/point_source.h"
#include "cullet/plugin/step/prefetch_step.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Two rounds of a mixing function by Chris Wellons ("hash prospector"), each of which changes all bits.
std::uint32_t hashOf(std::uint32_t a, std::uint32_t b)
{
    std::uint32_t hash = 0;
    for (const std::uint32_t id : {a, b})
    {
        hash ^= id;
        hash = (hash ^ hash >> 16) * 0x7feb352du;
        hash = (hash ^ hash >> 15) * 0x846ca68bu;
        hash ^= hash >> 16;
    }
    return hash;
}
}  // namespace

void ContactSet::collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                         SolverBodies& bodies)
{
    m_contacts.clear();
    m_bounces = m_hasOwnSoftness = false;
    for (int i = 0; i < count; ++i)
    {
        // Bullet's own narrow phase has a manifold for each pair of boxes, most of them without points.
        if (i + 2 * kPrefetchDistance < count)
            prefetchBodiesOf(manifolds[i + 2 * kPrefetchDistance]);
        if (i + kPrefetchDistance < count && manifolds[i + kPrefetchDistance]->getNumContacts() > 0)
            prefetchPointsOf(manifolds[i + kPrefetchDistance]);
        add(info, *manifolds[i], bodies);
    }
    m_order.sort(m_contacts, [](const Contact& contact) { return contact.hash; });
}

void ContactSet::plan(const SolverStep& step, SolverBodies& bodies, const ParallelLoops& loops)
{
    m_constraints.clear();
    for (const Contact& contact : m_contacts)
    {
        const auto moved = [&](std::uint32_t body) { return bodies.isMoved(body) ? body : kFixedBody; };
        bodies.bind(contact.a);
        bodies.bind(contact.b);
        m_constraints.push_back({moved(contact.a), moved(contact.b), 4u - contact.points});
    }
    m_plan.build(m_constraints, bodies.size());
    layOut(step, bodies);
    m_residuals.resize(loops.threads());
}

void ContactSet::add(const btContactSolverInfo& info, btPersistentManifold& manifold, SolverBodies& bodies)
{
    const LivePoints live(manifold);
    if (live.count == 0)
        return;
    const auto numberOf = [&](const btCollisionObject* object)
    { return bodies.add(*const_cast<btCollisionObject*>(object)); };
    Contact contact{};
    contact.manifold = &manifold;
    contact.a = numberOf(manifold.getBody0());
    contact.b = numberOf(manifold.getBody1());
    if (!bodies.isMoved(contact.a) && !bodies.isMoved(contact.b))
        return;
    contact.hash = hashOf(bodies.localId(contact.a), bodies.localId(contact.b));
    contact.points = static_cast<std::uint8_t>(live.count);
    for (int k = 0; k < live.count; ++k)
        notePoint(info, *live.points[k], k, contact);
    m_contacts.push_back(contact);
}

void ContactSet::notePoint(const btContactSolverInfo& info, const btManifoldPoint& point, int index,
                           Contact& contact)
{
    constexpr int kOwnSoftness = BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP |
                                 BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING | BT_CONTACT_FLAG_FRICTION_ANCHOR;
    const bool isDeep = info.m_splitImpulse &&
                        point.getDistance() + info.m_linearSlop <= info.m_splitImpulsePenetrationThreshold;
    contact.deep |= static_cast<std::uint8_t>(isDeep << index);
    contact.turns |= static_cast<std::uint8_t>((point.m_combinedRollingFriction > 0) << index);
    m_bounces = m_bounces || point.m_combinedRestitution > 0;
    m_hasOwnSoftness = m_hasOwnSoftness || (point.m_contactPointFlags & kOwnSoftness) != 0;
}

void ContactSet::layOut(const SolverStep& step, const SolverBodies& bodies)
{
    m_blocks.resize(m_plan.blocks().size());
    std::uint32_t rows = 0;
    m_pushCount = 0;
    for (std::size_t i = 0; i < m_blocks.size(); ++i)
    {
        ContactBlock& block = m_blocks[i];
        const BlockPlan::Block& planned = m_plan.blocks()[i];
        fillLanes(bodies, planned, block);
        unsigned deep = 0, turns = 0, points = 0;
        for (std::uint32_t lane = 0; lane < planned.lanes; ++lane)
        {
            const Contact& contact = m_contacts[block.manifolds[lane]];
            deep |= contact.deep;
            turns |= contact.turns;
            points = std::max<unsigned>(points, contact.points);
        }
        block.points = static_cast<std::uint8_t>(points);
        for (unsigned k = 0; k < points; ++k)
        {
            PointRows& point = block.rows[k];
            point.first = rows;
            point.turns = (turns >> k & 1) != 0;
            point.push = step.isSoft || (deep >> k & 1) != 0 ? m_pushCount++ : PointRows::kNoPush;
            rows += 1 + static_cast<unsigned>(step.slidingRows) + (point.turns ? 3 : 0);
        }
    }
    m_rows.allocate(rows);
    m_pushes.allocate(m_pushCount);
}

void ContactSet::fillLanes(const SolverBodies& bodies, const BlockPlan::Block& planned, ContactBlock& block)
{
    block.lanes = static_cast<std::uint8_t>(planned.lanes);
    block.bodies.clear();
    for (std::uint32_t lane = 0; lane < planned.lanes; ++lane)
    {
        const std::uint32_t index = m_plan.order()[planned.first + lane];
        const Contact& contact = m_contacts[index];
        block.manifolds[lane] = index;
        block.bodies.set(lane, {contact.a, bodies.isMoved(contact.a)},
                         {contact.b, bodies.isMoved(contact.b)});
    }
}

void ContactSet::setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                       ParallelLoops& loops)
{
    forEachBlock(m_plan, loops, [&](std::uint32_t i, unsigned) { setUpBlock(step, info, bodies, i); });
}

/// Prefetches the points of the block after this one.
void ContactSet::readAhead(std::uint32_t index) const
{
    if (index + 1 == m_blocks.size())
        return;
    const ContactBlock& next = m_blocks[index + 1];
    for (int lane = 0; lane < next.lanes; ++lane)
        prefetchPointsOf(m_contacts[next.manifolds[lane]].manifold);
}

void ContactSet::setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                            std::uint32_t index)
{
    ContactBlock& block = m_blocks[index];
    readAhead(index);
    btPersistentManifold* manifolds[kBlock];
    LivePoints points[kBlock];
    for (int lane = 0; lane < block.lanes; ++lane)
    {
        manifolds[lane] = m_contacts[block.manifolds[lane]].manifold;
        points[lane] = LivePoints(*manifolds[lane]);
    }
    PointSource sources[4];
    for (int k = 0; k < block.points; ++k)
        readPoints(info, points, manifolds, block.lanes, k, sources[k]);
    rowKernels().setUp(step, bodies.states(), block, sources, m_rows.data(), m_pushes.data(),
                       bodies.motions());
}

btScalar ContactSet::solve(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops)
{
    std::fill(m_residuals.begin(), m_residuals.end(), btScalar(0));
    // All normals first: a stack that friction shakes before its weight is carried does not come to rest.
    for (const auto kernel : {rowKernels().press, rowKernels().rub})
    {
        const auto solveBlock = [&](std::uint32_t i, unsigned thread)
        {
            const btScalar residual = kernel(step, m_blocks[i], m_rows.data(), bodies.motions());
            m_residuals[thread] = std::max(m_residuals[thread], residual);
        };
        forEachBlock(m_plan, loops, solveBlock);
    }
    return *std::max_element(m_residuals.begin(), m_residuals.end());
}

void ContactSet::applyImpulses(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops) const
{
    const RowKernels& kernels = rowKernels();
    forEachBlock(m_plan, loops,
                 [&](std::uint32_t i, unsigned)
                 { kernels.applyContacts(step, m_blocks[i], m_rows.data(), bodies.motions()); });
}

void ContactSet::solveSoft(const SolverStep& step, const SoftStep& substep, SolverBodies& bodies,
                           ParallelLoops& loops)
{
    const RowKernels& kernels = rowKernels();
    forEachBlock(m_plan, loops,
                 [&](std::uint32_t i, unsigned)
                 {
                     kernels.solveSoft(step, substep, m_blocks[i], m_rows.data(), m_pushes.data(),
                                       bodies.pushes(), bodies.motions());
                 });
}

void ContactSet::bounce(SolverBodies& bodies, ParallelLoops& loops)
{
    if (!m_bounces)
        return;
    const RowKernels& kernels = rowKernels();
    forEachBlock(m_plan, loops,
                 [&](std::uint32_t i, unsigned)
                 { kernels.bounce(m_blocks[i], m_rows.data(), m_pushes.data(), bodies.motions()); });
}

btScalar ContactSet::push(SolverBodies& bodies)
{
    const RowKernels& kernels = rowKernels();
    btScalar residual = 0;
    // Few points are deep.
    for (const ContactBlock& block : m_blocks)
    {
        const bool isDeep =
            std::any_of(block.rows, block.rows + block.points,
                        [](const PointRows& point) { return point.push != PointRows::kNoPush; });
        if (isDeep)
            residual =
                std::max(residual, kernels.push(block, m_rows.data(), m_pushes.data(), bodies.pushes()));
    }
    return residual;
}

void ContactSet::writeBack(const SolverStep& step, ParallelLoops& loops) const
{
    const auto writeBlock = [&](std::uint32_t index, unsigned)
    {
        readAhead(index);
        const ContactBlock& block = m_blocks[index];
        for (int lane = 0; lane < block.lanes; ++lane)
        {
            const LivePoints live(*m_contacts[block.manifolds[lane]].manifold);
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
    };
    forEachBlock(m_plan, loops, writeBlock);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
