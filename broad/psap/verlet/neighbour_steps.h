// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/data/scene_statistics.h"
#include "cullet/broad/psap/data/skins.h"

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
    CULLET_HOST_DEVICE float skinFor(float distance) const
    {
        constexpr float kMost = 4;
        // Boxes that were teleported or created say nothing about their future motion.
        if (!(distance <= common * (kMost / 2)))
            return common;
        float skin = common;
        while (skin < 2 * distance)
            skin *= 2;
        return skin;
    }
};

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
CULLET_HOST_DEVICE inline float decisiveCloseness(float displacement)
{
    return maxDepthGain(displacement) + 1e-37f;
}

/// Lists of a pair, as bits of RoutedPair::to.
inline constexpr std::uint32_t kToRemoved = 1, kToAdded = 2, kToKept = 4;

/// A pair of the neighbour list; by default no pair, whose boxes count as separated.
struct NeighbourItem
{
    RowPair pair = {};
    float closeness = -kInfinity;
    bool wasHeld = false;
    bool isPair = false;
};

/// Result of a test of a NeighbourItem.
struct NeighbourVerdict
{
    RoutedPair routed = {};
    float closeness = 0;
    bool isHeld = false;

    CULLET_HOST_DEVICE static NeighbourVerdict ofFollowed(const NeighbourItem& item, bool isHeld)
    {
        const std::uint32_t to =
            !isHeld ? (item.wasHeld ? kToRemoved : 0u) : (item.wasHeld ? kToKept : kToAdded);
        return {{item.pair, to}, item.closeness, isHeld};
    }
};

/// Classifies a pair by its closeness.
struct ClosenessTest
{
    bool areOverlapping, areSeparated;

    CULLET_HOST_DEVICE ClosenessTest(float closeness, float decisive)
        : areOverlapping(closeness > decisive), areSeparated(closeness < -decisive)
    {
    }
    CULLET_HOST_DEVICE bool isUndecided() const { return !areOverlapping && !areSeparated; }
    /// The rows whose boxes are loaded: row 0, which other lanes load too, where closeness decides. So a GPU loads
    /// the boxes of several pairs at once, without a branch for each.
    CULLET_HOST_DEVICE RowPair rowsToLoad(RowPair pair) const { return isUndecided() ? pair : RowPair{0, 0}; }
};

/// A view of a neighbour list, in an executor's memory.
struct NeighbourView
{
    RowPair* pairs;
    float* closeness;
    std::uint64_t room;
    std::uint64_t* count;

    /// False for all pairs where there was not enough room, since any of them may be missing.
    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < *count && *count <= room; }
    PairList found() const { return {pairs, room, count}; }

    CULLET_HOST_DEVICE NeighbourItem readPair(std::uint64_t i) const
    {
        return has(i) ? NeighbourItem{pairs[i], 0, false, true} : NeighbourItem{};
    }
    CULLET_HOST_DEVICE NeighbourItem read(std::uint64_t i, const std::uint8_t* wasHeld) const
    {
        return has(i) ? NeighbourItem{pairs[i], closeness[i], wasHeld[i] != 0, true} : NeighbourItem{};
    }
    /// Stores the result for a pair of a new list. @param isHeld [room, out]
    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NeighbourItem& item, const NeighbourVerdict& verdict,
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
struct StridedBoxes
{
    static constexpr std::uint64_t kBoxesPerIndex = 8, kManyBoxes = 1u << 17;

    std::uint64_t count;

    CULLET_HOST_DEVICE std::uint64_t indices() const
    {
        return count < kManyBoxes ? count : (count + kBoxesPerIndex - 1) / kBoxesPerIndex;
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
    AlignedBox* reference;  ///< the boxes and the thickness of their skins
    Aabb* grown;            ///< the boxes enlarged by their skins

    CULLET_HOST_DEVICE void store(std::uint64_t i, const Aabb& box, float skin) const
    {
        const bool isThere = isValid(box);
        storeAligned(reference, i, isThere ? box : emptyBox(), skin);
        storeBox(grown, i, isThere ? grownBy(box, skin) : emptyBox());
    }
};

/// Gives boxes their skins, and stores copies of the boxes.
struct GrowSkins
{
    StridedBoxes shared;
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
                           const float distance = copies.distanceFromOld(i, box);
                           most = distance > most ? distance : most;
                           skinned.store(i, box, rule.skinFor(distance));
                       });
        atomicMaxFloat(copies.motion, most);
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
        skinned.store(row, box, rule.skinFor(rows.distanceFromOld(row, box)));
    }
};

