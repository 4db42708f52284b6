// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/debug_containers.h"
#include "narrow/hull.h"
#include "narrow/support.h"
#include "narrow/surface_points.h"
#include "narrow/triangulation.h"
#include "narrow/unit_vector.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// The part of HullBuilder that makes a hull ready for climbing: neighbours, their blocks, and the table of start vertices.
template <class S>
class NeighbourBuilder
{
public:
    /// @param hull     its vertices and tie band are known
    /// @param points   given ones, without duplicates
    /// @param vertexOf by point; -1 where the point is no vertex
    NeighbourBuilder(Hull<S>& hull, const std::vector<Eigen::Vector3d>& points,
                     const std::vector<std::int32_t>& vertexOf)
        : m_hull(hull), m_points(points), m_vertexOf(vertexOf)
    {
    }

    void run(const Triangulation& surface, const SurfacePoints& extra)
    {
        storeNeighbours(surface, extra);
        storeBlocks();
        storeStartTable();
    }

private:
    using Vector = Eigen::Matrix<S, 3, 1>;

    void storeNeighbours(const Triangulation& surface, const SurfacePoints& extra)
    {
        std::vector<std::vector<std::int32_t>> lists(m_hull.m_vertexCount);
        // Weighted by area: the normal of a sliver is mostly rounding.
        std::vector<Eigen::Vector3d> outward(m_hull.m_vertexCount, Eigen::Vector3d::Zero());
        for (const Triangulation::Triangle& t : surface.triangles())
        {
            const Eigen::Vector3d normal = scaledNormal(m_points, t);
            for (int k = 0; k < 3; ++k)
            {
                lists[m_vertexOf[t.vertex[k]]].push_back(m_vertexOf[t.vertex[(k + 1) % 3]]);
                outward[m_vertexOf[t.vertex[k]]] += normal;
            }
        }
        for (const SurfacePoints::Attached& a : extra.attached())
        {
            const std::int32_t v = m_vertexOf[a.point];
            for (const std::int32_t point : a.corners)
            {
                const std::int32_t corner = m_vertexOf[point];
                lists[v].push_back(corner);
                lists[corner].push_back(v);
            }
            outward[v] = a.normal;
        }
        std::vector<std::size_t> naturalCounts;
        for (const std::vector<std::int32_t>& list : lists)
            naturalCounts.push_back(list.size());
        // The artificial ones are found by climbing over the natural ones.
        storeLists(lists, naturalCounts);
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
            addArtificialNeighbours(v, lists[v], outward[v]);
        storeLists(lists, naturalCounts);
    }

    void storeLists(const std::vector<std::vector<std::int32_t>>& lists,
                    const std::vector<std::size_t>& naturalCounts)
    {
        m_hull.m_neighbours.clear();
        m_hull.m_naturalEnd.clear();
        m_hull.m_neighbourBegin.assign(1, 0);
        for (std::size_t v = 0; v < lists.size(); ++v)
        {
            const std::size_t begin = m_hull.m_neighbours.size();
            m_hull.m_neighbours.insert(m_hull.m_neighbours.end(), lists[v].begin(), lists[v].end());
            m_hull.m_naturalEnd.push_back(static_cast<std::int32_t>(begin + naturalCounts[v]));
            m_hull.m_neighbourBegin.push_back(static_cast<std::int32_t>(m_hull.m_neighbours.size()));
        }
    }

    /// The support vertex; a climb takes few steps where a neighbour's answer is known.
    std::int32_t farthest(const Vector& way, std::int32_t start) const
    {
        constexpr std::int32_t kScanned = 256;
        return m_hull.vertexCount() <= kScanned ? supportLinear(m_hull, way)
                                                : supportClimb(m_hull, way, start).vertex;
    }

    void addArtificialNeighbours(std::int32_t v, std::vector<std::int32_t>& list,
                                 const Eigen::Vector3d& outward)
    {
        const Eigen::Vector3d normal = unitOf(outward);
        // Normals around a vertex of a shape without thickness may add up to nothing: then all ways lead to vertex 0.
        const Eigen::Vector3d side = normal.isZero(0.0) ? normal : Eigen::Vector3d(normal.unitOrthogonal());
        const Eigen::Vector3d front = normal.cross(side);
        // The opposite vertex first; then, to fill the last block, those that lie far to the sides.
        const std::array<Eigen::Vector3d, 8> ways = {
            -normal, side - normal, -side - normal, front - normal, -front - normal, side, -side, front};
        const std::int32_t before = *std::min_element(list.begin(), list.end());
        std::int32_t far = before < v ? m_hull.m_opposite[before] : v;
        for (std::size_t i = 0; i < ways.size() && (i == 0 || list.size() % 7 != 0); ++i)
        {
            far = farthest(ways[i].template cast<S>(), far);
            if (i == 0)
                m_hull.m_opposite.push_back(far);
            const bool isNew = far != v && std::find(list.begin(), list.end(), far) == list.end();
            if (isNew)
                list.push_back(far);
        }
    }

    void storeBlocks()
    {
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
        const auto centre = [](int cell) { return (S(2) * S(cell) + S(1)) / S(kCells) - S(1); };
        std::int32_t last = 0;
        for (int entry = 0; entry < 6 * kCells * kCells; ++entry)
        {
            const int side = entry / (kCells * kCells);
            Vector d;
            d[side / 2] = side % 2 == 0 ? S(1) : S(-1);
            d[(side / 2 + 1) % 3] = centre(entry / kCells % kCells);
            d[(side / 2 + 2) % 3] = centre(entry % kCells);
            last = supportClimbArtificial(m_hull, d, last).vertex;
            m_hull.m_startTable[entry] = static_cast<std::uint16_t>(last <= 0xffff ? last : 0);
        }
    }

    Hull<S>& m_hull;
    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<std::int32_t>& m_vertexOf;
};
}  // namespace cullet
