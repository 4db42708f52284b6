// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/data/scene_statistics.h"

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

/// Which lists a pair goes to, as SentPair has it.
inline constexpr std::uint32_t kToRemoved = 1, kToAdded = 2, kToKept = 4;

/// A near pair, or nothing: two boxes that are surely apart.
struct NearItem
{
    RowPair pair = {};
    float closeness = -kInfinity;
    bool wasHeld = false;
    bool isPair = false;
};

/// What is said of it.
struct NearVerdict
{
    SentPair sent = {};
    float closeness = 0;
    bool isHeld = false;

    CULLET_HOST_DEVICE static NearVerdict ofFollowed(const NearItem& item, bool isHeld)
    {
        const std::uint32_t to =
            !isHeld ? (item.wasHeld ? kToRemoved : 0u) : (item.wasHeld ? kToKept : kToAdded);
        return {{item.pair, to}, item.closeness, isHeld};
    }
};

/// What closeness tells of a pair.
struct Sureness
{
    bool areTogether, areApart;

    CULLET_HOST_DEVICE Sureness(float closeness, float sure)
        : areTogether(closeness > sure), areApart(closeness < -sure)
    {
    }
    CULLET_HOST_DEVICE bool isOpen() const { return !areTogether && !areApart; }
    /// The rows to look at: where they need not be, any that others look at too. So a GPU asks for the boxes of several pairs
    /// together, without a branch before each.
    CULLET_HOST_DEVICE RowPair askFor(RowPair pair) const { return isOpen() ? pair : RowPair{0, 0}; }
};

/// The near pairs, in an executor's memory.
struct NearList
{
    RowPair* pairs;
    float* closeness;
    std::uint64_t room;
    std::uint64_t* count;

    /// None where there was not room for all: those before may not be there either.
    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < *count && *count <= room; }
    PairList found() const { return {pairs, room, count}; }

    CULLET_HOST_DEVICE NearItem readPair(std::uint64_t i) const
    {
        return has(i) ? NearItem{pairs[i], 0, false, true} : NearItem{};
    }
    CULLET_HOST_DEVICE NearItem read(std::uint64_t i, const std::uint8_t* wasHeld) const
    {
        return has(i) ? NearItem{pairs[i], closeness[i], wasHeld[i] != 0, true} : NearItem{};
    }
    /// Of a new list. @param isHeld [room, out]
    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict,
                                 std::uint8_t* isHeld) const
    {
        if (!item.isPair)
            return;
        closeness[i] = verdict.closeness;
        isHeld[i] = verdict.isHeld ? 1 : 0;
    }
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

/// Boxes with their skins, in an executor's memory.
struct SkinnedBoxes
{
    AlignedBox* then;  ///< the boxes, and beside them how thick their skins are
    Aabb* grown;       ///< the boxes with their skins around them

    CULLET_HOST_DEVICE void store(std::uint64_t i, const Aabb& box, float skin) const
    {
        const bool isThere = isValid(box);
        storeAligned(then, i, isThere ? box : nowhere(), skin);
        storeBox(grown, i, isThere ? grownBy(box, skin) : nowhere());
    }
};

/// Gives boxes their skins, and keeps copies of them.
struct GrowSkins
{
    SharedBoxes shared;
    const Aabb* boxes;
    BoxCopies copies;
    SkinRule rule;
    SkinnedBoxes skinned;  ///< [out]

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
                           skinned.store(i, box, rule.skinFor(way));
                       });
        raise(copies.motion, most);
    }
};

/// Gives the box of a row its skin.
struct GrowRow
{
    RowBoxes rows;
    SkinRule rule;
    SkinnedBoxes skinned;  ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const
    {
        const Aabb box = loadBox(rows.now, row);
        skinned.store(row, box, rule.skinFor(rows.wayFromOld(row, box)));
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

/// What the boxes of a near pair in a new list tell.
struct FirstLook
{
    bool isEntering, isHeld;
};

/// @param boxes  with skins
/// @param decide called with the pair and its boxes, returns a FirstLook
template <class Decide>
CULLET_HOST_DEVICE NearVerdict judgeFirst(const NearItem& item, const AlignedBox* boxes, const Decide& decide)
{
    if (!item.isPair)
        return {};
    const SkinnedBox a = loadSkinned(boxes, item.pair.a);
    const SkinnedBox b = loadSkinned(boxes, item.pair.b);
    const FirstLook look = decide(item.pair, a.box, b.box);
    return {{item.pair, look.isEntering ? kToAdded : 0u}, closenessOf(a, b), look.isHeld};
}

/// Looks at near pair i of a new list for the first time: sends those that have come together.
struct BeginNear
{
    NearList near;
    std::uint8_t* isHeld;     ///< [near.room, out]
    const AlignedBox* boxes;  ///< with skins
    WasApart wasApart;
    std::uint64_t* added;  ///< how many pairs enter: void where there is not room for all near ones

    CULLET_HOST_DEVICE NearItem read(std::uint64_t i) const { return near.readPair(i); }

    CULLET_HOST_DEVICE NearVerdict operator()(const NearItem& item) const
    {
        return judgeFirst(item, boxes,
                          [&](RowPair pair, const Aabb& a, const Aabb& b)
                          {
                              const bool areTogether = overlaps(a, b);
                              return FirstLook{
                                  areTogether && wasApart.ready()(pair, [&] { return overlapOf(a, b); }),
                                  areTogether};
                          });
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict) const
    {
        if (i == 0 && *near.count > near.room)
            setAlike(added, kVoidCount);
        near.keep(i, item, verdict, isHeld);
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

    CULLET_HOST_DEVICE NearItem read(std::uint64_t i) const { return near.read(i, wasHeld); }

    CULLET_HOST_DEVICE NearVerdict operator()(const NearItem& item) const
    {
        return NearVerdict::ofFollowed(item, areTogether(item.pair, item.closeness));
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict) const
    {
        if (item.isPair)
            isHeld[i] = verdict.isHeld ? 1 : 0;
    }

private:
    CULLET_HOST_DEVICE bool areTogether(RowPair pair, float closeness) const
    {
        const Sureness sureness(closeness, sureFrom(floatOf(*stretch)));
        const RowPair asked = sureness.askFor(pair);
        const std::uint64_t a = 2 * std::uint64_t{asked.a}, b = 2 * std::uint64_t{asked.b};
        const bool meet = (int{meets(loadHalf(boxes, a), loadHalf(boxes, b))} &
                           int{meets(loadHalf(boxes, a + 1), loadHalf(boxes, b + 1))}) != 0;
        return sureness.isOpen() ? meet : sureness.areTogether;
    }
};

/// The size of a box, and how far it has gone.
struct BoxInSample
{
    float side;  ///< the longest; negative: no bounded box
    float way;
};

/// Box i of some, spread over all; not at equal distances, since every tenth may move.
///
/// @tparam Copies of the boxes of this set and of the last one: BoxCopies or RowBoxes
template <class Copies>
struct SampleBoxes
{
    Copies copies;
    std::uint64_t stride;
    std::uint64_t count;  ///< of all boxes
    BoxInSample* sample;  ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t shifted = i * stride + (i * 2654435761u >> 8) % stride;
        const std::uint64_t k = shifted < count ? shifted : count - 1;
        const Aabb box = loadBox(copies.now, k);
        const float side = isValid(box) ? boundedExtent(box) : -1.0f;
        sample[i] = {side < kInfinity ? side : -1.0f, copies.wayFromOld(k, box)};
    }
};
}  // namespace cullet::psap
