// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/joint_set.h"

#include "cullet/base/threads/parallel_for_each.h"
#include "cullet/plugin/solver/lane_vectors.h"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Blocks and joints for which a task pays.
constexpr std::size_t kJointBlockGrain = 8, kJointGrain = 64;

/// No joint of Bullet has more: two limits, a motor and a spring for each of six axes.
constexpr int kMostRows = 24;

/// A joint's rows as it writes them.
struct InfoRows
{
    btSolverConstraint rows[kMostRows];
    btScalar damping;
};

void clearFeedback(btTypedConstraint& joint)
{
    btJointFeedback* const feedback = joint.getJointFeedback();
    if (feedback == nullptr)
        return;
    feedback->m_appliedForceBodyA.setZero();
    feedback->m_appliedTorqueBodyA.setZero();
    feedback->m_appliedForceBodyB.setZero();
    feedback->m_appliedTorqueBodyB.setZero();
}

/// Prepares a joint for the step.
///
/// @return the number of its rows
int countRows(btTypedConstraint& joint)
{
    joint.buildJacobian();
    joint.internalSetAppliedImpulse(0);
    btTypedConstraint::btConstraintInfo1 request;
    request.m_numConstraintRows = 0;
    if (joint.isEnabled())
        joint.getInfo1(&request);
    return request.m_numConstraintRows;
}

void askForRows(const btContactSolverInfo& info, btTypedConstraint& joint, int rows, InfoRows& to)
{
    std::fill_n(reinterpret_cast<char*>(to.rows), sizeof(btSolverConstraint) * static_cast<std::size_t>(rows),
                '\0');
    for (int i = 0; i < rows; ++i)
    {
        to.rows[i].m_lowerLimit = -SIMD_INFINITY;
        to.rows[i].m_upperLimit = SIMD_INFINITY;
    }
    btSolverConstraint& first = to.rows[0];
    // As Bullet does: of the first row only.
    first.m_cfm = info.m_globalCfm;
    btTypedConstraint::btConstraintInfo2 request;
    request.fps = 1 / info.m_timeStep;
    request.erp = info.m_erp;
    request.m_J1linearAxis = first.m_contactNormal1;
    request.m_J1angularAxis = first.m_relpos1CrossNormal;
    request.m_J2linearAxis = first.m_contactNormal2;
    request.m_J2angularAxis = first.m_relpos2CrossNormal;
    request.rowskip = sizeof(btSolverConstraint) / sizeof(btScalar);
    request.m_constraintError = &first.m_rhs;
    request.m_damping = info.m_damping;
    request.cfm = &first.m_cfm;
    request.m_lowerLimit = &first.m_lowerLimit;
    request.m_upperLimit = &first.m_upperLimit;
    request.m_numIterations = info.m_numIterations;
    joint.getInfo2(&request);
    to.damping = request.m_damping;
}

void setRow(const btSolverConstraint& from, btScalar mostImpulse, int lane, JointRowBlock& to)
{
    setLane(to.linearA, lane, from.m_contactNormal1);
    setLane(to.armA, lane, from.m_relpos1CrossNormal);
    setLane(to.linearB, lane, from.m_contactNormal2);
    setLane(to.armB, lane, from.m_relpos2CrossNormal);
    to.target.lane[lane] = from.m_rhs;
    to.softness.lane[lane] = from.m_cfm;
    // A row without a bound holds or limits a place, and what it wants is to remove an error; motors and springs have bounds.
    const bool removesError = from.m_lowerLimit <= -SIMD_INFINITY || from.m_upperLimit >= SIMD_INFINITY;
    to.isLasting.lane[lane] = removesError ? 0 : 1;
    to.least.lane[lane] = std::max(from.m_lowerLimit, -mostImpulse);
    to.most.lane[lane] = std::min(from.m_upperLimit, mostImpulse);
}

void clearRow(int lane, JointRowBlock& row)
{
    const btVector3 zero(0, 0, 0);
    for (BlockOfVectors* vectors : {&row.linearA, &row.armA, &row.linearB, &row.armB})
        setLane(*vectors, lane, zero);
    for (BlockOf* numbers : {&row.target, &row.softness, &row.least, &row.most, &row.isLasting})
        numbers->lane[lane] = 0;
}
}  // namespace

