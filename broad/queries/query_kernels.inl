// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The body of the query kernels, included once per instruction set by a translation unit that is compiled for it and
// names its table in CULLET_QUERY_KERNELS. Everything here has internal linkage and calls no inline function of
// another header: the linker could otherwise keep a copy with instructions that the machine lacks.
#include "cullet/base/trees/wide_tests.inl"
#include "cullet/broad/queries/query_kernels.h"

#include <cstdint>

namespace cullet
{
namespace
{
/// Eight boxes in registers; planes 0-2 are the minima, 3-5 the maxima.
struct Lanes
{
    Float8 planes[6];
    Float8 plane(int i) const { return planes[i]; }
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
inline FourFloats first(const FourFloats& a, const FourFloats& b)
{
    return CULLET_SHUFFLE(a, b, 0, 4, 1, 5);
}
inline FourFloats last(const FourFloats& a, const FourFloats& b)
{
    return CULLET_SHUFFLE(a, b, 2, 6, 3, 7);
}
/// Turns eight boxes of six floats into six planes of eight, in two halves of four boxes.
inline Lanes gather(const Aabb* const* boxes)
{
    FourFloats planes[2][6];
    for (int half = 0; half < 2; ++half)
    {
        FourFloats low[4];   // min.x min.y min.z max.x
        FourFloats high[4];  // min.z max.x max.y max.z
        for (int i = 0; i < 4; ++i)
        {
            low[i] = loadFour(boxes[4 * half + i]->min);
            high[i] = loadFour(boxes[4 * half + i]->min + 2);
        }
        const FourFloats xy[2] = {first(low[0], low[1]), first(low[2], low[3])};
        const FourFloats zx[2] = {last(low[0], low[1]), last(low[2], low[3])};
        const FourFloats yz[2] = {last(high[0], high[1]), last(high[2], high[3])};
        const FourFloats* const sources[3] = {xy, zx, yz};
        for (int i = 0; i < 3; ++i)
        {
            planes[half][2 * i] = CULLET_SHUFFLE(sources[i][0], sources[i][1], 0, 1, 4, 5);
            planes[half][2 * i + 1] = CULLET_SHUFFLE(sources[i][0], sources[i][1], 2, 3, 6, 7);
        }
    }
    Lanes lanes;
    for (int i = 0; i < 6; ++i)
        lanes.planes[i] = {planes[0][i], planes[1][i]};
    return lanes;
}
#endif

inline std::uint32_t validLanes(const Lanes& lanes)
{
    return bits((lanes.plane(0) <= lanes.plane(3)) & (lanes.plane(1) <= lanes.plane(4)) &
                (lanes.plane(2) <= lanes.plane(5)));
}

/// The smallest box around eight boxes.
inline Aabb unite(const Aabb* const* boxes)
{
    Aabb bounds;
    FourFloats least = loadFour(boxes[0]->min);
    FourFloats most = loadFour(boxes[0]->min + 2);
    for (int i = 1; i < 8; ++i)
    {
        least = smallerOf(least, loadFour(boxes[i]->min));
        most = largerOf(most, loadFour(boxes[i]->min + 2));
    }
    for (int axis = 0; axis < 3; ++axis)
    {
        bounds.min[axis] = least[axis];
        bounds.max[axis] = most[axis + 1];
    }
    return bounds;
}

/// Traverses a tree depth first from the cursor on, until the batch could overflow or the traversal is over.
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

/// Tests eight boxes at a time from `position` on, until the batch could overflow or all boxes are tested.
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
        // An empty box passes the test if the query extends to infinity.
        if (hits != 0)
            hits &= validLanes(planes);
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
    return traverse(tree, PathTest(ray), cursor, rows);
}

std::uint32_t scanOverlap(const ScanView& view, const Aabb& box, std::uint32_t& position, std::uint32_t* rows)
{
    return scan(view, OverlapTest(box), position, rows);
}

std::uint32_t scanRay(const ScanView& view, const RayQuery& ray, std::uint32_t& position, std::uint32_t* rows)
{
    return scan(view, PathTest(ray), position, rows);
}
std::uint32_t fillNode(const Aabb* const* boxes, WideNode& node, Aabb& bounds)
{
    const Lanes lanes = gather(boxes);
    for (int i = 0; i < 6; ++i)
        store(node.planes[i], lanes.planes[i]);
    bounds = unite(boxes);
    return validLanes(lanes);
}
}  // namespace

extern const QueryKernels CULLET_QUERY_KERNELS = {treeOverlap, treeRay, scanOverlap, scanRay, fillNode};
}  // namespace cullet
