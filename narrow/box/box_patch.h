// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_corners.h"

namespace cullet
{
/// Up to four points on the reference's face; beyond the count, the lanes repeat the first point.
template <class Vector>
struct BoxPatch
{
    int count;
    Vector x, y, distances;
};

/// Selects up to four of the corners of a contact: a deep one, the farthest from it, and the farthest on either side of
/// the line through both; the deepest takes the place of the nearest. Of nearly equal corners the first is selected, so
/// that the selection does not change when the boxes tremble. There is no branch that depends on single corners, which
/// no processor predicts.
template <class Vector>
class BoxSelection
{
public:
    using S = typename Vector::Scalar;

    explicit BoxSelection(const BoxCorners<Vector>& corners) : m_apart(corners.apart())
    {
        Vector depths[kGroups];
        for (int i = 0; i < kGroups; ++i)
        {
            const Vector none(std::numeric_limits<S>::lowest());
            depths[i] = Vector::select(corners.areThere()[i], Vector(S(0)) - corners.distances()[i], none);
            corners.x()[i].store(m_x + 4 * i);
            corners.y()[i].store(m_y + 4 * i);
            corners.distances()[i].store(m_distances + 4 * i);
        }
        const S depth = largest(depths);
        m_deepest = firstAbove(depths, depth);
        const unsigned deep = bitsAbove(depths, depth - depth / 8);
        // Solvers favour the first point. A corner of the other face is on the side from which that box has moved.
        m_first = __builtin_ctz((deep & corners.whole()) != 0 ? deep & corners.whole() : deep);
        for (int i = 0; i < kGroups; ++i)
        {
            // What is not there becomes the first, which is no extreme.
            m_toX[i] = (corners.x()[i] - m_x[m_first]) & corners.areThere()[i];
            m_toY[i] = (corners.y()[i] - m_y[m_first]) & corners.areThere()[i];
        }
        for (int& chosen : m_chosen)
            chosen = m_first;
        selectOthers();
        includeDeepest();
    }

    void write(BoxPatch<Vector>& patch) const
    {
        const auto gather = [&](const S* from)
        {
            const S first = from[m_chosen[0]];
            return Vector(first, m_count > 1 ? from[m_chosen[1]] : first,
                          m_count > 2 ? from[m_chosen[2]] : first, m_count > 3 ? from[m_chosen[3]] : first);
        };
        patch.count = m_count;
        patch.x = gather(m_x);
        patch.y = gather(m_y);
        patch.distances = gather(m_distances);
    }

private:
    static constexpr int kGroups = BoxCorners<Vector>::kGroups;

    struct Direction
    {
        S x, y;
    };

    static S largest(const Vector (&scores)[kGroups])
    {
        return Vector::larger(Vector::larger(scores[0], scores[1]), scores[2]).largest();
    }

    /// Index of the first corner whose score is not below a limit.
    static int firstAbove(const Vector (&scores)[kGroups], S limit)
    {
        return __builtin_ctz(bitsAbove(scores, limit));
    }
    static unsigned bitsAbove(const Vector (&scores)[kGroups], S limit)
    {
        unsigned bits = 0;
        for (int i = 0; i < kGroups; ++i)
            bits |= (Vector(limit) <= scores[i]).bits() << (4 * i);
        return bits;
    }

    Direction fromFirst(int corner) const { return {m_x[corner] - m_x[m_first], m_y[corner] - m_y[m_first]}; }

    static S cross(const Direction& a, const Direction& b) { return a.x * b.y - a.y * b.x; }

    /// The products of a vector with those from the first corner to all; positive: on its left.
    void crossAll(const Direction& along, Vector (&products)[kGroups]) const
    {
        for (int i = 0; i < kGroups; ++i)
            products[i] = m_toY[i] * along.x - m_toX[i] * along.y;
    }

    void selectOthers()
    {
        Vector scores[kGroups], opposite[kGroups];
        for (int i = 0; i < kGroups; ++i)
            scores[i] = m_toX[i] * m_toX[i] + m_toY[i] * m_toY[i];
        const S farthest = largest(scores);
        if (farthest <= m_apart * m_apart)
            return;
        const int second = firstAbove(scores, farthest - farthest / 512);
        const Direction toSecond = fromFirst(second);
        const S length = Vector::root(toSecond.x * toSecond.x + toSecond.y * toSecond.y);
        crossAll(toSecond, scores);
        for (int i = 0; i < kGroups; ++i)
            opposite[i] = Vector(S(0)) - scores[i];
        // What is not there has the score 0 of the first corner.
        const S narrow = m_apart * length, left = largest(scores), right = largest(opposite);
        const bool hasThird = left > narrow, hasFourth = right > narrow;
        const int third = firstAbove(scores, left - narrow), fourth = firstAbove(opposite, right - narrow);
        if (hasThird)
            choose(third);
        choose(second);
        if (hasFourth)
            choose(fourth);
        if (hasThird != hasFourth)
            selectBeyond(toSecond, fromFirst(hasThird ? third : fourth), hasThird ? 1 : -1, narrow);
    }

