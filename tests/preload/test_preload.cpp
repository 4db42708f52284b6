// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/preload/preload_program.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cullet::test
{
namespace
{
/// Both precisions, by the suffix of their programs.
class PreloadedLibrary : public testing::TestWithParam<std::string>
{
protected:
    std::string plain(const std::string& how) const
    {
        return kFolder + "plain_towers" + GetParam() + " " + how;
    }
    std::string linked(const std::string& how) const
    {
        return kFolder + "linked_towers" + GetParam() + " " + how;
    }
    static std::string hash(const std::string& command) { return run(command).line("hash"); }
};

TEST_P(PreloadedLibrary, GivesTheWorldOfAProgramThatIsLinkedWithCullet)
{
    EXPECT_EQ(hash(kPreloaded + plain("stack")), hash(linked("narrow")));
    EXPECT_EQ(hash(kPreloaded + "CULLET_NARROW=0 " + plain("stack")), hash(linked("broad")));
    EXPECT_NE(hash(linked("broad")), hash(plain("stack"))) << "the hash cannot tell cullet from Bullet";
}

TEST_P(PreloadedLibrary, ReplacesBroadPhaseWhereverProgramAllocatesIt)
{
    const std::string expected = hash(linked("narrow"));
    for (const char* how : {"heap", "memory", "cache", "child"})
        EXPECT_EQ(hash(kPreloaded + plain(how)), expected) << how;
}

TEST_P(PreloadedLibrary, ServesThreadsThatMakeTheirWorldsAtTheSameTime)
{
    EXPECT_EQ(run(kPreloaded + plain("threads")).lines("hash"),
              std::vector<std::string>(4, hash(linked("narrow"))));
}

TEST_P(PreloadedLibrary, LetsTheTowersStandWhereTheyStandWithBullet)
{
    const Output stock = run(plain("stack"));
    for (const char* settings : {"", "CULLET_NARROW=0 ", "CULLET_BACKEND=brute "})
    {
        const Output own = run(kPreloaded + settings + plain("stack"));
        EXPECT_EQ(own.line("touching"), stock.line("touching"));
        EXPECT_EQ(own.line("touching"), "36") << "twelve towers of three boxes on the ground";
        EXPECT_EQ(own.line("rays"), "12");
        const std::vector<std::string> heights = own.lines("height"), stockHeights = stock.lines("height");
        ASSERT_EQ(heights.size(), 36u);
        // Penetration depths at rest depend on the order of the contacts.
        for (std::size_t i = 0; i < heights.size(); ++i)
            EXPECT_NEAR(std::stod(heights[i]), std::stod(stockHeights[i]), 0.01) << settings << i;
    }
}

TEST_P(PreloadedLibrary, LeavesBulletUnchangedWhenDisabled)
{
    const std::string stock = hash(plain("stack"));
    EXPECT_EQ(hash(kPreloaded + "CULLET_DISABLE=1 " + plain("stack")), stock);
    EXPECT_EQ(hash(kPreloaded + "CULLET_BACKEND=dbvt CULLET_NARROW=0 " + plain("stack")), stock);
}

TEST_P(PreloadedLibrary, AnswersCallsThatBypassVirtualTableAsBulletDoes)
{
    const std::string stock = run(plain("direct")).text;
    EXPECT_NE(stock.find("pairs 1\npairs 0\nbounds 0 5\nbox 0 0.5\nid 1"), std::string::npos) << stock;
    EXPECT_EQ(run(kPreloaded + plain("direct")).text, stock);
    EXPECT_EQ(run(kPreloaded + "CULLET_DISABLE=1 " + plain("direct")).text, stock);
}

TEST_P(PreloadedLibrary, LeavesDerivedClassesToBulletWithMessage)
{
    const Output output = run(kPreloaded + "CULLET_NARROW=0 " + plain("derived"));
    EXPECT_TRUE(output.has("derived from btDbvtBroadphase keeps Bullet's own")) << output.text;
    EXPECT_EQ(output.line("hash"), hash(plain("derived")));
}

TEST_P(PreloadedLibrary, LeavesTreeInsideAxisSweepAlone)
{
    const Output output = run(kPreloaded + "CULLET_NARROW=0 CULLET_STATS=1 " + plain("sweep"));
    EXPECT_EQ(output.line("hash"), hash(plain("sweep")));
    EXPECT_TRUE(output.has("broad phases: 0")) << output.text;
}

TEST_P(PreloadedLibrary, WarnsOfPairCacheThatItDoesNotFill)
{
    const Output output = run(kPreloaded + plain("foreign"));
    EXPECT_TRUE(output.has("another pair cache")) << output.text;
}

TEST_P(PreloadedLibrary, FillsThePublicTreesWhenAskedTo)
{
    EXPECT_EQ(run(plain("stack")).line("leaves"), "37");
    EXPECT_EQ(run(kPreloaded + plain("stack")).line("leaves"), "0");
    const Output filled = run(kPreloaded + "CULLET_TREES=1 " + plain("stack"));
    EXPECT_EQ(filled.line("leaves"), "37");
    EXPECT_EQ(filled.line("hash"), hash(linked("narrow")));
}

TEST_P(PreloadedLibrary, FillsThePublicTreesForProgramsThatNameTheirFunctions)
{
    const std::string walker = kFolder + "tree_walker" + GetParam();
    EXPECT_EQ(run(walker).line("found"), "3 1 3");
    EXPECT_EQ(run(kPreloaded + walker).line("found"), "3 1 3");
    EXPECT_EQ(run(kPreloaded + "CULLET_TREES=0 " + walker).line("found"), "0 0 0");
}

TEST_P(PreloadedLibrary, NamesTheBackendsWhenItDoesNotKnowOne)
{
    const Output output = run(kPreloaded + "CULLET_BACKEND=quadtree " + plain("stack"));
    EXPECT_TRUE(output.has("CULLET_BACKEND=quadtree")) << output.text;
    EXPECT_TRUE(output.has("auto grid cuda brute dbvt")) << output.text;
    EXPECT_EQ(output.line("hash"), hash(linked("narrow")));
}

TEST_P(PreloadedLibrary, ReportsSettingsThatItDoesNotUnderstand)
{
    const Output output = run(kPreloaded + "CULLET_NARROW=x CULLET_TREES=7 CULLET_STATS= " + plain("stack"));
    EXPECT_TRUE(output.has("CULLET_NARROW=x: 0 or 1 expected")) << output.text;
    EXPECT_TRUE(output.has("CULLET_TREES=7: 0 or 1 expected")) << output.text;
    EXPECT_FALSE(output.has("CULLET_STATS")) << output.text;
    EXPECT_EQ(output.line("hash"), hash(linked("narrow")));
}

TEST_P(PreloadedLibrary, LimitsThePointsOfAPatchWhenAskedTo)
{
    const std::string four = hash(linked("narrow"));
    const std::string one = hash(linked("one-point"));
    EXPECT_NE(one, four) << "the hash cannot tell the option";
    EXPECT_EQ(hash(kPreloaded + "CULLET_PATCH_POINTS=1 " + plain("stack")), one);
    EXPECT_EQ(hash(kPreloaded + "CULLET_PATCH_POINTS=4 " + plain("stack")), four);
    for (const std::string value : {"0", "5", "12", "-1", "two"})
    {
        const Output output = run(kPreloaded + "CULLET_PATCH_POINTS=" + value + " " + plain("stack"));
        EXPECT_TRUE(output.has("CULLET_PATCH_POINTS=" + value + ": 1 to 4 expected")) << output.text;
        EXPECT_EQ(output.line("hash"), four) << value;
    }
}

TEST_P(PreloadedLibrary, KeepsContactsWhenAskedTo)
{
    const std::string without = hash(linked("narrow"));
    const std::string with = hash(linked("keeping"));
    EXPECT_NE(with, without) << "the hash cannot tell the option";
    EXPECT_EQ(hash(kPreloaded + "CULLET_REUSE_POSE=0.002 " + plain("stack")), with);
    EXPECT_EQ(hash(kPreloaded + "CULLET_REUSE_POSE=0 " + plain("stack")), without);
    for (const std::string value : {"-1", "2", "far", "0.1m", "nan"})
    {
        const Output output = run(kPreloaded + "CULLET_REUSE_POSE=" + value + " " + plain("stack"));
        EXPECT_TRUE(output.has("CULLET_REUSE_POSE=" + value + ": 0 to 1 expected")) << output.text;
        EXPECT_EQ(output.line("hash"), without) << value;
    }
}

TEST_P(PreloadedLibrary, LeavesBoxesToBulletWhenAskedTo)
{
    const std::string own = hash(linked("narrow")), bullets = hash(linked("bullets-boxes"));
    EXPECT_NE(own, bullets) << "the hash cannot tell the option";
    EXPECT_EQ(hash(kPreloaded + "CULLET_BOXES=0 " + plain("stack")), bullets);
    EXPECT_EQ(hash(kPreloaded + "CULLET_BOXES=1 " + plain("stack")), own);
    const Output output = run(kPreloaded + "CULLET_BOXES=2 " + plain("stack"));
    EXPECT_TRUE(output.has("CULLET_BOXES=2: 0 or 1 expected")) << output.text;
    EXPECT_EQ(output.line("hash"), own);
}

TEST_P(PreloadedLibrary, RefusesUnknownChoicesOfTheLoopOverTriangles)
{
    const std::string own = hash(linked("narrow"));
    EXPECT_EQ(hash(kPreloaded + "CULLET_MESHES=0 " + plain("stack")), own);
    const Output output = run(kPreloaded + "CULLET_MESHES=2 " + plain("stack"));
    EXPECT_TRUE(output.has("CULLET_MESHES=2: 0 or 1 expected")) << output.text;
    EXPECT_EQ(output.line("hash"), own);
}

TEST_P(PreloadedLibrary, PrintsStatisticsAtExitWhenAskedTo)
{
    const Output output = run(kPreloaded + "CULLET_STATS=1 CULLET_BACKEND=brute " + plain("stack"));
    const std::string precision = GetParam().empty() ? "float" : "double";
    EXPECT_TRUE(output.has("broad phases: 1 (" + precision + ", brute)")) << output.text;
    EXPECT_TRUE(output.has("37 bodies")) << output.text;
    EXPECT_TRUE(output.has("240 updates")) << output.text;
    EXPECT_TRUE(output.has("12 queries")) << output.text;
    EXPECT_TRUE(output.has("ISA-GJK in 1 dispatchers")) << output.text;
    EXPECT_FALSE(run(kPreloaded + plain("stack")).has("cullet[")) << "says nothing unasked";
}

INSTANTIATE_TEST_SUITE_P(Precisions, PreloadedLibrary, testing::Values("", "-float64"),
                         [](const testing::TestParamInfo<std::string>& precision)
                         { return std::string(precision.param.empty() ? "Float" : "Double"); });

TEST(PreloadedLibraryElsewhere, PrintsNothingInProgramsWithoutBullet)
{
    EXPECT_EQ(run(kPreloaded + "CULLET_STATS=1 sh -c 'sh -c \"echo hello\"'").text, "hello\n");
    EXPECT_EQ(run(kPreloaded + "CULLET_STATS=1 " + kFolder + "plugin_host").text, "");
}

TEST(PreloadedLibraryElsewhere, LeavesForeignBulletOfPluginAlone)
{
    const Output output = run(kPreloaded + kFolder + "plugin_host " + kFolder + "foreign_bullet.so " +
                              kFolder + "tower_plugin.so");
    EXPECT_EQ(output.lines("foreign"), std::vector<std::string>(2, "7")) << output.text;
    EXPECT_TRUE(output.has("foreign_bullet.so: not the Bullet library that cullet was built for"))
        << output.text;
    EXPECT_EQ(output.lines("hash").front(), run(kFolder + "linked_towers narrow").line("hash"));
}

TEST(PreloadedLibraryElsewhere, ServesPluginsOfBothPrecisionsInOneProcess)
{
    const std::string host =
        kFolder + "plugin_host " + kFolder + "tower_plugin.so " + kFolder + "tower_plugin-float64.so";
    const Output output = run(kPreloaded + "CULLET_STATS=1 " + host);
    const std::vector<std::string> hashes = output.lines("hash");
    ASSERT_EQ(hashes.size(), 4u) << output.text;
    EXPECT_EQ(hashes[0], run(kFolder + "linked_towers narrow").line("hash"));
    EXPECT_EQ(hashes[1], run(kFolder + "linked_towers-float64 narrow").line("hash"));
    EXPECT_TRUE(output.has("broad phases: 1 (float")) << output.text;
    EXPECT_TRUE(output.has("broad phases: 1 (double")) << output.text;
    // Bullet's own objects, whose functions are resolved by the calling plug-in.
    EXPECT_EQ(run(kPreloaded + "CULLET_BACKEND=dbvt CULLET_NARROW=0 " + host).lines("hash"),
              run(host).lines("hash"));
}
}  // namespace
}  // namespace cullet::test
