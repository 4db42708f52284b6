// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/preload/preload_program.h"

#include <cstdlib>

namespace cullet::test
{
namespace
{
/// Only the solver is cullet's.
const std::string kAlone = kPreloaded + "CULLET_BACKEND=dbvt CULLET_NARROW=0 ";

/// Both precisions, by the suffix of their programs.
class PreloadedSolvers : public testing::TestWithParam<std::string>
{
protected:
    std::string plain(const std::string& how) const
    {
        return kFolder + "plain_solvers" + GetParam() + " " + how;
    }
    Output linked(const std::string& model) const
    {
        return run(kFolder + "linked_solvers" + GetParam() + " " + model + " 30");
    }
};

void expectSameMotion(const Output& a, const Output& b, const std::string& what)
{
    EXPECT_EQ(a.line("hash"), b.line("hash")) << what;
    EXPECT_EQ(a.line("impulses"), b.line("impulses")) << what;
}

TEST_P(PreloadedSolvers, GiveTheBitsOfAProgramThatUsesCulletsSolver)
{
    const Output stock = run(plain("stack"));
    const Output models[] = {linked("bullet"), linked("soft")};
    EXPECT_NE(models[0].line("hash"), stock.line("hash")) << "the hash cannot tell cullet from Bullet";
    EXPECT_NE(models[0].line("hash"), models[1].line("hash")) << "nor the models";
    for (const std::string how : {"stack", "heap", "world"})
    {
        for (const std::string world : {"", "CULLET_WORLD=1 "})
        {
            const Output hard = run(kAlone + world + "CULLET_SOLVER=1 " + plain(how));
            expectSameMotion(hard, models[0], world + how);
            const Output soft = run(kAlone + world + "CULLET_SOLVER=soft " + plain(how));
            expectSameMotion(soft, models[1], world + how);
            EXPECT_EQ(hard.line("kind"), stock.line("kind")) << how;
            EXPECT_NE(hard.line("type"), stock.line("type")) << how;
            EXPECT_FALSE(hard.has("cullet[")) << "says nothing unasked: " << hard.text;
        }
    }
}

TEST_P(PreloadedSolvers, GetAllGroupsOfAStepAtOnceFromPreloadedWorlds)
{
    const std::string how = "CULLET_SOLVER=1 CULLET_STATS=1 " + plain("stack 200");
    const Output bullets = run(kAlone + how), own = run(kAlone + "CULLET_WORLD=1 " + how);
    EXPECT_TRUE(bullets.has("solvers: 1; at most 1 groups")) << "group by group:\n" << bullets.text;
    EXPECT_TRUE(own.has("solvers: 1; at most ")) << own.text;
    EXPECT_FALSE(own.has("at most 1 groups")) << own.text;
    EXPECT_TRUE(own.has(" 30 joints solved last, and 0 groups left to Bullet")) << own.text;
    expectSameMotion(own, bullets, "200 towers");
}

TEST_P(PreloadedSolvers, AreBulletsUnlessTheyAreAskedFor)
{
    const Output stock = run(plain("stack 4"));
    for (const char* setting :
         {"", "CULLET_SOLVER= ", "CULLET_SOLVER=0 ", "CULLET_SOLVER=1 CULLET_DISABLE=1 "})
    {
        const Output with = run(kAlone + setting + plain("stack 4"));
        EXPECT_EQ(with.text, stock.text) << setting;
    }
}

TEST_P(PreloadedSolvers, LeaveDerivedClassesToBulletWithMessage)
{
    for (const std::string how : {"derived", "nncg", "mt", "multi-body"})
    {
        const Output own = run(kAlone + "CULLET_SOLVER=1 CULLET_STATS=1 " + plain(how)),
                     stock = run(plain(how));
        EXPECT_TRUE(
            own.has("CULLET_SOLVER: a class derived from btSequentialImpulseConstraintSolver keeps "
                    "Bullet's own solver"))
            << how << own.text;
        EXPECT_TRUE(own.has("solvers: 0")) << how << own.text;
        expectSameMotion(own, stock, how);
        EXPECT_EQ(own.line("type"), stock.line("type")) << how;
        EXPECT_FALSE(run(kAlone + plain(how)).has("cullet[")) << how;
    }
    EXPECT_EQ(run(kAlone + "CULLET_SOLVER=1 " + plain("derived")).line("steps"), "60");
}

TEST_P(PreloadedSolvers, FreeWhatTheyKeepBesideTheSolver)
{
    // What one of 50 solvers keeps is more than a hundred bytes.
    const Output output = run(kAlone + "CULLET_SOLVER=1 CULLET_STATS=1 " + plain("many"));
    EXPECT_TRUE(output.has("solvers: 100")) << output.text;
    EXPECT_LT(std::stol(output.line("left")), 4000) << output.text;
}

TEST_P(PreloadedSolvers, ServeThreadsThatMakeTheirSolversAtTheSameTime)
{
    const Output output = run(kAlone + "CULLET_SOLVER=1 CULLET_WORLD=1 CULLET_STATS=1 " + plain("threads"));
    EXPECT_EQ(output.lines("hash"), std::vector<std::string>(4, linked("bullet").line("hash")));
    EXPECT_TRUE(output.has("solvers: 4")) << output.text;
}

TEST_P(PreloadedSolvers, ReportASettingThatIsNotUnderstood)
{
    const Output output = run(kAlone + "CULLET_SOLVER=hard " + plain("stack 4"));
    EXPECT_TRUE(output.has("CULLET_SOLVER=hard: 0, 1 or soft expected; it is ignored")) << output.text;
    EXPECT_EQ(output.line("hash"), run(plain("stack 4")).line("hash"));
}

INSTANTIATE_TEST_SUITE_P(Precisions, PreloadedSolvers, testing::Values("", "-float64"),
                         [](const testing::TestParamInfo<std::string>& precision)
                         { return std::string(precision.param.empty() ? "Float" : "Double"); });
}  // namespace
}  // namespace cullet::test
