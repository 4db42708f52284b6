// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/program.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

namespace cullet
{
namespace
{
using Row = std::map<std::string, std::string>;

std::vector<std::string> split(const std::string& line)
{
    std::vector<std::string> fields;
    std::stringstream stream(line);
    for (std::string field; std::getline(stream, field, ',');)
        fields.push_back(field);
    return fields;
}

/// Rows of a CSV file without quoted fields.
std::vector<Row> readCsv(const std::string& path)
{
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    const std::vector<std::string> columns = split(line);
    std::vector<Row> rows;
    while (std::getline(file, line))
    {
        const std::vector<std::string> fields = split(line);
        Row row;
        for (std::size_t i = 0; i < columns.size(); ++i)
            row[columns[i]] = i < fields.size() ? fields[i] : "";
        rows.push_back(row);
    }
    return rows;
}

double number(const Row& row, const std::string& column)
{
    return std::stod(row.at(column));
}

bool hasMatplotlib()
{
    return runShell("/usr/bin/python3 -c 'import matplotlib'").code == 0;
}

/// A debug build refuses to measure, so little can be tested in it.
class FigureCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }

    void TearDown() override
    {
        std::filesystem::remove_all(m_folder);
    }

    Outcome run(const std::string& arguments, const std::string& environment = "") const
    {
        return runShell(environment + " " + CULLET_PROGRAM + " figure " + arguments + " --out " + m_folder);
    }

    std::vector<Row> rows(const std::string& name) const
    {
        return readCsv(m_folder + "/" + name + ".csv");
    }

    std::string m_folder = temporaryPath("figures");
};

TEST_F(FigureCommand, ComparesThesisCellsWithOursInFigure10)
{
    const Outcome outcome = run("10 --quick --no-plots --bodies 500,1000");
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::map<std::string, std::set<std::string>> hashes, backends;
    for (const Row& row : rows("figure10"))
    {
        const std::string bodies = row.at("bodies");
        EXPECT_EQ(row.at("scene"), "W1");
        EXPECT_GT(number(row, "pairs"), 0.7 * number(row, "bodies"));
        EXPECT_GT(number(row, "median_ms"), 0.0);
        EXPECT_EQ(row.at("checked_against"), "exact");
        hashes[bodies].insert(row.at("hash"));
        backends[bodies].insert(row.at("backend"));
    }
    ASSERT_EQ(hashes.size(), 2u);
    for (const auto& [bodies, found] : hashes)
    {
        EXPECT_EQ(found.size(), 1u) << bodies;
        for (const char* backend : {"psap-thesis", "psap-literal", "psap", "grid"})
            EXPECT_EQ(backends[bodies].count(backend), 1u) << backend;
    }
    // 500 bodies in a cube of side 25.2, half a box beyond on each side: 9 cells of 3 and less across.
    EXPECT_EQ(backends["500"].count("psap-cells:81"), 1u) << outcome.output;
}

TEST_F(FigureCommand, MeasuresEverySupportSearchOnEveryShapeInFigure11)
{
    const Outcome outcome = run("11 --quick --no-plots");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, std::set<std::string>> searches;
    for (const Row& row : rows("figure11"))
    {
        if (row.at("scene") == "regular")
            continue;
        searches[row.at("scene") + " " + row.at("regime")].insert(row.at("support"));
        EXPECT_EQ(row.at("wrong"), "0");
        EXPECT_GT(number(row, "ns_per_query"), 0.0);
        EXPECT_EQ(row.at("temperature"), "cold");
    }
    EXPECT_EQ(searches.size(), 8u) << "four shapes, separated and overlapping";
    for (const auto& [shape, found] : searches)
        EXPECT_EQ(found,
                  (std::set<std::string>{"automatic", "climb", "climb-artificial", "cubemap", "linear"}))
            << shape;
}

TEST_F(FigureCommand, ComparesTestsAtLeavesOnTheSamePairsInMidphase)
{
    const Outcome outcome = run("midphase --quick --no-plots");
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::map<std::string, std::set<std::string>> pairs, names;
    for (const Row& row : rows("midphase"))
    {
        if (row.at("benchmark") == "midphase.size")
            continue;
        const std::string scene = row.at("scene"), name = row.at("backend");
        pairs[scene].insert(row.at("pairs"));
        EXPECT_GT(number(row, "pairs"), 50.0);
        if (row.at("benchmark") != "midphase.leaf")
            continue;
        names[scene].insert(name);
        EXPECT_GT(number(row, "ns_per_pair"), 0.0);
        EXPECT_GT(number(row, "crossing_share"), 0.01) << scene << " " << name;
        // Triangles inside of a hull are seen by searches only; Bullet's has no depth solver.
        if (name.find("gjk") != std::string::npos || (scene == "bumps" && name.find("triangle") == 0))
        {
            EXPECT_EQ(row.at("disagreeing"), "0") << scene << " " << name;
        }
    }
    ASSERT_EQ(pairs.size(), 3u);
    for (const auto& [scene, found] : pairs)
    {
        EXPECT_EQ(found.size(), 1u) << scene;
        EXPECT_EQ(names[scene].size(), 8u) << scene;
    }
}