void JointSet::collect(const btContactSolverInfo& info, btTypedConstraint** joints, int count,
                       SolverBodies& bodies, ParallelLoops& loops)
{
    m_joints.clear();
    m_constraints.clear();
    m_mostIterations = 0;
    m_rowCounts.resize(static_cast<std::size_t>(count));
    parallelForEach(loops, m_rowCounts.size(), kJointGrain,
                    [&](std::uint32_t i) { m_rowCounts[i] = countRows(*joints[i]); });
    for (int i = 0; i < count; ++i)
    {
        // Joints may share a feedback.
        clearFeedback(*joints[i]);
        if (m_rowCounts[static_cast<std::size_t>(i)] > 0)
            add(info, *joints[i], m_rowCounts[static_cast<std::size_t>(i)], bodies);
    }
}

void JointSet::plan(const SolverBodies& bodies)
{
    m_plan.build(m_constraints, bodies.size());
    layOut(bodies);
}

void JointSet::add(const btContactSolverInfo& info, btTypedConstraint& joint, int rows, SolverBodies& bodies)
{
    const std::uint32_t a = bodies.add(joint.getRigidBodyA()), b = bodies.add(joint.getRigidBodyB());
    bodies.bind(a);
    bodies.bind(b);
    const int wanted = joint.getOverrideNumSolverIterations();
    const int iterations = wanted > 0 ? wanted : info.m_numIterations;
    m_mostIterations = std::max(m_mostIterations, iterations);
    m_joints.push_back({&joint, a, b, rows, iterations});
    m_constraints.push_back({bodies.isMoved(a) ? a : kFixedBody, bodies.isMoved(b) ? b : kFixedBody,
                             static_cast<std::uint32_t>(std::max(0, BlockPlan::kKinds - 1 - rows))});
}

void JointSet::layOut(const SolverBodies& bodies)
{
    m_blocks.resize(m_plan.blocks().size());
    m_places.resize(m_joints.size());
    std::uint32_t rows = 0;
    for (std::size_t i = 0; i < m_blocks.size(); ++i)
    {
        JointBlock& block = m_blocks[i];
        const BlockPlan::Block& planned = m_plan.blocks()[i];
        block.lanes = static_cast<std::uint8_t>(planned.lanes);
        block.bodies.clear();
        block.damping = {};
        int mostRows = 0, leastIterations = m_mostIterations;
        for (std::uint32_t lane = 0; lane < planned.lanes; ++lane)
        {
            const std::uint32_t index = m_plan.order()[planned.first + lane];
            const Joint& joint = m_joints[index];
            block.joints[lane] = index;
            block.bodies.set(lane, {joint.a, bodies.isMoved(joint.a)}, {joint.b, bodies.isMoved(joint.b)});
            m_places[index] = static_cast<std::uint32_t>(kBlock * i + lane);
            mostRows = std::max(mostRows, joint.rows);
            leastIterations = std::min(leastIterations, joint.iterations);
        }
        block.first = rows;
        block.rows = static_cast<std::uint8_t>(mostRows);
        block.iterations = static_cast<std::uint32_t>(leastIterations);
        rows += static_cast<std::uint32_t>(mostRows);
    }
    m_rows.allocate(rows);
}

void JointSet::setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                     ParallelLoops& loops)
{
    parallelForEach(loops, m_blocks.size(), kJointBlockGrain,
                    [&](std::uint32_t i) { setUpBlock(step, info, bodies, i); });
}

void JointSet::setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                          std::uint32_t index)
{
    JointBlock& block = m_blocks[index];
    for (int row = 0; row < block.rows; ++row)
    {
        for (int lane = 0; lane < kBlock; ++lane)
        {
            if (lane >= block.lanes || row >= m_joints[block.joints[lane]].rows)
                clearRow(lane, m_rows.data()[block.first + static_cast<unsigned>(row)]);
        }
    }
    for (int lane = 0; lane < block.lanes; ++lane)
        readJoint(info, m_joints[block.joints[lane]], lane, block);
    rowKernels().setUpJoints(step, bodies.states(), block, m_rows.data());
}

