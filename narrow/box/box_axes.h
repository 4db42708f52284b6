// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_pair.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Axes that are tested together, three at a time.
enum class BoxAxisGroup : std::uint8_t
{
    None,
    FacesOfA,
    FacesOfB,
    FirstEdgeOfA,  ///< crossed with each edge of B
    SecondEdgeOfA,
    ThirdEdgeOfA
};

/// The axis of least depth of two boxes that overlap.
template <class S>
struct BoxAxis
{
    int faceOfA = -1, faceOfB = -1;  ///< index of the axis; else -1
    int edgeOfA = -1, edgeOfB = -1;  ///< the axis is the product of these; else -1
    S distance = 0;                  ///< along the axis; minus the depth
};

/// The separating axis test of Gottschalk, Lin and Manocha (1996), "OBBTree": three axes in the lanes of a vector.
///
/// The surplus of an axis is how far apart the boxes are along it; negative: minus the depth. A product of two edges has
/// the surplus times its length, less what rounding may add to it: such an axis neither separates boxes that touch, nor,
/// between two edges that are nearly parallel, seems less deep than the faces beside these edges.
template <class Vector>
class BoxAxes
{
public:
    using S = typename Vector::Scalar;

    explicit BoxAxes(const BoxPair<Vector>& pair) : m_pair(pair)
    {
        for (int i = 0; i < 3; ++i)
            m_sizes[i] = pair.rows[i].magnitude();
        const Vector half = pair.halfA + pair.halfB;
        m_noise = 16 * std::numeric_limits<S>::epsilon() * (half[0] + half[1] + half[2]);
    }

    /// Whether an axis separates the boxes. The group only decides where the search begins.
    ///
    /// @param group [in, out] in which an axis separated the boxes the last time
    [[gnu::always_inline]] bool areSeparated(BoxAxisGroup& group)
    {
        if (group != BoxAxisGroup::None && separates(group))
            return true;
        // One after the other instead of a loop, so that the compiler can keep the rows in registers.
        if (testFacesOfA())
            group = BoxAxisGroup::FacesOfA;
        else if (testFacesOfB())
            group = BoxAxisGroup::FacesOfB;
        else if (testEdges<0>())
            group = BoxAxisGroup::FirstEdgeOfA;
        else if (testEdges<1>())
            group = BoxAxisGroup::SecondEdgeOfA;
        else if (testEdges<2>())
            group = BoxAxisGroup::ThirdEdgeOfA;
        else
            group = BoxAxisGroup::None;
        return group != BoxAxisGroup::None;
    }

    /// @pre not areSeparated()
    /// @return false if a number is not finite
    bool findLeastDepth(BoxAxis<S>& axis) const
    {
        const Vector sum = m_surplusA + m_surplusB;
        if ((sum - sum == Vector(S(0))).bits() % 8 != 7)
            return false;
        const Vector larger = Vector::larger(m_surplusA, m_surplusB);
        axis.distance = std::max(std::max(larger[0], larger[1]), larger[2]);
        const Vector least(axis.distance);
        const unsigned ofA = (m_surplusA == least).bits() % 8, ofB = (m_surplusB == least).bits() % 8;
        if (ofA != 0)
            axis.faceOfA = __builtin_ctz(ofA);
        else
            axis.faceOfB = __builtin_ctz(ofB);
        findEdges(least, axis);
        return true;
    }

private:
    [[gnu::always_inline]] bool separates(BoxAxisGroup group)
    {
        switch (group)
        {
            case BoxAxisGroup::FacesOfA:
                return testFacesOfA();
            case BoxAxisGroup::FacesOfB:
                return testFacesOfB();
            case BoxAxisGroup::FirstEdgeOfA:
                return testEdges<0>();
            case BoxAxisGroup::SecondEdgeOfA:
                return testEdges<1>();
            default:
                return testEdges<2>();
        }
    }

    static bool hasPositive(const Vector& surplus) { return (surplus > Vector(S(0))).bits() % 8 != 0; }

    /// Sums of products of the lanes of `half` and a vector each.
    static Vector extent(const Vector (&sizes)[3], const Vector& half)
    {
        return sizes[0] * half.template spread<0>() + sizes[1] * half.template spread<1>() +
               sizes[2] * half.template spread<2>();
    }

    [[gnu::always_inline]] bool testFacesOfA()
    {
        Vector columns[4];
        transposeRows(m_sizes, columns);
        m_surplusA = columns[3] - (m_pair.halfA + extent({columns[0], columns[1], columns[2]}, m_pair.halfB));
        return hasPositive(m_surplusA);
    }

    [[gnu::always_inline]] bool testFacesOfB()
    {
        const Vector(&rows)[3] = m_pair.rows;
        const Vector along = rows[0] * rows[0].template spread<3>() + rows[1] * rows[1].template spread<3>() +
                             rows[2] * rows[2].template spread<3>();
        m_surplusB = along.magnitude() - (m_pair.halfB + extent(m_sizes, m_pair.halfA));
        return hasPositive(m_surplusB);
    }

    template <int i>
    [[gnu::always_inline]] bool testEdges()
    {
        constexpr int k = (i + 1) % 3, l = (i + 2) % 3;
        const Vector &onK = m_pair.rows[k], &onL = m_pair.rows[l];
        const Vector along = onK * onL.template spread<3>() - onL * onK.template spread<3>();
        const Vector &a = m_pair.halfA, &b = m_pair.halfB, &size = m_sizes[i];
        const Vector extentA = m_sizes[l] * a.template spread<k>() + m_sizes[k] * a.template spread<l>();
        const Vector extentB = b.template lanes<1, 2, 0, 3>() * size.template lanes<2, 0, 1, 3>() +
                               b.template lanes<2, 0, 1, 3>() * size.template lanes<1, 2, 0, 3>();
        m_surplusOfEdges[i] = along.magnitude() - (extentA + extentB + m_noise);
        return hasPositive(m_surplusOfEdges[i]);
    }

    template <int i>
    Vector squaredLengths() const
    {
        constexpr int k = (i + 1) % 3, l = (i + 2) % 3;
        return m_pair.rows[k] * m_pair.rows[k] + m_pair.rows[l] * m_pair.rows[l];
    }

    /// @param least the surplus of the best face
    void findEdges(const Vector& least, BoxAxis<S>& axis) const
    {
        const Vector squares[3] = {squaredLengths<0>(), squaredLengths<1>(), squaredLengths<2>()};
        const Vector limit = least * least;
        unsigned better[3];
        for (int i = 0; i < 3; ++i)
            better[i] = (limit * squares[i] > m_surplusOfEdges[i] * m_surplusOfEdges[i]).bits() % 8;
        if ((better[0] | better[1] | better[2]) == 0)
            return;
        for (int i = 0; i < 3; ++i)
        {
            for (; better[i] != 0; better[i] &= better[i] - 1)
                consider(i, __builtin_ctz(better[i]), squares[i], axis);
        }
    }

    void consider(int i, int j, const Vector& squares, BoxAxis<S>& axis) const
    {
        const S distance = m_surplusOfEdges[i][j] / Vector::root(squares[j]);
        if (distance > axis.distance)
            axis = {-1, -1, i, j, distance};
    }

    const BoxPair<Vector>& m_pair;
    S m_noise;          ///< bound of the rounding error of a product of edges times its length
    Vector m_sizes[3];  ///< magnitudes of the pair's rows
    Vector m_surplusA, m_surplusB, m_surplusOfEdges[3];
};
}  // namespace cullet
