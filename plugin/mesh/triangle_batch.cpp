// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_batch.h"

#include "cullet/plugin/shapes/convex_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A core's basis that differs more from a rotation is left to Bullet's loop.
constexpr double kMostDistortion = 1e-3;
}  // namespace

CoreFrame::CoreFrame(const btTransform& core, const btTransform& mesh)
{
    turn = basisOf(core).cast<double>().transpose();
    distortion = (turn * turn.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().sum();
    basis = turn * basisOf(mesh).cast<double>();
    origin = turn * (toEigen(mesh.getOrigin()).cast<double>() - toEigen(core.getOrigin()).cast<double>());
}

bool CoreFrame::isUsable() const
{
    return distortion < kMostDistortion && basis.allFinite() && origin.allFinite();
}

void TriangleBatch::place(const CoreFrame& frame, double limit, double size)
{
    const auto count = static_cast<std::size_t>(m_count);
    const Eigen::Matrix3d& m = frame.basis;
    for (int c = 0; c < 3; ++c)
    {
        for (std::size_t i = 0; i < count; ++i)
        {
            const btVector3& corner = m_triangles[i].corners[c];
            const double x = double(corner.x()), y = double(corner.y()), z = double(corner.z());
            for (int row = 0; row < 3; ++row)
                m_corners[c][row][i] = m(row, 0) * x + m(row, 1) * y + m(row, 2) * z + frame.origin[row];
        }
    }
    // As padLimit(): another search may round the distance by as much.
    const double relative = frame.distortion + 16 * double(std::numeric_limits<btScalar>::epsilon());
    const double fixed = limit + relative * (size + frame.origin.lpNorm<1>());
    for (std::size_t i = 0; i < count; ++i)
    {
        double farthest = 0.0;
        for (int c = 0; c < 3; ++c)
            farthest = std::max(farthest, std::abs(m_corners[c][0][i]) + std::abs(m_corners[c][1][i]) +
                                              std::abs(m_corners[c][2][i]));
        m_reach[i] = fixed + relative * farthest;
        m_isNear[i] = 1;
    }
}

void TriangleBatch::dropOutside(const Eigen::Vector3d& low, const Eigen::Vector3d& high)
{
    const auto count = static_cast<std::size_t>(m_count);
    for (int row = 0; row < 3; ++row)
    {
        const Lanes &a = m_corners[0][row], &b = m_corners[1][row], &c = m_corners[2][row];
        for (std::size_t i = 0; i < count; ++i)
        {
            const bool isOutside = std::min({a[i], b[i], c[i]}) > high[row] + m_reach[i] ||
                                   std::max({a[i], b[i], c[i]}) < low[row] - m_reach[i];
            m_isNear[i] = static_cast<std::uint8_t>(m_isNear[i] & std::uint8_t(!isOutside));
        }
    }
}

int TriangleBatch::dropBeyond(const CoreAxis& axis, int first)
{
    const Eigen::Vector3d& n = axis.direction;
    int dropped = 0;
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(m_count); ++i)
    {
        const auto along = [&](int c)
        { return n[0] * m_corners[c][0][i] + n[1] * m_corners[c][1][i] + n[2] * m_corners[c][2][i]; };
        const bool isBeyond = std::min({along(0), along(1), along(2)}) - axis.height > m_reach[i];
        dropped += isBeyond && m_isNear[i] != 0;
        m_isNear[i] = static_cast<std::uint8_t>(m_isNear[i] & std::uint8_t(!isBeyond));
    }
    return dropped;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
