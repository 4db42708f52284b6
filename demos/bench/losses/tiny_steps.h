// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Adds cases of whole steps of up to 32 cubes over a floor, against none of cullet's parts.
void addTinySteps(std::vector<LossCase>& cases);
}  // namespace CULLET_PRECISION
}  // namespace cullet
