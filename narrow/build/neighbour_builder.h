// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/morton_order.h"
#include "cullet/narrow/build/quickhull.h"
#include "cullet/narrow/build/surface_points.h"
#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/support.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/unit_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace cullet
{
/// The part of HullBuilder that makes a hull ready for climbing: neighbours, their blocks, and the table of start
/// vertices.
template <class S>
class NeighbourBuilder
{
public:
    /// @param hull     has its vertices and tie band
    /// @param points   the given points without duplicates
    /// @param vertexOf by point; -1 where the point is no vertex
    /// @param areAllCorners no vertex lies inside a face or an edge
    NeighbourBuilder(Hull<S>& hull, const std::vector<Eigen::Vector3d>& points,
                     const std::vector<std::int32_t>& vertexOf, bool areAllCorners)
        : m_hull(hull),
          m_points(points),
          m_vertexOf(vertexOf),
          m_areAllCorners(areAllCorners),
          m_cells(static_cast<int>(std::sqrt(hull.m_vertexCount / 24.0)) + 1),
          m_answers(static_cast<std::size_t>(6 * m_cells * m_cells), 0)
    {
    }

    void run(const Quickhull& surface, const SurfacePoints& extra)
    {
        storeNatural(surface, extra);
        addArtificial(outwardOf(surface, extra));
        storeBlocks(
            m_hull, [this](std::int32_t v) { return m_hull.neighbours(v); },
            [this](std::int32_t v) { return m_hull.lanes(v); });
        if (m_hull.m_vertexCount > kMaxWithoutTable)
            storeStartTable();
    }

private:
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// Up to this many vertices every processor scans instead of using the table.
    static constexpr std::int32_t kMaxWithoutTable = leastLinearSupportMaximum<S>();
    /// Up to this many vertices a scan is cheaper than a climb.
    static constexpr std::int32_t kMaxScanned = 256;
    /// Limit of climbCorners().
    static constexpr std::int32_t kMaxProducts = 4096;

    /// Calls visit(vertex, neighbour) for all natural neighbours, those of a vertex in the order of its list.
    template <class Visit>
    void forEachNaturalNeighbour(const Quickhull& surface, const SurfacePoints& extra,
                                 const Visit& visit) const
    {
        for (const Quickhull::Triangle& t : surface.triangles())
        {
            for (int k = 0; k < 3; ++k)
                visit(m_vertexOf[t.vertex[k]], m_vertexOf[t.vertex[(k + 1) % 3]]);
        }
        for (const SurfacePoints::Attached& a : extra.attached())
        {
            const std::int32_t v = m_vertexOf[a.point];
            for (const std::int32_t point : a.corners)
            {
                const std::int32_t corner = m_vertexOf[point];
                visit(v, corner);
                visit(corner, v);
            }
        }
    }

    void storeNatural(const Quickhull& surface, const SurfacePoints& extra)
    {
        std::vector<std::int32_t>& begin = m_hull.m_neighbourBegin;
        begin.assign(static_cast<std::size_t>(m_hull.m_vertexCount) + 1, 0);
        forEachNaturalNeighbour(surface, extra, [&begin](std::int32_t v, std::int32_t) { ++begin[v + 1]; });
        std::partial_sum(begin.begin(), begin.end(), begin.begin());
        m_hull.m_neighbours.resize(static_cast<std::size_t>(begin.back()));
        m_hull.m_naturalEnd.assign(begin.begin(), begin.end() - 1);
        forEachNaturalNeighbour(surface, extra,
                                [this](std::int32_t v, std::int32_t neighbour)
                                { m_hull.m_neighbours[m_hull.m_naturalEnd[v]++] = neighbour; });
    }

    /// Outward normals by vertex, of any length. Weighted by area, since the normal of a sliver is mostly rounding.
    std::vector<Eigen::Vector3d> outwardOf(const Quickhull& surface, const SurfacePoints& extra) const
    {
        std::vector<Eigen::Vector3d> outward(m_hull.m_vertexCount, Eigen::Vector3d::Zero());
        for (const Quickhull::Triangle& t : surface.triangles())
        {
            const Eigen::Vector3d normal = scaledNormal(m_points, t);
            for (const std::int32_t point : t.vertex)
                outward[m_vertexOf[point]] += normal;
        }
        for (const SurfacePoints::Attached& a : extra.attached())
            outward[m_vertexOf[a.point]] = a.normal;
        return outward;
    }

    /// Adds artificial neighbours, which are found by climbing over the natural ones.
    void addArtificial(const std::vector<Eigen::Vector3d>& outward)
    {
        const MortonOrder order(verticesInDouble());
        if (m_hull.vertexCount() > kMaxScanned)
        {
            if (m_areAllCorners)
                storeNear(order);
            findAnswers();
        }
        const std::size_t count = static_cast<std::size_t>(m_hull.m_vertexCount);
        std::vector<std::int32_t> found;
        std::vector<FoundSpan> spans(count);
        found.reserve(3 * count);
        m_hull.m_opposite.resize(count);
        for (const std::int32_t v : order.points())
        {
            spans[v].begin = static_cast<std::int32_t>(found.size());
            findArtificialNeighbours(v, outward[v], found);
            spans[v].end = static_cast<std::int32_t>(found.size());
        }
        storeArtificial(found, spans);
    }

    /// The artificial neighbours of a vertex in a list of all.
    struct FoundSpan
    {
        std::int32_t begin, end;
    };

    /// Stores the artificial neighbours behind the natural ones.
    void storeArtificial(const std::vector<std::int32_t>& found, const std::vector<FoundSpan>& spans)
    {
        std::vector<std::int32_t> all, begin, naturalEnd;
        all.reserve(m_hull.m_neighbours.size() + found.size());
        begin.reserve(m_hull.m_neighbourBegin.size());
        naturalEnd.reserve(m_hull.m_naturalEnd.size());
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
        {
            const typename Hull<S>::Span natural = m_hull.naturalNeighbours(v);
            begin.push_back(static_cast<std::int32_t>(all.size()));
            all.insert(all.end(), natural.begin(), natural.end());
            naturalEnd.push_back(static_cast<std::int32_t>(all.size()));
            all.insert(all.end(), found.begin() + spans[v].begin, found.begin() + spans[v].end);
        }
        begin.push_back(static_cast<std::int32_t>(all.size()));
        m_hull.m_neighbours.swap(all);
        m_hull.m_neighbourBegin.swap(begin);
        m_hull.m_naturalEnd.swap(naturalEnd);
    }

    std::vector<Eigen::Vector3d> verticesInDouble() const
    {
        std::vector<Eigen::Vector3d> vertices;
        vertices.reserve(static_cast<std::size_t>(m_hull.m_vertexCount));
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
            vertices.push_back(m_hull.vertex(v).template cast<double>());
        return vertices;
    }

    /// Copies vertices and natural neighbours in an order in which climbs from near directions read near memory.
    void storeNear(const MortonOrder& order)
    {
        m_near.m_vertexCount = m_hull.m_vertexCount;
        m_vertexAt = order.points();
        std::vector<std::int32_t> places;
        const auto listOf = [&](std::int32_t place) -> typename Hull<S>::Span
        {
            places.clear();
            for (const std::int32_t neighbour : m_hull.naturalNeighbours(m_vertexAt[place]))
                places.push_back(order.placeOf(neighbour));
            return {places.data(), places.data() + places.size()};
        };
        storeBlocks(m_near, listOf, [this](std::int32_t place) { return m_hull.lanes(m_vertexAt[place]); });
    }

    /// The support vertex; a climb takes few steps, since it starts from the answer for a similar direction.
    std::int32_t farthest(const Vector& direction)
    {
        if (m_hull.vertexCount() <= kMaxScanned)
            return hitLinear(m_hull, direction).vertex;
        std::int32_t& answer = m_answers[static_cast<std::size_t>(cubeCell(direction, m_cells))];
        answer = climb(direction, answer);
        return m_areAllCorners ? m_vertexAt[answer] : answer;
    }

    /// From and to a vertex, or a place of it in m_near.
    std::int32_t climb(const Vector& direction, std::int32_t start) const
    {
        return m_areAllCorners ? climbCorners(direction, start)
                               : supportClimb(m_hull, direction, start).vertex;
    }

    /// Finds the answers for the centres of all cells, each from the answer of an adjacent cell, in boustrophedon
    /// order.
    void findAnswers()
    {
        std::int32_t last = 0;
        for (int row = 0; row < 6 * m_cells; ++row)
        {
            for (int i = 0; i < m_cells; ++i)
            {
                const int cell = row * m_cells + (row % 2 == 0 ? i : m_cells - 1 - i);
                last = climb(cellCentre<S>(cell, m_cells), last);
                m_answers[static_cast<std::size_t>(cell)] = last;
            }
        }
    }

    /// Climbs to a local maximum: the support vertex, or a vertex level with it up to rounding, which suffices for a
    /// corner. Around vertices with very many neighbours, as the tip of a cone, the climb ends early.
    ///
    /// @param place in m_near, as the result
    std::int32_t climbCorners(const Vector& direction, std::int32_t place) const
    {
        const LaneDirection<S> lanes(direction);
        for (std::int32_t productCount = 0; productCount <= kMaxProducts;)
        {
            const ClimbStep<S> step = climbStep(m_near, place, lanes);
            if (!(step.bestHeight > step.height))
                return place;
            productCount += m_hull.naturalNeighbours(m_vertexAt[place]).size();
            place = step.best;
        }
        return place;
    }

    /// @param found [in, out] receives the artificial neighbours of the vertex
    void findArtificialNeighbours(std::int32_t v, const Eigen::Vector3d& outward,
                                  std::vector<std::int32_t>& found)
    {
        const typename Hull<S>::Span natural = m_hull.naturalNeighbours(v);
        const auto begin = static_cast<std::ptrdiff_t>(found.size());
        const Eigen::Vector3d normal = unitOf(outward);
        // The normals around a vertex of a very thin shape may cancel: then all directions are 0 and give vertex 0.
        const Eigen::Vector3d side = normal.isZero(0.0) ? normal : Eigen::Vector3d(normal.unitOrthogonal());
        const Eigen::Vector3d front = normal.cross(side);
        // The opposite vertex first; then, to fill the last block, the vertices far to the sides.
        const std::array<Eigen::Vector3d, 8> directions = {
            -normal, side - normal, -side - normal, front - normal, -front - normal, side, -side, front};
        const auto isBlockFull = [&]
        { return (natural.size() + static_cast<std::ptrdiff_t>(found.size()) - begin) % 7 == 0; };
        const auto isIn = [](const auto& first, const auto& last, std::int32_t id)
        { return std::find(first, last, id) != last; };
        for (std::size_t i = 0; i < directions.size() && (i == 0 || !isBlockFull()); ++i)
        {
            const std::int32_t far = farthest(directions[i].template cast<S>());
            if (i == 0)
                m_hull.m_opposite[v] = far;
            if (far != v && !isIn(natural.begin(), natural.end(), far) &&
                !isIn(found.begin() + begin, found.end(), far))
                found.push_back(far);
        }
    }

    /// Stores the blocks of a hull.
    ///
    /// @param listOf  gives the neighbours of a vertex
    /// @param lanesOf gives the coordinates of a vertex
    template <class ListOf, class LanesOf>
    static void storeBlocks(Hull<S>& hull, const ListOf& listOf, const LanesOf& lanesOf)
    {
        // Most vertices have one block, and some of the others two.
        hull.m_blocks.reserve(static_cast<std::size_t>(hull.m_vertexCount) / 4 * 5 + 1);
        hull.m_blocks.resize(hull.m_vertexCount);
        hull.m_blockCount = hull.m_vertexCount;
        for (std::int32_t v = 0; v < hull.m_vertexCount; ++v)
        {
            const typename Hull<S>::Span list = listOf(v);
            std::int32_t index = v;
            for (std::int32_t first = 0; first < list.size(); first += 7)
            {
                const bool isLast = first + 7 >= list.size();
                const std::int32_t next = isLast ? -1 : static_cast<std::int32_t>(hull.m_blocks.size());
                fillBlock(v, list, first, next, lanesOf, hull.m_blocks[index]);
                if (isLast)
                    break;
                hull.m_blocks.emplace_back();
                index = next;
            }
        }
    }

    template <class LanesOf>
    static void fillBlock(std::int32_t v, const typename Hull<S>::Span& list, std::int32_t first,
                          std::int32_t next, const LanesOf& lanesOf, NeighbourBlock<S>& block)
    {
        for (std::int32_t lane = 0; lane < 8; ++lane)
        {
            const std::int32_t neighbour = first + lane - 1;
            const std::int32_t id = lane == 0 ? v : list[neighbour < list.size() ? neighbour : first];
            const S* const at = lanesOf(id);
            block.id[lane] = lane == 0 ? next : id;
            block.x[lane] = at[0];
            block.y[lane] = at[1];
            block.z[lane] = at[2];
        }
    }

    void storeStartTable()
    {
        constexpr int kCells = Hull<S>::kCubeCells;
        std::int32_t last = 0;
        for (int cell = 0; cell < 6 * kCells * kCells; ++cell)
        {
            last = supportClimbArtificial(m_hull, cellCentre<S>(cell, kCells), last).vertex;
            m_hull.m_startTable[cell] = static_cast<std::uint16_t>(last <= 0xffff ? last : 0);
        }
    }

    Hull<S>& m_hull;
    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<std::int32_t>& m_vertexOf;
    bool m_areAllCorners;
    int m_cells;  ///< for cubeCell(); four directions per vertex, few answers per cell
    std::vector<std::int32_t> m_answers;   ///< by cell: the last one found
    Hull<S> m_near;                        ///< blocks of natural neighbours, for climbs over corners
    std::vector<std::int32_t> m_vertexAt;  ///< by vertex of m_near
};
}  // namespace cullet
