// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/dk_hierarchy.h"
#include "cullet/narrow/hull/point_blocks.h"
#include "cullet/narrow/math/debug_containers.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
/// The affine span of a set of points; every kind but Solid has a defined, reduced Hull.
enum class HullKind : std::uint8_t
{
    Empty,      ///< no points: no vertex, and support searches may not be called
    NotFinite,  ///< a coordinate is NaN, infinite or beyond 1e60: treated as Empty
    Point,      ///< one distinct point: one vertex
    Segment,    ///< collinear: all distinct points are vertices, no face
    Polygon,    ///< coplanar (exactly): all distinct points are vertices, two faces back to back
    Solid,      ///< spans space: faces, neighbours and start table are filled
    Cloud       ///< not examined, see CloudBuilder: all points are vertices, no face; support searches scan
};

/// Optional data of a Hull.
enum class HullExtra : std::uint8_t
{
    None,
    Hierarchy  ///< Hull::hierarchy(), of a Solid
};

/// A vertex (lane 0) and seven of its neighbours with inline coordinates, so that one step of a climb needs no gather
/// and reads two cache lines. Lanes beyond the last neighbour repeat an earlier one.
template <class S>
struct alignas(64) NeighbourBlock
{
    std::array<S, 8> x, y, z;
    std::array<std::int32_t, 8> id;  ///< in lane 0: the vertex's next block with further neighbours, or -1
};
static_assert(sizeof(NeighbourBlock<float>) == 128);

/// Convex hull of a point set as a graph for support searches and as faces for contact clipping. Immutable.
///
/// Frame and unit: those of the given points. Vertices are the points on the surface of the hull: its corners, and
/// points closer to a face than rounding can tell (see HullBuilder), in the order given; duplicates and interior points
/// are left out. So the maximum of the rounded products x dx + y dy + z dz over the vertices is the maximum over all
/// given points, bit for bit.
///
/// **Neighbours.** The natural neighbours of a corner are the corners across an edge of a triangulation of the surface;
/// a vertex inside a triangle has the three corners of the triangle. In addition every vertex has at least one
/// *artificial neighbour* (Ericson 2005, section 9.5.4, and the thesis, section 6.2.1) among its neighbours: the vertex
/// farthest below it along the mean normal of its triangles. For a vertex inside a face, that lies strictly below the
/// face.
///
/// *A climb in exact arithmetic ends at the support vertex.* Let v be a vertex none of whose neighbours u has d.(u - v)
/// > 0. If v is a corner, the edges of the hull at v are among its neighbours, they generate the cone of directions
/// from v into the hull, hence d.(x - v) <= 0 for every x of the hull: v is a support vertex. If v lies inside an edge
/// of the hull, its neighbours lie on both sides along the edge and in both faces, and generate the wedge of the two
/// faces; the same follows. If v lies inside a face, its natural neighbours generate only the plane of the face, and
/// for d against the outer normal all of them are level with v: here the climb of a plain graph gets stuck with the
/// whole width of the hull as error. The artificial neighbour lies strictly below the plane; together they generate the
/// half-space, and the argument holds again. Each step strictly increases d.v, and there are finitely many vertices, so
/// no vertex is visited twice and there is no endless loop (the thesis's Figure 9).
///
/// *In rounded arithmetic* the climb stops at v when no neighbour has a larger rounded product. Let E bound the
/// rounding error of a product. If another vertex g has a larger rounded product than v, its exact product is at least
/// that of v minus 2 E. The vertices with an exact product of at least that are connected in the graph, up to `slack()`
/// for vertices that are not exactly on their triangle. So v has a neighbour whose rounded product is at least that of
/// v minus 4 E + slack. The searches in support.h test for such a neighbour, and use the linear scan if one exists:
/// they always return the same vertex as the linear scan.
template <class S>
class Hull
{
public:
    using Scalar = S;
    using Vector = Eigen::Matrix<S, 3, 1>;
    using Block = NeighbourBlock<S>;

    struct Face
    {
        Eigen::Vector3d normal;  ///< unit, outward
        double offset;           ///< normal . x of the face's plane: the largest over its corners
        std::int32_t begin;      ///< first corner in faceVertices()
        std::int32_t count;      ///< corners, counter-clockwise from outside
    };

    /// Edge between two merged faces: corners from, to; `left` is the face that has them in this order.
    struct Edge
    {
        std::int32_t from, to, left, right;
    };

    struct Span
    {
        const std::int32_t* first;
        const std::int32_t* last;
        const std::int32_t* begin() const { return first; }
        const std::int32_t* end() const { return last; }
        std::int32_t size() const { return static_cast<std::int32_t>(last - first); }
        std::int32_t operator[](std::int32_t i) const { return first[i]; }
    };

    HullKind kind() const { return m_kind; }
    std::int32_t vertexCount() const { return m_vertexCount; }
    Vector vertex(std::int32_t i) const { return {m_x[i], m_y[i], m_z[i]}; }
    /// The coordinates of a vertex and a 0, for one load; aligned to their size.
    const S* lanes(std::int32_t i) const { return m_lanes[i].of.data(); }

    /// Index among the given points (the first of several equal ones).
    std::int32_t sourceIndex(std::int32_t vertex) const
    {
        return m_source.empty() ? vertex : m_source[vertex];
    }

