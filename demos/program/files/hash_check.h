// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace cullet
{
/// Checks that all subjects find the pairs of the first subject for each question; a mismatch ends the program.
class HashCheck
{
public:
    /// @param what is compared, for the message
    explicit HashCheck(std::string what = "the pairs") : m_what(std::move(what)) {}

    /// @param question for example the scene, its size and the kind of query
    /// @param subject  name of the backend or library
    /// @throws ProgramError (kExitDisagreement), naming both, if an earlier subject found other pairs
    void require(const std::string& question, const std::string& subject, std::uint64_t pairs,
                 std::uint64_t hash);

private:
    struct Answer
    {
        std::string subject;
        std::uint64_t pairs, hash;
    };
    std::string m_what;
    std::map<std::string, Answer> m_answers;
};
}  // namespace cullet
