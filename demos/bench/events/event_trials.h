// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/broad_options.h"

#include <functional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Result of one trial of an event.
struct Trial
{
    double milliseconds = 0.0;
    std::uint32_t bodies = 0;  ///< that the event processed before the deadline
    bool finished = true;
    PairDigest digest;
};

/// Runs an event on a fresh subject several times for each backend, in turns, and writes one row per backend.
///
/// A backend whose trial took more than a fifth of the budget gets no further trials. Finished trials must agree on the
/// pairs.
///
/// @param trial     runs one trial, given the fresh subject and the milliseconds after which to stop
/// @throws ProgramError (kExitDisagreement)
void runTrials(const std::string& benchmark, const BroadCase& benchCase, const ExactBox& bounds,
               const std::function<Trial(Subject&, double)>& trial, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
