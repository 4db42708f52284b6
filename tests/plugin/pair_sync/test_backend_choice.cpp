// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/log.h"
#include "cullet/plugin/pair_sync/backend_choice.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/pair_sync/fake_backends.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kDeviceBodies = 100;
constexpr int kPatience = BackendChooser::kSwitchDelay;

/// A chooser between backends that count their input.
class Choice
{
public:
    Choice() : begin(makeBruteForceBackend()), chooser(*begin, kDeviceBodies, small(), large()) {}

    BackendChooser::Make small()
    {
        return [this] { return std::make_unique<CountingBackend>(traffic[0]); };
    }
    BackendChooser::Make large()
    {
        return [this]() -> std::unique_ptr<Backend>
        {
            ++largeAsked;
            return hasDevice ? std::make_unique<CountingBackend>(traffic[1]) : nullptr;
        };
    }

    /// Runs at most `most` updates until a backend takes over; returns their number, or 0.
    int updatesUntilSwitch(std::uint32_t bodies, int most)
    {
        for (int update = 1; update <= most; ++update)
        {
            if (std::unique_ptr<Backend> next = chooser.choose(*begin, bodies))
            {
                begin = std::move(next);
                return update;
            }
        }
        return 0;
    }

    Traffic traffic[2];
    bool hasDevice = true;
    int largeAsked = 0;
    std::unique_ptr<Backend> begin;
    BackendChooser chooser;
};

TEST(BackendChoice, SwitchesToDeviceWhenWorldGrowsAndBackBelowHalf)
{
    Choice choice;
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies - 1, 50), 0);
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies, 50), kPatience);
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies / 2, 50), 0) << "between the two sizes nothing changes";
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies / 2 - 1, 50), kPatience);
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies - 1, 50), 0);
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies, 50), kPatience) << "as often as it takes";
    EXPECT_EQ(choice.largeAsked, 2);
}

TEST(BackendChoice, DoesNotSwitchOnShortPeaks)
{
    Choice choice;
    for (int peak = 0; peak < 10; ++peak)
    {
        EXPECT_EQ(choice.updatesUntilSwitch(10 * kDeviceBodies, kPatience - 1), 0);
        EXPECT_EQ(choice.updatesUntilSwitch(1, 1), 0);
    }
}

TEST(BackendChoice, TriesDeviceOnlyOnceWhenThereIsNone)
{
    Choice choice;
    choice.hasDevice = false;
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies, 100), 0);
    EXPECT_EQ(choice.largeAsked, 1);
}

TEST(BackendChoice, KeepsBackendThatItDidNotMake)
{
    Choice choice;
    ASSERT_EQ(choice.updatesUntilSwitch(kDeviceBodies, kPatience), kPatience);
    choice.begin = makeGridBackend();  // as after a failure
    EXPECT_EQ(choice.updatesUntilSwitch(1, 50), 0);
    EXPECT_EQ(choice.updatesUntilSwitch(kDeviceBodies, 50), 0);
    EXPECT_EQ(choice.largeAsked, 1);
}

TEST(BackendChoice, KeepsBackendOfApplicationAtAddressOfFirstOne)
{
    static int asked = 0;
    asked = 0;
    setLogFunction([](LogLevel, const char* message)
                   { asked += std::strstr(message, "no CUDA backend") != nullptr ? 1 : 0; });
    BroadphaseOptions options;
    options.deviceBodies = 1;
    Broadphase broadphase(options);
    addCube(broadphase, vec(0, 0, 0));
    // Each backend is created before its predecessor is destroyed, so that the second one after may have its address.
    for (int i = 0; i < 4; ++i)
    {
        broadphase.setBackend(makeGridBackend());
        EXPECT_EQ(broadphase.stats().restartsTotal, 0u);
    }
    for (int update = 0; update < 2 * kPatience; ++update)
        broadphase.calculateOverlappingPairs(nullptr);
    setLogFunction(nullptr);
    EXPECT_EQ(asked, 0);
    EXPECT_STREQ(broadphase.stats().backendName, "grid");
}

TEST(BackendChoice, KeepsPairsWhenBackendChanges)
{
    Choice choice;
    Broadphase broadphase(makeBruteForceBackend());
    choice.chooser = BackendChooser(broadphase.backend(), kDeviceBodies, choice.small(), choice.large());
    std::vector<btBroadphaseProxy*> proxies;
    int switches = 0;
    // Grows to twice the size and shrinks again, one body per update in a row of touching cubes.
    for (int update = 0; update < 400; ++update)
    {
        if (update < 200)
        {
            proxies.push_back(addCube(broadphase, vec(0.9 * update, 0, 0)));
        }
        else
        {
            broadphase.destroyProxy(proxies.back(), nullptr);
            proxies.pop_back();
        }
        if (std::unique_ptr<Backend> next =
                choice.chooser.choose(broadphase.backend(), broadphase.stats().bodies))
        {
            broadphase.setBackend(std::move(next));
            ++switches;
        }
        broadphase.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(broadphase.stats().pairs, proxies.empty() ? 0 : proxies.size() - 1) << update;
    }
    EXPECT_EQ(switches, 2);
    EXPECT_GT(choice.traffic[1].updates, 100u);
    EXPECT_EQ(choice.traffic[1].restarts, 1u);
    EXPECT_EQ(choice.traffic[0].restarts, 1u);
}

TEST(BackendChoice, TakesFirstBackendFromOptions)
{
    BroadphaseOptions options;
    EXPECT_STREQ(makeBackend(options)->name(), makeGridBackend()->name());
    EXPECT_STREQ(makeBestBackend(options, options.deviceBodies - 1)->name(), makeGridBackend()->name());
    const bool hasDevice = makeCudaPsapBackend() != nullptr;
    const char* best = hasDevice ? "cuda" : makeGridBackend()->name();
    EXPECT_STREQ(makeBestBackend(options, options.deviceBodies)->name(), best);
    options.deviceBodies = 0;
    EXPECT_STREQ(makeBackend(options)->name(), best);
}
}  // namespace
}  // namespace cullet::test
