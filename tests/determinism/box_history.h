// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_hash.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cullet::test
{
inline constexpr SceneKind kBoxScenes[] = {SceneKind::Uniform, SceneKind::ManySizes, SceneKind::MostlyStatic,
                                           SceneKind::Pile, SceneKind::Teleport};
inline constexpr std::uint32_t kHistoryBoxes = 700;

/// Hashes of the changes that a backend reports: after each step, of all steps so far.
///
/// @param order position -> number of the box, whose id is the number + 1; empty: as numbered
inline std::vector<std::uint64_t> boxHistory(Backend& backend, SceneKind kind,
                                             std::vector<std::size_t> order = {})
{
    constexpr int kSteps = 14;
    constexpr float kMargin = 0.03125f;
    if (order.empty())
    {
        order.resize(kHistoryBoxes);
        std::iota(order.begin(), order.end(), std::size_t{0});
    }
    BoxScene scene(kind, kHistoryBoxes, 20261126);
    ProxyTable table;
    std::vector<ProxyId> rows(kHistoryBoxes);
    for (const std::size_t box : order)
        rows[box] = table.create(scene.boxes()[box], static_cast<std::uint32_t>(box) + 1,
                                 box % 10 == 0 ? Filter{2, ~2} : kEverything);
    PairStreamHash hash;
    PairDelta delta;
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < kSteps; ++step)
    {
        EXPECT_EQ(backend.update(table.beginUpdate(kMargin, true), delta), Status::Ok);
        table.endUpdate();
        hash.add(delta);
        hashes.push_back(hash.value());
        scene.step();
        for (const std::uint32_t box : scene.moved())
            table.setBox(rows[box], scene.boxes()[box]);
    }
    EXPECT_GT(backend.stats().pairs, 300u);
    return hashes;
}
}  // namespace cullet::test
