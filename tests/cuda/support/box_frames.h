// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_hash.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <vector>

namespace cullet::test
{
/// The boxes of several frames; a body has the same row in each.
using BoxFrames = std::vector<std::vector<Aabb>>;

inline BoxFrames framesOf(SceneKind kind, std::uint32_t count, int frames)
{
    BoxScene scene(kind, count, 2010);
    BoxFrames boxes = {scene.boxes()};
    for (int frame = 1; frame < frames; ++frame)
    {
        scene.step();
        boxes.push_back(scene.boxes());
    }
    return boxes;
}

/// The reports of a backend over several frames.
struct PairStream
{
    std::uint64_t hash = 0;
    std::uint64_t added = 0;
    std::uint64_t removed = 0;
};

inline bool operator==(const PairStream& a, const PairStream& b)
{
    return a.hash == b.hash && a.added == b.added && a.removed == b.removed;
}

inline void PrintTo(const PairStream& stream, std::ostream* out)
{
    *out << stream.added << " pairs added, " << stream.removed << " removed, " << std::hex << stream.hash
         << std::dec;
}

/// Updates the backend with the frames; bodies of every tenth row do not pair with each other.
inline PairStream follow(Backend& backend, const BoxFrames& frames)
{
    ProxyTable table;
    std::uint32_t nextId = 1;
    for (const Aabb& box : frames[0])
    {
        table.create(box, nextId, nextId % 10 == 1 ? Filter{2, ~2} : kEverything);
        ++nextId;
    }
    PairStream stream;
    PairStreamHash hash;
    PairDelta delta;
    for (const std::vector<Aabb>& boxes : frames)
    {
        for (std::uint32_t body = 0; body < boxes.size(); ++body)
        {
            if (boxes[body] != table.box(body))
                table.setBox(body, boxes[body]);
        }
        EXPECT_EQ(backend.update(table.beginUpdate(0, true), delta), Status::Ok);
        table.endUpdate();
        hash.add(delta);
        stream.added += delta.added.size();
        stream.removed += delta.removed.size();
    }
    stream.hash = hash.value();
    return stream;
}
}  // namespace cullet::test
