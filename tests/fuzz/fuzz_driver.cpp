// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Runs a fuzz target without libFuzzer: the corpus, then random inputs and changed ones of the corpus.

#include "cullet/tests/fuzz/fuzz_driver.h"

#include "cullet/tests/fuzz/fuzz_child.h"
#include "cullet/tests/fuzz/fuzz_inputs.h"
#include "cullet/tests/fuzz/fuzz_shrink.h"
#include "cullet/tests/fuzz/fuzz_target.h"

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::size_t kMostPrinted = 2048;

struct Options
{
    std::uint64_t cases = 1000;
    std::uint64_t first = 0;  ///< case
    std::uint32_t seed = 1;
    std::uint32_t operations = 400;
    double minutes = 0;  ///< in place of `cases`, if above zero
    std::string corpus;  ///< a folder or a file
    std::string save;    ///< file for the shrunk input
};

int usage()
{
    std::fprintf(stderr,
                 "usage: fuzz_%s [--cases N] [--first I] [--seed S] [--operations M] [--corpus DIR|FILE]\n"
                 "               [--minutes T] [--save FILE]\n"
                 "Runs the corpus, then N inputs of up to M operations from the I-th on, or for T minutes. "
                 "Shrinks what\n"
                 "fails, prints it as a test and saves it to FILE.\n",
                 kFuzzTargetName);
    return 2;
}

bool parse(int count, char** arguments, Options& options)
{
    for (int i = 1; i + 1 < count; i += 2)
    {
        const std::string name = arguments[i];
        const char* value = arguments[i + 1];
        if (name == "--cases")
            options.cases = std::strtoull(value, nullptr, 10);
        else if (name == "--first")
            options.first = std::strtoull(value, nullptr, 10);
        else if (name == "--seed")
            options.seed = static_cast<std::uint32_t>(std::strtoul(value, nullptr, 10));
        else if (name == "--operations")
            options.operations = static_cast<std::uint32_t>(std::strtoul(value, nullptr, 10));
        else if (name == "--minutes")
            options.minutes = std::strtod(value, nullptr);
        else if (name == "--corpus")
            options.corpus = value;
        else if (name == "--save")
            options.save = value;
        else
            return false;
    }
    return count % 2 == 1;
}

Bytes readFile(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file)
    {
        std::fprintf(stderr, "cannot read %s\n", path.c_str());
        std::exit(2);
    }
    Bytes bytes{std::istreambuf_iterator<char>(file), {}};
    return bytes;
}

std::vector<Bytes> readCorpus(const std::string& path)
{
    // MemorySanitizer does not know what std::filesystem writes.
    if (path.empty())
        return {};
    std::vector<std::string> files;
    if (std::filesystem::is_directory(path))
    {
        for (const auto& entry : std::filesystem::directory_iterator(path))
            files.push_back(entry.path().string());
        std::sort(files.begin(), files.end());
    }
    else
        files.push_back(path);
    std::vector<Bytes> corpus;
    for (const std::string& file : files)
        corpus.push_back(readFile(file));
    return corpus;
}

std::uint32_t hashOf(const Bytes& bytes)
{
    std::uint32_t hash = 2166136261u;  // FNV-1a
    for (const std::uint8_t value : bytes)
        hash = (hash ^ value) * 16777619u;
    return hash;
}

/// pair_cache as PairCache.
std::string suiteName()
{
    std::string name;
    bool isFirst = true;
    for (const char* letter = kFuzzTargetName; *letter != 0; ++letter)
    {
        const bool isLetter = *letter != '_';
        if (isLetter)
            name += isFirst && *letter >= 'a' && *letter <= 'z' ? static_cast<char>(*letter - 'a' + 'A')
                                                                : *letter;
        isFirst = !isLetter;
    }
    return name;
}

