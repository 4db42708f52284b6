// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The body of the query kernels, included once per instruction set by a translation unit that is compiled for it and
// names its table in CULLET_QUERY_KERNELS. Everything here has internal linkage and calls no inline function of
// another header: the linker could otherwise keep a copy with instructions that the machine lacks.
#include "broad/query_kernels.h"

#include <cstdint>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace cullet
{
namespace
{
#if defined(__AVX__)
struct Float8
{
    __m256 v;
};
inline Float8 load(const float* p)
{
    return {_mm256_loadu_ps(p)};
}
inline Float8 broadcast(float x)
{
    return {_mm256_set1_ps(x)};
}
inline Float8 operator-(Float8 a, Float8 b)
{
    return {_mm256_sub_ps(a.v, b.v)};
}
inline Float8 operator*(Float8 a, Float8 b)
{
    return {_mm256_mul_ps(a.v, b.v)};
}
inline Float8 smaller(Float8 a, Float8 b)
{
    return {_mm256_min_ps(a.v, b.v)};
}
inline Float8 larger(Float8 a, Float8 b)
{
    return {_mm256_max_ps(a.v, b.v)};
}
inline Float8 operator&(Float8 a, Float8 b)
{
    return {_mm256_and_ps(a.v, b.v)};
}
inline Float8 operator<=(Float8 a, Float8 b)
{
    return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)};
}
inline std::uint32_t bits(Float8 mask)
{
    return static_cast<std::uint32_t>(_mm256_movemask_ps(mask.v));
}
#elif defined(__SSE2__)
struct Float8
{
    __m128 v, w;
};
inline Float8 load(const float* p)
{
    return {_mm_loadu_ps(p), _mm_loadu_ps(p + 4)};
}
inline Float8 broadcast(float x)
{
    return {_mm_set1_ps(x), _mm_set1_ps(x)};
}
inline Float8 operator-(Float8 a, Float8 b)
{
    return {_mm_sub_ps(a.v, b.v), _mm_sub_ps(a.w, b.w)};
}
inline Float8 operator*(Float8 a, Float8 b)
{
    return {_mm_mul_ps(a.v, b.v), _mm_mul_ps(a.w, b.w)};
}
inline Float8 smaller(Float8 a, Float8 b)
{
    return {_mm_min_ps(a.v, b.v), _mm_min_ps(a.w, b.w)};
}
inline Float8 larger(Float8 a, Float8 b)
{
    return {_mm_max_ps(a.v, b.v), _mm_max_ps(a.w, b.w)};
}
inline Float8 operator&(Float8 a, Float8 b)
{
    return {_mm_and_ps(a.v, b.v), _mm_and_ps(a.w, b.w)};
}
inline Float8 operator<=(Float8 a, Float8 b)
{
    return {_mm_cmple_ps(a.v, b.v), _mm_cmple_ps(a.w, b.w)};
}
inline std::uint32_t bits(Float8 mask)
{
    return static_cast<std::uint32_t>(_mm_movemask_ps(mask.v) | _mm_movemask_ps(mask.w) << 4);
}
#else
struct Float8
{
    float v[8];
};
template <class Operation>
inline Float8 perLane(Operation operation)
{
    Float8 result;
    for (int i = 0; i < 8; ++i)
        result.v[i] = operation(i);
    return result;
}
inline Float8 load(const float* p)
{
    return perLane([=](int i) { return p[i]; });
}
inline Float8 broadcast(float x)
{
    return perLane([=](int) { return x; });
}
inline Float8 operator-(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] - b.v[i]; });
}
inline Float8 operator*(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] * b.v[i]; });
}
inline Float8 smaller(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}
inline Float8 larger(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}
inline Float8 operator&(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] != 0.0f && b.v[i] != 0.0f ? 1.0f : 0.0f; });
}
inline Float8 operator<=(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] <= b.v[i] ? 1.0f : 0.0f; });
}
inline std::uint32_t bits(const Float8& mask)
{
    std::uint32_t result = 0;
    for (int i = 0; i < 8; ++i)
        result |= (mask.v[i] != 0.0f ? 1u : 0u) << i;
    return result;
}
#endif

