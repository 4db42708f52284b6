// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/hull.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

/// Support searches: the vertex of a hull with the largest product d.v.
///
/// Every search returns the same vertex: the one with the largest product, rounded as x dx + y dy + z dz from left to
/// right, and among equal ones the lowest index. Compile without contraction (-ffp-contract=off), or the widths differ.
///
/// @pre the hull has a vertex; the largest component of the direction has a magnitude of about 1e-10 to 1e10, so that no
///      product underflows below the hull's tie band or overflows. A zero direction gives vertex 0, one with a NaN some
///      vertex. Nothing loops.
namespace cullet
{
/// How supportVertex() searches.
enum class SupportMethod : std::uint8_t
{
    Automatic,        ///< measured choice by size and by whether a start vertex is known
    Linear,           ///< scan of all vertices, O(n), without branches
    Climb,            ///< hill climbing over natural neighbours from the start vertex
    ClimbArtificial,  ///< hill climbing over natural and artificial neighbours, eight at a time
    CubeMap           ///< climb as above from the start table's vertex for the direction
};

/// Optional counters of a search.
struct SupportCounters
{
    std::int64_t searches = 0;
    std::int64_t steps = 0;  ///< vertices whose neighbours were looked at
    std::int64_t ties = 0;   ///< climbs that the linear scan had to decide
};

/// Eight lanes as 16-byte vectors, the width that every x86-64 and ARMv8 has.
template <class S>
struct Lanes
{
    static constexpr int kWidth = static_cast<int>(16 / sizeof(S));
    using Integer = std::conditional_t<sizeof(S) == 4, std::int32_t, std::int64_t>;
    typedef S Vector __attribute__((vector_size(16)));
    typedef Integer Mask __attribute__((vector_size(16)));  ///< what a comparison of two vectors gives

    static Vector load(const S* p)
    {
        Vector v;
        std::memcpy(&v, p, sizeof(v));
        return v;
    }
    static Vector fill(S value) { return Vector{} + value; }
    static Mask largest() { return Mask{} + std::numeric_limits<Integer>::max(); }
    /// 0, 1, 2, ...
    static Mask counting()
    {
        Mask lanes;
        for (int lane = 0; lane < kWidth; ++lane)
            lanes[lane] = lane;
        return lanes;
    }
};

/// Largest of the lanes; a NaN lane may or may not be passed over.
inline float largestLane(Lanes<float>::Vector v)
{
    const Lanes<float>::Vector halves = __builtin_shufflevector(v, v, 2, 3, 0, 1);
    v = v > halves ? v : halves;
    const Lanes<float>::Vector pairs = __builtin_shufflevector(v, v, 1, 0, 3, 2);
    v = v > pairs ? v : pairs;
    return v[0];
}

inline double largestLane(Lanes<double>::Vector v)
{
    return v[0] > v[1] ? v[0] : v[1];
}

inline std::int32_t smallestLane(Lanes<float>::Mask v)
{
    const Lanes<float>::Mask halves = __builtin_shufflevector(v, v, 2, 3, 0, 1);
    v = v < halves ? v : halves;
    return v[0] < v[1] ? v[0] : v[1];
}

inline std::int64_t smallestLane(Lanes<double>::Mask v)
{
    return v[0] < v[1] ? v[0] : v[1];
}

template <class S>
inline S supportProduct(const Hull<S>& hull, std::int32_t v, const Eigen::Matrix<S, 3, 1>& d)
{
    return hull.x()[v] * d[0] + hull.y()[v] * d[1] + hull.z()[v] * d[2];
}

/// Scan of all vertices. Cost: O(n).
template <class S>
std::int32_t supportLinear(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    // Two accumulators of lanes: i counts vectors, and a lane keeps the first i at which it saw its maximum.
    const Vector dx = L::fill(d[0]), dy = L::fill(d[1]), dz = L::fill(d[2]);
    const auto product = [&](std::int32_t i)
    { return L::load(hull.x() + i) * dx + L::load(hull.y() + i) * dy + L::load(hull.z() + i) * dz; };
    Vector best0 = product(0), best1 = product(L::kWidth);
    using Mask = typename L::Mask;
    Mask where0 = {}, where1 = {};
    Mask index = {};
    for (std::int32_t i = 2 * L::kWidth; i < hull.paddedCount(); i += 2 * L::kWidth)
    {
        index += 1;
        const Vector s0 = product(i), s1 = product(i + L::kWidth);
        const Mask m0 = s0 > best0, m1 = s1 > best1;
        best0 = m0 ? s0 : best0;
        best1 = m1 ? s1 : best1;
        where0 = m0 ? index : where0;
        where1 = m1 ? index : where1;
    }
    // Lowest vertex among the lanes that have the maximum; none if that is NaN.
    const Vector best = L::fill(largestLane(best0 > best1 ? best0 : best1));
    const Mask vertex0 = best0 == best ? where0 * (2 * L::kWidth) + L::counting() : L::largest();
    const Mask vertex1 = best1 == best ? where1 * (2 * L::kWidth) + L::counting() + L::kWidth : L::largest();
    const auto bestIndex = smallestLane(vertex0 < vertex1 ? vertex0 : vertex1);
    return bestIndex < hull.vertexCount() ? static_cast<std::int32_t>(bestIndex) : 0;
}

/// Hill climbing over the natural neighbours, as in the thesis without artificial ones; the comparator.
template <class S>
std::int32_t supportClimb(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start,
                          SupportCounters* counters = nullptr)
{
    const S band = hull.tieBand() * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
    std::int32_t vertex = start;
    S height = supportProduct(hull, vertex, d);
    for (;;)
    {
        std::int32_t best = -1;
        S bestHeight = -std::numeric_limits<S>::infinity();
        for (const std::int32_t neighbour : hull.naturalNeighbours(vertex))
        {
            const S h = supportProduct(hull, neighbour, d);
            if (h > bestHeight)
            {
                best = neighbour;
                bestHeight = h;
            }
        }
        if (counters != nullptr)
            ++counters->steps;
        if (bestHeight > height)
        {
            vertex = best;
            height = bestHeight;
            continue;
        }
        if (bestHeight < height - band)
            return vertex;
        if (counters != nullptr)
            ++counters->ties;
        return supportLinear(hull, d);
    }
}

template <class S>
inline typename Lanes<S>::Vector blockProducts(const NeighbourBlock<S>& block, int lane,
                                               const Eigen::Matrix<S, 3, 1>& d)
{
    using L = Lanes<S>;
    return L::load(&block.x[lane]) * L::fill(d[0]) + L::load(&block.y[lane]) * L::fill(d[1]) +
           L::load(&block.z[lane]) * L::fill(d[2]);
}

/// The best of the neighbours in the blocks of one vertex: its height, and the block that has it.
template <class S>
struct BlockMaximum
{
    S height;
    const NeighbourBlock<S>* block;

