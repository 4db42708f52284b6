// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
// Bullet's float and double builds use the same symbol names, so one program holds one of them. Two programs are built
// from the same sources, `cullet` (float) and `cullet-float64` (double). Each starts the other one, in its own folder,
// if that one's precision is requested. `cullet-run` and `cullet-run-float64` likewise.

/// "float" or "double": Bullet's scalar in this program.
std::string ownPrecision();

/// Replaces this process by the sibling program if the arguments request its precision (`--precision double`,
/// `--precision=double`); returns if this program has the requested precision or the value is invalid.
///
/// @throws ProgramError (kExitUnavailable) if the sibling does not exist
void switchPrecision(int argc, char** argv);
}  // namespace cullet