void printTest(const Bytes& bytes)
{
    if (bytes.size() > kMostPrinted)
    {
        std::printf("too long to print, but --save FILE saves it\n");
        return;
    }
    std::printf("\nfor tests/fuzz/test_fuzz_%s.cpp:\n\n", kFuzzTargetName);
    std::printf("TEST(%sFuzz, HoldsForShrunkInput%08" PRIx32 ")\n{\n", suiteName().c_str(), hashOf(bytes));
    std::printf("    // clang-format off\n    const std::uint8_t input[] = {");
    for (std::size_t i = 0; i < bytes.size(); ++i)
        std::printf("%s0x%02x,", i % kOperationBytes == 0 ? "\n        " : " ", bytes[i]);
    std::printf("\n    };\n    // clang-format on\n");
    std::printf("    EXPECT_EQ(runFuzzInput(input, sizeof input), \"\");\n}\n\n");
}

void save(const Bytes& bytes, const std::string& path)
{
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

class Driver
{
public:
    explicit Driver(const Options& options)
        : m_options(options), m_corpus(readCorpus(options.corpus)), m_inputs(m_corpus, options.operations)
    {
    }

    int run()
    {
        std::printf("%s: seed %" PRIu32 ", %zu files\n", kFuzzTargetName, m_options.seed, m_corpus.size());
        bool holds = runCorpus();
        const std::uint64_t end = m_options.minutes > 0 ? std::numeric_limits<std::uint64_t>::max()
                                                        : m_options.first + m_options.cases;
        for (std::uint64_t index = m_options.first; holds && index < end && !isOver(); index += kBatch)
            holds = runBatch(index, std::min(kBatch, end - index));
        const auto perSecond = static_cast<double>(m_child.operations()) / std::max(seconds(), 1e-3);
        std::printf("%s: %" PRIu64 " cases, %" PRIu64 " operations, %.0f per second\n", kFuzzTargetName,
                    m_child.cases(), m_child.operations(), perSecond);
        return holds ? 0 : 1;
    }

private:
    static constexpr std::uint64_t kBatch = 200;

    double seconds() const
    {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - m_begin).count();
    }

    bool isOver() const { return m_options.minutes > 0 && seconds() > m_options.minutes * 60; }

    bool runCorpus()
    {
        const auto file = [this](std::size_t i) { return m_corpus[i]; };
        return report(m_child.run(m_corpus.size(), file, false), "corpus");
    }

    bool runBatch(std::uint64_t first, std::uint64_t count)
    {
        const auto input = [this, first](std::size_t i) { return m_inputs.make(m_options.seed, first + i); };
        const FuzzOutcome outcome =
            m_child.run(static_cast<std::size_t>(count), input, false, [this] { return isOver(); });
        return report(outcome, "cases from " + std::to_string(first));
    }

    bool report(FuzzOutcome outcome, const std::string& where)
    {
        if (outcome == FuzzOutcome::Holds)
            return true;
        Bytes bytes = m_child.input();
        std::printf("%s, seed %" PRIu32 ", %s: %s\n", kFuzzTargetName, m_options.seed, where.c_str(),
                    m_child.message().c_str());
        std::fflush(stdout);
        // To shrink what hangs would take as long as many hangs.
        if (outcome != FuzzOutcome::Hung)
            bytes = shrunk(bytes, outcome);
        const FuzzOutcome last = m_child.run(
            1, [&](std::size_t) { return bytes; }, false);
        std::printf("shrunk to %zu bytes: %s\n", bytes.size(),
                    last == FuzzOutcome::Holds ? "fails only after other inputs" : m_child.message().c_str());
        printTest(bytes);
        if (!m_options.save.empty())
            save(bytes, m_options.save);
        return false;
    }

    Bytes shrunk(const Bytes& bytes, FuzzOutcome outcome)
    {
        const auto fails = [this, outcome](const Bytes& candidate)
        {
            return m_child.run(
                       1, [&](std::size_t) { return candidate; }, true) == outcome;
        };
        return FuzzShrinker(fails, 4000).shrink(bytes);
    }

    const std::chrono::steady_clock::time_point m_begin = std::chrono::steady_clock::now();
    Options m_options;
    std::vector<Bytes> m_corpus;
    FuzzInputs m_inputs;
    FuzzChild m_child;
};
}  // namespace

int runFuzzDriver(int count, char** arguments)
{
    Options options;
    if (!parse(count, arguments, options))
        return usage();
    return Driver(options).run();
}
}  // namespace cullet::test
