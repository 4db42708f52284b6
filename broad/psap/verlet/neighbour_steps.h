// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/data/scene_statistics.h"

#include <cstdint>

/// The neighbour list of molecular dynamics (Verlet 1967), for boxes: pairs that may overlap soon, reused for several
/// sets of boxes.
///
/// When the list is made, each box gets a skin, and the list contains the pairs whose boxes overlap when enlarged by
/// their skins. As long as no face of a box has moved farther than the thickness of its skin, the list contains all
/// overlapping pairs, and no search is needed. Most pairs of the list are classified without loading their boxes,
/// from their depth or distance when the list was made.
namespace cullet::psap
{
/// Thickness of the skins. Most boxes have the same one, so that boxes of equal size have equal sizes with skins too.
struct SkinRule
{
    float common;

    /// @param distance that the box has moved since the last set
    CULLET_HOST_DEVICE float skinFor(float way) const
    {
        constexpr float kMost = 4;
        // Boxes that were teleported or created say nothing about their future motion.
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

/// An upper bound of the rounding error of a sum of that size; 0 for infinite sums, since faces of boxes may be
/// infinite.
CULLET_HOST_DEVICE inline float roundingOf(float sum)
{
    constexpr float kRelative = 0x1p-22f, kAbsolute = 1e-37f;
    const float size = fabsf(sum);
    return size < kInfinity ? size * kRelative + kAbsolute : 0.0f;
}

/// The box enlarged by its skin, rounded outwards.
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

/// Largest displacement of a face of a box, in skins. Infinite where the box has become empty, or was.
CULLET_HOST_DEVICE inline float stretchOf(const SkinnedBox& then, const Aabb& now)
{
    const bool wasValid = isValid(then.box);
    if (wasValid != isValid(now))
        return kInfinity;
    return wasValid ? wayOf(now, then.box) / then.skin : 0.0f;
}
/// Largest displacement for which a list is complete.
inline constexpr float kMostStretch = 0.9999f;

/// Depth of two boxes on the axis where it is least, negative where they are separated, divided by the sum of their
/// skins. NaN where infinities make it undefined.
CULLET_HOST_DEVICE inline float closenessOf(const SkinnedBox& a, const SkinnedBox& b)
{
    float least = kInfinity;
    bool isKnown = true;
    for (int axis = 0; axis < 3; ++axis)
    {
        // Larger than the shared length where one box is short, so that more pairs are decided without a load.
        const float right = a.box.max[axis] - b.box.min[axis];
        const float left = b.box.max[axis] - a.box.min[axis];
        const float reach = right < left ? right : left;
        isKnown &= (right == right) & (left == left);
        least = reach < least ? reach : least;
    }
    return isKnown ? least / (a.skin + b.skin) : kNan;
}

/// Closeness above which two boxes still overlap after that displacement, and below whose negative they are still
/// separated.
CULLET_HOST_DEVICE inline float sureFrom(float stretch)
{
    return deeperThan(stretch) + 1e-37f;
}

/// Lists of a pair, as bits of RoutedPair::to.
inline constexpr std::uint32_t kToRemoved = 1, kToAdded = 2, kToKept = 4;

/// A pair of the neighbour list; by default no pair, whose boxes count as separated.
struct NearItem
{
    RowPair pair = {};
    float closeness = -kInfinity;
    bool wasHeld = false;
    bool isPair = false;
};

/// Result of a test of a NeighbourItem.
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

/// Classifies a pair by its closeness.
struct Sureness
{
    bool areTogether, areApart;

    CULLET_HOST_DEVICE Sureness(float closeness, float sure)
        : areTogether(closeness > sure), areApart(closeness < -sure)
    {
    }
    CULLET_HOST_DEVICE bool isOpen() const { return !areTogether && !areApart; }
    /// The rows whose boxes are loaded: row 0, which other lanes load too, where closeness decides. So a GPU loads
    /// the boxes of several pairs at once, without a branch for each.
    CULLET_HOST_DEVICE RowPair askFor(RowPair pair) const { return isOpen() ? pair : RowPair{0, 0}; }
};

/// A view of a neighbour list, in an executor's memory.
struct NearList
{
    RowPair* pairs;
    float* closeness;
    std::uint64_t room;
    std::uint64_t* count;

    /// False for all pairs where there was not enough room, since any of them may be missing.
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
    /// Stores the result for a pair of a new list. @param isHeld [room, out]
    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict,
                                 std::uint8_t* isHeld) const
    {
        if (!item.isPair)
            return;
        closeness[i] = verdict.closeness;
        isHeld[i] = verdict.isHeld ? 1 : 0;
    }
};

/// Counts of pairs that enter are void from this value on.
inline constexpr std::uint64_t kVoidCount = 1ull << 62;

/// Boxes distributed over indices, several per index, so that fewer atomics go to one address.
struct SharedBoxes
{
    static constexpr std::uint64_t kEach = 8, kMany = 1u << 17;

