// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_batch.h"

#include "cullet/narrow/hull/linear_scan_avx2.h"
#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A core's basis that differs more from a rotation is left to Bullet's loop.
constexpr double kMostDistortion = 1e-3;

/// In roundings of the distances from the origin: how far computed points on one corner or edge are apart.
constexpr double kSamePlace = 16.0;

/// For so few triangles, a loop over their lanes costs more than it saves.
constexpr int kFew = 4;

/// Reach of a triangle and bounds of the core.
struct Limits
{
    const CoreBounds& bounds;
    double reach;     ///< without the part that depends on the triangle
    double relative;  ///< times the size of the triangle
};

// Loops over the lanes of a batch, compiled for several instruction sets. None has fused products, so that the bits are
// the same.

[[gnu::always_inline]] inline void mapLanes(const btScalar* const (&from)[3], const Eigen::Vector3d& row,
                                            double origin, int count, double* to)
{
    const double a = row[0], b = row[1], c = row[2];
    const btScalar *const x = from[0], *const y = from[1], *const z = from[2];
    for (int i = 0; i < count; ++i)
        to[i] = a * double(x[i]) + b * double(y[i]) + c * double(z[i]) + origin;
}

[[gnu::always_inline]] inline double lesser(double a, double b)
{
    return a < b ? a : b;
}
[[gnu::always_inline]] inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/// @param corners [3 corner + coordinate]
/// @param gaps    [out] between the bounds of core and triangle, along the worst axis
[[gnu::always_inline]] inline void measureLanes(const double* const (&corners)[9], const Limits& limits,
                                                int count, double* reach, double* gaps)
{
    const Eigen::Vector3d low = limits.bounds.low, high = limits.bounds.high;
    const double fixed = limits.reach, relative = limits.relative;
    for (int i = 0; i < count; ++i)
    {
        double gap = -std::numeric_limits<double>::max(), farthest = 0.0;
        for (int row = 0; row < 3; ++row)
        {
            const double a = corners[row][i], b = corners[3 + row][i], c = corners[6 + row][i];
            gap =
                larger(gap, larger(lesser(lesser(a, b), c) - high[row], low[row] - larger(larger(a, b), c)));
        }
        for (int c = 0; c < 9; c += 3)
            farthest = larger(farthest, std::abs(corners[c][i]) + std::abs(corners[c + 1][i]) +
                                            std::abs(corners[c + 2][i]));
        gaps[i] = gap;
        reach[i] = fixed + relative * farthest;
    }
}

/// @param lowest [out] the least product of a corner and a direction
[[gnu::always_inline]] inline void findLowestLanes(const double* const (&corners)[9],
                                                   const Eigen::Vector3d& direction, int count,
                                                   double* lowest)
{
    const double x = direction[0], y = direction[1], z = direction[2];
    for (int i = 0; i < count; ++i)
    {
        const double a = x * corners[0][i] + y * corners[1][i] + z * corners[2][i];
        const double b = x * corners[3][i] + y * corners[4][i] + z * corners[5][i];
        const double c = x * corners[6][i] + y * corners[7][i] + z * corners[8][i];
        lowest[i] = lesser(lesser(a, b), c);
    }
}

struct Kernels
{
    void (*map)(const btScalar* const (&)[3], const Eigen::Vector3d&, double, int, double*);
    void (*measure)(const double* const (&)[9], const Limits&, int, double*, double*);
    void (*findLowest)(const double* const (&)[9], const Eigen::Vector3d&, int, double*);
};