TEST_F(FigureCommand, FindsSamePairsWithEachTreeInMidphase)
{
    const Outcome outcome = run("midphase --quick --no-plots --bodies 500,2000");
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::map<std::string, std::set<std::string>> hashes, names;
    for (const Row& row : rows("midphase"))
    {
        if (row.at("benchmark") != "midphase.size")
            continue;
        hashes[row.at("bodies")].insert(row.at("hash"));
        names[row.at("bodies")].insert(row.at("backend"));
        EXPECT_GT(number(row, "pairs"), 100.0);
        EXPECT_GT(number(row, "median_ms"), 0.0);
    }
    ASSERT_EQ(hashes.size(), 2u);
    for (const auto& [triangles, found] : hashes)
    {
        EXPECT_EQ(found.size(), 1u) << triangles;
        // Two more where a device answers.
        EXPECT_TRUE(names[triangles].size() == 3 || names[triangles].size() == 5) << triangles;
    }
}

TEST_F(FigureCommand, CountsPairsOfBruteForceNearExpectationInFigure12)
{
    const Outcome outcome = run("12 --no-plots --bodies 300,3000 --seed 3");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, std::set<std::string>> hashes;
    const std::vector<Row> found = rows("figure12");
    ASSERT_EQ(found.size(), 8u);
    for (const Row& row : found)
    {
        // The seed is fixed; four samples of a distribution near the normal one.
        EXPECT_LT(std::abs(number(row, "deviations")), 3.0) << row.at("scene") << row.at("bodies");
        hashes[row.at("scene") + row.at("bodies")].insert(row.at("hash"));
    }
    EXPECT_EQ(hashes.size(), 4u);
    for (const auto& [which, values] : hashes)
        EXPECT_EQ(values.size(), 1u) << which;
    // By the formula of both uniform distributions: N^2 / 2 times (1 - (1 - 2 / L)^2)^3 with L^3 = 32 N.
    EXPECT_NEAR(number(found.front(), "expected_pairs"), 258.75, 0.01);
}

TEST_F(FigureCommand, FindsSameTouchingPairsWithBothSystemsInFigure13)
{
    const Outcome outcome = run("13 --quick --no-plots --bodies 1000");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::set<std::string> hashes, kinds;
    for (const Row& row : rows("figure13"))
    {
        hashes.insert(row.at("hash"));
        kinds.insert(row.at("system") + " " + row.at("benchmark"));
        EXPECT_GT(number(row, "median_ms"), 0.0);
        // Spheres touch in about half of the cases in which their boxes do: pi / 6.
        EXPECT_NEAR(number(row, "touching_pairs") / number(row, "pairs"), 0.5, 0.1);
    }
    EXPECT_EQ(hashes.size(), 1u);
    for (const char* kind : {"thesis figure13.broad", "thesis figure13.narrow", "cullet figure13.broad",
                             "cullet figure13.narrow"})
        EXPECT_EQ(kinds.count(kind), 1u) << kind;
}

TEST_F(FigureCommand, WritesRowsOfCellSizeScalingCrossoverThreadsAndPhases)
{
    const Outcome outcome =
        run("cell-size scaling crossover threads phases --quick --no-plots --bodies 250,1000");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::set<std::string> edges;
    std::map<std::string, double> fullestCells;
    for (const Row& row : rows("cell-size"))
    {
        if (row.at("scene") == "W1")
            edges.insert(row.at("cell_edge"));
        if (row.at("backend") == "legrand" && row.at("bodies") == "1000")
            fullestCells[row.at("scene")] = number(row, "most_tests");
    }
    EXPECT_EQ(edges.size(), 10u) << "nine widths, and none where the width is automatic";
    EXPECT_EQ(fullestCells.size(), 3u);
    EXPECT_GT(fullestCells["W2"], 10 * fullestCells["W1"]) << "cells as large as the largest box";
    std::set<std::string> exponents;
    for (const Row& row : rows("scaling"))
    {
        exponents.insert(row.at("exponent"));
        EXPECT_GT(number(row, "exponent"), 0.0);
        EXPECT_LT(number(row, "exponent"), 5.0);
    }
    EXPECT_EQ(exponents.size(), 4u) << "the grid alone and through Bullet, DBVT, and DBVT deferred";
    std::set<std::string> scenes;
    for (const Row& row : rows("crossover"))
        scenes.insert(row.at("scene"));
    EXPECT_EQ(scenes, (std::set<std::string>{"W1", "W3fresh"}));
    EXPECT_GE(rows("threads").size(), 6u);
    std::set<std::string> worlds;
    for (const Row& row : rows("phases"))
        worlds.insert(row.at("scene") + row.at("backend") + row.at("narrow"));
    EXPECT_EQ(worlds.size(), 8u);
}