/// Eight boxes in registers; planes 0-2 are the minima, 3-5 the maxima.
struct Lanes
{
    Float8 planes[6];
    Float8 plane(int i) const { return planes[i]; }
};

/// Eight boxes in a node, loaded plane by plane as the test asks.
struct NodeLanes
{
    const BoxNode& node;
    Float8 plane(int i) const { return load(node.planes[i]); }
};

#if defined(__AVX__)
/// Turns eight boxes of six floats into six planes of eight: two overlapping loads per box, then 4x4 transposes.
inline Lanes gather(const Aabb* const* boxes)
{
    __m256 low[4];   // min.x min.y min.z max.x
    __m256 high[4];  // min.z max.x max.y max.z
    for (int i = 0; i < 4; ++i)
    {
        const float* a = boxes[i]->min;
        const float* b = boxes[i + 4]->min;
        low[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a)), _mm_loadu_ps(b), 1);
        high[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a + 2)), _mm_loadu_ps(b + 2), 1);
    }
    const __m256 xy01 = _mm256_unpacklo_ps(low[0], low[1]), xy23 = _mm256_unpacklo_ps(low[2], low[3]);
    const __m256 zx01 = _mm256_unpackhi_ps(low[0], low[1]), zx23 = _mm256_unpackhi_ps(low[2], low[3]);
    const __m256 yz01 = _mm256_unpackhi_ps(high[0], high[1]), yz23 = _mm256_unpackhi_ps(high[2], high[3]);
    return {{{_mm256_shuffle_ps(xy01, xy23, 0x44)},
             {_mm256_shuffle_ps(xy01, xy23, 0xEE)},
             {_mm256_shuffle_ps(zx01, zx23, 0x44)},
             {_mm256_shuffle_ps(zx01, zx23, 0xEE)},
             {_mm256_shuffle_ps(yz01, yz23, 0x44)},
             {_mm256_shuffle_ps(yz01, yz23, 0xEE)}}};
}
#else
inline Lanes gather(const Aabb* const* boxes)
{
    BoxNode node;
    for (int lane = 0; lane < 8; ++lane)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            node.planes[axis][lane] = boxes[lane]->min[axis];
            node.planes[axis + 3][lane] = boxes[lane]->max[axis];
        }
    }
    const NodeLanes lanes{node};
    return {{lanes.plane(0), lanes.plane(1), lanes.plane(2), lanes.plane(3), lanes.plane(4), lanes.plane(5)}};
}
#endif

/// Lanes that overlap a box.
class OverlapTest
{
public:
    explicit OverlapTest(const Aabb& box)
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

/// Lanes that a prepared ray may hit. No product is NaN: origins are finite and inverses neither zero nor infinite.
class RayTest
{
public:
    explicit RayTest(const RayQuery& ray) : m_lambdaMax(broadcast(ray.lambdaMax))
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            m_near[axis] = ray.inverse[axis] < 0.0f ? axis + 3 : axis;
            m_far[axis] = ray.inverse[axis] < 0.0f ? axis : axis + 3;
            m_nearOrigin[axis] = broadcast(ray.nearOrigin[axis]);
            m_farOrigin[axis] = broadcast(ray.farOrigin[axis]);
            m_inverse[axis] = broadcast(ray.inverse[axis]);
        }
    }

    template <class Boxes>
    std::uint32_t operator()(const Boxes& boxes) const
    {
        // Sixteen rounding steps cover the three roundings of this test and of the exact one that follows.
        constexpr float kSlack = 1.0f + 16.0f / 8388608.0f;
        const Float8 enter = larger(larger(enterAt(boxes, 0), enterAt(boxes, 1)), enterAt(boxes, 2));
        const Float8 leave = smaller(smaller(leaveAt(boxes, 0), leaveAt(boxes, 1)), leaveAt(boxes, 2));
        return bits((enter <= m_lambdaMax) & (broadcast(0.0f) <= leave) &
                    (enter <= leave * broadcast(kSlack)));
    }

