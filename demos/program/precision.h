// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
// Bullet's float and double builds use the same symbol names, so one program holds one of them. Two programs are built
// from the same sources, `cullet` (float) and `cullet-float64` (double), and each starts the other one, found in its
// own folder, when it is asked for the other's precision. `cullet-run` and `cullet-run-float64` likewise.

/// "float" or "double": Bullet's scalar in this program.
std::string ownPrecision();

/// Replaces this process by the sibling program when the arguments ask for its precision (`--precision double`,
/// `--precision=double`); returns when this program is the right one or the value is none of the two.
///
/// @throws ProgramError (kExitUnavailable) when the sibling is not there
void switchPrecision(int argc, char** argv);
}  // namespace cullet
