// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/support.h"
#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/tests/fuzz/hulls/lattice_hull.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

/// Kind, faces and support searches of one hull against the exact hull of its points.
namespace cullet::test
{
template <class S>
class HullStructureCheck
{
public:
    HullStructureCheck(const LatticeHull& lattice, const TypedHull<S>& typed)
        : m_points(lattice.points()), m_typed(typed), m_hull(typed.hull())
    {
    }

    /// @param directions seed of some directions with small whole components
    std::string run(std::uint32_t directions)
    {
        checkKind();
        if (m_hull.kind() == HullKind::Solid)
            checkFacets();
        for (int i = 0; i < 4 && m_error.empty(); ++i)
        {
            Lattice direction;
            for (std::int64_t& component : direction)
            {
                component = static_cast<std::int64_t>(directions % 7) - 3;
                directions = directions * 1664525u + 1013904223u;
                directions ^= directions >> 15;
            }
            if (!isZero(direction))
                checkSupport(direction);
        }
        return m_error;
    }

private:
    template <class... Parts>
    void require(bool isTrue, const Parts&... parts)
    {
        if (isTrue || !m_error.empty())
            return;
        std::ostringstream text;
        text << (sizeof(S) == sizeof(float) ? "float hull: " : "double hull: ");
        (text << ... << parts);
        m_error = text.str();
    }

    /// The first of the points that equal a given one, in all of which a hull counts only the first.
    std::int32_t firstLike(std::size_t point) const
    {
        return static_cast<std::int32_t>(std::find(m_points.begin(), m_points.end(), m_points[point]) -
                                         m_points.begin());
    }

    void checkKind()
    {
        static constexpr HullKind kKinds[] = {HullKind::Point, HullKind::Segment, HullKind::Polygon,
                                              HullKind::Solid};
        const int dimension = dimensionOf(m_points);
        require(m_hull.kind() == kKinds[dimension], "kind ", static_cast<int>(m_hull.kind()),
                " of points of dimension ", dimension);
        for (std::int32_t v = 0; v < m_hull.vertexCount(); ++v)
        {
            const std::int32_t source = m_hull.sourceIndex(v);
            require(firstLike(static_cast<std::size_t>(source)) == source, "vertex ", v, " is a duplicate");
            require(m_hull.vertex(v) == m_typed.points()[static_cast<std::size_t>(source)], "vertex ", v,
                    " has moved");
            require(v == 0 || source > m_hull.sourceIndex(v - 1), "vertex ", v, " is out of order");
        }
    }

    /// Sorted sources of the corners of a face.
    template <class Corners>
    std::set<std::int32_t> sourcesOf(const Corners& corners) const
    {
        std::set<std::int32_t> sources;
        for (const std::int32_t v : corners)
            sources.insert(m_hull.sourceIndex(v));
        return sources;
    }

    void checkFacets()
    {
        const Facets facets = exactFacets();
        require(m_hull.faces().size() == facets.size(), m_hull.faces().size(), " faces instead of ",
                facets.size());
        std::map<std::int32_t, std::int32_t> facesAt;
        for (std::size_t f = 0; f < m_hull.faces().size(); ++f)
        {
            const auto corners = m_hull.faceVertices(static_cast<std::int32_t>(f));
            const std::set<std::int32_t> sources = sourcesOf(corners);
            const auto facet = facets.find(sources);
            require(facet != facets.end() && static_cast<int>(sources.size()) == corners.size(), "face ", f,
                    " is no facet");
            if (!m_error.empty())
                return;
            checkNormal(f, facet->second, corners);
            for (const std::int32_t v : corners)
            {
                ++facesAt[v];
                const auto around = m_hull.facesOf(v);
                require(std::count(around.begin(), around.end(), static_cast<std::int32_t>(f)) == 1,
                        "facesOf(", v, ") lacks face ", f);
            }
        }
        const std::size_t cornerCount = facesAt.size();
        for (std::int32_t v = 0; v < m_hull.vertexCount(); ++v)
            require(m_hull.facesOf(v).size() == facesAt[v], "facesOf(", v, ") has too many faces");
        require(cornerCount + facets.size() == m_hull.edges().size() + 2, m_hull.edges().size(), " edges");
        if (m_error.empty())
            checkFans(facets);
    }