/// Stores copies of boxes, and measures how far they have moved since the list was made.
struct MeasureDisplacement
{
    StridedBoxes shared;
    const Aabb* boxes;
    AlignedBox* now;
    const AlignedBox* reference;
    std::uint32_t* displacement;  ///< bits of the largest displacementOf(); 0 when the list was made
    std::uint64_t* added;         ///< pairs that enter: void where a box has left its skin

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        float most = 0;
        shared.forEach(index,
                       [&](std::uint64_t i)
                       {
                           const Aabb box = loadBox(boxes, i);
                           storeCopy(now, i, box);
                           const float much = displacementOf(loadSkinned(reference, i), box);
                           most = much > most ? much : most;
                       });
        atomicMaxFloat(displacement, most);
        if (!(most <= kMostDisplacement))
            storeSameValue(added, kVoidCount);
    }
};

/// What the boxes of a pair in a new list decide.
struct FirstVerdict
{
    bool isEntering, isHeld;
};

/// @param boxes  boxes with skins
/// @param decide called with the pair and its boxes; returns a FirstVerdict
template <class Decide>
CULLET_HOST_DEVICE NeighbourVerdict classifyFirst(const NeighbourItem& item, const AlignedBox* boxes,
                                                  const Decide& decide)
{
    if (!item.isPair)
        return {};
    const SkinnedBox a = loadSkinned(boxes, item.pair.a);
    const SkinnedBox b = loadSkinned(boxes, item.pair.b);
    const FirstVerdict verdict = decide(item.pair, a.box, b.box);
    return {{item.pair, verdict.isEntering ? kToAdded : 0u}, closenessOf(a, b), verdict.isHeld};
}

/// Tests pair i of a new list for the first time; appends the pairs that enter.
struct BeginNeighbours
{
    NeighbourView neighbours;
    std::uint8_t* isHeld;     ///< [neighbours.room, out]
    const AlignedBox* boxes;  ///< with skins
    WasSeparated wasSeparated;
    std::uint64_t* added;  ///< pairs that enter: void where the list was too short

    CULLET_HOST_DEVICE NeighbourItem read(std::uint64_t i) const { return neighbours.readPair(i); }

    CULLET_HOST_DEVICE NeighbourVerdict operator()(const NeighbourItem& item) const
    {
        return classifyFirst(
            item, boxes,
            [&](RowPair pair, const Aabb& a, const Aabb& b)
            {
                const bool areOverlapping = overlaps(a, b);
                return FirstVerdict{
                    areOverlapping && wasSeparated.preloaded()(pair, [&] { return overlapOf(a, b); }),
                    areOverlapping};
            });
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NeighbourItem& item,
                                 const NeighbourVerdict& verdict) const
    {
        if (i == 0 && *neighbours.count > neighbours.room)
            storeSameValue(added, kVoidCount);
        neighbours.keep(i, item, verdict, isHeld);
    }
};

/// Tests whether pair i is still held, enters or leaves.
struct FollowNeighbours
{
    NeighbourView neighbours;
    const std::uint8_t* wasHeld;
    std::uint8_t* isHeld;  ///< [out]
    const AlignedBox* boxes;
    const std::uint32_t* displacement;  ///< as MeasureDisplacement::displacement

    CULLET_HOST_DEVICE NeighbourItem read(std::uint64_t i) const { return neighbours.read(i, wasHeld); }

    CULLET_HOST_DEVICE NeighbourVerdict operator()(const NeighbourItem& item) const
    {
        return NeighbourVerdict::ofFollowed(item, areOverlapping(item.pair, item.closeness));
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NeighbourItem& item,
                                 const NeighbourVerdict& verdict) const
    {
        if (item.isPair)
            isHeld[i] = verdict.isHeld ? 1 : 0;
    }

private:
    CULLET_HOST_DEVICE bool areOverlapping(RowPair pair, float closeness) const
    {
        const ClosenessTest closenessTest(closeness, decisiveCloseness(floatOf(*displacement)));
        const RowPair asked = closenessTest.rowsToLoad(pair);
        const std::uint64_t a = 2 * std::uint64_t{asked.a}, b = 2 * std::uint64_t{asked.b};
        const bool meet = (int{meets(loadHalf(boxes, a), loadHalf(boxes, b))} &
                           int{meets(loadHalf(boxes, a + 1), loadHalf(boxes, b + 1))}) != 0;
        return closenessTest.isUndecided() ? meet : closenessTest.areOverlapping;
    }
};

/// Size of a box, and how far it has moved.
struct BoxInSample
{
    float side;  ///< longest side; negative: no bounded box
    float distance;
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
        sample[i] = {side < kInfinity ? side : -1.0f, copies.distanceFromOld(k, box)};
    }
};
}  // namespace cullet::psap