void mapBaseline(const btScalar* const (&from)[3], const Eigen::Vector3d& row, double origin, int count,
                 double* to)
{
    mapLanes(from, row, origin, count, to);
}
void measureBaseline(const double* const (&corners)[9], const Limits& limits, int count, double* reach,
                     double* gaps)
{
    measureLanes(corners, limits, count, reach, gaps);
}
void findLowestBaseline(const double* const (&corners)[9], const Eigen::Vector3d& direction, int count,
                        double* lowest)
{
    findLowestLanes(corners, direction, count, lowest);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void mapAvx2(const btScalar* const (&from)[3], const Eigen::Vector3d& row,
                                     double origin, int count, double* to)
{
    mapLanes(from, row, origin, count, to);
}
[[gnu::target("avx2")]] void measureAvx2(const double* const (&corners)[9], const Limits& limits, int count,
                                         double* reach, double* gaps)
{
    measureLanes(corners, limits, count, reach, gaps);
}
[[gnu::target("avx2")]] void findLowestAvx2(const double* const (&corners)[9],
                                            const Eigen::Vector3d& direction, int count, double* lowest)
{
    findLowestLanes(corners, direction, count, lowest);
}
#endif

constexpr Kernels kBaseline = {mapBaseline, measureBaseline, findLowestBaseline};

const Kernels& kernels()
{
#if defined(__x86_64__)
    static constexpr Kernels kAvx2 = {mapAvx2, measureAvx2, findLowestAvx2};
    if (kHasAvx2)
        return kAvx2;
#endif
    return kBaseline;
}

/// Index of the only one in three bits; else 3.
int onlyBit(unsigned bits)
{
    return bits == 1 ? 0 : bits == 2 ? 1 : bits == 4 ? 2 : 3;
}
}  // namespace

CoreFrame::CoreFrame(const btTransform& core, const btTransform& mesh, FrameAxes axes)
{
    const Eigen::Matrix3d basis = basisOf(core).cast<double>(), identity = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d gram = basis.transpose() * basis, inWorld = basisOf(mesh).cast<double>();
    const double distortion = (gram - identity).cwiseAbs().sum();
    m_origin = toEigen(core.getOrigin()).cast<double>();
    const Eigen::Vector3d apart = toEigen(mesh.getOrigin()).cast<double>() - m_origin;
    if (axes == FrameAxes::World)
    {
        m_axes = identity;
        m_coreBasis = basis;
        m_meshBasis = inWorld;
        m_meshOrigin = apart;
    }
    else
    {
        // Newton's iteration for the nearest rotation; each step squares the distortion.
        m_axes = basis * (1.5 * identity - 0.5 * gram);
        m_axes = m_axes * (1.5 * identity - 0.5 * m_axes.transpose() * m_axes);
        m_coreBasis = m_axes.transpose() * basis;
        m_meshBasis = m_axes.transpose() * inWorld;
        m_meshOrigin = m_axes.transpose() * apart;
    }
    // A NaN makes the comparison false.
    m_isUsable = distortion < kMostDistortion && m_meshBasis.allFinite() && m_meshOrigin.allFinite();
}

CoreFrame::CoreFrame(const btTransform& core, const btTransform& mesh, const CoreFrame& turned)
    : CoreFrame(turned)
{
    m_origin = toEigen(core.getOrigin()).cast<double>();
    m_meshOrigin = m_axes.transpose() * (toEigen(mesh.getOrigin()).cast<double>() - m_origin);
    m_isUsable = turned.m_isUsable && m_meshOrigin.allFinite();
}

LastFrame::Bases::Bases(const btTransform& core, const btTransform& mesh)
{
    for (int row = 0; row < 3; ++row)
    {
        std::copy_n(core.getBasis()[row].m_floats, 3, numbers + 3 * row);
        std::copy_n(mesh.getBasis()[row].m_floats, 3, numbers + 9 + 3 * row);
    }
}

CoreFrame LastFrame::frameOf(const btTransform& core, const btTransform& mesh)
{
    const Bases bases(core, mesh);
    if (m_bases && m_frame->isUsable() && std::memcmp(&bases, &*m_bases, sizeof(bases)) == 0)
        return CoreFrame(core, mesh, *m_frame);
    m_bases = bases;
    return m_frame.emplace(core, mesh, FrameAxes::Core);
}

