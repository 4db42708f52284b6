// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_search.h"

#include "cullet/narrow/math/simplex.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// In sizes of a box, the size of triangles that a sphere around it is compared with.
constexpr double kMuchLarger = 5.0;

/// Times the limit of a sphere's contacts: closer to its centre, a point of a triangle gives no direction.
constexpr double kOnTriangle = 1e-6;

double highestOf(const Eigen::Vector3d (&corners)[3], const Eigen::Vector3d& direction)
{
    return std::max({direction.dot(corners[0]), direction.dot(corners[1]), direction.dot(corners[2])});
}

/// The direction in the plane of a triangle that leads out over its side from a corner to the next.
///
/// @param across normal of the plane, by the corners
Eigen::Vector3d outOf(const Eigen::Vector3d (&corners)[3], int i, const Eigen::Vector3d& across)
{
    return (corners[(i + 1) % 3] - corners[i]).cross(across);
}

/// Half extents of a box along the axes of the frame in which it is placed; 0 for other shapes.
Eigen::Vector3d halfOf(const ConvexSide& side, const std::optional<PosedShape>& core)
{
    // The core is the image of a cube.
    return side.kind == ConvexKind::Box && core ? Eigen::Vector3d(core->basis().cwiseAbs().rowwise().sum())
                                                : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

/// Decided by the points of a hull, whether it has a graph or not.
bool hasFewPoints(const ConvexSide& side)
{
    return side.kind != ConvexKind::Hull ||
           static_cast<const btConvexHullShape&>(side.shape).getNumPoints() <= FaceTouch::kMostVertices;
}
}  // namespace

TriangleSearch::TriangleSearch(IsaGjkRegistration& isaGjk, const ConvexSide& convex, const CoreFrame& frame,
                               HullUse (&hulls)[2], const MeshLimits& limits)
    : m_isaGjk(isaGjk),
      m_limits(limits),
      m_hulls(hulls),
      m_coreAt(frame.coreBasis()),
      m_triangleAt(btTransform::getIdentity()),
      m_pair(ConvexSide(convex.shape, m_coreAt), ConvexSide(m_triangle, m_triangleAt)),
      m_limit(convex.margin + limits.meshMargin + limits.breakingThreshold),
      m_cores(poseShape(convex.shape, convex.kind, m_coreAt, hulls[0], isaGjk.pass())),
      m_size(radiusOf(m_pair.a, m_cores.a)),
      m_half(halfOf(m_pair.a, m_cores.a))
{
}

Eigen::Vector3d TriangleSearch::farthestAlong(const Eigen::Vector3d& direction) const
{
    if (m_cores.a)
        return m_cores.a->support(direction, -1).point + m_cores.a->origin();
    return PosedSupport(m_pair.a.shape, m_coreAt, Eigen::Vector3d::Zero()).support(direction, -1).point;
}

double TriangleSearch::heightAlong(const Eigen::Vector3d& direction) const
{
    return direction.dot(farthestAlong(direction));
}

CoreBounds TriangleSearch::bounds() const
{
    if (m_pair.a.kind == ConvexKind::Sphere)
        return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    if (m_pair.a.kind == ConvexKind::Box)
        return {-m_half, m_half};
    CoreBounds bounds;
    if (m_pair.a.kind == ConvexKind::Support)
    {
        // Larger by the margin, and without six calls.
        btVector3 low, high;
        m_pair.a.shape.getAabb(m_coreAt, low, high);
        return {toEigen(low).cast<double>(), toEigen(high).cast<double>()};
    }
    for (int i = 0; i < 3; ++i)
    {
        bounds.high[i] = heightAlong(Eigen::Vector3d::Unit(i));
        bounds.low[i] = -heightAlong(-Eigen::Vector3d::Unit(i));
    }
    return bounds;
}

Eigen::Vector3d TriangleSearch::centre() const
{
    return m_cores.a ? Eigen::Vector3d(m_cores.a->centre() + m_cores.a->origin()) : Eigen::Vector3d::Zero();
}

bool TriangleSearch::isPlaced(const Corners& corners) const
{
    return m_cores.b && m_placed[0] == corners[0] && m_placed[1] == corners[1] && m_placed[2] == corners[2];
}

/// Rounding of the triangle's first corner moves both cores.
void TriangleSearch::place(const Corners& corners)
{
    std::copy_n(corners, 3, m_placed);
    m_cores.b.emplace(poseTriangle(corners));
    const Eigen::Vector3d rest = m_cores.b->origin() - corners[0];
    if (m_cores.a)
        m_cores.a->moveTo(rest);
    m_cores.forgetFans();
    m_triangleAt.setOrigin(toBullet(corners[0]));
}

std::optional<ContactSearchResult> TriangleSearch::answerAtOnce(const Corners& corners)
{
    m_touch.normal.setZero();
    if (!corners[0].allFinite() || !corners[1].allFinite() || !corners[2].allFinite())
        return ContactSearchResult{GjkState::Separated, false};
    if (m_pair.a.kind == ConvexKind::Support)
        return searchFromSupport(corners);
    const std::optional<ContactSearchResult> found =
        m_pair.a.kind == ConvexKind::Sphere ? searchFromPoint(corners) : searchAtFace(corners);
    if (found)
        count(found->state);
    return found;
}

