// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_pairs.h"
#include "broad/psap_statistics.h"

#include <cstdint>

/// Pairs that are near, kept from one set of boxes to the next: the neighbour list of molecular dynamics (Verlet 1967), for boxes.
///
/// When the list is made, each box gets a skin, and pairs whose boxes with their skins overlap are near. As long as no side
/// of a box has gone farther than its skin is thick, all pairs that overlap are near, and nothing has to be searched. Most
/// of the near ones need no look at their boxes either: by how much they reached into each other tells what has become of
/// them.
namespace cullet::psap
{
/// How thick skins are: mostly alike, so that boxes of one size are of one size with them too.
struct SkinRule
{
    float common;

    /// @param way that the box has gone since the last set
    CULLET_HOST_DEVICE float skinFor(float way) const
    {
        constexpr float kMost = 4;
        // What has jumped, or was not there, says nothing about what it will do.
        if (!(way <= common * (kMost / 2)))
            return common;
        float skin = common;
        while (skin < 2 * way)
            skin *= 2;
        return skin;
    }
};

/// A box when the list was made.
struct SkinnedBox
{
    Aabb box;
    float skin;
};

CULLET_HOST_DEVICE inline SkinnedBox loadSkinned(const AlignedBox* boxes, std::uint64_t i)
{
    const BoxHalf xy = loadHalf(boxes, 2 * i);
    const BoxHalf z = loadHalf(boxes, 2 * i + 1);
    return {{{xy.low0, xy.low1, z.low0}, {xy.high0, xy.high1, z.high0}}, z.high1};
}

/// More than a sum of that size is off by; nothing where it is infinite, as the sides of boxes may be.
CULLET_HOST_DEVICE inline float roundingOf(float sum)
{
    constexpr float kRelative = 0x1p-22f, kAbsolute = 1e-37f;
    const float size = fabsf(sum);
    return size < kInfinity ? size * kRelative + kAbsolute : 0.0f;
}

/// The box with its skin: no number is rounded inwards.
CULLET_HOST_DEVICE inline Aabb grownBy(const Aabb& box, float skin)
{
    Aabb grown;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float low = box.min[axis] - skin;
        const float high = box.max[axis] + skin;
        grown.min[axis] = low - roundingOf(low);
        grown.max[axis] = high + roundingOf(high);
    }
    return grown;
}

/// How far the sides of a box have gone, in skins. Infinite where it has become empty, or was.
CULLET_HOST_DEVICE inline float stretchOf(const SkinnedBox& then, const Aabb& now)
{
    const bool wasValid = isValid(then.box);
    if (wasValid != isValid(now))
        return kInfinity;
    return wasValid ? wayOf(now, then.box) / then.skin : 0.0f;
}
/// A list is of no use any more where boxes have gone farther.
inline constexpr float kMostStretch = 0.9999f;

/// How near two boxes were: by how much they reached into each other, negative how far they were apart, on the axis where
/// that was least; in skins of both. NaN where that cannot be told.
CULLET_HOST_DEVICE inline float closenessOf(const SkinnedBox& a, const SkinnedBox& b)
{
    float least = kInfinity;
    bool isKnown = true;
    for (int axis = 0; axis < 3; ++axis)
    {
        // More than the length that they share where one is small, so that less has to be looked at.
        const float right = a.box.max[axis] - b.box.min[axis];
        const float left = b.box.max[axis] - a.box.min[axis];
        const float reach = right < left ? right : left;
        isKnown &= (right == right) & (left == left);
        least = reach < least ? reach : least;
    }
    return isKnown ? least / (a.skin + b.skin) : kNan;
}

/// What closeness tells after boxes have gone so far: above this they overlap, below its negative they do not.
CULLET_HOST_DEVICE inline float sureFrom(float stretch)
{
    return deeperThan(stretch) + 1e-37f;
}

/// The near pairs, in an executor's memory.
struct NearList
{
    IdPair* pairs;
    float* closeness;
    std::uint64_t room;
    std::uint64_t* count;

    /// None where there was not room for all: those before may not be there either.
    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < *count && *count <= room; }
    PairList found() const { return {pairs, room, count}; }
};

/// Counts of pairs that enter begin here when they are void.
inline constexpr std::uint64_t kVoidCount = 1ull << 62;

/// What a device's indices tell in one place it takes one after the other: each does some boxes, and tells of all.
struct SharedBoxes
{
    static constexpr std::uint64_t kEach = 8, kMany = 1u << 17;

    std::uint64_t count;

    CULLET_HOST_DEVICE std::uint64_t indices() const
    {
        return count < kMany ? count : (count + kEach - 1) / kEach;
    }
    /// body(i) for the boxes of an index.
    template <class Body>
    CULLET_HOST_DEVICE void forEach(std::uint64_t index, const Body& body) const
    {
        for (std::uint64_t i = index; i < count; i += indices())
            body(i);
    }
};

