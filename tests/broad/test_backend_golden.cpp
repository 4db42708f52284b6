// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Fingerprints of the pair streams of fixed scenes, the same for every backend, thread count and machine.
//
// A failure here means that the reported pairs or their updates have changed. If only one backend fails, it is wrong.
// If all fail and only the scene generators changed, or the definition in Backend was changed on purpose, insert the
// new values, and explain each change in the commit. In all other cases a simulation that was reproducible for months
// now runs differently: find the cause instead.

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_hash.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
struct Golden
{
    SceneKind kind;
    float margin;
    std::uint64_t hash;
    std::uint64_t pairs;  ///< held after the last step: if it differs, a number says more than a hash
};

constexpr std::uint32_t kCount = 600;
constexpr int kSteps = 12;

constexpr Golden kGolden[] = {
    {SceneKind::Uniform, 0.0f, 0x3faf19a40596c7e4u, 537},
    {SceneKind::ManySizes, 0.0f, 0xdc3641e5edfa494bu, 2635},
    {SceneKind::MostlyStatic, 0.0f, 0x4550783e41642fdau, 498},
    {SceneKind::Pile, 0.03125f, 0x44762d7329e21b83u, 1938},
    {SceneKind::Teleport, 0.05f, 0x260768370bf8872bu, 582},
};

class BackendGolden : public BackendTest
{
};

CULLET_ON_EVERY_BACKEND(BackendGolden);

TEST_P(BackendGolden, ReproducesRecordedPairStreamHashesOfFixedScenes)
{
    for (const Golden& golden : kGolden)
    {
        SCOPED_TRACE(sceneName(golden.kind));
        const auto backend = GetParam().make();
        BoxScene scene(golden.kind, kCount, 2010);
        ProxyTable table;
        // Every tenth box is static by its filter words: pairs of two static boxes are not reported.
        for (std::uint32_t body = 0; body < kCount; ++body)
            table.create(scene.boxes()[body], body + 1, body % 10 == 0 ? Filter{2, ~2} : kEverything);
        PairStreamHash hash;
        PairDelta delta;
        for (int step = 0; step < kSteps; ++step)
        {
            ASSERT_EQ(backend->update(table.beginUpdate(golden.margin, true), delta), Status::Ok);
            table.endUpdate();
            hash.add(delta);
            scene.step();
            for (const std::uint32_t body : scene.moved())
                table.setBox(body, scene.boxes()[body]);
        }
        EXPECT_EQ(backend->stats().pairs, golden.pairs);
        EXPECT_EQ(hash.value(), golden.hash) << std::hex << "0x" << hash.value() << "u";
    }
}
}  // namespace
}  // namespace cullet::test