TEST_F(FigureCommand, DrawsSvgAndPngOrSaysHowToGetThem)
{
    const Outcome outcome = run("10 12 13 crossover --quick --bodies 200,400");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    if (!hasMatplotlib())
    {
        EXPECT_TRUE(contains(outcome.errors, "apt install python3-matplotlib")) << outcome.errors;
        GTEST_SKIP() << "no python3-matplotlib here: no plots to look at";
    }
    for (const char* name : {"figure10", "figure12", "figure13", "crossover"})
    {
        const std::string svg = readText(m_folder + "/" + name + ".svg");
        std::size_t lines = 0;
        for (std::size_t at = svg.find("line2d_"); at != std::string::npos; at = svg.find("line2d_", at + 1))
            ++lines;
        // Curves, ticks and entries of the legend.
        EXPECT_GT(lines, 15u) << name;
        EXPECT_EQ(readText(m_folder + "/" + name + ".png").substr(1, 3), "PNG") << name;
    }
}

TEST_F(FigureCommand, WritesDataAndMessageWithoutMatplotlib)
{
    std::filesystem::create_directories(m_folder);
    std::ofstream(m_folder + "/matplotlib.py") << "raise ImportError('none')\n";
    const Outcome outcome = run("12 --bodies 200,400", "PYTHONPATH=" + m_folder);
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_EQ(rows("figure12").size(), 8u);
    EXPECT_TRUE(contains(outcome.errors, "apt install python3-matplotlib")) << outcome.errors;
    EXPECT_TRUE(contains(outcome.errors, "no plots; the measured data are in " + m_folder)) << outcome.errors;
}

TEST_F(FigureCommand, AnswersUnknownFigureWithKnownOnes)
{
    const Outcome outcome = run("14");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(contains(outcome.errors, "unknown figure '14'; known: 10, 11, 12, 13, cell-size"))
        << outcome.errors;
    EXPECT_EQ(runShell(std::string(CULLET_PROGRAM) + " figure 12 --bodies 300 --out /proc/nowhere").code, 4);
    const Outcome option = run("10 --threads 3");
    EXPECT_EQ(option.code, 2);
    EXPECT_TRUE(contains(option.errors, "--threads")) << option.errors;
}

TEST_F(FigureCommand, TracesThePhasesOfItsFramesAndSteps)
{
    const std::string path = temporaryPath("figures.trace");
    const Outcome outcome = run("12 13 crossover phases --quick --no-plots --bodies 200 --trace " + path);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, int> counts;
    for (const auto& [name, count] : countSpans(nlohmann::json::parse(readText(path), nullptr, false)))
        counts[name.substr(0, name.rfind(' '))] += count;
    std::remove(path.c_str());
    EXPECT_EQ(counts["create"], 4) << "figure 12";
    EXPECT_GE(counts["broad"], 2 * 5) << "figure 13, two systems";
    EXPECT_EQ(counts["broad"], counts["narrow"]);
    EXPECT_GE(counts["setBoxes"], 2 * 6) << "crossover, two scenes";
    EXPECT_EQ(counts["solveConstraints"], 8 * 60) << "eight worlds";
}

TEST_F(FigureCommand, LeavesOutWorldsForWhichThereIsNoTime)
{
    const std::string json = temporaryPath("figures.json");
    const Outcome outcome = run("12 crossover --no-plots --budget 0.000001 --bodies 300,600 --json " + json);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_TRUE(contains(outcome.errors, "figure 12: without worlds of 600 bodies")) << outcome.errors;
    const nlohmann::json document = nlohmann::json::parse(readText(json), nullptr, false);
    std::remove(json.c_str());
    std::map<std::string, int> counts;
    for (const nlohmann::json& row : document["rows"])
    {
        EXPECT_EQ(row["bodies"], 300) << "the first world is always measured";
        ++counts[row["figure"]];
    }
    EXPECT_EQ(counts["12"], 4) << "two distributions by the grid and by brute force";
    EXPECT_EQ(counts["crossover"], 2) << "two scenes";
    EXPECT_EQ(document["options"]["budget"], 0.000001);
}
}  // namespace
}  // namespace cullet
