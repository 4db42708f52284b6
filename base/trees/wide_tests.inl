// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Tests of eight boxes at a time, for kernels of wide trees; included by a source that is compiled for an instruction set.
// Everything has internal linkage, since the linker could otherwise keep a copy with instructions that the machine lacks.
#include "cullet/base/simd_float8.inl"
#include "cullet/base/trees/wide_node.h"

#include <cstdint>

namespace cullet
{
namespace
{
/// The boxes of a node, each plane loaded when a test needs it.
struct NodeLanes
{
    const WideNode& node;
    Float8 plane(int i) const { return load(node.planes[i]); }
};

/// Lanes that overlap a box.
class OverlapTest
{
public:
    template <class Box>
    explicit OverlapTest(const Box& box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            m_min[axis] = broadcast(box.min[axis]);
            m_max[axis] = broadcast(box.max[axis]);
        }
    }

    template <class Boxes>
    std::uint32_t operator()(const Boxes& boxes) const
    {
        const Float8 x = (boxes.plane(0) <= m_max[0]) & (m_min[0] <= boxes.plane(3));
        const Float8 y = (boxes.plane(1) <= m_max[1]) & (m_min[1] <= boxes.plane(4));
        const Float8 z = (boxes.plane(2) <= m_max[2]) & (m_min[2] <= boxes.plane(5));
        return bits(x & y & z);
    }

private:
    Float8 m_min[3];
    Float8 m_max[3];
};

/// Lanes that a ray or a swept box may hit: a query with the origins on the near and the far side, the inverse of the
/// direction, and a limit. No product is NaN: origins are finite and inverses neither zero nor infinite.
class PathTest
{
public:
    template <class Query>
    explicit PathTest(const Query& query) : m_limit(broadcast(query.limit))
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            m_near[axis] = query.inverse[axis] < 0.0f ? axis + 3 : axis;
            m_far[axis] = query.inverse[axis] < 0.0f ? axis : axis + 3;
            m_nearOrigin[axis] = broadcast(query.nearOrigin[axis]);
            m_farOrigin[axis] = broadcast(query.farOrigin[axis]);
            m_inverse[axis] = broadcast(query.inverse[axis]);
        }
    }

    template <class Boxes>
    std::uint32_t operator()(const Boxes& boxes) const
    {
        return test(boxes, enterOf(boxes));
    }

    /// @param enter [out, 8] where the path enters the boxes
    template <class Boxes>
    std::uint32_t operator()(const Boxes& boxes, float* enter) const
    {
        const Float8 entered = enterOf(boxes);
        store(enter, entered);
        return test(boxes, entered);
    }

private:
    template <class Boxes>
    Float8 enterOf(const Boxes& boxes) const
    {
        return larger(larger(enterAt(boxes, 0), enterAt(boxes, 1)), enterAt(boxes, 2));
    }

    template <class Boxes>
    std::uint32_t test(const Boxes& boxes, Float8 enter) const
    {
        // Sixteen rounding steps cover the three roundings of this test and of the exact one that follows.
        constexpr float kSlack = 1.0f + 16.0f / 8388608.0f;
        const Float8 leave = smaller(smaller(leaveAt(boxes, 0), leaveAt(boxes, 1)), leaveAt(boxes, 2));
        return bits((enter <= m_limit) & (broadcast(0.0f) <= leave) & (enter <= leave * broadcast(kSlack)));
    }

    template <class Boxes>
    Float8 enterAt(const Boxes& boxes, int axis) const
    {
        return (boxes.plane(m_near[axis]) - m_nearOrigin[axis]) * m_inverse[axis];
    }

    template <class Boxes>
    Float8 leaveAt(const Boxes& boxes, int axis) const
    {
        return (boxes.plane(m_far[axis]) - m_farOrigin[axis]) * m_inverse[axis];
    }

    Float8 m_nearOrigin[3];
    Float8 m_farOrigin[3];
    Float8 m_inverse[3];
    Float8 m_limit;
    int m_near[3];
    int m_far[3];
};
}  // namespace
}  // namespace cullet
