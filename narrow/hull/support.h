// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/block_scan.h"
#include "cullet/narrow/hull/cube_map.h"
#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/linear_scan.h"
#include "cullet/narrow/hull/linear_scan_avx2.h"
#include "cullet/narrow/math/lanes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

/// Support searches: the vertex of a hull with the largest product d.v.
///
/// Every search returns the same vertex: the one with the largest product, rounded as x dx + y dy + z dz from left to
/// right, and among equal ones the lowest index. Compile without contraction (-ffp-contract=off), or the widths differ.
///
/// @pre the hull has a vertex; the largest component of the direction has a magnitude of about 1e-10 to 1e10, so that
///      no product underflows below the hull's tie band or overflows. A zero direction gives vertex 0, a direction with
///      a NaN an arbitrary vertex. Every search terminates.
namespace cullet
{
/// How supportVertex() searches.
enum class SupportMethod : std::uint8_t
{
    Automatic,        ///< measured choice by size and by whether a start vertex is known
    Linear,           ///< scan of all vertices, O(n), without branches
    Climb,            ///< hill climbing over natural neighbours from the start vertex
    ClimbArtificial,  ///< hill climbing over natural and artificial neighbours, eight at a time
    CubeMap,          ///< ClimbArtificial from the start table's vertex for the direction
    DobkinKirkpatrick  ///< ClimbArtificial from the end of a descent through the hull's hierarchy, if it has one
};

/// Optional counters of a search.
struct SupportCounters
{
    std::int64_t searches = 0;
    std::int64_t steps = 0;  ///< vertices whose neighbours were tested
    std::int64_t ties = 0;   ///< climbs that the linear scan had to decide
};

/// Hulls of at most so many vertices are scanned inline: no branch then depends on the orientation of the hull.
constexpr std::int32_t kFewVertices = 16;

/// When an axis is tested again, a vertex that is no longer its support nearly always has the new support as a
/// neighbour: so many vertices are tested before a search.
constexpr int kTestsNearVertex = 2;

/// Products of a direction and the vertices of a block from lane `first` on.
template <class S>
[[gnu::always_inline]] inline typename Lanes<S>::Vector productsOf(const NeighbourBlock<S>& block, int first,
                                                                   const LaneDirection<S>& d)
{
    using L = Lanes<S>;
    return L::loadAligned(&block.x[first]) * d.x + L::loadAligned(&block.y[first]) * d.y +
           L::loadAligned(&block.z[first]) * d.z;
}

/// A vertex, the best of its neighbours, and the rounded products of both.
template <class S>
struct ClimbStep
{
    S height;
    S bestHeight;
    std::int32_t best;
};

/// The highest of some products, and the neighbour that has it.
template <class S>
struct BestNeighbour
{
    S height;
    std::int32_t id;
};

/// @param products of the vertices of a block; lane 0 of the first vector repeats lane 1 instead of the block's own
///                 vertex
template <class S>
[[gnu::always_inline]] inline BestNeighbour<S> bestNeighbour(
    const NeighbourBlock<S>& block, const typename Lanes<S>::Vector (&products)[8 / Lanes<S>::kWidth])
{
    using L = Lanes<S>;
    constexpr int kVectors = 8 / L::kWidth;
    typename L::Vector best = products[0];
    for (int k = 1; k < kVectors; ++k)
        best = best > products[k] ? best : products[k];
    const S height = largestLane(best);
    unsigned bits = 0x80u;  // a NaN equals nothing
    for (int k = 0; k < kVectors; ++k)
        bits |= (laneBits(products[k] == L::fill(height)) & ~(k == 0 ? 1u : 0u)) << (k * L::kWidth);
    return {height, block.id[__builtin_ctz(bits)]};
}

/// Computes the products of a vertex and all of its neighbours, and the best neighbour.
template <class S>
inline ClimbStep<S> climbStep(const Hull<S>& hull, std::int32_t vertex, const LaneDirection<S>& d)
{
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    constexpr int kVectors = 8 / L::kWidth;
    ClimbStep<S> step = {S(0), -std::numeric_limits<S>::infinity(), vertex};
    for (std::int32_t index = vertex; index >= 0;)
    {
        const NeighbourBlock<S>& block = hull.block(index);
        Vector products[kVectors];
        for (int k = 0; k < kVectors; ++k)
            products[k] = productsOf(block, k * L::kWidth, d);
        step.height = products[0][0];
        products[0] = withoutLaneZero(products[0]);
        const BestNeighbour<S> best = bestNeighbour(block, products);
        if (best.height > step.bestHeight)
        {
            step.bestHeight = best.height;
            step.best = best.id;
        }
        index = block.id[0];
    }
    return step;
}

/// True if no neighbour has a product within `band` of the vertex's: then it is the support vertex.
///
/// @param vertex or a later block of it, from which on its neighbours are tested
/// @param height [out] product of the vertex
template <class S>
[[gnu::always_inline]] inline bool isPeak(const Hull<S>& hull, std::int32_t vertex, const LaneDirection<S>& d,
                                          S band, S& height)
{
    using L = Lanes<S>;
    constexpr int kVectors = 8 / L::kWidth;
    unsigned near = 0;
    std::int32_t index = vertex;
    do
    {
        const NeighbourBlock<S>& block = hull.block(index);
        typename L::Vector best = productsOf(block, 0, d);
        height = best[0];
        const typename L::Vector low = L::fill(height - band);
        best = withoutLaneZero(best);
        for (int k = 1; k < kVectors; ++k)
        {
            const typename L::Vector products = productsOf(block, k * L::kWidth, d);
            best = best > products ? best : products;
        }
        near |= laneBits(best >= low);
        index = block.id[0];
    } while (index >= 0);
    return near == 0;
}

/// isPeak() with the vertex from which to continue the climb if the result is false.
///
/// @param beside [out] if false, the highest neighbour in the vertex's first block, provided that one is within the
///               band
template <class S>
[[gnu::always_inline]] inline bool isPeak(const Hull<S>& hull, std::int32_t vertex, const LaneDirection<S>& d,
                                          S band, S& height, std::int32_t& beside)
{
    using L = Lanes<S>;
    constexpr int kVectors = 8 / L::kWidth;
    const NeighbourBlock<S>& block = hull.block(vertex);
    typename L::Vector products[kVectors];
    for (int k = 0; k < kVectors; ++k)
        products[k] = productsOf(block, k * L::kWidth, d);
    height = products[0][0];
    products[0] = withoutLaneZero(products[0]);
    typename L::Vector best = products[0];
    for (int k = 1; k < kVectors; ++k)
        best = best > products[k] ? best : products[k];
    beside = vertex;
    if (laneBits(best >= L::fill(height - band)) == 0)
        return block.id[0] < 0 || isPeak(hull, block.id[0], d, band, height);
    beside = bestNeighbour(block, products).id;
    return false;
}

/// A vertex and its rounded product.
template <class S>
struct SupportHit
{
    std::int32_t vertex;
    S height;
};

/// Scan of kVectors vectors of vertices.
template <int kVectors, class S>
[[gnu::always_inline]] inline SupportHit<S> hitVectors(const Hull<S>& hull, const LaneDirection<S>& d)
{
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    Vector products[kVectors];
    for (int k = 0; k < kVectors; ++k)
    {
        const int i = k * L::kWidth;
        products[k] = L::load(hull.x() + i) * d.x + L::load(hull.y() + i) * d.y + L::load(hull.z() + i) * d.z;
    }
    Vector best = products[0];
    for (int k = 1; k < kVectors; ++k)
        best = best > products[k] ? best : products[k];
    const S height = largestLane(best);
    const Vector level = L::fill(height);
    unsigned bits = 1u << kFewVertices;  // a NaN equals nothing
    for (int k = 0; k < kVectors; ++k)
        bits |= laneBits(products[k] == level) << (k * L::kWidth);
    const std::int32_t vertex = __builtin_ctz(bits);
    return {vertex < kFewVertices ? vertex : 0, height};
}

/// Scan of at most kFewVertices vertices.
template <class S>
[[gnu::always_inline]] inline SupportHit<S> hitFew(const Hull<S>& hull, const LaneDirection<S>& d)
{
    constexpr int kHalf = 8 / Lanes<S>::kWidth;
    return hull.vertexCount() > 8 ? hitVectors<2 * kHalf>(hull, d) : hitVectors<kHalf>(hull, d);
}

/// Scan of the points in PointBlocks.
template <class S>
SupportHit<S> hitBlocks(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    const std::int32_t vertex = BlockScan<S>(hull.pointBlocks(), d).highest();
    return {vertex, supportProduct(hull, vertex, d)};
}

/// Scan of all vertices.
template <class S>
SupportHit<S> hitLinear(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    if (!hull.pointBlocks().isEmpty())
        return hitBlocks(hull, d);
#ifdef __SSE2__
    if (kHasAvx2)
    {
        if constexpr (std::is_same_v<S, float>)
        {
            const LinearMaximum best = linearMaximumAvx2(hull, d.data());
            return {best.index < hull.vertexCount() ? best.index : 0, best.value};
        }
        else
        {
            const std::int64_t best = indexOfMaximumAvx2(hull, d.data());
            const std::int32_t vertex = best < hull.vertexCount() ? static_cast<std::int32_t>(best) : 0;
            return {vertex, supportProduct(hull, vertex, d)};
        }
    }
#endif
    const std::int32_t vertex = supportLinear(hull, d);
    return {vertex, supportProduct(hull, vertex, d)};
}

/// Hill climbing over the natural neighbours only, as in the thesis; for comparison.
template <class S>
SupportHit<S> supportClimb(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start,
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
            return {vertex, height};
        if (counters != nullptr)
            ++counters->ties;
        return hitLinear(hull, d);
    }
}

