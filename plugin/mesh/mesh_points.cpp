// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_points.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Position and depth of a point, as lengths. Points with other normals have other positions on a convex shape. To
/// prefer other normals would be to prefer contacts at the edges inside of a mesh.
using Feature = Eigen::Vector4d;

/// A difference of depths counts as a distance of so many times its length: on level ground a point between two others
/// is needed only where it is deeper.
constexpr double kDepthScale = 10.0;
/// In units of the distance at which the manifold merges points: what is closer to a line between two points carries
/// nothing.
constexpr double kBetween = 0.1;
/// A later point must be better by this part, so that noise does not change the selection from step to step.
constexpr double kBetter = 2e-3;

/// From one feature to another.
class Line
{
public:
    Line(const Feature& from, const Feature& to)
        : m_from(from), m_line(to - from), m_length2(m_line.squaredNorm())
    {
    }

    double distance2To(const Feature& point) const
    {
        const Feature way = point - m_from;
        const double part = m_length2 > 0.0 ? std::clamp(m_line.dot(way) / m_length2, 0.0, 1.0) : 0.0;
        return (way - part * m_line).squaredNorm();
    }

private:
    const Feature m_from, m_line;
    const double m_length2;
};
}  // namespace

/// The order in which points are selected.
class MeshPoints::Selection
{
public:
    Selection(const MeshPoints& points, int first)
        : m_merge2(points.m_threshold * points.m_threshold), m_count(points.m_count)
    {
        const double range = points.m_threshold - points[first].distance;
        for (int i = 0; i < m_count; ++i)
        {
            const MeshPoint& point = points[i];
            Row& added = row(i);
            added.feature << point.place, kDepthScale * point.distance;
            added.weight = range > 0.0 ? (points.m_threshold - point.distance) / range : 1.0;
            added.place = i;
        }
        std::swap(row(first), row(0));
    }

    /// Selects one more point.
    ///
    /// @return false if no other point carries anything
    bool add()
    {
        measureLast();
        int best = -1;
        double highest = 0.0;
        for (int i = m_selected; i < m_count; ++i)
        {
            const Row& other = row(i);
            const double score = other.weight * other.away2;
            if (other.away2 > kBetween * kBetween * m_merge2 && score > highest * (1.0 + kBetter))
            {
                best = i;
                highest = score;
            }
        }
        if (best < 0)
            return false;
        std::swap(row(best), row(m_selected++));
        return true;
    }

    int selected() const { return m_selected; }
    /// Of the selected points, in the set.
    int place(int i) const { return m_rows[static_cast<std::size_t>(i)].place; }

private:
    struct Row
    {
        Feature feature;
        double weight;
        double away2;  ///< from the nearest line between two selected features
        int place;     ///< of the point in the set
    };

    Row& row(int i) { return m_rows[static_cast<std::size_t>(i)]; }

    /// Takes the last selected point into account. Removes the points that the manifold would merge with it.
    void measureLast()
    {
        const int last = m_selected - 1;
        const Feature feature = row(last).feature;
        for (int i = m_count - 1; i >= m_selected; --i)
        {
            const Feature way = row(i).feature - feature;
            if (way.head<3>().squaredNorm() <= m_merge2)
                std::swap(row(i), row(--m_count));
            else if (last == 0)
                row(i).away2 = way.squaredNorm();
        }
        for (int j = 0; j < last; ++j)
        {
            const Line line(feature, row(j).feature);
            for (int i = m_selected; i < m_count; ++i)
                row(i).away2 = std::min(row(i).away2, line.distance2To(row(i).feature));
        }
    }

    const double m_merge2;  ///< square of the distance below which the manifold merges points
    int m_count, m_selected = 1;
    std::array<Row, kRoom> m_rows;
};

/// Up to a thousandth of its difference to the limit.
int MeshPoints::deepest() const
{
    int found = 0;
    for (int i = 1; i < m_count; ++i)
    {
        const double depth = (*this)[found].distance;
        if ((*this)[i].distance < depth - 1e-3 * (m_threshold - depth))
            found = i;
    }
    return found;
}

void MeshPoints::reduce(int most)
{
    if (m_count < 2)
        return;
    Selection selection(*this, deepest());
    while (selection.selected() < most && selection.add())
    {
    }
    std::array<Room, kKept> kept;
    m_count = selection.selected();
    // Often the first points are where they should be.
    int first = 0;
    while (first < m_count && selection.place(first) == first)
        ++first;
    for (int i = first; i < m_count; ++i)
        new (&kept[static_cast<std::size_t>(i)].point) MeshPoint((*this)[selection.place(i)]);
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(m_count); ++i)
        m_points[i].point = kept[i].point;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
