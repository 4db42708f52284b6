// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace cullet
{
/// Result of a run of the program.
struct Outcome
{
    int code = -1;
    std::string output;  ///< stdout
    std::string errors;  ///< stderr
};

inline std::string readText(const std::string& path)
{
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

/// A path in the folder for temporary files that no other test process uses.
inline std::string temporaryPath(const std::string& name)
{
    return testing::TempDir() + "cullet_" + std::to_string(getpid()) + "_" + name;
}

/// Runs a shell command with stdout and stderr in files, so that neither is a terminal.
inline Outcome runShell(const std::string& command)
{
    const std::string outputPath = temporaryPath("stdout");
    const std::string errorPath = temporaryPath("stderr");
    const int status = std::system((command + " >" + outputPath + " 2>" + errorPath + " </dev/null").c_str());
    Outcome outcome;
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.output = readText(outputPath);
    outcome.errors = readText(errorPath);
    std::remove(outputPath.c_str());
    std::remove(errorPath.c_str());
    return outcome;
}

/// Runs `cullet` with these arguments.
inline Outcome runProgram(const std::string& arguments)
{
    return runShell(std::string(CULLET_PROGRAM) + " " + arguments);
}

/// Runs `cullet` with `--json` and returns the document; null if it is invalid.
inline nlohmann::json runForJson(const std::string& arguments, Outcome* outcome = nullptr)
{
    const std::string path = temporaryPath("result.json");
    const Outcome result = runProgram(arguments + " --json " + path);
    if (outcome != nullptr)
        *outcome = result;
    const std::string text = readText(path);
    std::remove(path.c_str());
    return nlohmann::json::parse(text, nullptr, false);
}

/// Expects one hash in all rows that have the same texts in some columns.
///
/// @return the number of different texts
inline std::size_t expectOneHashFor(const std::vector<std::string>& columns, const nlohmann::json& rows)
{
    std::map<std::string, std::set<std::string>> hashes;
    for (const nlohmann::json& row : rows)
    {
        std::string texts;
        for (const std::string& column : columns)
            texts += row[column].get<std::string>();
        hashes[texts].insert(row["hash"].get<std::string>());
    }
    for (const auto& [texts, found] : hashes)
        EXPECT_EQ(found.size(), 1u) << texts;
    return hashes.size();
}

/// Spans of a Chrome trace by "NAME LANE", and 1 for the name of each lane.
inline std::map<std::string, int> countSpans(const nlohmann::json& trace)
{
    std::map<std::string, int> counts;
    for (const nlohmann::json& event : trace)
    {
        const bool isSpan = event["ph"] == "X";
        ++counts[isSpan ? event["name"].get<std::string>() + " " + std::to_string(event["tid"].get<int>())
                        : event["args"]["name"].get<std::string>()];
    }
    return counts;
}

inline bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}
}  // namespace cullet
