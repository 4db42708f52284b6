// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

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
        storeBlocks();
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
        constexpr std::size_t kUsual = 10;
        std::vector<std::int32_t> all, begin, naturalEnd;
        all.reserve(kUsual * static_cast<std::size_t>(m_hull.m_vertexCount));
        begin.reserve(m_hull.m_neighbourBegin.size());
        naturalEnd.reserve(m_hull.m_naturalEnd.size());
        m_hull.m_opposite.reserve(m_hull.m_naturalEnd.size());
        if (m_hull.vertexCount() > kMaxScanned)
            findAnswers();
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
        {
            const typename Hull<S>::Span natural = m_hull.naturalNeighbours(v);
            begin.push_back(static_cast<std::int32_t>(all.size()));
            all.insert(all.end(), natural.begin(), natural.end());
            naturalEnd.push_back(static_cast<std::int32_t>(all.size()));
            addArtificialNeighbours(v, outward[v], all);
        }
        begin.push_back(static_cast<std::int32_t>(all.size()));
        m_hull.m_neighbours.swap(all);
        m_hull.m_neighbourBegin.swap(begin);
        m_hull.m_naturalEnd.swap(naturalEnd);
    }

    /// The support vertex; a climb takes few steps, since it starts from the answer for a similar direction.
    std::int32_t farthest(const Vector& direction)
    {
        if (m_hull.vertexCount() <= kMaxScanned)
            return hitLinear(m_hull, direction).vertex;
        std::int32_t& answer = m_answers[static_cast<std::size_t>(cubeCell(direction, m_cells))];
        answer = climb(direction, answer);
        return answer;
    }

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
    std::int32_t climbCorners(const Vector& direction, std::int32_t vertex) const
    {
        S height = supportProduct(m_hull, vertex, direction);
        std::int32_t productCount = 0;
        for (std::int32_t before = -1; before != vertex && productCount <= kMaxProducts;)
        {
            before = vertex;
            const typename Hull<S>::Span neighbours = m_hull.naturalNeighbours(before);
            productCount += neighbours.size();
            for (const std::int32_t u : neighbours)
            {
                const S h = supportProduct(m_hull, u, direction);
                vertex = h > height ? u : vertex;
                height = std::max(h, height);
            }
        }
        return vertex;
    }

    /// @param all ends with the natural neighbours
    void addArtificialNeighbours(std::int32_t v, const Eigen::Vector3d& outward,
                                 std::vector<std::int32_t>& all)
    {
        const auto begin = static_cast<std::ptrdiff_t>(all.size()) - m_hull.naturalNeighbours(v).size();
        const Eigen::Vector3d normal = unitOf(outward);
        // The normals around a vertex of a very thin shape may cancel: then all directions are 0 and give vertex 0.
        const Eigen::Vector3d side = normal.isZero(0.0) ? normal : Eigen::Vector3d(normal.unitOrthogonal());
        const Eigen::Vector3d front = normal.cross(side);
        // The opposite vertex first; then, to fill the last block, the vertices far to the sides.
        const std::array<Eigen::Vector3d, 8> directions = {
            -normal, side - normal, -side - normal, front - normal, -front - normal, side, -side, front};
        const auto isBlockFull = [&] { return (static_cast<std::ptrdiff_t>(all.size()) - begin) % 7 == 0; };
        for (std::size_t i = 0; i < directions.size() && (i == 0 || !isBlockFull()); ++i)
        {
            const std::int32_t far = farthest(directions[i].template cast<S>());
            if (i == 0)
                m_hull.m_opposite.push_back(far);
            const bool isNew = far != v && std::find(all.begin() + begin, all.end(), far) == all.end();
            if (isNew)
                all.push_back(far);
        }
    }

    void storeBlocks()
    {
        // Most vertices have one block, and most of the others two.
        m_hull.m_blocks.reserve(m_hull.m_neighbours.size() / 5);
        m_hull.m_blocks.resize(m_hull.m_vertexCount);
        m_hull.m_blockCount = m_hull.m_vertexCount;
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
        {
            const typename Hull<S>::Span list = m_hull.neighbours(v);
            std::int32_t index = v;
            for (std::int32_t first = 0; first < list.size(); first += 7)
            {
                const bool isLast = first + 7 >= list.size();
                const std::int32_t next = isLast ? -1 : static_cast<std::int32_t>(m_hull.m_blocks.size());
                m_hull.m_blocks[index] = makeBlock(v, list, first, next);
                if (isLast)
                    break;
                m_hull.m_blocks.emplace_back();
                index = next;
            }
        }
    }

    NeighbourBlock<S> makeBlock(std::int32_t v, const typename Hull<S>::Span& list, std::int32_t first,
                                std::int32_t next) const
    {
        NeighbourBlock<S> block;
        for (std::int32_t lane = 0; lane < 8; ++lane)
        {
            const std::int32_t neighbour = first + lane - 1;
            const std::int32_t id = lane == 0 ? v : list[neighbour < list.size() ? neighbour : first];
            block.id[lane] = lane == 0 ? next : id;
            block.x[lane] = m_hull.m_x[id];
            block.y[lane] = m_hull.m_y[id];
            block.z[lane] = m_hull.m_z[id];
        }
        return block;
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
    std::vector<std::int32_t> m_answers;  ///< by cell: the last one found
};
}  // namespace cullet