/// The best of the vertices that are level with `vertex` within the band, which are connected and usually few.
///
/// @return vertex -1 if there are too many, or a product is NaN
template <class S>
SupportHit<S> bestOfLevel(const Hull<S>& hull, const LaneDirection<S>& d, std::int32_t vertex, S height,
                          S band)
{
    using L = Lanes<S>;
    constexpr std::int32_t kMaxCount = 8;
    std::array<std::int32_t, kMaxCount> level = {vertex};
    std::int32_t count = 1;
    SupportHit<S> best = {vertex, height};
    const typename L::Vector low = L::fill(height - band);
    for (std::int32_t i = 0; i < count; ++i)
    {
        for (std::int32_t index = level[i]; index >= 0; index = hull.block(index).id[0])
        {
            const NeighbourBlock<S>& block = hull.block(index);
            for (int first = 0; first < 8; first += L::kWidth)
            {
                const typename L::Vector products = productsOf(block, first, d);
                unsigned near = laneBits(products >= low) & ~(first == 0 ? 1u : 0u);
                for (; near != 0; near &= near - 1)
                {
                    const int lane = __builtin_ctz(near);
                    const std::int32_t id = block.id[first + lane];
                    if (std::find(level.begin(), level.begin() + count, id) != level.begin() + count)
                        continue;
                    if (count == kMaxCount)
                        return {-1, height};
                    level[count++] = id;
                    const S product = products[lane];
                    if (product > best.height || (product == best.height && id < best.vertex))
                        best = {id, product};
                }
            }
        }
    }
    return best;
}

