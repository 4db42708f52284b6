// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Changes of the scene that must not change the pairs. Cell size, number of buckets, threads, layout and instruction
// set differ between the cases of the suite; scale, position, axes and the order of the rows are varied here.

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kCount = 300;
constexpr int kSteps = 10;
constexpr float kMargin = 0.0625f;

/// A variant of a scene that must give the same deltas.
struct Variant
{
    std::function<Aabb(const Aabb&)> transform = [](const Aabb& box) { return box; };
    float marginScale = 1;
    bool isPermuted = false;  ///< rows in another order, with the same ids
};

/// Coordinates in steps of 1/64 of a scene below 2^7: 13 bits, which leaves 10 for shifts.
Aabb onLattice(const Aabb& box)
{
    Aabb result;
    for (int axis = 0; axis < 3; ++axis)
    {
        result.min[axis] = std::floor(box.min[axis] * 64) / 64;
        result.max[axis] = std::ceil(box.max[axis] * 64) / 64;
    }
    return result;
}

std::vector<PairDelta> deltasOf(Backend& backend, SceneKind kind, const Variant& variant)
{
    BoxScene scene(kind, kCount, 5);
    std::vector<std::uint32_t> order(kCount);
    std::iota(order.begin(), order.end(), 0u);
    Random random(77);
    for (std::uint32_t i = kCount; variant.isPermuted && i > 1; --i)
        std::swap(order[i - 1], order[random.below(i)]);

    ProxyTable table;
    std::vector<ProxyId> rowOf(kCount);
    for (const std::uint32_t body : order)
        rowOf[body] = table.create(variant.transform(onLattice(scene.boxes()[body])), body + 1, kEverything);

    std::vector<PairDelta> deltas(kSteps);
    for (PairDelta& delta : deltas)
    {
        EXPECT_EQ(backend.update(table.beginUpdate(kMargin * variant.marginScale, true), delta), Status::Ok);
        table.endUpdate();
        scene.step();
        for (const std::uint32_t body : scene.moved())
            table.setBox(rowOf[body], variant.transform(onLattice(scene.boxes()[body])));
    }
    return deltas;
}

constexpr SceneKind kScenes[] = {SceneKind::Uniform, SceneKind::ManySizes, SceneKind::MostlyStatic,
                                 SceneKind::Pile, SceneKind::Teleport};

/// The deltas that every backend and variant must give: the deltas of brute force on the plain scene.
const std::vector<PairDelta>& expectedDeltas(SceneKind kind)
{
    static std::map<SceneKind, std::vector<PairDelta>> cache;
    std::vector<PairDelta>& deltas = cache[kind];
    if (deltas.empty())
        deltas = deltasOf(*makeBruteForceBackend(), kind, {});
    return deltas;
}

class BackendMetamorphic : public BackendTest
{
protected:
    void expectSameDeltas(const Variant& variant)
    {
        for (const SceneKind kind : kScenes)
        {
            SCOPED_TRACE(sceneName(kind));
            const std::vector<PairDelta>& expected = expectedDeltas(kind);
            const std::vector<PairDelta> actual = deltasOf(*GetParam().make(), kind, variant);
            std::size_t changes = 0;
            for (int step = 0; step < kSteps; ++step)
            {
                EXPECT_EQ(expected[step].added, actual[step].added) << "step " << step;
                EXPECT_EQ(expected[step].removed, actual[step].removed) << "step " << step;
                changes += step > 0 ? expected[step].added.size() + expected[step].removed.size() : 0;
            }
            EXPECT_GT(expected[0].added.size(), 50u);
            EXPECT_GT(changes, 5u);
        }
    }
};

CULLET_ON_EVERY_BACKEND(BackendMetamorphic);

TEST_P(BackendMetamorphic, ReportsDeltasOfBruteForce)
{
    expectSameDeltas({});
}

TEST_P(BackendMetamorphic, ReportsSameDeltasWhenRowsArePermuted)
{
    Variant variant;
    variant.isPermuted = true;
    expectSameDeltas(variant);
}

TEST_P(BackendMetamorphic, ReportsSameDeltasWhenSceneIsScaledByPowerOfTwo)
{
    for (const float scale : {0x1p-20f, 0x1p-1f, 0x1p+3f, 0x1p+40f})
    {
        SCOPED_TRACE(scale);
        Variant variant;
        variant.marginScale = scale;
        variant.transform = [scale](Aabb box)
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                box.min[axis] *= scale;
                box.max[axis] *= scale;
            }
            return box;
        };
        expectSameDeltas(variant);
    }
}

TEST_P(BackendMetamorphic, ReportsSameDeltasWhenSceneIsShiftedWithoutRounding)
{
    Variant variant;
    variant.transform = [](const Aabb& box) { return translated(box, 4096, -8192, 1.5f); };
    expectSameDeltas(variant);
}

TEST_P(BackendMetamorphic, ReportsSameDeltasWhenAxesArePermuted)
{
    Variant variant;
    variant.transform = [](const Aabb& box) {
        return Aabb{{box.min[2], box.min[0], box.min[1]}, {box.max[2], box.max[0], box.max[1]}};
    };
    expectSameDeltas(variant);
}

TEST_P(BackendMetamorphic, ReportsSameDeltasWhenSceneIsMirrored)
{
    Variant variant;
    variant.transform = [](const Aabb& box) {
        return Aabb{{-box.max[0], -box.max[1], -box.max[2]}, {-box.min[0], -box.min[1], -box.min[2]}};
    };
    expectSameDeltas(variant);
}
}  // namespace
}  // namespace cullet::test