ContactSearchResult TriangleSearch::search(GjkCache<btScalar>& cache)
{
    const SearchSetup setup = {m_pair,
                               m_hulls,
                               m_isaGjk.pass(),
                               nullptr,
                               m_isaGjk.options().patchPoints > 1,
                               m_isaGjk.counters().exact};
    const ContactSearchResult found = searchSettled(setup, m_cores, m_limit, {}, true, cache, m_touch);
    count(found.state);
    return found;
}

/// A bound of the rounding of a distance.
double TriangleSearch::noiseAt(const Corners& corners) const
{
    return 16 * double(std::numeric_limits<btScalar>::epsilon()) *
           (m_size + double(m_limit) +
            std::max({corners[0].lpNorm<1>(), corners[1].lpNorm<1>(), corners[2].lpNorm<1>()}));
}

bool TriangleSearch::isFar(const Corners& corners) const
{
    if (m_pair.a.kind == ConvexKind::Sphere)
        return false;
    if (m_pair.a.kind == ConvexKind::Box)
    {
        if (const std::optional<bool> isFarAway = isFarFromBox(corners))
            return *isFarAway;
    }
    const Eigen::Vector3d across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (m_pair.a.kind == ConvexKind::Support)
        return isApartAlong(corners, farthestSide(corners, across));
    const double reach = m_size + double(m_limit) + noiseAt(corners), reach2 = reach * reach;
    // The core's origin is that of the frame.
    const auto isFarAlong = [&](const Eigen::Vector3d& direction, double height)
    { return height < 0.0 && height * height > reach2 * direction.squaredNorm(); };
    const auto isBehind = [&](const Eigen::Vector3d& direction, int corner)
    {
        // Corners of a side are level up to rounding; a sliver has no direction that is known so well.
        return isFarAlong(direction, direction.dot(corners[corner])) &&
               isFarAlong(direction, highestOf(corners, direction));
    };
    return isBehind(across, 0) || isBehind(-across, 0) || isBehind(outOf(corners, 0, across), 0) ||
           isBehind(outOf(corners, 1, across), 1) || isBehind(outOf(corners, 2, across), 2);
}

/// isFar() for a box.
///
/// @return nothing if a sphere around it may drop more: only triangles that are much larger
std::optional<bool> TriangleSearch::isFarFromBox(const Corners& corners) const
{
    const Eigen::Vector3d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
                          high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    // Of the gaps on both sides along an axis, one is negative.
    if ((low.cwiseMax(-high) - m_half).maxCoeff() > double(m_limit) + noiseAt(corners))
        return true;
    if ((high - low).maxCoeff() < kMuchLarger * m_size)
        return false;
    return {};
}

/// Of the directions out of the sides of a triangle, in its plane, the one along which the core's origin is farthest
/// from its side.
///
/// @param across normal of the triangle's plane, by its corners
/// @return unit, or 0 if the origin is beyond no side
Eigen::Vector3d TriangleSearch::farthestSide(const Corners& corners, const Eigen::Vector3d& across)
{
    Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
    double most2 = 0.0;
    for (int i = 0; i < 3; ++i)
    {
        const Eigen::Vector3d out = outOf(corners, i, across);
        const double along = -out.dot(corners[i]), length2 = out.squaredNorm();
        if (along > 0.0 && along * along > most2 * length2)
        {
            most2 = along * along / length2;
            farthest = out / std::sqrt(length2);
        }
    }
    return farthest;
}

/// Whether a triangle is farther from the core than the limit, along a direction towards the core.
///
/// @param direction unit, or 0
bool TriangleSearch::isApartAlong(const Corners& corners, const Eigen::Vector3d& direction) const
{
    return !direction.isZero(0.0) &&
           -heightAlong(-direction) - highestOf(corners, direction) > double(m_limit) + noiseAt(corners);
}

/// Only the triangle's own plane is tried: Bullet's algorithm must answer anyway if the shapes touch, and a search costs
/// as much.
ContactSearchResult TriangleSearch::searchFromSupport(const Corners& corners)
{
    const Eigen::Vector3d across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const double length = across.norm();
    if (length > 0.0)
    {
        const Eigen::Vector3d normal = across * ((across.dot(corners[0]) > 0.0 ? -1.0 : 1.0) / length);
        if (isApartAlong(corners, normal))
        {
            count(GjkState::Separated);
            m_touch.normal = normal;
            return {GjkState::Separated, false};
        }
    }
    m_isaGjk.counters().delegated.add(1);
    return {GjkState::NotConverged, false};
}

std::optional<ContactSearchResult> TriangleSearch::searchAtFace(const Corners& corners)
{
    place(corners);
    const FaceTouch face = touchFace(corners);
    switch (face.state())
    {
        case FaceTouch::State::Separated:
            m_touch.normal = face.normal();
            return ContactSearchResult{GjkState::Separated, false};
        case FaceTouch::State::Near:
            m_touch = face.touch();
            return ContactSearchResult{
                m_touch.distance <= double(m_limit) ? GjkState::Near : GjkState::Separated, true};
        default:
            return {};
    }
}

