// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/determinism/history.h"

#include <cstdint>
#include <map>
#include <string>

namespace cullet::test
{
/// Compares hashes, and counts them by what was varied. The program prints the counts at its end.
class HashLedger
{
public:
    /// What a comparison compares of each fingerprint.
    enum class Part
    {
        PairsOnly,
        PairsAndContacts,
        Everything
    };

    static HashLedger& instance();

    /// Fails the test at the first step in which the histories differ.
    ///
    /// @param what   what was varied, e.g. "threads"
    /// @param how    this variation
    void expectSame(const std::string& what, const History& expected, const History& actual,
                    const std::string& how, Part part = Part::Everything);
    void expectSame(const std::string& what, std::uint64_t expected, std::uint64_t actual,
                    const std::string& how);

    std::uint64_t total() const;
    void print() const;

private:
    HashLedger() = default;

    std::map<std::string, std::uint64_t> m_counts;
};
}  // namespace cullet::test
