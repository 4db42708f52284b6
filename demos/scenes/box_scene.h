// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace cullet
{
struct BoxSceneOptions
{
    std::uint32_t bodies = 65536;
    /// Initial rows along a Morton curve instead of in random order. Trees profit from it, so a fair comparison shows
    /// both.
    bool sortedIds = false;
    std::uint64_t seed = 12345;
};

/// A sequence of frames of float boxes without physics: input for a broad phase.
///
/// Deterministic: the same options give the same boxes on every machine. Row = position in boxes(), for the whole
/// life of the scene.
class BoxScene
{
public:
    virtual ~BoxScene() = default;

    /// The boxes of the current frame; before the first step(), the initial ones.
    const std::vector<Aabb>& boxes() const noexcept { return m_boxes; }

    /// Rows that the last step() moved, ascending; empty before the first.
    const std::vector<std::uint32_t>& moved() const noexcept { return m_moved; }

    /// Advances to the next frame. O(moved bodies).
    virtual void step() = 0;

protected:
    std::vector<Aabb> m_boxes;
    std::vector<std::uint32_t> m_moved;
};

struct BoxSceneInfo
{
    const char* name;
    const char* summary;
    std::unique_ptr<BoxScene> (*make)(const BoxSceneOptions&);
};

/// Every scene, in reading order.
const std::vector<BoxSceneInfo>& boxScenes();

/// The scene of that name (case matters), or null.
const BoxSceneInfo* findBoxScene(std::string_view name);
}  // namespace cullet