/// Gives boxes their skins, and keeps copies of them.
struct GrowSkins
{
    SharedBoxes shared;
    const Aabb* boxes;
    BoxCopies copies;
    SkinRule rule;
    AlignedBox* then;  ///< [out]
    Aabb* grown;       ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        float most = 0;
        shared.forEach(index,
                       [&](std::uint64_t i)
                       {
                           const Aabb box = loadBox(boxes, i);
                           storeCopy(copies.now, i, box);
                           const float way = copies.wayFromOld(i, box);
                           most = way > most ? way : most;
                           grow(i, box, rule.skinFor(way));
                       });
        raise(copies.motion, most);
    }

private:
    CULLET_HOST_DEVICE void grow(std::uint64_t i, const Aabb& box, float skin) const
    {
        const bool isThere = isValid(box);
        storeAligned(then, i, isThere ? box : nowhere(), skin);
        storeBox(grown, i, isThere ? grownBy(box, skin) : nowhere());
    }
};

/// Keeps copies of boxes, and tells how far they have gone since the list began.
struct StretchSkins
{
    SharedBoxes shared;
    const Aabb* boxes;
    AlignedBox* now;
    const AlignedBox* then;
    std::uint32_t* stretch;  ///< bits of the largest stretchOf(); 0 when the list began
    std::uint64_t* added;    ///< how many pairs enter: void where boxes have gone too far

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        float most = 0;
        shared.forEach(index,
                       [&](std::uint64_t i)
                       {
                           const Aabb box = loadBox(boxes, i);
                           storeCopy(now, i, box);
                           const float much = stretchOf(loadSkinned(then, i), box);
                           most = much > most ? much : most;
                       });
        raise(stretch, most);
        if (!(most <= kMostStretch))
            setAlike(added, kVoidCount);
    }
};

/// Which list a pair goes to.
inline constexpr std::uint32_t kToKept = 0, kToRemoved = 1, kToAdded = 2;

/// Looks at near pair i of a new list for the first time: sends those that have come together.
struct BeginNear
{
    NearList near;
    std::uint8_t* isHeld;     ///< [near.room, out]
    const AlignedBox* boxes;  ///< with skins
    WasApart wasApart;
    std::uint64_t* added;  ///< how many pairs enter: void where there is not room for all near ones

    CULLET_HOST_DEVICE SentPair operator()(std::uint64_t i) const
    {
        if (i == 0 && *near.count > near.room)
            setAlike(added, kVoidCount);
        if (!near.has(i))
            return {};
        const IdPair pair = near.pairs[i];
        const SkinnedBox a = loadSkinned(boxes, pair.a);
        const SkinnedBox b = loadSkinned(boxes, pair.b);
        near.closeness[i] = closenessOf(a, b);
        const bool areTogether = overlaps(a.box, b.box);
        isHeld[i] = areTogether ? 1 : 0;
        const bool isEntering =
            areTogether && wasApart.ready()(pair, [&] { return overlapOf(a.box, b.box); });
        return {pair, isEntering ? kToAdded : SentPair::kNowhere};
    }
};

/// Tells what has become of near pair i.
struct FollowNear
{
    NearList near;
    const std::uint8_t* wasHeld;
    std::uint8_t* isHeld;  ///< [out]
    const AlignedBox* boxes;
    const std::uint32_t* stretch;  ///< as StretchSkins has it

    CULLET_HOST_DEVICE SentPair operator()(std::uint64_t i) const
    {
        if (!near.has(i))
            return {};
        const IdPair pair = near.pairs[i];
        const bool wasTogether = wasHeld[i] != 0;
        const bool isTogether = areTogether(pair, near.closeness[i]);
        isHeld[i] = isTogether ? 1 : 0;
        const std::uint32_t to = !isTogether ? (wasTogether ? kToRemoved : SentPair::kNowhere)
                                             : (wasTogether ? kToKept : kToAdded);
        return {pair, to};
    }

private:
    CULLET_HOST_DEVICE bool areTogether(IdPair pair, float closeness) const
    {
        const float sure = sureFrom(floatOf(*stretch));
        if (closeness > sure)
            return true;
        if (closeness < -sure)
            return false;
        return meets(loadHalf(boxes, 2 * std::uint64_t{pair.a}),
                     loadHalf(boxes, 2 * std::uint64_t{pair.b})) &&
               meets(loadHalf(boxes, 2 * std::uint64_t{pair.a} + 1),
                     loadHalf(boxes, 2 * std::uint64_t{pair.b} + 1));
    }
};

/// The size of a box, and how far it has gone.
struct BoxInSample
{
    float side;  ///< the longest; negative: no bounded box
    float way;
};

/// Box i of some, evenly spread over all.
struct SampleBoxes
{
    BoxCopies copies;
    std::uint64_t stride;
    BoxInSample* sample;  ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const Aabb box = loadBox(copies.now, i * stride);
        const float side = isValid(box) ? boundedExtent(box) : -1.0f;
        sample[i] = {side < kInfinity ? side : -1.0f, copies.wayFromOld(i * stride, box)};
    }
};
}  // namespace cullet::psap
