// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The body of the mesh kernels, included once per instruction set by a translation unit that is compiled for it and names
// its table in CULLET_MESH_KERNELS. Everything here has internal linkage and calls no inline function of another header:
// the linker could otherwise keep a copy with instructions that the machine lacks.
#include "cullet/base/trees/wide_tests.inl"
#include "cullet/mid/mesh_kernels.h"

#include <cstdint>

namespace cullet
{
namespace
{
/// Lanes of a node that a test finds. A box has no place of entry.
inline std::uint32_t hitsOf(const OverlapTest& test, const WideNode& node, float*)
{
    return test(NodeLanes{node});
}
inline std::uint32_t hitsOf(const PathTest& test, const WideNode& node, float* enter)
{
    return test(NodeLanes{node}, enter);
}

inline void setFound(std::uint32_t& found, std::uint32_t item, float)
{
    found = item;
}
inline void setFound(MeshCandidate& found, std::uint32_t item, float enter)
{
    found = {item, enter};
}

/// Visits nodes in any order until the batch could overflow or the walk is over.
template <class Test, class Found>
std::uint32_t collect(const MeshTreeView& tree, const Test& test, MeshWalk& walk, Found* found)
{
    alignas(32) float enter[8] = {};
    std::uint32_t count = 0;
    while (walk.size > 0 && count <= kMeshBatch - 8)
    {
        const MeshWalk::Entry at = walk.stack[--walk.size];
        std::uint32_t hits = hitsOf(test, tree.levels[at.level][at.node], enter);
        for (; hits != 0; hits &= hits - 1)
        {
            const int lane = __builtin_ctz(hits);
            const std::uint32_t child = 8 * at.node + static_cast<std::uint32_t>(lane);
            if (at.level == 0)
                setFound(found[count++], tree.items[child], enter[lane]);
            else
                walk.stack[walk.size++] = {child, at.level - 1, enter[lane]};
        }
    }
    return count;
}

/// Inserts an entry so that `entries` ascends, or descends, by where the query enters them; equal ones keep their order.
template <bool kAscends, class Entry>
void insertByEntry(Entry* entries, int count, const Entry& added)
{
    int place = count;
    while (place > 0 &&
           (kAscends ? added.enter < entries[place - 1].enter : entries[place - 1].enter < added.enter))
    {
        entries[place] = entries[place - 1];
        --place;
    }
    entries[place] = added;
}

std::uint32_t overlaps(const MeshTreeView& tree, const MeshBox& box, MeshWalk& walk, std::uint32_t* items)
{
    return collect(tree, OverlapTest(box), walk, items);
}

std::uint32_t onPath(const MeshTreeView& tree, const SweptQuery& query, MeshWalk& walk, MeshCandidate* found)
{
    return collect(tree, PathTest(query), walk, found);
}

std::uint32_t nearestLeaf(const MeshTreeView& tree, const SweptQuery& query, MeshWalk& walk,
                          MeshCandidate* found)
{
    const PathTest test(query);
    alignas(32) float enter[8];
    while (walk.size > 0)
    {
        const MeshWalk::Entry at = walk.stack[--walk.size];
        if (query.limit < at.enter)
            continue;
        std::uint32_t hits = hitsOf(test, tree.levels[at.level][at.node], enter);
        int count = 0;
        for (; hits != 0; hits &= hits - 1)
        {
            const int lane = __builtin_ctz(hits);
            const std::uint32_t child = 8 * at.node + static_cast<std::uint32_t>(lane);
            if (at.level == 0)
            {
                insertByEntry<true>(found, count, MeshCandidate{tree.items[child], enter[lane]});
            }
            else
            {
                __builtin_prefetch(&tree.levels[at.level - 1][child]);
                __builtin_prefetch(&tree.levels[at.level - 1][child].planes[2]);
                __builtin_prefetch(&tree.levels[at.level - 1][child].planes[4]);
                insertByEntry<false>(walk.stack + walk.size, count,
                                     MeshWalk::Entry{child, at.level - 1, enter[lane]});
            }
            ++count;
        }
        if (at.level > 0)
            walk.size += count;
        else if (count > 0)
            return static_cast<std::uint32_t>(count);
    }
    return 0;
}

/// A vector in each lane.
struct Vector8
{
    Float8 x, y, z;
};

inline Vector8 operator-(const Vector8& a, const Vector8& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vector8 crossed(const Vector8& a, const Vector8& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Float8 magnitude(Float8 v)
{
    return larger(v, broadcast(0.0f) - v);
}

inline Float8 largestOf(const Vector8& v)
{
    return larger(larger(magnitude(v.x), magnitude(v.y)), magnitude(v.z));
}

/// The triangles of eight lanes, and one that is in all lanes.
class TrianglePairs
{
public:
    TrianglePairs(const TriangleBlock& block, const float (&one)[3][3])
    {
        for (int corner = 0; corner < 3; ++corner)
        {
            m_a[corner] = {load(block.corners[corner][0]), load(block.corners[corner][1]),
                           load(block.corners[corner][2])};
            m_b[corner] = {broadcast(one[corner][0]), broadcast(one[corner][1]), broadcast(one[corner][2])};
        }
        // Rounding is one of distances, not of places.
        const Vector8 origin = m_b[0];
        Float8 size = broadcast(0.0f), nothing = broadcast(0.0f);
        for (int corner = 0; corner < 3; ++corner)
        {
            m_a[corner] = m_a[corner] - origin;
            m_b[corner] = m_b[corner] - origin;
            size = larger(size, larger(largestOf(m_a[corner]), largestOf(m_b[corner])));
            nothing = nothing - nothingOf(m_a[corner]) - nothingOf(m_b[corner]);
        }
        m_isFinite = nothing <= broadcast(0.0f);
        // Of products of three numbers, each of which is off by a few roundings of the size.
        constexpr float kNoise = 64.0f / 8388608.0f;
        m_noise = size * broadcast(kNoise);
        for (int corner = 0; corner < 3; ++corner)
        {
            m_edgesA[corner] = m_a[(corner + 1) % 3] - m_a[corner];
            m_edgesB[corner] = m_b[(corner + 1) % 3] - m_b[corner];
        }
    }

    /// Lanes that an axis separates: normals, products of edges, and in the planes normals of edges.
    std::uint32_t apart() const
    {
        const Vector8 normalA = crossed(m_edgesA[0], m_edgesA[1]);
        const Vector8 normalB = crossed(m_edgesB[0], m_edgesB[1]);
        std::uint32_t found = bits(separates(normalA)) | bits(separates(normalB));
        for (int i = 0; i < 3 && found != 255u; ++i)
        {
            for (int k = 0; k < 3; ++k)
                found |= bits(separates(crossed(m_edgesA[i], m_edgesB[k])));
        }
        for (int i = 0; i < 3 && found != 255u; ++i)
        {
            found |= bits(separates(crossed(normalA, m_edgesA[i])));
            found |= bits(separates(crossed(normalB, m_edgesB[i])));
        }
        return found & bits(m_isFinite);
    }

private:
    /// 0, or NaN if a coordinate is not finite.
    static Float8 nothingOf(const Vector8& v) { return (v.x - v.x) - (v.y - v.y) - (v.z - v.z); }

    Float8 separates(const Vector8& axis) const
    {
        const Vector8 back = {axis.x, broadcast(0.0f) - axis.y, broadcast(0.0f) - axis.z};
        const auto heightOf = [&](const Vector8& point)
        { return point.x * back.x - point.y * back.y - point.z * back.z; };
        const Float8 a[3] = {heightOf(m_a[0]), heightOf(m_a[1]), heightOf(m_a[2])};
        const Float8 b[3] = {heightOf(m_b[0]), heightOf(m_b[1]), heightOf(m_b[2])};
        const Float8 lowA = smaller(smaller(a[0], a[1]), a[2]), highA = larger(larger(a[0], a[1]), a[2]);
        const Float8 lowB = smaller(smaller(b[0], b[1]), b[2]), highB = larger(larger(b[0], b[1]), b[2]);
        const Float8 gap = larger(lowA - highB, lowB - highA);
        // An axis of no length separates nothing: its noise is 0, and so is the gap.
        const Float8 noise = m_noise * (magnitude(axis.x) - (broadcast(0.0f) - magnitude(axis.y)) -
                                        (broadcast(0.0f) - magnitude(axis.z)));
        return isBelow(noise, gap);
    }

    /// False for a NaN and for equal numbers.
    static Float8 isBelow(Float8 a, Float8 b)
    {
        constexpr float kNext = 1.0f + 1.0f / 8388608.0f;
        return (a * broadcast(kNext) <= b) & (broadcast(1e-37f) <= b);
    }

    Vector8 m_a[3], m_b[3], m_edgesA[3], m_edgesB[3];
    Float8 m_noise, m_isFinite;
};

std::uint32_t apart(const TriangleBlock& block, const float (&one)[3][3])
{
    return TrianglePairs(block, one).apart();
}
}  // namespace

extern const MeshKernels CULLET_MESH_KERNELS = {overlaps, onPath, nearestLeaf, apart};
}  // namespace cullet