    /// The neighbour; found late, since most steps of a coherent climb only need to know that none is higher.
    std::int32_t vertex(const Eigen::Matrix<S, 3, 1>& d) const
    {
        int lane = 0;
        while (lane < 7 && !(block->x[lane] * d[0] + block->y[lane] * d[1] + block->z[lane] * d[2] == height))
            ++lane;
        return block->id[lane];
    }
};

template <class S>
inline BlockMaximum<S> blockMaximum(const NeighbourBlock<S>* block, const NeighbourBlock<S>* end,
                                    const Eigen::Matrix<S, 3, 1>& d)
{
    using Vector = typename Lanes<S>::Vector;
    BlockMaximum<S> result = {-std::numeric_limits<S>::infinity(), block};
    for (; block != end; ++block)
    {
        Vector best = blockProducts(*block, 0, d);
        for (int lane = Lanes<S>::kWidth; lane < 8; lane += Lanes<S>::kWidth)
        {
            const Vector products = blockProducts(*block, lane, d);
            best = best > products ? best : products;
        }
        const S height = largestLane(best);
        if (height > result.height)
            result = {height, block};
    }
    return result;
}

/// Hill climbing over natural and artificial neighbours, eight at a time. Cost: 4 ns a step where measured; from the
/// support vertex of a direction a few degrees away it takes one or two steps at any size.
template <class S>
std::int32_t supportClimbArtificial(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start,
                                    SupportCounters* counters = nullptr)
{
    const S band = hull.tieBand() * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
    std::int32_t vertex = start;
    S height = supportProduct(hull, vertex, d);
    for (;;)
    {
        const BlockMaximum<S> best = blockMaximum(hull.blocksBegin(vertex), hull.blocksEnd(vertex), d);
        if (counters != nullptr)
            ++counters->steps;
        // Comparison order: if a product is NaN, neither of the first two holds, and the scan ends the search.
        if (best.height > height)
        {
            vertex = best.vertex(d);
            height = best.height;
            continue;
        }
        if (best.height < height - band)
            return vertex;
        if (counters != nullptr)
            ++counters->ties;
        return supportLinear(hull, d);
    }
}

/// Start vertex for a direction from the hull's table: the cell of a cube's side that the direction hits.
template <class S>
std::int32_t cubeMapStart(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    constexpr int kCells = Hull<S>::kCubeCells;
    const S ax = std::abs(d[0]), ay = std::abs(d[1]), az = std::abs(d[2]);
    const int axis = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2);
    const S largest = std::abs(d[axis]);
    if (!(largest > S(0)))
        return 0;
    const auto cell = [&](S value)
    {
        // A NaN fails the comparison and lands in the first cell.
        const S place = (value / largest + S(1)) * S(kCells / 2);
        return place > S(0) ? static_cast<int>(place < S(kCells) ? place : S(kCells - 1)) : 0;
    };
    const int side = 2 * axis + (d[axis] < S(0) ? 1 : 0);
    return hull.startTable()[(side * kCells + cell(d[(axis + 1) % 3])) * kCells + cell(d[(axis + 2) % 3])];
}

template <class S>
std::int32_t supportCubeMap(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d,
                            SupportCounters* counters = nullptr)
{
    return supportClimbArtificial(hull, d, cubeMapStart(hull, d), counters);
}

/// Up to this many vertices the scan beats the table and a climb for unrelated directions (SSE2: from 40 to 64).
constexpr std::int32_t kLinearSupportMaximum = 48;

/// Support vertex by the measured best method.
///
/// @param start a vertex, likely near the answer (last frame's), or -1
template <class S>
std::int32_t supportVertex(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start = -1,
                           SupportMethod method = SupportMethod::Automatic,
                           SupportCounters* counters = nullptr)
{
    if (counters != nullptr)
        ++counters->searches;
    if (method == SupportMethod::Linear || !hull.hasNeighbours())
        return supportLinear(hull, d);
    const bool hasStart = start >= 0 && start < hull.vertexCount();
    if (method == SupportMethod::Climb)
        return supportClimb(hull, d, hasStart ? start : 0, counters);
    if (method == SupportMethod::ClimbArtificial || (method == SupportMethod::Automatic && hasStart))
        return supportClimbArtificial(hull, d, hasStart ? start : 0, counters);
    if (method == SupportMethod::CubeMap || hull.vertexCount() > kLinearSupportMaximum)
        return supportCubeMap(hull, d, counters);
    return supportLinear(hull, d);
}
}  // namespace cullet