    /// Facets of the distinct points, by indices among all points.
    Facets exactFacets() const
    {
        LatticePoints distinct;
        std::vector<std::int32_t> index;
        for (std::size_t i = 0; i < m_points.size(); ++i)
        {
            if (firstLike(i) != static_cast<std::int32_t>(i))
                continue;
            distinct.push_back(m_points[i]);
            index.push_back(static_cast<std::int32_t>(i));
        }
        Facets named;
        for (const auto& [corners, normal] : facetsOf(distinct))
        {
            std::set<std::int32_t> names;
            for (const std::int32_t corner : corners)
                names.insert(index[static_cast<std::size_t>(corner)]);
            named[names] = normal;
        }
        return named;
    }

    template <class Corners>
    void checkNormal(std::size_t face, const Lattice& normal, const Corners& corners)
    {
        const Eigen::Vector3d exact = TypedHull<double>::toVector(normal, 1.0).normalized();
        const auto& found = m_hull.faces()[face];
        require((found.normal - exact).norm() < 1e-12, "normal of face ", face, " is off");
        for (std::int32_t i = 0; i < corners.size(); ++i)
        {
            const auto at = [&](std::int32_t k) -> const Lattice&
            { return m_points[static_cast<std::size_t>(m_hull.sourceIndex(corners[k % corners.size()]))]; };
            const Lattice turn = cross(minus(at(i + 1), at(i)), minus(at(i + 2), at(i + 1)));
            require(dot(turn, normal) > 0, "face ", face, " turns the wrong way");
            const double height = m_hull.vertex(corners[i]).template cast<double>().dot(found.normal);
            require(std::abs(height - found.offset) <= 1e-12 * m_hull.radius(), "offset of face ", face);
        }
    }

    /// The faces that gift wrapping finds around the support vertices of normals, on the points alone.
    void checkFans(const Facets& facets)
    {
        const Hull<S> cloud = makeCloud(m_typed.points());
        for (const auto& [corners, normal] : facets)
        {
            // A corner may be given twice, and is none of the vertices of a fan then.
            const std::int32_t corner = *corners.begin();
            const VertexFan<S> fan(cloud, corner, TypedHull<double>::toVector(normal, 1.0));
            if (!fan.isKnown())
                continue;
            std::size_t count = 0;
            for (const auto& facet : facets)
                count += facet.first.count(corner);
            for (const ClearFace& face : fan)
            {
                const std::set<std::int32_t> around(face.corners.begin(), face.corners.end());
                require(facets.count(around) == 1, "the fan of point ", corner,
                        " has a face that is no facet");
            }
            require(static_cast<std::size_t>(fan.end() - fan.begin()) == count, "the fan of point ", corner,
                    " has ", fan.end() - fan.begin(), " faces instead of ", count);
        }
    }

    void checkSupport(const Lattice& direction)
    {
        const std::int64_t most = highest(m_points, direction);
        const auto isHighest = [&](const Lattice& point) { return dot(point, direction) == most; };
        const auto expected = static_cast<std::int32_t>(
            std::find_if(m_points.begin(), m_points.end(), isHighest) - m_points.begin());
        const Eigen::Matrix<S, 3, 1> d = TypedHull<S>::toVector(direction, 1.0);
        for (const SupportMethod method :
             {SupportMethod::Automatic, SupportMethod::Linear, SupportMethod::Climb,
              SupportMethod::ClimbArtificial, SupportMethod::CubeMap, SupportMethod::DobkinKirkpatrick})
        {
            for (std::int32_t start = -1; start < m_hull.vertexCount(); ++start)
            {
                const std::int32_t found = m_hull.sourceIndex(supportVertex<S>(m_hull, d, start, method));
                require(found == expected, "support method ", static_cast<int>(method), " from ", start,
                        " finds point ", found, " instead of ", expected, " along ", d.transpose());
            }
        }
    }

    const LatticePoints m_points;
    const TypedHull<S>& m_typed;
    const Hull<S>& m_hull;
    std::string m_error;
};
}  // namespace cullet::test
