// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/narrow/box/box_oracle.h"
#include "cullet/tests/support/random.h"

#include <Eigen/Geometry>

#include <ostream>

namespace cullet::test
{
template <class S>
struct PlainBox
{
    Eigen::Matrix<S, 3, 3> axes;
    Eigen::Matrix<S, 3, 1> centre, half;

    template <class Vector>
    PosedBox<Vector> posed() const
    {
        PosedBox<Vector> box;
        for (int i = 0; i < 3; ++i)
            box.rows[i] = Vector(axes(i, 0), axes(i, 1), axes(i, 2), 0);
        box.centre = Vector(centre[0], centre[1], centre[2], 0);
        box.half = Vector(half[0], half[1], half[2], 0);
        return box;
    }
    WideBox wide() const
    {
        return {axes.template cast<Wide>(), centre.template cast<Wide>(), half.template cast<Wide>()};
    }
};

template <class S>
struct PlainPair
{
    PlainBox<S> a, b;
};

#ifdef __AVX2__
template <class S>
using TestLanes = FourLanes<S, 32>;
#else
template <class S>
using TestLanes = FourLanes<S>;
#endif

template <class S>
BoxContact<S> contactOf(const PlainPair<S>& pair, BoxAxisGroup& group)
{
    BoxContact<S> contact;
    collideBoxes(pair.a.template posed<TestLanes<S>>(), pair.b.template posed<TestLanes<S>>(), group,
                 contact);
    return contact;
}

template <class S>
BoxContact<S> contactOf(const PlainPair<S>& pair)
{
    BoxAxisGroup group = BoxAxisGroup::None;
    return contactOf(pair, group);
}

/// How two boxes of a random pair lie.
enum class BoxKind
{
    Random,
    Aligned,    ///< the same axes
    Level,      ///< faces nearly level, turned about their normal
    Congruent,  ///< equal boxes on each other, with a trembling pose
    Count
};

inline void PrintTo(BoxKind kind, std::ostream* out)
{
    *out << "kind " << static_cast<int>(kind);
}

/// Pairs of boxes of sizes around 1 that overlap a little or are a little apart.
class BoxPairs
{
public:
    explicit BoxPairs(std::uint32_t seed) : m_random(seed) {}

    template <class S>
    PlainPair<S> draw(BoxKind kind)
    {
        PlainPair<double> pair;
        pair.a = {rotation(), between3(-5, 5), between3(0.2f, 1)};
        pair.b = {Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), between3(0.2f, 1)};
        const int axis = static_cast<int>(m_random.below(3));
        // Statements of their own, since the arguments of a call are evaluated in any order.
        const Eigen::Vector3d direction = between3(-1, 1).normalized();
        const Eigen::Matrix3d turned = rotation();
        if (kind == BoxKind::Random)
            placeApart(pair, direction, turned);
        else if (kind == BoxKind::Aligned)
            placeApart(pair, direction, Eigen::Matrix3d::Identity());
        else
            placeOn(pair, axis, kind == BoxKind::Congruent);
        return {toScalar<S>(pair.a), toScalar<S>(pair.b)};
    }

    /// Only sums, products, quotients and roots, which IEEE 754 rounds in one way.
    Eigen::Matrix3d rotation()
    {
        const Eigen::Vector3d axis = between3(-1, 1);
        return turn(axis, double(m_random.between(-1, 1)));
    }

private:
    /// The rotation of a quaternion that is not yet of unit length.
    static Eigen::Matrix3d turn(const Eigen::Vector3d& axis, double w)
    {
        return Eigen::Quaterniond(w, axis[0], axis[1], axis[2]).normalized().toRotationMatrix();
    }

    Eigen::Vector3d between3(float low, float high)
    {
        const auto p = m_random.point(low, high);
        return {double(p[0]), double(p[1]), double(p[2])};
    }

    /// In a direction, with centres as far apart as lets the boxes about touch.
    void placeApart(PlainPair<double>& pair, const Eigen::Vector3d& local, const Eigen::Matrix3d& turn)
    {
        pair.b.axes = pair.a.axes * turn;
        const Eigen::Vector3d direction = pair.a.axes * local;
        const double reach = (pair.a.axes.transpose() * direction).cwiseAbs().dot(pair.a.half) +
                             (pair.b.axes.transpose() * direction).cwiseAbs().dot(pair.b.half);
        pair.b.centre = pair.a.centre + direction * reach * double(m_random.between(0.3f, 1.02f));
    }

    void placeOn(PlainPair<double>& pair, int axis, bool isCongruent)
    {
        const Eigen::Vector3d up = pair.a.axes.col(axis);
        const double small = isCongruent ? 1e-4 : 0.02;
        if (isCongruent)
            pair.b.half = pair.a.half;
        const Eigen::Matrix3d tilt = turn(between3(-1, 1) * small / 2, 1);
        const Eigen::Matrix3d yaw = turn(up * (isCongruent ? small : 1.0), double(m_random.between(0.1f, 1)));
        pair.b.axes = tilt * yaw * pair.a.axes;
        Eigen::Vector3d shift = between3(-1, 1) * (isCongruent ? small : 0.5);
        shift -= up * up.dot(shift);
        const double reach = pair.a.half[axis] + pair.b.half[axis];
        pair.b.centre = pair.a.centre + shift + up * reach * double(m_random.between(0.98f, 1.001f));
    }

    template <class S>
    static PlainBox<S> toScalar(const PlainBox<double>& box)
    {
        return {box.axes.template cast<S>(), box.centre.template cast<S>(), box.half.template cast<S>()};
    }

    Random m_random;
};
}  // namespace cullet::test