private:
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
    Float8 m_lambdaMax;
    int m_near[3];
    int m_far[3];
};

/// Depth first from where the cursor stands, until the batch could overflow or the tree is done.
template <class Test>
std::uint32_t traverse(const BoxTreeView& tree, const Test& test, TreeCursor& cursor, std::uint32_t* rows)
{
    std::uint32_t count = 0;
    int depth = tree.levelCount == 0 ? 0 : cursor.depth;
    while (depth > 0 && count <= kQueryBatch - 8)
    {
        std::uint32_t& pending = cursor.pending[depth - 1];
        if (pending == 0)
        {
            --depth;
            continue;
        }
        const std::uint32_t child =
            8 * cursor.nodes[depth - 1] + static_cast<std::uint32_t>(__builtin_ctz(pending));
        pending &= pending - 1;
        const int level = tree.levelCount - depth;
        std::uint32_t hits = test(NodeLanes{tree.levels[level][child]});
        if (level > 0)
        {
            cursor.nodes[depth] = child;
            cursor.pending[depth] = hits;
            ++depth;
            continue;
        }
        for (; hits != 0; hits &= hits - 1)
            rows[count++] = tree.rows[8 * child + static_cast<std::uint32_t>(__builtin_ctz(hits))];
    }
    cursor.depth = depth;
    return count;
}

/// Eight boxes at a time from `position` on, until the batch could overflow or the last box is done.
template <class Test>
std::uint32_t scan(const ScanView& view, const Test& test, std::uint32_t& position, std::uint32_t* rows)
{
    std::uint32_t count = 0;
    while (position < view.size && count <= kQueryBatch - 8)
    {
        const Aabb* boxes[8];
        const std::uint32_t lanes = view.size - position < 8 ? view.size - position : 8;
        for (std::uint32_t i = 0; i < 8; ++i)
        {
            const std::uint32_t at = i < lanes ? position + i : position;
            boxes[i] = view.boxes + (view.rows != nullptr ? view.rows[at] : at);
        }
        const Lanes planes = gather(boxes);
        std::uint32_t hits = test(planes) & (0xFFu >> (8 - lanes));
        // An empty box passes when the question reaches infinity.
        if (hits != 0)
        {
            hits &= bits((planes.plane(0) <= planes.plane(3)) & (planes.plane(1) <= planes.plane(4)) &
                         (planes.plane(2) <= planes.plane(5)));
        }
        for (; hits != 0; hits &= hits - 1)
        {
            const std::uint32_t at = position + static_cast<std::uint32_t>(__builtin_ctz(hits));
            rows[count++] = view.rows != nullptr ? view.rows[at] : at;
        }
        position += lanes;
    }
    return count;
}

std::uint32_t treeOverlap(const BoxTreeView& tree, const Aabb& box, TreeCursor& cursor, std::uint32_t* rows)
{
    return traverse(tree, OverlapTest(box), cursor, rows);
}

std::uint32_t treeRay(const BoxTreeView& tree, const RayQuery& ray, TreeCursor& cursor, std::uint32_t* rows)
{
    return traverse(tree, RayTest(ray), cursor, rows);
}

std::uint32_t scanOverlap(const ScanView& view, const Aabb& box, std::uint32_t& position, std::uint32_t* rows)
{
    return scan(view, OverlapTest(box), position, rows);
}

std::uint32_t scanRay(const ScanView& view, const RayQuery& ray, std::uint32_t& position, std::uint32_t* rows)
{
    return scan(view, RayTest(ray), position, rows);
}
}  // namespace

extern const QueryKernels CULLET_QUERY_KERNELS = {treeOverlap, treeRay, scanOverlap, scanRay};
}  // namespace cullet
