// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/contact_steps.h"
#include "cullet/cuda/narrow/depth_steps.h"
#include "cullet/cuda/narrow/hull_set.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace cullet::convex
{
/// Most vertices of polytopes: nearly all pairs need less than the first one.
struct PolytopeSizes
{
    std::uint32_t small = 32, large = 512;
};

/// Finds depths and contacts of the pairs in a list of overlaps, on an executor. Keeps nothing of a pair from query to
/// query.
///
/// @tparam Exec HostPairExec or CudaPairExec
template <class Exec>
class ContactQueries
{
public:
    /// Copies the surfaces of the hulls, which need not outlive the call, to the executor.
    ContactQueries(Exec& exec, const HullSet& hulls, const PolytopeSizes& polytopes = {}) : m_sizes(polytopes)
    {
        const SurfaceTables from = hulls.surfaces();
        const SurfaceSizes sizes = hulls.surfaceSizes();
        copyTo(exec, m_rows, from.rows, hulls.size());
        copyTo(exec, m_faces, from.faces, sizes.faces);
        copyTo(exec, m_edges, from.edges, sizes.edges);
        copyTo(exec, m_corners, from.corners, sizes.corners);
        copyTo(exec, m_around, from.around, sizes.around);
        copyTo(exec, m_vertexFaces, from.vertexFaces, sizes.vertexFaces);
        m_surfaces = {m_rows.data(),    m_faces.data(),  m_edges.data(),
                      m_corners.data(), m_around.data(), m_vertexFaces.data()};
    }

    /// Makes room for a query. Waits where memory has to grow.
    ///
    /// @param overlaps expected number of pairs that overlap; later ones are left out
    /// @param hasPoints contacts are asked for
    void prepare(Exec& exec, std::uint32_t overlaps, bool hasPoints)
    {
        exec.reserve(m_depths, std::max(overlaps, 1u));
        exec.reserve(m_large, m_depths.size());
        exec.reserve(m_examined, m_depths.size());
        if (hasPoints)
            exec.reserve(m_contacts, m_depths.size());
        exec.reserve(m_counts, 1);
        exec.reserve(m_fetched, 1);
        m_lanes = exec.lanesFor(room(), kLanes);
        m_largeLanes = exec.lanesFor(room(), kLargeLanes);
        m_small.reserve(exec, m_lanes, m_sizes.small);
        m_largeMemory.reserve(exec, m_largeLanes, m_sizes.large);
        if (!std::exchange(m_areCountsClear, true))
            exec.clear(m_counts.data(), 1);
        m_fetchedOnDevice = exec.mappedForWriting(m_fetched.data());
    }

    /// Launches the search for depths. Allocates nothing, so that the launches can be recorded.
    ///
    /// @param overlaps, overlapCount of PairQueries, in the executor's memory
    /// @pre prepare()
    void launchDepths(Exec& exec, const PairReader& reader, const std::uint32_t* overlaps,
                      const std::uint32_t* overlapCount)
    {
        const OverlapLists lists = listsOf(overlaps, overlapCount);
        exec.forEachLane(m_lanes, MeasureDepths{{reader, lists, m_small.view(m_lanes), m_sizes.small}});
        exec.forEachLane(m_largeLanes, MeasureLargeDepths{
                                           {reader, lists, m_largeMemory.view(m_largeLanes), m_sizes.large}});
        exec.examineDepths(room(), ExamineDepths{reader, m_surfaces, lists});
        exec.forOne(HandOverDepthCounts{m_counts.data(), m_fetchedOnDevice});
    }

    /// Launches the search for the points of contacts.
    ///
    /// @param margin points farther apart are left out
    /// @pre launchDepths() with the same arguments
    void launchContacts(Exec& exec, const PairReader& reader, const std::uint32_t* overlaps,
                        const std::uint32_t* overlapCount, float margin)
    {
        const std::uint32_t lanes = exec.lanesFor(room(), kContactLanes);
        exec.forEachLane(lanes,
                         MakeContacts{reader, m_surfaces, listsOf(overlaps, overlapCount), margin, lanes});
    }

    /// To be called after a failure.
    void forget() { m_areCountsClear = false; }

    /// Pairs for which there is memory.
    std::uint32_t room() const
    {
        return static_cast<std::uint32_t>(std::min<std::uint64_t>(m_depths.size(), 0xffffffffu));
    }
    const PairDepth* depths() const { return m_depths.data(); }
    const PairContact* contacts() const { return m_contacts.data(); }
    /// Of the last query. @pre it has run
    const DepthCounts& counts() const { return *m_fetched.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Lanes of a multiprocessor at most.
    static constexpr std::uint32_t kLanes = 384, kLargeLanes = 8, kContactLanes = 384;

    /// Memory for polytopes of a size.
    struct Polytopes
    {
        void reserve(Exec& exec, std::uint64_t lanes, std::uint64_t capacity)
        {
            const std::uint64_t vertices = lanes * capacity, faces = 2 * vertices;
            exec.reserve(placesXY, vertices);
            exec.reserve(placesZ, vertices);
            exec.reserve(normalsXY, faces);
            exec.reserve(normalsZ, faces);
            exec.reserve(distances, faces);
            exec.reserve(corners, faces);
            exec.reserve(visible, faces);
            exec.reserve(next, vertices);
        }
        PolytopeMemory view(std::uint32_t lanes) const
        {
            return {placesXY.data(), placesZ.data(),   normalsXY.data(),
                    normalsZ.data(), distances.data(), corners.data(),
                    visible.data(),  next.data(),      lanes};
        }

        Buffer<VectorXY> placesXY, normalsXY;
        Buffer<PlaceZ> placesZ;
        Buffer<double> normalsZ, distances;
        Buffer<FaceCorners> corners;
        Buffer<VisibleFace> visible;
        Buffer<std::uint16_t> next;
    };

    template <class Element>
    static void copyTo(Exec& exec, Buffer<Element>& to, const Element* from, std::uint64_t count)
    {
        exec.reserve(to, std::max<std::uint64_t>(count, 1));
        exec.uploadAndWait(to.data(), from, count);
    }

    OverlapLists listsOf(const std::uint32_t* overlaps, const std::uint32_t* overlapCount) const
    {
        return {overlaps, overlapCount,   m_depths.data(),   m_contacts.data(),
                room(),   m_large.data(), m_examined.data(), m_counts.data()};
    }

    PolytopeSizes m_sizes;
    SurfaceTables m_surfaces;
    Buffer<SurfaceRow> m_rows;
    Buffer<HullFace> m_faces;
    Buffer<HullEdge> m_edges;
    Buffer<std::uint32_t> m_corners, m_around, m_vertexFaces;
    std::uint32_t m_lanes = 0, m_largeLanes = 0;
    bool m_areCountsClear = false;
    Polytopes m_small, m_largeMemory;
    Buffer<std::uint32_t> m_large, m_examined;
    Buffer<DepthCounts> m_counts;
    typename Exec::template Staging<DepthCounts> m_fetched;
    DepthCounts* m_fetchedOnDevice = nullptr;
    Buffer<PairContact> m_contacts;
    Buffer<PairDepth> m_depths;
};
}  // namespace cullet::convex
