// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/files/hash_check.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/result_file.h"

namespace cullet
{
void HashCheck::require(const std::string& question, const std::string& subject, std::uint64_t pairs,
                        std::uint64_t hash)
{
    const Answer& first = m_answers.try_emplace(question, Answer{subject, pairs, hash}).first->second;
    if (first.pairs == pairs && first.hash == hash)
        return;
    const auto describe = [](const std::string& name, std::uint64_t count, std::uint64_t sum)
    { return name + " has " + std::to_string(count) + " (hash " + toHex(sum) + ")"; };
    throw ProgramError(kExitDisagreement, m_what + " disagree, " + question + ": " +
                                              describe(first.subject, first.pairs, first.hash) + ", " +
                                              describe(subject, pairs, hash));
}
}  // namespace cullet