/// The points at the triangle's face. A hull of few points gets its graph for that: whether it had one already must not
/// make a difference.
FaceTouch TriangleSearch::touchFace(const Corners& corners)
{
    if (!hasFewPoints(m_pair.a))
        return {};
    const double limit = double(padLimit(m_pair, m_cores, m_limit));
    if (!m_normals)
        m_normals.emplace(*m_cores.a);
    const FaceTouch face(*m_cores.a, corners, limit, &*m_normals);
    const bool needsGraph = face.state() == FaceTouch::State::Unknown && m_cores.hasCloud() &&
                            m_cores.mayBuildGraphs(m_pair, m_hulls);
    return needsGraph && m_cores.buildGraphs(m_pair, m_hulls, m_isaGjk.pass())
               ? FaceTouch(*m_cores.a, corners, limit, &*m_normals)
               : face;
}

/// The core of a sphere is the origin of the frame. Nothing is worth remembering.
ContactSearchResult TriangleSearch::searchFromPoint(const Corners& corners)
{
    const Eigen::Vector3d closest =
        closestOnSimplex({corners[0], corners[1], corners[2], Eigen::Vector3d::Zero()}, 3).point;
    const double distance = closest.norm();
    if (distance > double(m_limit))
        return {GjkState::Separated, false};
    // In the plane of the triangle, either side will do.
    const Eigen::Vector3d across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const Eigen::Vector3d normal =
        distance > kOnTriangle * double(m_limit) ? Eigen::Vector3d(-closest) : across;
    const double length = normal.norm();
    m_touch = {length > 0.0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::UnitY(), distance, closest};
    return {GjkState::Near, false};
}

void TriangleSearch::count(GjkState state)
{
    IsaGjkRegistration::Counters& counters = m_isaGjk.counters();
    switch (state)
    {
        case GjkState::Separated:
            return counters.separated.add(1);
        case GjkState::NotConverged:
            return counters.notConverged.add(1);
        default:
            counters.touching.add(1);
            counters.depths.add(state == GjkState::Overlapping ? 1 : 0);
    }
}

/// The distance of the shapes with their margins, for one of the cores.
double TriangleSearch::gapAt(double distance) const
{
    return distance - double(m_pair.a.margin) - double(m_limits.meshMargin);
}

Eigen::Vector3d TriangleSearch::placeOnConvex() const
{
    return touchedPoint() + (m_touch.distance - double(m_pair.a.margin)) * m_touch.normal;
}

bool TriangleSearch::isTouchAlone() const
{
    return m_pair.a.kind == ConvexKind::Sphere || m_isaGjk.options().patchPoints == 1 ||
           cullet::isTouchAlone(*m_cores.a, *m_cores.b, m_touch, double(m_limit));
}

void TriangleSearch::turnTouch(const Corners& corners, const Eigen::Vector3d& normal,
                               const Eigen::Vector3d& onTriangle, double distance)
{
    const PosedShape& core = *m_cores.a;
    const SupportPoint lowest = core.support(-normal, m_touch.vertexA);
    const Eigen::Vector3d point = lowest.point + core.origin();
    const bool isDeep = m_touch.distance < 0.0;
    m_touch = {normal, distance, onTriangle - core.origin(), lowest.vertex};
    const double height = normal.dot(point - corners[0]);
    const Eigen::Vector3d foot = point - height * normal;
    if (isDeep && isOver(corners, foot))
    {
        m_touch.distance = height;
        m_touch.onB = foot - core.origin();
    }
}

void TriangleSearch::addTouch(const Eigen::Vector3d& place, const TriangleBatch::Triangle& triangle,
                              MeshPoints& points) const
{
    if (m_touch.distance <= double(m_limit))
        points.add({place, m_touch.normal, gapAt(m_touch.distance), triangle, m_touch});
}

void TriangleSearch::addPatch(const TriangleBatch::Triangle& triangle, const Corners& corners,
                              MeshPoints& points)
{
    if (m_touch.distance > double(m_limit))
        return;
    if (!isPlaced(corners))
        place(corners);
    // The search has found them, too, or has built a graph.
    m_cores.findFans(m_touch.normal, m_touch.vertexA, m_touch.vertexB);
    const ContactPatch patch =
        makeWidePatch(*m_cores.a, *m_cores.b, m_touch,
                      {double(m_limit), m_limits.breakingThreshold, m_isaGjk.options().patchPoints},
                      {m_cores.fanA ? &*m_cores.fanA : nullptr, m_cores.fanB ? &*m_cores.fanB : nullptr},
                      m_normals ? &*m_normals : nullptr);
    for (int i = 0; i < patch.count; ++i)
    {
        const ContactPoint& point = patch.points[static_cast<std::size_t>(i)];
        const double distance = double(point.distance);
        const Eigen::Vector3d onMesh = touchedPoint() + toEigen(point.fromTouch).cast<double>();
        points.add({onMesh + (distance - double(m_pair.a.margin)) * m_touch.normal, m_touch.normal,
                    gapAt(distance), triangle, m_touch});
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
