// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <sstream>
#include <stdio.h>
#include <string>
#include <vector>

/// Programs that know nothing of cullet, run with and without the preloaded library.
namespace cullet::test
{
/// Output of a program, stderr included.
struct Output
{
    std::string text;

    bool has(const std::string& part) const { return text.find(part) != std::string::npos; }

    /// The lines that begin with a word, without that word.
    std::vector<std::string> lines(const std::string& word) const
    {
        std::vector<std::string> result;
        std::istringstream stream(text);
        for (std::string line; std::getline(stream, line);)
        {
            if (line.compare(0, word.size() + 1, word + " ") == 0)
                result.push_back(line.substr(word.size() + 1));
        }
        return result;
    }
    std::string line(const std::string& word) const
    {
        const std::vector<std::string> all = lines(word);
        EXPECT_EQ(all.size(), 1u) << word << " in:\n" << text;
        return all.empty() ? "" : all.front();
    }
};

inline Output run(const std::string& command)
{
    Output output;
    FILE* pipe = popen(("env -u LD_PRELOAD " + command + " 2>&1").c_str(), "r");
    std::array<char, 4096> buffer;
    while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe))
        output.text.append(buffer.data(), count);
    EXPECT_EQ(pclose(pipe), 0) << command << "\n" << output.text;
    return output;
}

inline const std::string kPreloaded = std::string("LD_PRELOAD=") + CULLET_PRELOAD_LIBRARY + " ";
inline const std::string kFolder = CULLET_PRELOAD_PROGRAMS "/";
}  // namespace cullet::test