btTransform CoreFrame::coreBasis() const
{
    btTransform transform(btTransform::getIdentity());
    for (int i = 0; i < 3; ++i)
        transform.getBasis()[i] = toBullet(m_coreBasis.row(i));
    return transform;
}

Eigen::Vector3d CoreFrame::ofWorld(const btVector3& point) const
{
    return m_axes.transpose() * (toEigen(point).cast<double>() - m_origin);
}

Eigen::Vector3d CoreFrame::turnedOfWorld(const btVector3& direction) const
{
    return m_axes.transpose() * toEigen(direction).cast<double>();
}

btVector3 CoreFrame::toWorld(const Eigen::Vector3d& point) const
{
    return toBullet(m_axes * point + m_origin);
}

btVector3 CoreFrame::turnedToWorld(const Eigen::Vector3d& direction) const
{
    return toBullet(m_axes * direction);
}

void TriangleBatch::placeAll(const CoreFrame& frame)
{
    if (m_count <= kFew)
        return placeFew(frame);
    for (int c = 0; c < 3; ++c)
    {
        const btScalar* const from[] = {m_inMesh[c][0].data(), m_inMesh[c][1].data(), m_inMesh[c][2].data()};
        for (int row = 0; row < 3; ++row)
            kernels().map(from, frame.meshBasis().row(row), frame.meshOrigin()[row], m_count,
                          m_corners[c][row].data());
    }
    std::fill_n(m_isNear.begin(), m_count, std::uint8_t(1));
}

/// placeAll() with the same bits, one triangle after the other.
void TriangleBatch::placeFew(const CoreFrame& frame)
{
    for (int i = 0; i < m_count; ++i)
    {
        const auto place = static_cast<std::size_t>(i);
        for (int c = 0; c < 3; ++c)
        {
            const Eigen::Vector3d corner = frame.ofMesh(inMesh(i, c));
            for (int row = 0; row < 3; ++row)
                m_corners[c][row][place] = corner[row];
        }
        m_isNear[place] = 1;
    }
}

void TriangleBatch::place(const CoreFrame& frame, const CoreBounds& bounds, double limit, double size)
{
    placeAll(frame);
    const double* corners[9];
    for (std::size_t i = 0; i < 9; ++i)
        corners[i] = m_corners[i / 3][i % 3].data();
    // As padLimit(): a search may round the distance by as much.
    const double relative = 16 * double(std::numeric_limits<btScalar>::epsilon());
    Lanes gaps;
    kernels().measure(corners, {bounds, limit + relative * size, relative}, m_count, m_reach.data(),
                      gaps.data());
    keepWithin(gaps);
}

/// Removes the triangles with gaps larger than their reach.
void TriangleBatch::keepWithin(const Lanes& gaps)
{
    std::size_t kept = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(m_count); ++i)
    {
        // A NaN makes the comparison false.
        if (!(gaps[i] <= m_reach[i]))
            continue;
        if (kept == i)
        {
            ++kept;
            continue;
        }
        for (int c = 0; c < 3; ++c)
        {
            for (int row = 0; row < 3; ++row)
            {
                m_inMesh[c][row][kept] = m_inMesh[c][row][i];
                m_corners[c][row][kept] = m_corners[c][row][i];
            }
        }
        m_ids[kept] = m_ids[i];
        m_reach[kept++] = m_reach[i];
    }
    m_count = static_cast<int>(kept);
}

int TriangleBatch::dropBeyond(const CoreAxis& axis, int first)
{
    const double* corners[9];
    for (std::size_t i = 0; i < 9; ++i)
        corners[i] = m_corners[i / 3][i % 3].data() + first;
    Lanes lowest;
    kernels().findLowest(corners, axis.direction, m_count - first, lowest.data() + first);
    int dropped = 0;
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(m_count); ++i)
    {
        const bool isBeyond = lowest[i] - axis.height > m_reach[i];
        dropped += isBeyond && m_isNear[i] != 0;
        m_isNear[i] = static_cast<std::uint8_t>(m_isNear[i] & std::uint8_t(!isBeyond));
    }
    return dropped;
}

