// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

/// Hulls as the steps of convex pairs read them, in one array for all hulls.
namespace cullet::convex
{
/// Lanes of a block: a vertex and seven of its neighbours, 128 bytes.
inline constexpr std::uint32_t kBlockLanes = 8;

/// Cells of a hull's start table: Hull::startTable().
inline constexpr std::uint32_t kStarts = 384;

/// A vertex with a number. In a block, lane 0 is the block's own vertex and has its next block, or -1; the other lanes
/// are neighbours and have their ids. Lanes beyond the last neighbour repeat an earlier one.
struct alignas(16) HullLane
{
    float x, y, z;
    std::int32_t id;
};

/// Where the vertices of a hull are.
struct alignas(16) HullRow
{
    static constexpr std::uint32_t kClimbable = 0x80000000u;

    std::uint32_t
        first;  ///< of its blocks, in all of HullTables::lanes; a hull without a graph has vertices there
    std::uint32_t count;  ///< of vertices, and kClimbable where each vertex i has block first + i
    float reach;          ///< no vertex is farther from the origin of the hull
    float tieBand;        ///< Hull::tieBand()
};

/// A face of a hull.
struct HullFace
{
    float normal[3];             ///< unit, outward, rounded
    std::uint32_t first, count;  ///< of its corners in SurfaceTables::corners, counter-clockwise from outside
};

/// An edge between two faces.
struct alignas(16) HullEdge
{
    static constexpr std::uint32_t kNoFace = 0xffffffffu;

    std::uint32_t from, to;  ///< vertices of the hull
    std::uint32_t left,
        right;  ///< faces of the hull, the left one has the vertices in this order; kNoFace: a segment
};

/// Where the faces and edges of a hull are. Without faces, as those of a cloud, both are empty.
struct alignas(16) SurfaceRow
{
    std::uint32_t firstFace, faces;
    std::uint32_t firstEdge, edges;
    std::uint32_t
        firstVertex;  ///< in SurfaceTables::around; the faces of a vertex end where those of the next begin
};

/// The surfaces of hulls, in the order of HullTables::rows.
struct SurfaceTables
{
    const SurfaceRow* rows = nullptr;        ///< [hulls]
    const HullFace* faces = nullptr;         ///< of all hulls
    const HullEdge* edges = nullptr;         ///< likewise
    const std::uint32_t* corners = nullptr;  ///< vertices of faces
    const std::uint32_t* around =
        nullptr;  ///< by vertex, and one more for each hull: the first in vertexFaces
    const std::uint32_t* vertexFaces = nullptr;  ///< faces of vertices, numbers within their hull
};

/// The sizes of the arrays of SurfaceTables.
struct SurfaceSizes
{
    std::uint64_t faces, edges, corners, around, vertexFaces;
};

struct HullTables
{
    const HullRow* rows = nullptr;          ///< [hulls]
    const HullLane* lanes = nullptr;        ///< [kBlockLanes blocks]
    const std::uint16_t* starts = nullptr;  ///< [kStarts hulls]
    std::uint32_t hulls = 0;
};
}  // namespace cullet::convex
