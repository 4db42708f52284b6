// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/four_lanes.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Tests boxes of one tree against those of another one in another frame, as btCompoundCompoundCollisionAlgorithm does.
class TreeBoxTest
{
public:
    /// @param frame    of the second tree in that of the first
    /// @param distance by which boxes of the second tree are grown
    TreeBoxTest(const btTransform& frame, btScalar distance) : m_distance(distance)
    {
        const btMatrix3x3& basis = frame.getBasis();
        const btMatrix3x3 magnitudes = basis.absolute();
        for (int i = 0; i < 3; ++i)
        {
            const btVector3 column = basis.getColumn(i), magnitude = magnitudes.getColumn(i);
            m_columns[i] = Lanes::load(column.m_floats);
            m_magnitudes[i] = Lanes::load(magnitude.m_floats);
        }
        m_origin = Lanes::load(frame.getOrigin().m_floats);
    }

    bool operator()(const btDbvtVolume& a, const btDbvtVolume& b) const
    {
        const Lanes lowest = Lanes::load(b.Mins().m_floats), highest = Lanes::load(b.Maxs().m_floats);
        const Lanes half = (highest - lowest) * btScalar(0.5), centre = (highest + lowest) * btScalar(0.5);
        const Lanes middle = m_columns[0] * centre.spread<0>() + m_columns[1] * centre.spread<1>() +
                             m_columns[2] * centre.spread<2>() + m_origin;
        const Lanes extent = m_magnitudes[0] * half.spread<0>() + m_magnitudes[1] * half.spread<1>() +
                             m_magnitudes[2] * half.spread<2>();
        const Lanes low = middle - extent - m_distance, high = middle + extent + m_distance;
        const Lanes isOverlap =
            (low <= Lanes::load(a.Maxs().m_floats)) & (Lanes::load(a.Mins().m_floats) <= high);
        return (isOverlap.bits() & 7u) == 7u;
    }

private:
    using Lanes = FourLanes<btScalar>;

    const btScalar m_distance;
    Lanes m_columns[3], m_magnitudes[3], m_origin;
};

/// Calls visit(leaf of A, leaf of B) for the leaves of two trees whose boxes, and those of all nodes above them, overlap;
/// in the order of btCompoundCompoundCollisionAlgorithm.
template <class Visit>
void forEachLeafPair(const btDbvtNode* a, const btDbvtNode* b, const TreeBoxTest& overlap, const Visit& visit)
{
    if (a == nullptr || b == nullptr)
        return;
    using Nodes = btDbvt::sStkNN;
    Nodes room[btDbvt::DOUBLE_STACKSIZE];
    btAlignedObjectArray<Nodes> stack;
    stack.initializeFromBuffer(room, 1, btDbvt::DOUBLE_STACKSIZE);
    stack[0] = Nodes(a, b);
    while (stack.size() > 0)
    {
        const Nodes top = stack[stack.size() - 1];
        stack.pop_back();
        if (!overlap(top.a->volume, top.b->volume))
            continue;
        if (top.a->isleaf() && top.b->isleaf())
        {
            visit(top.a->dataAsInt, top.b->dataAsInt);
            continue;
        }
        const bool isLeafA = top.a->isleaf(), isLeafB = top.b->isleaf();
        for (int ofB = 0; ofB < (isLeafB ? 1 : 2); ++ofB)
        {
            const btDbvtNode* const childOfB = isLeafB ? top.b : top.b->childs[ofB];
            for (int ofA = 0; ofA < (isLeafA ? 1 : 2); ++ofA)
                stack.push_back(Nodes(isLeafA ? top.a : top.a->childs[ofA], childOfB));
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
