// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/narrow/hull_set.h"

#include "cullet/narrow/hull/hull.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <type_traits>
#include <vector>

namespace cullet
{
using convex::HullEdge;
using convex::HullFace;
using convex::HullLane;
using convex::HullRow;
using convex::kBlockLanes;
using convex::kStarts;
using convex::SurfaceRow;

struct HullSet::Arrays
{
    std::vector<HullRow> rows;
    std::vector<HullLane> lanes;
    std::vector<std::uint16_t> starts;
    std::vector<SurfaceRow> surfaces;
    std::vector<HullFace> faces;
    std::vector<HullEdge> edges;
    std::vector<std::uint32_t> corners, around, vertexFaces;

    void growForSurface(const Hull<float>& hull);
    void addSurface(const Hull<float>& hull);
};

namespace
{
constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();

/// Makes room for more elements, so that they can be added without an exception.
template <class T>
void growBy(std::vector<T>& list, std::uint64_t count)
{
    const std::uint64_t needed = list.size() + count;
    if (needed > list.capacity())
        list.reserve(std::max(needed, std::uint64_t{2} * list.capacity()));
}

template <class T>
std::uint32_t lengthOf(const std::vector<T>& list)
{
    return static_cast<std::uint32_t>(list.size());
}

/// Calls body(index) for every block of a hull with neighbours.
template <class Body>
void forEachBlock(const Hull<float>& hull, const Body& body)
{
    for (std::int32_t vertex = 0; vertex < hull.blockCount(); ++vertex)
    {
        for (std::int32_t index = vertex; index >= 0; index = hull.block(index).id[0])
            body(index);
    }
}

std::uint64_t blocksOf(const Hull<float>& hull)
{
    if (!hull.hasNeighbours())
        return (static_cast<std::uint64_t>(hull.vertexCount()) + kBlockLanes - 1) / kBlockLanes;
    std::int32_t last = 0;
    forEachBlock(hull, [&](std::int32_t index) { last = std::max(last, index); });
    return static_cast<std::uint64_t>(last) + 1;
}

/// @param lanes [8 blocksOf(hull)]
void fillLanes(const Hull<float>& hull, HullLane* lanes)
{
    const auto fillBlock = [&](std::int32_t index)
    {
        const NeighbourBlock<float>& block = hull.block(index);
        HullLane* const to = lanes + static_cast<std::size_t>(index) * kBlockLanes;
        for (std::size_t k = 0; k < kBlockLanes; ++k)
            to[k] = {block.x[k], block.y[k], block.z[k], block.id[k]};
    };
    if (hull.hasNeighbours())
        forEachBlock(hull, fillBlock);
    else
    {
        for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
            lanes[i] = {hull.x()[i], hull.y()[i], hull.z()[i], i};
    }
}
/// The only edge of a segment, between its ends.
HullEdge segmentOf(const Hull<float>& hull)
{
    const auto farthestFrom = [&](std::int32_t from)
    {
        std::int32_t best = 0;
        for (std::int32_t i = 1; i < hull.vertexCount(); ++i)
        {
            if ((hull.vertex(i) - hull.vertex(from)).squaredNorm() >
                (hull.vertex(best) - hull.vertex(from)).squaredNorm())
                best = i;
        }
        return best;
    };
    const std::int32_t from = farthestFrom(0), to = farthestFrom(from);
    return {static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to), HullEdge::kNoFace,
            HullEdge::kNoFace};
}
}  // namespace

/// Makes room for the faces and edges of a hull.
void HullSet::Arrays::growForSurface(const Hull<float>& hull)
{
    // Each corner of a face is a face of a corner. There are more of them than of faces, of edges and of vertices.
    std::uint64_t faceCorners = 0;
    for (const Hull<float>::Face& face : hull.faces())
        faceCorners += static_cast<std::uint64_t>(face.count);
    const std::uint64_t ends = static_cast<std::uint64_t>(hull.vertexCount()) + 1;
    if (corners.size() + faceCorners > kMost || around.size() + ends > kMost)
        throw std::bad_alloc();
    growBy(surfaces, 1);
    growBy(faces, hull.faces().size());
    growBy(edges, hull.edges().size() + 1);
    growBy(corners, faceCorners);
    growBy(vertexFaces, faceCorners);
    growBy(around, ends);
}

