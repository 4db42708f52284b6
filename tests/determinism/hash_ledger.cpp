// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/determinism/hash_ledger.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace cullet::test
{
namespace
{
class PrintLedger final : public testing::Environment
{
public:
    void TearDown() override { HashLedger::instance().print(); }
};

[[maybe_unused]] testing::Environment* const printLedger = testing::AddGlobalTestEnvironment(new PrintLedger);

/// The hashes of a step that are compared, with their names.
std::vector<std::pair<const char*, std::uint64_t Fingerprint::*>> hashesOf(HashLedger::Part part)
{
    std::vector<std::pair<const char*, std::uint64_t Fingerprint::*>> hashes = {
        {"pairs", &Fingerprint::pairs}};
    if (part != HashLedger::Part::PairsOnly)
        hashes.emplace_back("contacts", &Fingerprint::contacts);
    if (part == HashLedger::Part::Everything)
        hashes.emplace_back("bodies", &Fingerprint::bodies);
    return hashes;
}
}  // namespace

HashLedger& HashLedger::instance()
{
    static HashLedger ledger;
    return ledger;
}

void HashLedger::expectSame(const std::string& what, const History& expected, const History& actual,
                            const std::string& how, Part part)
{
    ASSERT_FALSE(expected.empty()) << what << ", " << how;
    ASSERT_EQ(actual.size(), expected.size()) << what << ", " << how;
    for (std::size_t step = 0; step < expected.size(); ++step)
    {
        for (const auto& [name, hash] : hashesOf(part))
        {
            ++m_counts[what];
            ASSERT_EQ(actual[step].*hash, expected[step].*hash)
                << what << ", " << how << ": " << name << " differ from step " << step << " on";
        }
    }
}

void HashLedger::expectSame(const std::string& what, std::uint64_t expected, std::uint64_t actual,
                            const std::string& how)
{
    ++m_counts[what];
    EXPECT_EQ(actual, expected) << what << ", " << how;
}

std::uint64_t HashLedger::total() const
{
    std::uint64_t total = 0;
    for (const auto& [what, count] : m_counts)
        total += count;
    return total;
}

void HashLedger::print() const
{
    for (const auto& [what, count] : m_counts)
        std::printf("hashes compared: %8llu  %s\n", static_cast<unsigned long long>(count), what.c_str());
    std::printf("hashes compared: %8llu  in all\n", static_cast<unsigned long long>(total()));
}
}  // namespace cullet::test