/// @return the corner of a triangle at the same place of the mesh, or -1
int TriangleBatch::findCorner(int i, const btVector3& corner) const
{
    const auto place = static_cast<std::size_t>(i);
    for (int c = 0; c < 3; ++c)
    {
        if (m_inMesh[c][0][place] == corner.x() && m_inMesh[c][1][place] == corner.y() &&
            m_inMesh[c][2][place] == corner.z())
            return c;
    }
    return -1;
}

bool TriangleBatch::hasNearAfter(int i) const
{
    return std::any_of(m_isNear.begin() + i + 1, m_isNear.begin() + m_count,
                       [](std::uint8_t isNear) { return isNear != 0; });
}

void TriangleBatch::dropRepeats(int i, const Eigen::Vector3d& normal, const Eigen::Vector3d& point)
{
    if (!hasNearAfter(i))
        return;
    const double noise = kSamePlace * double(std::numeric_limits<btScalar>::epsilon()) * point.lpNorm<1>();
    const Eigen::Vector3d corners[] = {corner(i, 0), corner(i, 1), corner(i, 2)};
    unsigned off = 0;  // the edges, each opposite of a corner, that do not contain the point
    for (int c = 0; c < 3; ++c)
    {
        const Eigen::Vector3d &a = corners[(c + 1) % 3], edge = corners[(c + 2) % 3] - a;
        const double length2 = edge.squaredNorm();
        // Of a corner, rounding must not decide which of its edges contain it: a triangle at an edge may rise from its end.
        const double part = length2 > 0.0 ? std::clamp(edge.dot(point - a) / length2, 0.0, 1.0) : 0.0;
        const bool isOn = (point - a - edge * part).squaredNorm() <= noise * noise;
        off |= unsigned(!isOn) << c;
    }
    // On one edge alone, or at the corner of two.
    const int offOne = onlyBit(off), onOne = onlyBit(off ^ 7u);
    for (int k = i + 1; k < m_count && (offOne < 3 || onOne < 3); ++k)
    {
        if (!isNear(k))
            continue;
        if (offOne < 3 ? repeatsCorner(k, inMesh(i, offOne), normal, point)
                       : repeatsEdge(k, inMesh(i, (onOne + 1) % 3), inMesh(i, (onOne + 2) % 3), normal))
            m_isNear[static_cast<std::size_t>(k)] = 0;
    }
}

bool TriangleBatch::repeatsCorner(int i, const btVector3& shared, const Eigen::Vector3d& normal,
                                  const Eigen::Vector3d& point) const
{
    const int c = findCorner(i, shared);
    return c >= 0 && isSteep(corner(i, (c + 1) % 3) - point, normal) &&
           isSteep(corner(i, (c + 2) % 3) - point, normal);
}

bool TriangleBatch::repeatsEdge(int i, const btVector3& sharedA, const btVector3& sharedB,
                                const Eigen::Vector3d& normal) const
{
    const int a = findCorner(i, sharedA), b = findCorner(i, sharedB);
    if (a < 0 || b < 0 || a == b)
        return false;
    const Eigen::Vector3d from = corner(i, a), edge = corner(i, b) - from, way = corner(i, 3 - a - b) - from;
    const double length2 = edge.squaredNorm();
    return length2 > 0.0 && isSteep(way - edge * (edge.dot(way) / length2), normal);
}

Eigen::Vector3d TriangleBatch::middleWithin(int i, const CoreBounds& bounds) const
{
    const Eigen::Vector3d middle = (corner(i, 0) + corner(i, 1) + corner(i, 2)) / 3.0;
    return middle.cwiseMax(bounds.low).cwiseMin(bounds.high);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
