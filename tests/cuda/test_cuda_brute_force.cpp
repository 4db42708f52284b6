// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Up to a million boxes: every search finds the pairs of brute force, which runs on the device, too.

#include "cullet/broad/proxy_table.h"
#include "cullet/demos/scenes/fresh_boxes.h"
#include "cullet/tests/cuda/support/device_boxes.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/cuda/support/pair_sums.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_lists.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// The pairs that a new backend reports for boxes.
PairSum sumOfUpdate(Backend& backend, const std::vector<Aabb>& boxes)
{
    ProxyTable table;
    std::uint32_t nextId = 1;
    for (const Aabb& box : boxes)
        table.create(box, nextId++, kEverything);
    PairDelta delta;
    EXPECT_EQ(backend.update(table.beginUpdate(0, false), delta), Status::Ok);
    table.endUpdate();
    EXPECT_TRUE(delta.removed.empty());
    PairSum sum;
    for (const Pair pair : delta.added)
        sum.add(pair.first - 1, pair.second - 1);
    return sum;
}

/// Two sets of boxes of a scene, and their pairs by brute force.
class CheckedSets
{
public:
    explicit CheckedSets(const FreshScene& scene)
    {
        current.allocate(scene.bodies);
        for (const std::uint64_t seed : {12345u, 12346u})
        {
            sets.push_back(scene.make(scene.bodies, seed));
            show(sets.size() - 1);
            sums.push_back(sumOfBruteForce(current.data(), scene.bodies));
        }
    }

    void show(std::size_t set) { upload(current, sets[set]); }

    std::vector<std::vector<Aabb>> sets;
    std::vector<PairSum> sums;
    DeviceBuffer<Aabb> current;
};

class CudaBruteForce : public testing::TestWithParam<FreshScene>
{
};

TEST_P(CudaBruteForce, FindsSamePairsAsEverySearchAndGrid)
{
    const FreshScene& scene = GetParam();
    CheckedSets checked(scene);
    EXPECT_GT(checked.sums[0].count, scene.bodies / 2);
    EXPECT_FALSE(checked.sums[0] == checked.sums[1]);
    for (std::size_t set = 0; set < checked.sets.size(); ++set)
    {
        EXPECT_EQ(sumOfUpdate(*makeGridBackend(), checked.sets[set]), checked.sums[set]);
        EXPECT_EQ(sumOfUpdate(*makeCudaPsapBackend(), checked.sets[set]), checked.sums[set]);
    }
    for (const NamedOptions& variant : allOrders())
    {
        SCOPED_TRACE(variant.name);
        const auto finder = makeFinder(variant.options);
        ASSERT_NE(finder, nullptr);
        // The first frame makes plans; later ones are recorded, and launched again.
        for (std::size_t frame = 0; frame < 6; ++frame)
        {
            checked.show(frame % 2);
            DevicePairs found;
            ASSERT_EQ(finder->enqueue(checked.current.data(), scene.bodies), Status::Ok);
            ASSERT_EQ(finder->collect(found), Status::Ok);
            ASSERT_EQ(sumOf(found), checked.sums[frame % 2]) << "frame " << frame;
        }
    }
}

std::vector<FreshScene> scenes()
{
    std::vector<FreshScene> all;
    for (const std::uint32_t bodies : {1u << 14, 1u << 17, 1u << 20})
    {
        all.push_back({"W1", bodies, uniformBoxes});
        all.push_back({"W2", bodies, boxesOfManySizes});
        all.push_back({"W3", bodies, heapOfBoxes});
    }
    return all;
}

std::string nameOfScene(const testing::TestParamInfo<FreshScene>& info)
{
    return std::string(info.param.name) + "With" + std::to_string(info.param.bodies);
}
INSTANTIATE_TEST_SUITE_P(Cuda, CudaBruteForce, testing::ValuesIn(scenes()), nameOfScene);

TEST(CudaPairSums, EqualSumOfAllPairsFoundByCpu)
{
    std::vector<Aabb> boxes = uniformBoxes(5001, 3);
    boxes[17] = cube(-kInfinity, kInfinity);
    boxes[4000] = cube(kNan, 1);
    boxes[5000] = cube(200, -200);
    DeviceBuffer<Aabb> onDevice;
    onDevice.allocate(boxes.size());
    upload(onDevice, boxes);
    PairSum expected;
    for (const Pair pair : everyPair(boxes))
        expected.add(pair.first, pair.second);
    ASSERT_GT(expected.count, 8000u);
    EXPECT_EQ(sumOfBruteForce(onDevice.data(), 5001), expected);
    EXPECT_EQ(sumOfUpdate(*makeGridBackend(), boxes), expected);
    const auto finder = makeDevicePairFinder({}, nullptr, nullptr);
    ASSERT_NE(finder, nullptr);
    DevicePairs found;
    ASSERT_EQ(finder->enqueue(onDevice.data(), boxes.size()), Status::Ok);
    ASSERT_EQ(finder->collect(found), Status::Ok);
    EXPECT_EQ(sumOf(found), expected);
}
}  // namespace
}  // namespace cullet::test