/// The support vertex, given the local maximum at which a climb has ended.
template <class S>
SupportHit<S> endOfClimb(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, const LaneDirection<S>& lanes,
                         std::int32_t vertex, const ClimbStep<S>& last, SupportCounters* counters = nullptr)
{
    const S band = hull.tieBand() * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
    // If a product is NaN, the comparison is false, and the scan ends the search.
    if (last.bestHeight < last.height - band)
        return {vertex, last.height};
    if (counters != nullptr)
        ++counters->ties;
    const SupportHit<S> hit = bestOfLevel(hull, lanes, vertex, last.height, band);
    return hit.vertex >= 0 && last.height == last.height ? hit : hitLinear(hull, d);
}

/// Hill climbing over natural and artificial neighbours, eight vertices at a time including the current one. Cost: 4 ns
/// per step where measured; from the support vertex of a direction a few degrees away it takes one or two steps at any
/// size.
template <class S>
SupportHit<S> supportClimbArtificial(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start,
                                     SupportCounters* counters = nullptr)
{
    const LaneDirection<S> lanes(d);
    std::int32_t vertex = start;
    for (;;)
    {
        const ClimbStep<S> step = climbStep(hull, vertex, lanes);
        if (counters != nullptr)
            ++counters->steps;
        if (!(step.bestHeight > step.height))
            return endOfClimb(hull, d, lanes, vertex, step, counters);
        vertex = step.best;
    }
}

template <class S>
SupportHit<S> supportCubeMap(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d,
                             SupportCounters* counters = nullptr)
{
    return supportClimbArtificial(hull, d, cubeMapStart(hull, d), counters);
}

