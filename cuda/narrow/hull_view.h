// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/turn.h"

#include <cmath>
#include <cstdint>
#include <type_traits>

/// Support searches over HullTables: the vertex of a hull with the largest rounded product d.v.
namespace cullet::convex
{
template <class T>
struct Support
{
    std::int32_t vertex;
    T height;  ///< d.v
};

/// Reads a lane of the tables as any memory.
struct PlainRead
{
    CULLET_HOST_DEVICE HullLane operator()(const HullLane* lane) const { return *lane; }
};

/// Reads a lane on a GPU as memory that no kernel writes. For the searches in double: booleans in float take 5 to 15 %
/// longer with it (H100).
struct ConstantRead
{
    CULLET_HOST_DEVICE HullLane operator()(const HullLane* lane) const { return readConstant(lane); }
};

template <class T>
using ReadFor = std::conditional_t<sizeof(T) == sizeof(double), ConstantRead, PlainRead>;

/// A hull in the tables.
class HullView
{
public:
    HullView() = default;
    /// @param tables outlive this object
    /// @pre hull < tables.hulls
    CULLET_HOST_DEVICE HullView(const HullTables& tables, std::uint32_t hull)
        : HullView(tables, hull, tables.rows[hull])
    {
    }
    /// @param row of that hull
    CULLET_HOST_DEVICE HullView(const HullTables& tables, std::uint32_t hull, const HullRow& row)
        : m_tables(&tables), m_row(row), m_hull(hull)
    {
    }

    CULLET_HOST_DEVICE std::int32_t vertexCount() const
    {
        return static_cast<std::int32_t>(m_row.count & ~HullRow::kClimbable);
    }
    CULLET_HOST_DEVICE float reach() const { return m_row.reach; }
    /// In the tables.
    CULLET_HOST_DEVICE std::uint32_t index() const { return m_hull; }
    CULLET_HOST_DEVICE bool isVertex(std::int32_t vertex) const
    {
        return vertex >= 0 && vertex < vertexCount();
    }

    template <class T>
    CULLET_HOST_DEVICE Vec<T> vertex(std::int32_t vertex) const
    {
        const HullLane lane = ReadFor<T>()(lanesAt(0) + static_cast<std::uint32_t>(vertex) * stride());
        return {T(lane.x), T(lane.y), T(lane.z)};
    }

    /// Climbs over the neighbours, and scans all vertices where a neighbour at the end of the climb is as high up to
    /// rounding (see Hull), so that the result does not depend on the start.
    ///
    /// @param start a vertex likely near the result; any other number: that of the start table
    template <class T>
    CULLET_HOST_DEVICE Support<T> support(const Vec<T>& d, std::int32_t start) const
    {
        if (!isClimbable())
            return scan(d);
        if constexpr (sizeof(T) == sizeof(double))
            return supportInDouble(d, startOf(d, start));
        else
            return supportFrom(d, startOf(d, start));
    }

    CULLET_HOST_DEVICE bool isClimbable() const { return (m_row.count & HullRow::kClimbable) != 0; }

    /// Where a climb begins.
    ///
    /// @param start as for support()
    /// @pre isClimbable()
    template <class T>
    CULLET_HOST_DEVICE std::int32_t startOf(const Vec<T>& d, std::int32_t start) const
    {
        return isVertex(start) ? start : startFor(d);
    }

    /// A vertex whose neighbours are all lower by more than this is the support.
    template <class T>
    CULLET_HOST_DEVICE T bandFor(const Vec<T>& d) const
    {
        return T(m_row.tieBand) * sumOfMagnitudes(d);
    }

    /// The block of a vertex in HullTables::lanes.
    CULLET_HOST_DEVICE std::uint32_t blockOf(std::int32_t vertex) const
    {
        return m_row.first + static_cast<std::uint32_t>(vertex);
    }

    template <class T>
    CULLET_HOST_DEVICE static T productOf(const HullLane& lane, const Vec<T>& d)
    {
        return dot(Vec<T>{T(lane.x), T(lane.y), T(lane.z)}, d);
    }

private:
    template <class T>
    struct Step
    {
        T own, best;
        std::int32_t id;  ///< the neighbour with the best product
    };

    CULLET_HOST_DEVICE std::uint32_t stride() const { return isClimbable() ? kBlockLanes : 1; }
    CULLET_HOST_DEVICE const HullLane* lanesAt(std::int32_t block) const
    {
        return m_tables->lanes +
               (std::uint64_t{m_row.first} + static_cast<std::uint32_t>(block)) * kBlockLanes;
    }

    template <class T>
    CULLET_HOST_DEVICE Support<T> supportFrom(const Vec<T>& d, std::int32_t vertex) const
    {
        const T band = bandFor(d);
        for (;;)
        {
            const Step<T> step = stepFrom(vertex, d, ReadFor<T>());
            if (!(step.best >= step.own - band))
                return {vertex, step.own};
            // Each step goes up, so that no vertex is visited twice.
            if (!(step.best > step.own))
                return scan(d);
            vertex = step.id;
        }
    }

