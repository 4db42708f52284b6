// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"
#include "cullet/demos/program/files/result_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet bench losses`.
struct LossOptions
{
    /// The ratio of a single round is often one of the host's other work.
    static constexpr std::uint32_t kLeastRounds = 5;

    std::vector<std::string> cases;  ///< names of lossCases(); empty: all of them
    std::uint32_t rounds = 15;
    double budget = 60.0;  ///< seconds after which a case that has had kLeastRounds gets no further round
    double scale = 1.0;    ///< share of the bodies of each case
    int threads = 1;       ///< of cullet; 0: as many as the machine has
    std::uint64_t seed = 1;
    bool quiet = false;
};

/// Benchmark "losses": every case with all its sides, in turns of one run each, the order of which rotates. A row for each
/// case.
///
/// Columns beyond those of every row: SIDE_ms and SIDE_min_ms, the median and the least of each side, and SIDE_ratio, the median over the rounds of the
/// time of cullet over that of the side; bytes, SIDE_bytes and memory_ratio, where the case has no world; measure, target and met:
/// whether the ratio to the second side reaches the target; checks: answers that were compared with brute force.
///
/// Cases that need double precision are left out in single precision, with a message.
///
/// @throws ProgramError (kExitUsage) for an unknown case, (kExitDisagreement) if the answer of a side differs from that of
///         brute force
void runLossBench(const LossOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
