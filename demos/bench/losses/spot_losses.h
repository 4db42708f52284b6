// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Adds cases of 60 to 3,000 bodies that are created at one spot and move apart, in a new broad phase in each run: without a
/// callback, with one of the application, and with an algorithm for each pair.
///
/// DBVT removes a tenth of the pairs in the update that is timed, and keeps the others for later ones. Memory is that of three
/// updates later.
void addSpots(std::vector<LossCase>& cases);
}  // namespace CULLET_PRECISION
}  // namespace cullet
