// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/boxes/aabb_simd.h"

#include <cstddef>
#include <vector>

namespace cullet
{
/// How far each face of a box may be from the same face of its reference box while a Verlet list (VerletPairs) holds.
struct Skin
{
    float thickness = 0;

    /// That of boxes at rest.
    static Skin ofMargin(float margin) noexcept { return {0.5f * margin}; }

    bool contains(const Aabb& box, const Aabb& reference) const noexcept
    {
        return isInsideSkin(box, reference, thickness);
    }
    /// By how much a reference box is grown to contain its box: a little more, for the rounding of sums and differences.
    float growth() const noexcept { return 1.0001f * thickness; }
    /// How far apart two reference boxes may be while their boxes can touch: a little more, as above.
    float pairGap() const noexcept { return 2.0002f * thickness; }
    /// Up to which gap of the reference boxes a held pair stays held (overlapsWithMargin()): a little less.
    float persistentGap(float margin) const noexcept { return 1.9999f * margin - pairGap(); }
};

/// The same skin around several boxes.
struct Skins
{
    std::vector<Aabb> references;
    Skin skin;

    bool contain(const Aabb& box, std::size_t index) const noexcept
    {
        return skin.contains(box, references[index]);
    }
};
}  // namespace cullet