    /// Climbs in float, which a GPU does in a fraction of the time. Two products in float, of a direction that was
    /// rounded, are off by less than 2^-21 of the reach times the direction's 1-norm: a vertex whose neighbours are all
    /// lower by more is the support in double, too.
    CULLET_HOST_DEVICE Support<double> supportInDouble(const Vec<double>& d, std::int32_t vertex) const
    {
        const Vec<float> rounded = {float(d.x), float(d.y), float(d.z)};
        const float band = bandFor(rounded) + 1e-6f * m_row.reach * sumOfMagnitudes(rounded);
        for (;;)
        {
            const Step<float> step = stepFrom(vertex, rounded, ConstantRead());
            // False where float overflows.
            if (step.best < step.own - band)
                return {vertex, dot(this->vertex<double>(vertex), d)};
            if (!(step.best > step.own))
                return scanInDouble(d, rounded, band);
            vertex = step.id;
        }
    }

    template <class T, class Read>
    CULLET_HOST_DEVICE Step<T> stepFrom(std::int32_t vertex, const Vec<T>& d, Read read) const
    {
        Step<T> step = {T(0), -T(INFINITY), vertex};
        for (std::int32_t index = vertex; index >= 0;)
        {
            const HullLane* const block = lanesAt(index);
            const HullLane own = read(block);
            step.own = productOf(own, d);
            CULLET_UNROLL
            for (std::uint32_t k = 1; k < kBlockLanes; ++k)
            {
                const HullLane lane = read(block + k);
                const T product = productOf(lane, d);
                if (product > step.best)
                {
                    step.best = product;
                    step.id = lane.id;
                }
            }
            index = own.id;
        }
        return step;
    }

    /// The lowest of the vertices with the largest product.
    template <class T>
    CULLET_HOST_DEVICE Support<T> scan(const Vec<T>& d) const
    {
        const HullLane* const lanes = lanesAt(0);
        Support<T> best = {0, -T(INFINITY)};
        const std::int32_t count = vertexCount();
        for (std::int32_t i = 0; i < count; ++i)
        {
            const HullLane lane = ReadFor<T>()(lanes + static_cast<std::uint32_t>(i) * stride());
            const T product = productOf(lane, d);
            if (product > best.height)
                best = {i, product};
        }
        return best;
    }

    /// scan() in double, for which only vertices count that are high enough in float.
    ///
    /// @param rounded d in float
    /// @param band    a larger difference in float has the sign of that in double
    CULLET_HOST_DEVICE Support<double> scanInDouble(const Vec<double>& d, const Vec<float>& rounded,
                                                    float band) const
    {
        const HullLane* const lanes = lanesAt(0);
        Support<double> best = {0, -double(INFINITY)};
        float highest = -INFINITY;
        const std::int32_t count = vertexCount();
        for (std::int32_t i = 0; i < count; ++i)
        {
            const HullLane lane = ConstantRead()(lanes + static_cast<std::uint32_t>(i) * stride());
            const float height = productOf(lane, rounded);
            if (height < highest - band)
                continue;
            highest = fmaxf(highest, height);
            const double product = productOf(lane, d);
            if (product > best.height)
                best = {i, product};
        }
        return best;
    }

    /// The start table's vertex for a direction; cubeCell() finds the same cell.
    template <class T>
    CULLET_HOST_DEVICE std::int32_t startFor(const Vec<T>& d) const
    {
        constexpr int kCells = 8;
        static_assert(6 * kCells * kCells == kStarts, "the cells of a cube");
        const T ax = magnitude(d.x), ay = magnitude(d.y), az = magnitude(d.z);
        const int axis = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2);
        const T along = axis == 0 ? d.x : axis == 1 ? d.y : d.z;
        const T right = axis == 0 ? d.y : axis == 1 ? d.z : d.x;
        const T up = axis == 0 ? d.z : axis == 1 ? d.x : d.y;
        if (!(magnitude(along) > T(0)))
            return 0;
        const T half = T(kCells) / T(2), scale = half / magnitude(along);
        const int side = 2 * axis + (along < T(0) ? 1 : 0);
        const int cell = (side * kCells + cellOf(right * scale + half)) * kCells + cellOf(up * scale + half);
        const std::int32_t start =
            m_tables->starts[std::uint64_t{m_hull} * kStarts + static_cast<std::uint32_t>(cell)];
        return isVertex(start) ? start : 0;
    }

    template <class T>
    CULLET_HOST_DEVICE static int cellOf(T place)
    {
        // A NaN fails the comparison.
        return place > T(0) ? static_cast<int>(place < T(8) ? place : T(7)) : 0;
    }

    // Addresses are computed where they are needed: in a kernel the tables are constants.
    const HullTables* m_tables = nullptr;
    HullRow m_row = {};
    std::uint32_t m_hull = 0;
};
}  // namespace cullet::convex
