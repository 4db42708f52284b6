// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/preload/preload_program.h"

#include <cstdlib>
#include <thread>

namespace cullet::test
{
namespace
{
constexpr const char* kKinds[] = {"heap", "stack", "simple", "multi-body"};

/// Both precisions, by the suffix of their programs.
class PreloadedWorlds : public testing::TestWithParam<std::string>
{
protected:
    std::string plain(const std::string& how) const
    {
        return kFolder + "plain_worlds" + GetParam() + " " + how;
    }

    Output runWithWorld(const std::string& how) const
    {
        return run(kPreloaded + "CULLET_WORLD=1 CULLET_STATS=1 " + plain(how));
    }
};

TEST_P(PreloadedWorlds, GiveTheBitsOfBulletsWorldsOnSeveralThreads)
{
    for (const std::string how : kKinds)
    {
        const Output with = runWithWorld(how), without = run(kPreloaded + plain(how)),
                     stock = run(plain(how));
        EXPECT_EQ(with.line("hash"), without.line("hash")) << how;
        EXPECT_TRUE(with.has("worlds: 1; at most ")) << how << ":\n" << with.text;
        EXPECT_NE(with.line("type"), stock.line("type")) << how << " is Bullet's own";
        EXPECT_EQ(with.line("discrete"), stock.line("discrete")) << how;
        const Output alone =
            run(kPreloaded + "CULLET_WORLD=1 CULLET_BACKEND=dbvt CULLET_NARROW=0 " + plain(how));
        EXPECT_EQ(alone.line("hash"), stock.line("hash")) << how;
        EXPECT_NE(alone.line("type"), stock.line("type")) << how << " is Bullet's own";
        EXPECT_FALSE(alone.has("cullet[")) << "says nothing unasked: " << alone.text;
    }
}

TEST_P(PreloadedWorlds, GiveTheBitsOfBulletsLargeWorld)
{
    const std::string how = "heap 8000";
    const Output with = runWithWorld(how);
    EXPECT_EQ(with.line("hash"), run(kPreloaded + plain(how)).line("hash"));
    // On one thread the boxes are set as by Bullet.
    if (std::thread::hardware_concurrency() > 1)
    {
        EXPECT_TRUE(with.has("worlds: 1; at most 800")) << with.text;
    }
}

TEST_P(PreloadedWorlds, AreBulletsUnlessTheyAreAskedFor)
{
    for (const std::string kind : kKinds)
    {
        const std::string how = kind + " 10", stock = run(plain(how)).line("type");
        for (const char* setting :
             {"", "CULLET_WORLD= ", "CULLET_WORLD=0 ", "CULLET_WORLD=1 CULLET_DISABLE=1 "})
            EXPECT_EQ(run(kPreloaded + setting + plain(how)).line("type"), stock) << how << " " << setting;
    }
}

TEST_P(PreloadedWorlds, LeaveDerivedClassesToBulletWithMessage)
{
    for (const std::string how : {"derived", "mt"})
    {
        const Output own = runWithWorld(how), other = run(kPreloaded + plain(how));
        EXPECT_TRUE(
            own.has("CULLET_WORLD=1: a class derived from btDiscreteDynamicsWorld keeps Bullet's own"))
            << own.text;
        EXPECT_TRUE(own.has("worlds: 0")) << own.text;
        EXPECT_EQ(own.line("hash"), other.line("hash"));
        EXPECT_EQ(own.line("type"), other.line("type"));
        EXPECT_FALSE(other.has("cullet[")) << other.text;
    }
    EXPECT_EQ(runWithWorld("derived").line("steps"), "40");
}

TEST_P(PreloadedWorlds, FreeWhatTheyKeepBesideTheWorld)
{
    // What one of 50 worlds keeps is more than a hundred bytes.
    const Output output = runWithWorld("many");
    EXPECT_TRUE(output.has("worlds: 100")) << output.text;
    EXPECT_LT(std::stol(output.line("left")), 4000) << output.text;
}

TEST_P(PreloadedWorlds, ServeThreadsThatMakeTheirWorldsAtTheSameTime)
{
    const Output output = runWithWorld("threads");
    EXPECT_EQ(output.lines("hash"),
              std::vector<std::string>(4, run(kPreloaded + plain("stack")).line("hash")));
    EXPECT_TRUE(output.has("worlds: 4")) << output.text;
}

TEST_P(PreloadedWorlds, ReportASettingThatIsNotUnderstood)
{
    const Output output = run(kPreloaded + "CULLET_WORLD=yes " + plain("stack 10"));
    EXPECT_TRUE(output.has("CULLET_WORLD=yes: 0 or 1 expected; it is ignored")) << output.text;
    EXPECT_EQ(output.line("type"), run(plain("stack 10")).line("type"));
}

INSTANTIATE_TEST_SUITE_P(Precisions, PreloadedWorlds, testing::Values("", "-float64"),
                         [](const testing::TestParamInfo<std::string>& precision)
                         { return std::string(precision.param.empty() ? "Float" : "Double"); });

TEST(PreloadedWorldsElsewhere, ServePluginsOfBothPrecisionsInOneProcess)
{
    const std::string host =
        kFolder + "plugin_host " + kFolder + "tower_plugin.so " + kFolder + "tower_plugin-float64.so";
    const Output with = run(kPreloaded + "CULLET_WORLD=1 CULLET_STATS=1 " + host);
    EXPECT_EQ(with.lines("hash"), run(kPreloaded + host).lines("hash"));
    const std::string text = with.text;
    const std::size_t first = text.find("worlds: 2;");
    EXPECT_NE(first, std::string::npos) << text;
    EXPECT_NE(text.find("worlds: 2;", first + 1), std::string::npos) << "of the other precision: " << text;
}
}  // namespace
}  // namespace cullet::test