/// @pre growForSurface()
void HullSet::Arrays::addSurface(const Hull<float>& hull)
{
    const std::uint32_t firstFace = lengthOf(faces), firstEdge = lengthOf(edges),
                        firstVertex = lengthOf(around);
    const auto faceCount = static_cast<std::int32_t>(hull.faces().size());
    for (std::int32_t i = 0; i < faceCount; ++i)
    {
        const Hull<float>::Face& face = hull.faces()[static_cast<std::size_t>(i)];
        const Eigen::Vector3f normal = face.normal.cast<float>();
        faces.push_back(
            {{normal[0], normal[1], normal[2]}, lengthOf(corners), static_cast<std::uint32_t>(face.count)});
        for (const std::int32_t vertex : hull.faceVertices(i))
            corners.push_back(static_cast<std::uint32_t>(vertex));
    }
    for (const Hull<float>::Edge& edge : hull.edges())
    {
        edges.push_back({static_cast<std::uint32_t>(edge.from), static_cast<std::uint32_t>(edge.to),
                         static_cast<std::uint32_t>(edge.left), static_cast<std::uint32_t>(edge.right)});
    }
    if (hull.kind() == HullKind::Segment)
        edges.push_back(segmentOf(hull));
    around.push_back(lengthOf(vertexFaces));
    for (std::int32_t vertex = 0; vertex < hull.vertexCount(); ++vertex)
    {
        if (faceCount > 0)
        {
            for (const std::int32_t face : hull.facesOf(vertex))
                vertexFaces.push_back(static_cast<std::uint32_t>(face));
        }
        around.push_back(lengthOf(vertexFaces));
    }
    surfaces.push_back(
        {firstFace, lengthOf(faces) - firstFace, firstEdge, lengthOf(edges) - firstEdge, firstVertex});
}

HullSet::HullSet() : m_arrays(std::make_unique<Arrays>()) {}
HullSet::HullSet(HullSet&&) noexcept = default;
HullSet& HullSet::operator=(HullSet&&) noexcept = default;
HullSet::~HullSet() = default;

std::uint32_t HullSet::add(const Hull<float>& given)
{
    const Hull<float>& hull = given.corners();
    static_assert(std::tuple_size_v<std::decay_t<decltype(hull.startTable())>> == kStarts, "the same cube");
    Arrays& arrays = *m_arrays;
    const std::uint64_t first = blockCount(), blocks = blocksOf(hull);
    if (first + blocks > kMost)
        throw std::bad_alloc();
    // What may throw comes before what changes the set.
    growBy(arrays.rows, 1);
    growBy(arrays.starts, kStarts);
    arrays.growForSurface(hull);
    arrays.lanes.resize(arrays.lanes.size() + blocks * kBlockLanes);
    fillLanes(hull, arrays.lanes.data() + first * kBlockLanes);
    const auto count = static_cast<std::uint32_t>(hull.vertexCount());
    arrays.rows.push_back({static_cast<std::uint32_t>(first),
                           count | (hull.hasNeighbours() ? HullRow::kClimbable : 0u), hull.reach(),
                           hull.tieBand()});
    arrays.starts.insert(arrays.starts.end(), hull.startTable().begin(), hull.startTable().end());
    arrays.addSurface(hull);
    return size() - 1;
}

std::uint32_t HullSet::size() const
{
    return static_cast<std::uint32_t>(m_arrays->rows.size());
}

std::uint64_t HullSet::blockCount() const
{
    return m_arrays->lanes.size() / kBlockLanes;
}

convex::HullTables HullSet::tables() const
{
    return {m_arrays->rows.data(), m_arrays->lanes.data(), m_arrays->starts.data(), size()};
}

convex::SurfaceTables HullSet::surfaces() const
{
    const Arrays& arrays = *m_arrays;
    return {arrays.surfaces.data(), arrays.faces.data(),  arrays.edges.data(),
            arrays.corners.data(),  arrays.around.data(), arrays.vertexFaces.data()};
}

convex::SurfaceSizes HullSet::surfaceSizes() const
{
    const Arrays& arrays = *m_arrays;
    return {arrays.faces.size(), arrays.edges.size(), arrays.corners.size(), arrays.around.size(),
            arrays.vertexFaces.size()};
}
}  // namespace cullet