/// Vertex at the end of a descent through the hull's hierarchy: the support vertex, except with ties. Cost: O(log n).
/// @pre the hierarchy is built
template <class S>
std::int32_t hierarchyStart(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    const DkHierarchy& hierarchy = hull.hierarchy();
    SupportHit<S> best = {hierarchy.top()[0], supportProduct(hull, hierarchy.top()[0], d)};
    const auto visit = [&](std::int32_t v)
    {
        const S height = supportProduct(hull, v, d);
        if (height > best.height)
            best = {v, height};
    };
    for (const std::int32_t v : hierarchy.top())
        visit(v);
    for (std::int32_t level = hierarchy.levelCount() - 1; level >= 0; --level)
    {
        for (const std::int32_t v : hierarchy.removed(level, best.vertex))
            visit(v);
    }
    return best.vertex;
}

template <class S>
SupportHit<S> supportHierarchy(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d,
                               SupportCounters* counters = nullptr)
{
    return supportClimbArtificial(hull, d, hierarchyStart(hull, d), counters);
}

/// Whether the scan tests eight vertices at a time.
template <class S>
bool isScanWide()
{
#ifdef __SSE2__
    return std::is_same_v<S, float> && kHasAvx2;
#else
    return false;
#endif
}

/// The least linearSupportMaximum() of any processor.
template <class S>
constexpr std::int32_t leastLinearSupportMaximum()
{
    return std::is_same_v<S, float> ? 48 : 32;
}

/// Up to this many vertices the scan beats the table and a climb for unrelated directions, where measured.
template <class S>
std::int32_t linearSupportMaximum()
{
    return isScanWide<S>() ? 100 : leastLinearSupportMaximum<S>();
}

/// Up to this many vertices the scan beats a climb from a vertex near the answer, where measured.
template <class S>
std::int32_t cheapScanMaximum()
{
    return isScanWide<S>() ? 64 : 16;
}

/// Support vertex and its product by the measured best method.
///
/// @param start a vertex, likely near the answer (last frame's), or -1
template <class S>
SupportHit<S> supportHit(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start = -1,
                         SupportMethod method = SupportMethod::Automatic, SupportCounters* counters = nullptr)
{
    if (counters != nullptr)
        ++counters->searches;
    if (method == SupportMethod::Linear || !hull.hasNeighbours())
        return hitLinear(hull, d);
    const bool hasStart = start >= 0 && start < hull.vertexCount();
    if (hasStart && method == SupportMethod::Automatic && hull.vertexCount() <= cheapScanMaximum<S>())
        return hitLinear(hull, d);
    if (hasStart && (method == SupportMethod::Automatic || method == SupportMethod::ClimbArtificial))
        return supportClimbArtificial(hull, d, start, counters);
    if (method == SupportMethod::Climb)
        return supportClimb(hull, d, hasStart ? start : 0, counters);
    if (method == SupportMethod::ClimbArtificial)
        return supportClimbArtificial(hull, d, 0, counters);
    if (method == SupportMethod::DobkinKirkpatrick && hull.hierarchy().isBuilt())
        return supportHierarchy(hull, d, counters);
    if (method == SupportMethod::CubeMap || hull.vertexCount() > linearSupportMaximum<S>())
        return supportCubeMap(hull, d, counters);
    return hitLinear(hull, d);
}

/// The support near a vertex that is no longer the support: tests a few vertices, moving to the highest neighbour each
/// time, then searches.
///
/// @param vertex the first vertex to test, or an invalid id
/// @param band   see isPeak()
template <class S>
SupportHit<S> hitNearVertex(const Hull<S>& hull, const typename Quad<S>::Vector& d, S band,
                            std::int32_t vertex)
{
    SupportHit<S> hit = {vertex, S(0)};
    // A negative id is a large unsigned number.
    const bool isKnown = static_cast<std::uint32_t>(vertex) < static_cast<std::uint32_t>(hull.blockCount());
    const LaneDirection<S> lanes(d);
    for (int visit = 0; isKnown && visit < kTestsNearVertex; ++visit)
    {
        std::int32_t beside;
        if (isPeak(hull, hit.vertex, lanes, band, hit.height, beside))
            return hit;
        hit.vertex = beside;
    }
    return supportHit<S>(hull, {d[0], d[1], d[2]}, hit.vertex);
}

template <class S>
std::int32_t supportVertex(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d, std::int32_t start = -1,
                           SupportMethod method = SupportMethod::Automatic,
                           SupportCounters* counters = nullptr)
{
    return supportHit(hull, d, start, method, counters).vertex;
}
}  // namespace cullet