    /// The hull of the corners alone: exactly the same body, with fewer vertices to search; this hull if all vertices
    /// are corners. Its support points are support points of all given points, up to rounding.
    const Hull& corners() const { return m_corners != nullptr ? *m_corners : *this; }

    /// Coordinates by axis, padded to a multiple of 8 with copies of vertex 0.
    const S* x() const { return m_x.data(); }
    const S* y() const { return m_y.data(); }
    const S* z() const { return m_z.data(); }
    std::int32_t paddedCount() const { return static_cast<std::int32_t>(m_x.size()); }

    /// True for a Solid: climbing is possible.
    bool hasNeighbours() const { return m_blockCount > 0; }
    Span naturalNeighbours(std::int32_t v) const
    {
        return span(m_neighbours, m_neighbourBegin[v], m_naturalEnd[v]);
    }
    /// Natural neighbours, then artificial ones.
    Span neighbours(std::int32_t v) const
    {
        return span(m_neighbours, m_neighbourBegin[v], m_neighbourBegin[v + 1]);
    }
    /// The vertex farthest below vertex v along the mean normal at v, of a Solid; a vertex that is merely far where v
    /// is a corner and finding the farthest would take thousands of products.
    std::int32_t opposite(std::int32_t v) const { return m_opposite[v]; }
    /// Number of vertices with a block: none, or all.
    std::int32_t blockCount() const { return m_blockCount; }
    /// The first block of vertex i is block i.
    const Block& block(std::int32_t i) const { return m_blocks[i]; }

    /// Of a Cloud of more than kMostInOneScan points; else empty.
    const PointBlocks<S>& pointBlocks() const { return m_pointBlocks; }
    /// Up to this many points a scan of all is fast enough.
    static constexpr std::int32_t kMostInOneScan = 4096;

    /// Built only with HullExtra::Hierarchy.
    const DkHierarchy& hierarchy() const { return m_hierarchy; }

    const std::vector<Face>& faces() const { return m_faces; }
    const std::vector<Edge>& edges() const { return m_edges; }
    Span faceVertices(std::int32_t face) const
    {
        return span(m_faceVertices, m_faces[face].begin, m_faces[face].begin + m_faces[face].count);
    }
    /// Faces with the vertex as a corner; none if the vertex is no corner.
    Span facesOf(std::int32_t v) const
    {
        return span(m_vertexFaces, m_vertexFaceBegin[v], m_vertexFaceBegin[v + 1]);
    }

    /// Largest distance of a vertex from the origin of the frame.
    double radius() const { return m_radius; }
    /// radius() rounded up.
    S reach() const { return m_reach; }
    /// Mean of the vertices.
    const Eigen::Vector3d& centre() const { return m_centre; }
    /// centre() rounded, and a 0.
    const S* centreLanes() const { return m_centreLanes.of.data(); }
    /// The centre is so near to the origin of the frame that the origin can replace it in a first guess.
    bool isCentred() const { return m_isCentred; }
    /// Largest distance between a vertex that is not a corner and its triangle.
    double slack() const { return m_slack; }
    /// Times |dx| + |dy| + |dz|: a larger difference of two rounded products has the sign of the exact difference;
    /// includes the slack.
    S tieBand() const { return m_tieBand; }

    /// Cells along the edge of one side of the start table's cube.
    static constexpr int kCubeCells = 8;
    /// Support vertex at the centre of a cell; row-major, sides ordered +x -x +y -y +z -z. Zero where the index has
    /// more than 16 bits: any start is valid, since a climb follows.
    const std::array<std::uint16_t, 6 * kCubeCells * kCubeCells>& startTable() const { return m_startTable; }

private:
    template <class>
    friend class CloudBuilder;
    template <class>
    friend class HullBuilder;
    template <class>
    friend class NeighbourBuilder;

    static Span span(const std::vector<std::int32_t>& list, std::int32_t begin, std::int32_t end)
    {
        return {list.data() + begin, list.data() + end};
    }

    struct alignas(4 * sizeof(S)) FourLanes
    {
        std::array<S, 4> of = {};
    };

    HullKind m_kind = HullKind::Empty;
    std::int32_t m_vertexCount = 0;
    std::int32_t m_blockCount = 0;
    std::vector<S> m_x, m_y, m_z;
    std::vector<FourLanes> m_lanes;
    std::vector<std::int32_t> m_source;  ///< empty: vertex i is point i
    std::vector<std::int32_t> m_neighbours, m_neighbourBegin, m_naturalEnd, m_opposite;
    std::vector<Block> m_blocks;
    PointBlocks<S> m_pointBlocks;
    DkHierarchy m_hierarchy;
    std::shared_ptr<const Hull> m_corners;  ///< null if all vertices are corners
    std::vector<Face> m_faces;
    std::vector<Edge> m_edges;
    std::vector<std::int32_t> m_faceVertices, m_vertexFaces, m_vertexFaceBegin;
    std::array<std::uint16_t, 6 * kCubeCells* kCubeCells> m_startTable = {};
    Eigen::Vector3d m_centre = Eigen::Vector3d::Zero();
    FourLanes m_centreLanes;
    bool m_isCentred = false;
    double m_radius = 0.0;
    double m_slack = 0.0;
    S m_tieBand = S(0);
    S m_reach = S(0);
};
}  // namespace cullet