    /// The farthest beyond the other sides of a triangle, where all corners are on one side of the first.
    ///
    /// @param side 1: on the left of that from the first to the second corner; -1: on the right
    void selectBeyond(const Direction& second, const Direction& tip, S side, S narrow)
    {
        const Direction fromTip = {side * (second.x - tip.x), side * (second.y - tip.y)};
        Vector beside[kGroups], beyond[kGroups], scores[kGroups];
        crossAll({side * tip.x, side * tip.y}, beside);
        crossAll(fromTip, beyond);
        for (int i = 0; i < kGroups; ++i)
            scores[i] = Vector::larger(beside[i], beyond[i] + cross(tip, fromTip));
        const S most = largest(scores);
        if (most > narrow)
            choose(firstAbove(scores, most - narrow));
    }

    void includeDeepest()
    {
        int nearest = 0;
        S least = std::numeric_limits<S>::max();
        for (int i = 0; i < 4; ++i)
        {
            const S x = m_x[m_chosen[i]] - m_x[m_deepest], y = m_y[m_chosen[i]] - m_y[m_deepest];
            const S square = x * x + y * y;
            nearest = square < least ? i : nearest;
            least = std::min(square, least);
        }
        if (m_count < 4 && least > m_apart * m_apart)
            nearest = m_count++;
        m_chosen[nearest] = m_deepest;
    }

    void choose(int corner) { m_chosen[m_count++] = corner; }

    S m_apart;
    S m_x[4 * kGroups], m_y[4 * kGroups], m_distances[4 * kGroups];
    Vector m_toX[kGroups], m_toY[kGroups];  ///< from the first corner
    int m_first, m_deepest;
    int m_chosen[4];
    int m_count = 1;
};

/// One corner.
template <class Vector>
void patchOf(const BoxCorners<Vector>& corners, int corner, BoxPatch<Vector>& patch)
{
    const int group = corner / 4, lane = corner % 4;
    patch = {1, Vector(corners.x()[group][lane]), Vector(corners.y()[group][lane]),
             Vector(corners.distances()[group][lane])};
}

/// What BoxSelection selects of two corners, of which the second has the larger index.
template <class Vector>
void patchOfTwo(const BoxCorners<Vector>& corners, int first, int second, BoxPatch<Vector>& patch)
{
    using S = typename Vector::Scalar;
    const auto of = [](const Vector(&from)[BoxCorners<Vector>::kGroups], int corner)
    { return from[corner / 4][corner % 4]; };
    const S x[2] = {of(corners.x(), first), of(corners.x(), second)};
    const S y[2] = {of(corners.y(), first), of(corners.y(), second)};
    const S distances[2] = {of(corners.distances(), first), of(corners.distances(), second)};
    const S toX = x[1] - x[0], toY = y[1] - y[0];
    const S depth = std::max(-distances[0], -distances[1]), limit = depth - depth / 8;
    const bool areDeep[2] = {-distances[0] >= limit, -distances[1] >= limit};
    const bool areWhole[2] = {(corners.whole() >> first & 1) != 0, (corners.whole() >> second & 1) != 0};
    const bool isWholeDeep = (areDeep[0] && areWhole[0]) || (areDeep[1] && areWhole[1]);
    const auto mayBeFirst = [&](int i) { return areDeep[i] && (areWhole[i] || !isWholeDeep); };
    const bool areApart = toX * toX + toY * toY > corners.apart() * corners.apart();
    const int begin = areApart ? !mayBeFirst(0) : distances[1] < distances[0];
    const int end = areApart ? 1 - begin : begin;
    patch = {areApart ? 2 : 1, Vector(x[begin], x[end], x[begin], x[begin]),
             Vector(y[begin], y[end], y[begin], y[begin]),
             Vector(distances[begin], distances[end], distances[begin], distances[begin])};
}

/// The deepest corner of a contact and up to three around it, none closer to another one than BoxCorners::apart().
///
/// @param depth of the boxes along the normal; that of the only point where rounding leaves no corner
template <class Vector>
void makeBoxPatch(const BoxFaces<Vector>& faces, typename Vector::Scalar depth, BoxPatch<Vector>& patch)
{
    BoxCorners<Vector> corners(faces);
    if (corners.findOther())
    {
        patch = {4, corners.x()[0], corners.y()[0], corners.distances()[0]};
        return;
    }
    if (!corners.findAll())
        corners.takeDeepest(depth);
    // Of many contacts, a third have one corner, and a quarter two.
    const unsigned there = corners.there(), others = there & (there - 1);
    if (others == 0)
        return patchOf(corners, __builtin_ctz(there), patch);
    if ((others & (others - 1)) == 0)
        return patchOfTwo(corners, __builtin_ctz(there), __builtin_ctz(others), patch);
    BoxSelection<Vector>(corners).write(patch);
}
}  // namespace cullet
