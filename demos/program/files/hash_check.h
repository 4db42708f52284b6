// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace cullet
{
/// Holds everyone who answers a question to the answer of the first: a faster wrong one ends the program.
class HashCheck
{
public:
    /// @param question for example the scene, its size and what is asked for
    /// @param subject  who answers
    /// @throws ProgramError (kExitDisagreement), naming both, where another one found other pairs
    void require(const std::string& question, const std::string& subject, std::uint64_t pairs,
                 std::uint64_t hash);

private:
    struct Answer
    {
        std::string subject;
        std::uint64_t pairs, hash;
    };
    std::map<std::string, Answer> m_answers;
};
}  // namespace cullet