void JointSet::readJoint(const btContactSolverInfo& info, const Joint& joint, int lane, JointBlock& block)
{
    InfoRows rows;
    askForRows(info, *joint.joint, joint.rows, rows);
    block.damping.lane[lane] = rows.damping;
    const btScalar mostImpulse = joint.joint->getBreakingImpulseThreshold();
    for (int i = 0; i < joint.rows; ++i)
        setRow(rows.rows[i], mostImpulse, lane, m_rows.data()[block.first + static_cast<unsigned>(i)]);
}

ColourLoop JointSet::solve(const SolverStep& step, int stride, bool relaxes, SolverBodies& bodies,
                           btScalar* residuals)
{
    return {&m_plan.colours(), [=, &step, &bodies](const BlockRange& range)
            {
                btScalar& residual = residuals[range.thread];
                for (std::uint32_t i = range.begin; i < range.end; ++i)
                    residual = std::max(residual,
                                        solveBlock(step, m_blocks[i], range.round * stride, relaxes, bodies));
            }};
}

btScalar JointSet::solveBlock(const SolverStep& step, const JointBlock& block, int iteration, bool relaxes,
                              SolverBodies& bodies)
{
    BlockOf active{};
    const bool areAllActive = static_cast<std::uint32_t>(iteration) < block.iterations;
    for (int lane = 0; lane < block.lanes && !areAllActive; ++lane)
        active.lane[lane] = iteration < m_joints[block.joints[lane]].iterations ? 1 : 0;
    return rowKernels().solveJoints(step, block, areAllActive ? nullptr : &active, relaxes, m_rows.data(),
                                    bodies.motions());
}

ColourLoop JointSet::applyImpulses(SolverBodies& bodies) const
{
    return {&m_plan.colours(), [this, &bodies](const BlockRange& range)
            {
                for (std::uint32_t i = range.begin; i < range.end; ++i)
                    rowKernels().applyJoints(m_blocks[i], m_rows.data(), bodies.motions());
            }};
}

/// Calls visit(row, lane) for all numbers of the rows.
template <class Visit>
void JointSet::forEachRow(const Visit& visit)
{
    for (const JointBlock& block : m_blocks)
    {
        for (std::uint32_t i = block.first; i < block.first + block.rows; ++i)
        {
            for (int lane = 0; lane < kBlock; ++lane)
                visit(m_rows.data()[i], lane);
        }
    }
}

void JointSet::noteSubstep()
{
    forEachRow([](JointRowBlock& row, int lane) { row.sum.lane[lane] += row.impulse.lane[lane]; });
}

void JointSet::forgetImpulses()
{
    noteSubstep();
    forEachRow([](JointRowBlock& row, int lane) { row.impulse.lane[lane] *= row.isLasting.lane[lane]; });
}

void JointSet::writeBack(const SolverStep& step, const btContactSolverInfo& info) const
{
    // In their order: joints may share a feedback.
    for (const std::uint32_t place : m_places)
        writeBack(step, info, m_blocks[place / kBlock], static_cast<int>(place % kBlock));
}

void JointSet::writeBack(const SolverStep& step, const btContactSolverInfo& info, const JointBlock& block,
                         int lane) const
{
    const Joint& joint = m_joints[block.joints[lane]];
    btJointFeedback* const feedback = joint.joint->getJointFeedback();
    const btRigidBody &a = joint.joint->getRigidBodyA(), &b = joint.joint->getRigidBodyB();
    for (int i = 0; i < joint.rows; ++i)
    {
        const JointRowBlock& row = m_rows.data()[block.first + static_cast<unsigned>(i)];
        const bool isSum = step.isSoft && row.isLasting.lane[lane] == 0;
        const btScalar impulse = (isSum ? row.sum : row.impulse).lane[lane],
                       force = impulse / info.m_timeStep;
        if (feedback != nullptr)
        {
            feedback->m_appliedForceBodyA += laneOf(row.linearA, lane) * a.getLinearFactor() * force;
            feedback->m_appliedForceBodyB += laneOf(row.linearB, lane) * b.getLinearFactor() * force;
            feedback->m_appliedTorqueBodyA += laneOf(row.armA, lane) * a.getAngularFactor() * force;
            feedback->m_appliedTorqueBodyB += laneOf(row.armB, lane) * b.getAngularFactor() * force;
        }
        joint.joint->internalSetAppliedImpulse(impulse);
        if (std::abs(impulse) >= joint.joint->getBreakingImpulseThreshold())
            joint.joint->setEnabled(false);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