    std::uint64_t count;

    CULLET_HOST_DEVICE std::uint64_t indices() const
    {
        return count < kMany ? count : (count + kEach - 1) / kEach;
    }
    /// Calls body(i) for the boxes of an index.
    template <class Body>
    CULLET_HOST_DEVICE void forEach(std::uint64_t index, const Body& body) const
    {
        for (std::uint64_t i = index; i < count; i += indices())
            body(i);
    }
};

/// Boxes and their skins, in an executor's memory.
struct SkinnedBoxes
{
    AlignedBox* then;  ///< the boxes and the thickness of their skins
    Aabb* grown;       ///< the boxes enlarged by their skins

    CULLET_HOST_DEVICE void store(std::uint64_t i, const Aabb& box, float skin) const
    {
        const bool isThere = isValid(box);
        storeAligned(then, i, isThere ? box : nowhere(), skin);
        storeBox(grown, i, isThere ? grownBy(box, skin) : nowhere());
    }
};

/// Gives boxes their skins, and stores copies of the boxes.
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

/// Stores copies of boxes, and measures how far they have moved since the list was made.
struct StretchSkins
{
    SharedBoxes shared;
    const Aabb* boxes;
    AlignedBox* now;
    const AlignedBox* then;
    std::uint32_t* stretch;  ///< bits of the largest displacementOf(); 0 when the list was made
    std::uint64_t* added;    ///< pairs that enter: void where a box has left its skin

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

/// What the boxes of a pair in a new list decide.
struct FirstLook
{
    bool isEntering, isHeld;
};

/// @param boxes  boxes with skins
/// @param decide called with the pair and its boxes; returns a FirstVerdict
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

/// Tests pair i of a new list for the first time; appends the pairs that enter.
struct BeginNear
{
    NearList near;
    std::uint8_t* isHeld;     ///< [near.room, out]
    const AlignedBox* boxes;  ///< with skins
    WasApart wasApart;
    std::uint64_t* added;  ///< pairs that enter: void where the list was too short

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

/// Tests whether pair i is still held, enters or leaves.
struct FollowNear
{
    NearList near;
    const std::uint8_t* wasHeld;
    std::uint8_t* isHeld;  ///< [out]
    const AlignedBox* boxes;
    const std::uint32_t* stretch;  ///< as MeasureDisplacement::displacement

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

/// Size of a box, and how far it has moved.
struct BoxInSample
{
    float side;  ///< longest side; negative: no bounded box
    float way;
};

/// Samples box i of a sample spread over all boxes. Not at equal distances, since every tenth box may move.
///
/// @tparam Copies boxes of this set and of the previous one: BoxCopies or RowBoxes
template <class Copies>
struct SampleBoxes
{
    Copies copies;
    std::uint64_t stride;
    std::uint64_t count;  ///< number of all boxes
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
