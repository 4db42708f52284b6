// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_hash.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace cullet::test
{
/// Fingerprint of updates of 200,000 bodies. First every third moves: more than a GPU gathers from the table, so that
/// the rest is uploaded in two parts, and fewer than the limit for uploading all boxes. Then all move. Then of every
/// third, and at last of every second, some are created, destroyed or change their filter words instead.
///
/// @param isLockable whether a device can read from the table
inline std::uint64_t scatteredStream(Backend& backend, bool isLockable)
{
    constexpr std::uint32_t kCount = 200000;
    BoxScene scene(SceneKind::Uniform, kCount, 7);
    ProxyTable table;
    for (std::uint32_t body = 0; body < kCount; ++body)
        table.create(scene.boxes()[body], body + 1, kEverything);
    PairStreamHash hash;
    PairDelta delta;
    std::uint32_t nextId = kCount + 1;
    for (std::uint32_t step = 0; step < 8; ++step)
    {
        ProxyView view = table.beginUpdate(0, true);
        view.lockableRows = isLockable ? view.lockableRows : 0;
        EXPECT_EQ(backend.update(view, delta), Status::Ok);
        table.endUpdate();
        EXPECT_GT(delta.added.size(), 0u);
        hash.add(delta);
        const std::uint32_t every = step == 2 ? 1 : step < 6 ? 3 : 2;
        for (std::uint32_t row = step % every; row < kCount; row += every)
        {
            const float way = 0.3f * static_cast<float>(row % 7) - 0.9f;
            if (step < 3 || row % 11 > 2)
                table.setBox(row, translated(table.box(row), way, 0.5f * way, -way));
            else if (row % 11 == 0)
                table.setFilter(row, Filter{2, row % 2 == 0 ? ~2 : -1});
            else if (table.uniqueId(row) != 0 && isValid(table.box(row)))
                table.destroy(row);
            else
                table.create(boxAt(static_cast<float>(row % 64), static_cast<float>(row % 57), 3), nextId++,
                             kEverything);
        }
    }
    return hash.value();
}
}  // namespace cullet::test
