// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/pair_heights.h"
#include "cullet/cuda/narrow/pair_search.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/posed_pair.h"

#include <cstdint>

/// The steps of a query for all pairs; each is called for one pair.
namespace cullet::convex
{
/// The input of a query. Addresses of the executor's memory.
struct PairInput
{
    const BodyPose* poses = nullptr;  ///< [bodies]
    std::uint32_t bodies = 0;
    const RowPair* pairs = nullptr;  ///< [count]
    std::uint32_t count = 0;
};

/// What is kept of each pair from one query to the next. Any content gives the same answers, up to rounding; but
/// heights are those of the hulls that they name.
struct PairMemory
{
    PairAxis* axes = nullptr;
    PairHeights* heights = nullptr;
    PairSimplex* simplices = nullptr;
    PairState* states = nullptr;

    /// Forgets a pair, as cleared memory has.
    CULLET_HOST_DEVICE void clear(std::uint64_t pair) const
    {
        axes[pair] = {};
        heights[pair] = {};
        simplices[pair] = {};
        states[pair] = {};
    }
    CULLET_HOST_DEVICE void copy(std::uint64_t pair, const PairMemory& from, std::uint64_t other) const
    {
        axes[pair] = from.axes[other];
        heights[pair] = from.heights[other];
        simplices[pair] = from.simplices[other];
        states[pair] = from.states[other];
    }
};

/// Where a pair goes before or after its axis has been tested.
enum class PairRoute
{
    Done,
    Asked,      ///< its axis is to be tested
    Failed,     ///< its axis does not separate
    Remembered  ///< it overlapped in the last query
};

struct PairCounts
{
    std::uint32_t failed = 0, remembered = 0, doubtful = 0;
    std::uint32_t overlapping = 0, undecided = 0, invalid = 0;
};

/// The pairs that are searched, in any order: no result depends on it.
struct PairQueues
{
    std::uint32_t* searched =
        nullptr;  ///< [count] failed pairs from the front, remembered ones from the back
    std::uint32_t* doubtful = nullptr;  ///< [count]
    PairCounts* counts = nullptr;
};

/// The bodies of a pair of the list.
struct ReadPair
{
    BodyPose a = {}, b = {};
    HullView hullA, hullB;

    template <class T>
    CULLET_HOST_DEVICE PosedPair<T> posed() const
    {
        return PosedPair<T>(hullA, hullB, a, b);
    }
};

/// Reads what a pair of the list refers to.
struct PairReader
{
    HullTables hulls;
    PairInput input;

    /// @return false for an invalid pair
    CULLET_HOST_DEVICE bool read(RowPair rows, ReadPair& pair) const
    {
        if (rows.a >= input.bodies || rows.b >= input.bodies)
            return false;
        pair.a = input.poses[rows.a];
        pair.b = input.poses[rows.b];
        if (pair.a.hull >= hulls.hulls || pair.b.hull >= hulls.hulls)
            return false;
        pair.hullA = HullView(hulls, pair.a.hull);
        pair.hullB = HullView(hulls, pair.b.hull);
        return isUsable(pair.a) && isUsable(pair.b) && pair.hullA.vertexCount() > 0 &&
               pair.hullB.vertexCount() > 0;
    }
};

/// Tests the remembered axis of each pair, or without one the axis between the origins. In three parts, between which a
/// GPU's threads look for the supports together: begin(), support() of both sides, finish(). A pair of which the known
/// heights prove that it is apart needs no supports.
struct TestAxes
{
    PairReader reader;
    PairMemory memory;
    PairCounts* counts;

    struct Query
    {
        HullSide<float> a, b;
        Vec<float> axis;
        float shift;          ///< see testOf()
        float least;          ///< what proves a gap
        std::uint32_t known;  ///< PairAxis::vertices of the axis
        bool isNew;           ///< it is not the remembered axis
        PairState state;      ///< of the last query
    };

    CULLET_HOST_DEVICE PairRoute operator()(std::uint32_t pair) const
    {
        Query query;
        const PairRoute route = begin(pair, query);
        return route == PairRoute::Asked ? finish(pair, query, query.a.support(), query.b.support()) : route;
    }

