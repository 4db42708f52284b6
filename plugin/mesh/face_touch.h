// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/contact/contact_patch.h"

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether a point in the plane of a triangle is in it.
bool isOver(const Eigen::Vector3d (&corners)[3], const Eigen::Vector3d& point);

/// The closest points of a core and a triangle, without a search, where one of their faces is at the touch: the lowest
/// vertices of the core over the triangle; corners of the triangle over the core's face; or edges of both that cross.
///
/// Points are returned only if nothing of the core and the triangle is ahead of them along the normal, by more than a
/// rounding. All vertices and corners are compared, in double and in an order that depends on their places alone.
class FaceTouch
{
public:
    enum class State : std::uint8_t
    {
        Separated,  ///< by more than the limit, by the plane of the triangle
        Near,
        Unknown  ///< anything else
    };

    /// More are not compared: a search costs less.
    static constexpr std::int32_t kMostVertices = 32;

    FaceTouch() = default;
    /// @pre the core has up to kMostVertices
    /// @param corners of the triangle, in the frame in which the core has its origin()
    /// @param limit   the largest distance of a contact, and a bound of rounding errors
    /// @param map     of the core; null: it is found out
    FaceTouch(const PosedShape& core, const Eigen::Vector3d (&corners)[3], double limit,
              const NormalMap* map = nullptr);

    State state() const { return m_state; }
    /// Unit, from the triangle to the core; valid for Separated and Near.
    const Eigen::Vector3d& normal() const { return m_touch.normal; }
    /// Valid for Near.
    const Touch& touch() const { return m_touch; }

private:
    using Corners = Eigen::Vector3d[3];
    struct Polygon;
    class Prism;

    /// Heights of the core's vertices along a direction.
    struct Lowest
    {
        std::int32_t vertex;
        double height;  ///< over the core's origin
    };

    static Lowest lowestAlong(const PosedShape& core, const Eigen::Vector3d& direction);
    bool findOverTriangle(const Polygon& polygon, const Prism& prism);
    bool findOverPolygon(const Polygon& polygon, const Corners& corners);
    bool findCrossing(const PosedShape& core, const Polygon& polygon, const Prism& prism,
                      const Corners& corners);

    Touch m_touch = {};
    double m_rounding = 0.0;  ///< a length
    double m_least = 0.0;     ///< distances that are not larger may be overlaps in a search
    State m_state = State::Unknown;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