    /// @param query [out] set where the result is Asked
    CULLET_HOST_DEVICE PairRoute begin(std::uint32_t pair, Query& query) const
    {
        // All loads that need no other one come first.
        const RowPair rows = reader.input.pairs[pair];
        const PairAxis remembered = memory.axes[pair];
        const PairHeights heights = memory.heights[pair];
        query.state = memory.states[pair];
        ReadPair bodies;
        if (!reader.read(rows, bodies))
        {
            memory.states[pair] = PairState::Invalid;
            fetchAdd(&counts->invalid, 1);
            return PairRoute::Done;
        }
        if (query.state == PairState::Overlapping)
            return PairRoute::Remembered;
        const PosedPair<float> posed = bodies.posed<float>();
        query.axis = {remembered.axis[0], remembered.axis[1], remembered.axis[2]};
        query.known = remembered.vertices;
        const float length2 = dot(query.axis, query.axis);
        // A longer axis is not covered by the bound of errors; a NaN makes the comparison false.
        query.isNew = !(length2 > 0.99f && length2 < 1.0001f);
        if (query.isNew)
        {
            query.axis = firstAxis(posed.offset());
            query.known = kNoVertices;
        }
        const VertexIds starts = unpacked(query.known);
        query.a = posed.sideA(query.axis, starts.a);
        query.b = posed.sideB(query.axis, starts.b);
        query.shift = dot(query.axis, posed.offset());
        // Errors are relative to the length of the axis.
        query.least = posed.error() * 1.0001f;
        if (query.isNew || !(-mostHeights(heights, query.a, query.b) - query.shift > 1.5f * query.least))
            return PairRoute::Asked;
        storeApart(pair, query.state);
        return PairRoute::Done;
    }

    CULLET_HOST_DEVICE PairRoute finish(std::uint32_t pair, const Query& query, const Support<float>& a,
                                        const Support<float>& b) const
    {
        const AxisTest<float> test = testOf(a, b, query.shift);
        const std::uint32_t now = packed(test.ids);
        if (query.isNew || now != query.known)
            memory.axes[pair] = {{query.axis.x, query.axis.y, query.axis.z}, now};
        if (!(test.along > query.least))
            return PairRoute::Failed;
        memory.heights[pair] = heightsOf(query.a, query.b, a.height + b.height);
        storeApart(pair, query.state);
        return PairRoute::Done;
    }

private:
    CULLET_HOST_DEVICE void storeApart(std::uint32_t pair, PairState last) const
    {
        if (last != PairState::Apart)
            memory.states[pair] = PairState::Apart;
    }

    CULLET_HOST_DEVICE static Vec<float> firstAxis(const Vec<float>& offset)
    {
        const float largest = fmaxf(fmaxf(fabsf(offset.x), fabsf(offset.y)), fabsf(offset.z));
        if (!(largest > 1e-30f && largest < 1e30f))
            return {1.0f, 0.0f, 0.0f};
        const Vec<float> scaled = offset * (-1.0f / largest);
        return scaled * (1.0f / sqrtf(dot(scaled, scaled)));
    }
};

/// Searches one pair in T.
template <class T>
struct SearchPair
{
    PairReader reader;
    PairMemory memory;
    PairCounts* counts;

    /// @return false if the pair is doubtful
    CULLET_HOST_DEVICE bool search(std::uint32_t pair, SearchStart start) const
    {
        PairAxis axis = memory.axes[pair];
        PairSimplex simplex = memory.simplices[pair];
        ReadPair bodies;
        if (!reader.read(reader.input.pairs[pair], bodies))
            return true;
        const PosedPair<T> posed = bodies.template posed<T>();
        const SearchResult result = PairSearch<T>(posed).run(axis, simplex, start);
        memory.axes[pair] = axis;
        memory.simplices[pair] = simplex;
        if (result == SearchResult::Doubtful)
            return false;
        store(pair, result == SearchResult::Apart ? PairState::Apart : PairState::Overlapping);
        return true;
    }

    CULLET_HOST_DEVICE void store(std::uint32_t pair, PairState state) const
    {
        memory.states[pair] = state;
        if (state == PairState::Overlapping)
            fetchAdd(&counts->overlapping, 1);
        else if (state == PairState::Undecided)
            fetchAdd(&counts->undecided, 1);
    }
};

/// Searches in float; what float cannot prove goes to the next queue.
struct SearchInFloat
{
    SearchPair<float> search;

    /// @return false if the pair is doubtful
    CULLET_HOST_DEVICE bool operator()(std::uint32_t pair, PairRoute route) const
    {
        return search.search(pair, route == PairRoute::Remembered ? SearchStart::Simplex : SearchStart::Axis);
    }
};

/// Searches in double, a second time without the simplex if rounding has led the first one astray.
struct SearchInDouble
{
    SearchPair<double> search;

    CULLET_HOST_DEVICE void operator()(std::uint32_t pair) const
    {
        if (search.search(pair, SearchStart::Simplex))
            return;
        search.memory.simplices[pair] = {{kNoVertices, kNoVertices, kNoVertices, kNoVertices}};
        if (!search.search(pair, SearchStart::Axis))
            search.store(pair, PairState::Undecided);
    }
};

/// Hands the counts to the CPU, and begins new ones.
struct HandOverCounts
{
    PairCounts* counts;
    PairCounts* fetched;  ///< memory that the CPU reads

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        *fetched = *counts;
        *counts = {};
    }
};
}  // namespace cullet::convex
